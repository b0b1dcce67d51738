-- When an upload was last tried again: it is judged by the clock of then, also when results are made anew. An older
-- build would not know some reasons for which uploads are set aside.
update schema_info set version = 11, min_binary = 11;

create table retried (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    retried_at bigint not null,
    checksum bytea not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
);
select wall('retried', 'select, insert, delete');
