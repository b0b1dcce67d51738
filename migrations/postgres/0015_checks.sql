-- When the tails of an operator are in the hangar, and how it reads forecasts. An older build would write what is ready to be
-- told in words that this one does not look for.
update schema_info set version = 17, min_binary = 17;

-- Append-only. The newest version is in force.
create table operator_settings (
    operator text collate "C" not null,
    version bigint not null,
    set_at bigint not null,
    set_by text not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, version)
);
select wall('operator_settings', 'select, insert');

-- Append-only. The newest version of a tail is in force; one without checks withdraws the one before.
create table tail_checks (
    operator text collate "C" not null,
    tail text collate "C" not null,
    version bigint not null,
    set_at bigint not null,
    set_by text not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, tail, version)
);
select wall('tail_checks', 'select, insert');

-- They call data of now by their old name, and `actuary migrate` makes them anew. Row-level security holds the owner, too.
alter table board_units no force row level security;
delete from board_units;
alter table board_units force row level security;
