-- Where events installed components, lives that begin with an overhaul, prognoses taken back. A build that
-- ignores overhauls would write wrong results, and one that knows only the newest life would leave the
-- others unprocessed.
update schema_info set version = 5, min_binary = 5;

-- maintenance_events.kind: also 'install', 'remove' and 'overhaul'.

-- Installs (inward: 1) and removals (0) that are not voided.
create table movements (
    operator text not null,
    tail text not null,
    position text not null,
    part_number text not null,
    serial_number text not null,
    occurred_at integer not null,
    event_id text not null,
    inward integer not null check (inward in (0, 1)),
    primary key (operator, part_number, serial_number, occurred_at, event_id)
) strict, without rowid;
create index movements_of_place on movements (operator, tail, position, inward, part_number, serial_number);

-- What uploads alone tell.
alter table installations rename to observed_installations;
drop index installations_of_component;
create index observed_installations_of_component
    on observed_installations (operator, part_number, serial_number, from_at, from_upload);

-- What events and uploads together tell. Half-open periods; their ends are moments of the order (at, by, name),
-- by: 'event' or 'upload'.
create table installations (
    operator text not null,
    tail text not null,
    position text not null,
    part_number text not null,
    serial_number text not null,
    from_at integer not null,
    from_by text not null,
    from_name text not null,
    to_at integer,
    to_by text,
    to_name text,
    primary key (operator, tail, position, from_at, from_by, from_name)
) strict, without rowid;
insert into installations
    (operator, tail, position, part_number, serial_number, from_at, from_by, from_name, to_at, to_by, to_name)
select operator, tail, position, part_number, serial_number, from_at, 'upload', from_upload,
       to_at, case when to_at is not null then 'upload' end, to_upload
from observed_installations;
create index installations_of_component
    on installations (operator, part_number, serial_number, from_at, from_by, from_name);

-- The overhaul with which the life began: its event, and its place in the order of the component's lives.
-- The first life begins with nothing.
alter table lives add column began_by text;
alter table lives add column began_fh real not null default 0;
alter table lives add column began_at integer not null default 0;

-- When the data that it rests on turned out to be of another life; null while it stands.
alter table prognoses add column withdrawn_at integer;

-- The component's input_revision when the life last got something to process: it waits while this is more
-- than the component's processed_revision.
alter table lives add column touched_revision integer not null default 0;
update lives set touched_revision = (
    select q.input_revision from component_queue q
    where q.operator = lives.operator and q.part_number = lives.part_number
      and q.serial_number = lives.serial_number);
