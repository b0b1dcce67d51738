-- Where events installed components, lives that begin with an overhaul, prognoses taken back. A build that
-- ignores overhauls would write wrong results, and one that knows only the newest life would leave the
-- others unprocessed.
update schema_info set version = 5, min_binary = 5;

-- maintenance_events.kind: also 'install', 'remove' and 'overhaul'.

-- Installs (inward: 1) and removals (0) that are not voided.
create table movements (
    operator text collate "C" not null,
    tail text collate "C" not null,
    position text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    occurred_at bigint not null,
    event_id text collate "C" not null,
    inward bigint not null check (inward in (0, 1)),
    primary key (operator, part_number, serial_number, occurred_at, event_id)
);
create index movements_of_place on movements (operator, tail, position, inward, part_number, serial_number);
select wall('movements', 'select, insert, delete');

-- What uploads alone tell.
alter table installations rename to observed_installations;
alter index installations_pkey rename to observed_installations_pkey;
alter index installations_of_component rename to observed_installations_of_component;

-- What events and uploads together tell. Half-open periods; their ends are moments of the order (at, by, name),
-- by: 'event' or 'upload'.
create table installations (
    operator text collate "C" not null,
    tail text collate "C" not null,
    position text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    from_at bigint not null,
    from_by text collate "C" not null,
    from_name text collate "C" not null,
    to_at bigint,
    to_by text collate "C",
    to_name text collate "C",
    primary key (operator, tail, position, from_at, from_by, from_name)
);
insert into installations
    (operator, tail, position, part_number, serial_number, from_at, from_by, from_name, to_at, to_by, to_name)
select operator, tail, position, part_number, serial_number, from_at, 'upload', from_upload,
       to_at, case when to_at is not null then 'upload' end, to_upload
from observed_installations;
create index installations_of_component
    on installations (operator, part_number, serial_number, from_at, from_by, from_name);
select wall('installations', 'select, insert, delete');

-- The overhaul with which the life began: its event, and its place in the order of the component's lives.
-- The first life begins with nothing.
alter table lives add column began_by text collate "C";
alter table lives add column began_fh double precision not null default 0;
alter table lives add column began_at bigint not null default 0;

-- When the data that it rests on turned out to be of another life; null while it stands.
alter table prognoses add column withdrawn_at bigint;
grant update (withdrawn_at) on prognoses to actuary_service;

-- The component's input_revision when the life last got something to process: it waits while this is more
-- than the component's processed_revision.
alter table lives add column touched_revision bigint not null default 0;
