-- Times are microseconds since the Unix epoch. Bodies are canonical JSON; a checksum covers the
-- row's key and body. Every table but those of the models carries the operator, and the component where
-- it is about one.

pragma application_id = 0x41435455;

-- A build serves this schema when it knows at least schema min_binary.
create table schema_info (
    one integer primary key check (one = 1),
    version integer not null,
    min_binary integer not null
) strict;
insert into schema_info (one, version, min_binary) values (1, 1, 1);

create table bundles (
    hash blob primary key,
    summary text not null,
    body blob not null,
    active integer not null,
    added_at integer not null,
    activated_at integer,
    checksum blob not null
) strict;
create unique index bundles_active on bundles (active) where active = 1;

create table masks (
    mask_id blob primary key,
    model blob not null,
    k_nom real not null,
    body text not null,
    checksum blob not null
) strict;

create table operators (
    operator text primary key,
    enrolled_at integer not null
) strict, without rowid;

create table tails (
    operator text not null,
    tail text not null,
    primary key (operator, tail)
) strict, without rowid;

create table components (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    enrolled_at integer not null,
    primary key (operator, part_number, serial_number)
) strict, without rowid;

-- generation: the one that answers are made of.
create table lives (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    generation integer not null,
    primary key (operator, part_number, serial_number, overhaul_index)
) strict, without rowid;

create table generations (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    number integer not null,
    model blob not null,
    prior blob not null,
    primary key (operator, part_number, serial_number, overhaul_index, number)
) strict, without rowid;

-- Half-open periods; their ends are moments of the order (recorded_at, upload_id).
create table installations (
    operator text not null,
    tail text not null,
    position text not null,
    part_number text not null,
    serial_number text not null,
    from_at integer not null,
    from_upload text not null,
    to_at integer,
    to_upload text,
    primary key (operator, tail, position, from_at, from_upload)
) strict, without rowid;
create index installations_of_component
    on installations (operator, part_number, serial_number, from_at, from_upload);

-- Names of uploads are taken for ever, also when the uploads themselves have moved elsewhere.
create table upload_keys (
    operator text not null,
    upload_id text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    content_hash blob not null,
    primary key (operator, upload_id)
) strict, without rowid;

create table uploads (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    received_at integer not null,
    body text not null,
    checksum blob not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict;

-- Uploads that wait to be processed.
create table inbox (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;

-- Uploads that cannot be processed.
create table set_aside (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    reason text not null,
    set_aside_at integer not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;

create table component_queue (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    input_revision integer not null,
    processed_revision integer not null,
    lease_until integer not null,
    fence integer not null,
    attempts integer not null,
    not_before integer not null,
    primary key (operator, part_number, serial_number)
) strict, without rowid;
create index component_queue_waiting
    on component_queue (not_before, operator, part_number, serial_number)
    where input_revision > processed_revision;

create table estimates (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    generation integer not null,
    flight_hours real not null,
    recorded_at integer not null,
    upload_id text not null,
    body text not null,
    checksum blob not null,
    primary key
        (operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at, upload_id)
) strict;

-- flight_hours: of the block's last observation.
create table states (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    generation integer not null,
    block integer not null,
    flight_hours real not null,
    body text not null,
    checksum blob not null,
    primary key (operator, part_number, serial_number, overhaul_index, generation, block)
) strict;

-- Append-only: what was served, one per lease at most.
create table prognoses (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    generation integer not null,
    fence integer not null,
    issued_at integer not null,
    body text not null,
    checksum blob not null,
    primary key (operator, part_number, serial_number, overhaul_index, generation, fence)
) strict;
