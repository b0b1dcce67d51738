-- Whom the keys of uplink frames speak for. Their secrets follow from one that is not here.
update schema_info set version = 16;

-- Keys are never deleted: uploads are called by them. position, part_number, serial_number, mask_id and bundle are null of a
-- key for the strain of a tail.
create table frame_keys (
    operator text not null,
    key_id text not null,
    tail text not null,
    position text,
    part_number text,
    serial_number text,
    mask_id blob,
    bundle blob,
    made_at integer not null,
    revoked_at integer,
    checksum blob not null,
    primary key (operator, key_id)
) strict, without rowid;
