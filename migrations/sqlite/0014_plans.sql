-- What planners say of the flights to come of a tail.
update schema_info set version = 14;

-- Append-only. The newest version of a tail is in force; one without stretches withdraws the one before.
create table tail_plans (
    operator text not null,
    tail text not null,
    version integer not null,
    set_at integer not null,
    set_by text not null,
    body text not null,
    checksum blob not null,
    primary key (operator, tail, version)
) strict, without rowid;
