-- When the tails of an operator are in the hangar, and how it reads forecasts. An older build would write what is ready to be
-- told in words that this one does not look for.
update schema_info set version = 17, min_binary = 17;

-- Append-only. The newest version is in force.
create table operator_settings (
    operator text not null,
    version integer not null,
    set_at integer not null,
    set_by text not null,
    body text not null,
    checksum blob not null,
    primary key (operator, version)
) strict, without rowid;

-- Append-only. The newest version of a tail is in force; one without checks withdraws the one before.
create table tail_checks (
    operator text not null,
    tail text not null,
    version integer not null,
    set_at integer not null,
    set_by text not null,
    body text not null,
    checksum blob not null,
    primary key (operator, tail, version)
) strict, without rowid;

-- They call data of now by their old name, and are made anew when the file is opened.
delete from board_units;
