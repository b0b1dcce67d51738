-- Checksums over the columns of rows that have no body, and where the chains of the audit log end. A build that
-- knows none of them would write rows without, which are refused.
update schema_info set version = 8, min_binary = 8;

-- 1 once every row has its checksum: from then on, a row without one is damaged.
alter table schema_info add column sealed integer not null default 0;

alter table operators add column checksum blob;
alter table tails add column checksum blob;
alter table components add column checksum blob;
-- Over all columns but touched_revision, which each upload changes and no answer rests on.
alter table lives add column checksum blob;
alter table generations add column checksum blob;
alter table installations add column checksum blob;
alter table observed_installations add column checksum blob;
alter table movements add column checksum blob;
alter table upload_keys add column checksum blob;
alter table inbox add column checksum blob;
alter table set_aside add column checksum blob;
alter table exclusions add column checksum blob;
alter table voided add column checksum blob;
alter table voided_events add column checksum blob;

-- Over what is changed in rows whose other columns have their checksum: when a prognosis was withdrawn (null while
-- it stands), and which bundle is active since when.
alter table prognoses add column withdrawal_checksum blob;
alter table bundles add column activation_checksum blob;

-- The newest record of each chain of the audit log, and how many tokens its operator was ever given.
create table anchors (
    operator text not null primary key,
    sequence integer not null,
    hash blob not null,
    tokens integer not null,
    checksum blob
) strict, without rowid;
