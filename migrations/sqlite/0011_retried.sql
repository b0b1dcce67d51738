-- When an upload was last tried again: it is judged by the clock of then, also when results are made anew. An older
-- build would not know some reasons for which uploads are set aside.
update schema_info set version = 11, min_binary = 11;

create table retried (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    retried_at integer not null,
    checksum blob not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;
