-- What planners say of the flights to come of a tail.
update schema_info set version = 14;

-- Append-only. The newest version of a tail is in force; one without stretches withdraws the one before.
create table tail_plans (
    operator text collate "C" not null,
    tail text collate "C" not null,
    version bigint not null,
    set_at bigint not null,
    set_by text not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, tail, version)
);
select wall('tail_plans', 'select, insert');
