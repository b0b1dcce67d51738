-- Whom the keys of uplink frames speak for. Their secrets follow from one that is not here.
update schema_info set version = 16;

-- Keys are never deleted: uploads are called by them. position, part_number, serial_number, mask_id and bundle are null of a
-- key for the strain of a tail.
create table frame_keys (
    operator text collate "C" not null,
    key_id text collate "C" not null,
    tail text collate "C" not null,
    position text collate "C",
    part_number text collate "C",
    serial_number text collate "C",
    mask_id bytea,
    bundle bytea,
    made_at bigint not null,
    revoked_at bigint,
    checksum bytea not null,
    primary key (operator, key_id)
);
select wall('frame_keys', 'select, insert, update');
