-- Times are microseconds since the Unix epoch. Bodies are canonical JSON; a checksum covers the
-- row's key and body. Text is compared by its bytes, as it is in SQLite. Every table but those of the
-- models carries the operator, and the component where it is about one.
--
-- Who may do what. Whoever migrates owns the tables. The service logs in as another role, a member of
-- actuary_service. Row-level security lets it see one operator in a transaction, the one that it names in
-- actuary.operator, and none before it names one. Over all operators it may lease, count what waits and list
-- names, and for that it must become actuary_system, which it does not inherit.

create function ensure_roles() returns void language plpgsql as $$
declare
    role text;
begin
    foreach role in array array['actuary_system', 'actuary_service'] loop
        begin
            if not exists (select from pg_roles where rolname = role) then
                execute format('create role %I nologin noinherit', role);
            end if;
        exception when duplicate_object or unique_violation then
            null; -- Another database of this cluster is being migrated, too.
        end;
    end loop;
    if not pg_has_role('actuary_service', 'actuary_system', 'member') then
        grant actuary_system to actuary_service;
    end if;
end $$;
select ensure_roles();
drop function ensure_roles();

grant usage on schema public to actuary_service, actuary_system;

-- Walls a table in: its rows are those of one operator. The service may do with them what is granted.
create function wall(walled regclass, granted text) returns void language plpgsql as $$
begin
    execute format('alter table %s enable row level security', walled);
    execute format('alter table %s force row level security', walled);
    execute format(
        'create policy operator on %s using (operator = current_setting(''actuary.operator'', true))', walled);
    execute format('grant %s on %s to actuary_service', granted, walled);
end $$;
revoke execute on function wall from public;

-- What actuary_system may do with a table, over all operators.
create function across(walled regclass, granted text) returns void language plpgsql as $$
begin
    execute format('create policy across_operators on %s to actuary_system using (true)', walled);
    execute format('grant %s on %s to actuary_system', granted, walled);
end $$;
revoke execute on function across from public;

-- A build serves this schema when it knows at least schema min_binary. Versions count as in SQLite.
create table schema_info (
    one bigint primary key check (one = 1),
    version bigint not null,
    min_binary bigint not null
);
insert into schema_info (one, version, min_binary) values (1, 3, 3);
grant select on schema_info to actuary_service;

create table bundles (
    hash bytea primary key,
    summary text not null,
    body bytea not null,
    active bigint not null,
    added_at bigint not null,
    activated_at bigint,
    checksum bytea not null
);
create unique index bundles_active on bundles (active) where active = 1;
grant select, insert, update on bundles to actuary_service;
grant select on bundles to actuary_system;

create table masks (
    mask_id bytea primary key,
    model bytea not null,
    k_nom double precision not null,
    body text not null,
    checksum bytea not null
);
grant select, insert on masks to actuary_service;
grant select on masks to actuary_system;

-- Its row is locked by whatever writes what an operator sent or asked for.
create table operators (
    operator text collate "C" primary key,
    enrolled_at bigint not null
);
select wall('operators', 'select, insert, update');
select across('operators', 'select');

create table tails (
    operator text collate "C" not null,
    tail text collate "C" not null,
    primary key (operator, tail)
);
select wall('tails', 'select, insert');

create table components (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    enrolled_at bigint not null,
    primary key (operator, part_number, serial_number)
);
select wall('components', 'select, insert');

-- generation: the one that answers are made of. prognosis_fence: of the prognosis that is served; null while
-- there is none. ended_by: the event that is the life's failure; null while there is none.
create table lives (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    prognosis_fence bigint,
    ended_by text collate "C",
    primary key (operator, part_number, serial_number, overhaul_index)
);
create index lives_ended on lives (operator, part_number) where ended_by is not null;
select wall('lives', 'select, insert, update, delete');
select across('lives', 'select (operator, part_number, serial_number, overhaul_index, generation)');

create table generations (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    number bigint not null,
    model bytea not null,
    prior bytea not null,
    primary key (operator, part_number, serial_number, overhaul_index, number)
);
select wall('generations', 'select, insert, update, delete');
select across('generations', 'select');

-- Half-open periods; their ends are moments of the order (recorded_at, upload_id).
create table installations (
    operator text collate "C" not null,
    tail text collate "C" not null,
    position text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    from_at bigint not null,
    from_upload text collate "C" not null,
    to_at bigint,
    to_upload text collate "C",
    primary key (operator, tail, position, from_at, from_upload)
);
create index installations_of_component
    on installations (operator, part_number, serial_number, from_at, from_upload);
select wall('installations', 'select, insert, update, delete');

-- Names of uploads are taken for ever, also when the uploads themselves have moved elsewhere.
create table upload_keys (
    operator text collate "C" not null,
    upload_id text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    content_hash bytea not null,
    primary key (operator, upload_id)
) partition by hash (operator, upload_id);
do $$
declare
    part text;
begin
    for i in 0..15 loop
        part := format('upload_keys_%s', lpad(i::text, 2, '0'));
        execute format('create table %I partition of upload_keys for values with (modulus 16, remainder %s)', part, i);
        -- Nobody reads a part but through the whole, whose policy holds then.
        execute format('alter table %I enable row level security', part);
        execute format('alter table %I force row level security', part);
    end loop;
end $$;
select wall('upload_keys', 'select, insert');

-- One partition for each calendar month (UTC) of receipt.
create table uploads (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    received_at bigint not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id, received_at)
) partition by range (received_at);
select wall('uploads', 'select, insert');

-- For months that have no partition. It should be empty: its uploads are kept and read like any others, but it
-- is one table for all time.
create table uploads_default partition of uploads default;
alter table uploads_default enable row level security;
alter table uploads_default force row level security;
create policy owner on uploads_default to current_user using (true);

-- Makes the partitions of the present month and of some months to come, and moves into them what the default
-- partition holds of those months.
create function make_upload_partitions(months_ahead integer) returns void
language plpgsql security definer set search_path = pg_catalog, public, pg_temp set lock_timeout = '2s' as $$
declare
    month timestamp;
    part text;
    from_at bigint;
    to_at bigint;
begin
    for i in 0..least(months_ahead, 24) loop
        month := date_trunc('month', now() at time zone 'utc') + make_interval(months => i);
        part := 'uploads_' || to_char(month, 'YYYY_MM');
        continue when to_regclass('public.' || part) is not null;
        from_at := extract(epoch from month) * 1000000;
        to_at := extract(epoch from month + interval '1 month') * 1000000;
        begin
            execute format('create table public.%I (like public.uploads including all)', part);
            lock table public.uploads_default in access exclusive mode;
            execute format(
                'with moved as (delete from public.uploads_default where received_at >= $1 and received_at < $2
                                returning *)
                 insert into public.%I select * from moved', part) using from_at, to_at;
            execute format('alter table public.%I enable row level security', part);
            execute format('alter table public.%I force row level security', part);
            execute format(
                'alter table public.uploads attach partition public.%I for values from (%s) to (%s)',
                part, from_at, to_at);
        exception when duplicate_table or unique_violation then
            null; -- Another process made it meanwhile.
        end;
    end loop;
end $$;
revoke execute on function make_upload_partitions from public;
grant execute on function make_upload_partitions to actuary_service;
select make_upload_partitions(3);

-- How many uploads have no partition of their own month; counted up to a thousand.
create function uploads_without_partition() returns bigint
language sql security definer stable set search_path = pg_catalog, public, pg_temp as $$
    select count(*) from (select from public.uploads_default limit 1000) as counted
$$;
revoke execute on function uploads_without_partition from public;
grant execute on function uploads_without_partition to actuary_system;

-- Uploads that wait to be processed. since: when the upload began to wait.
create table inbox (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    since bigint not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) with (autovacuum_vacuum_scale_factor = 0.02);
select wall('inbox', 'select, insert, update, delete');
select across('inbox', 'select');

-- Uploads that have no estimate. reason: a code; detail: words.
create table set_aside (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    reason text collate "C" not null,
    detail text not null,
    set_aside_at bigint not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
);
select wall('set_aside', 'select, insert, update, delete');
select across('set_aside', 'select');

-- Uploads that have an estimate, but do not count in their life by a rule over the whole of it.
create table exclusions (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    reason text collate "C" not null,
    detail text not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id, overhaul_index, generation)
);
select wall('exclusions', 'select, insert, update, delete');
select across('exclusions', 'select');

create table voided (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    voided_at bigint not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
);
select wall('voided', 'select, insert');

-- Both kinds; exclusions in the generation that answers.
create view uploads_set_aside with (security_invoker = true) as
select operator, part_number, serial_number, recorded_at, upload_id, reason, detail from set_aside
union all
select x.operator, x.part_number, x.serial_number, x.recorded_at, x.upload_id, x.reason, x.detail
from exclusions x cross join lives l
where l.operator = x.operator and l.part_number = x.part_number and l.serial_number = x.serial_number
  and l.overhaul_index = x.overhaul_index and l.generation = x.generation;
grant select on uploads_set_aside to actuary_service, actuary_system;

create view uploads_processed with (security_invoker = true) as
select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id
from uploads u
where not exists (
    select 1 from inbox w
    where w.operator = u.operator and w.part_number = u.part_number and w.serial_number = u.serial_number
      and w.recorded_at = u.recorded_at and w.upload_id = u.upload_id)
  and not exists (
    select 1 from voided v
    where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
      and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)
  and not exists (
    select 1 from uploads_set_aside a
    where a.operator = u.operator and a.part_number = u.part_number and a.serial_number = u.serial_number
      and a.recorded_at = u.recorded_at and a.upload_id = u.upload_id);
grant select on uploads_processed to actuary_service;

-- Narrow and alone, because each upload and each lease writes here. Times are those of the database's clock.
create table component_queue (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    input_revision bigint not null,
    processed_revision bigint not null,
    lease_until bigint not null,
    fence bigint not null,
    attempts bigint not null,
    not_before bigint not null,
    primary key (operator, part_number, serial_number)
) with (fillfactor = 50, autovacuum_vacuum_scale_factor = 0.01, autovacuum_vacuum_cost_delay = 0);
create index component_queue_waiting
    on component_queue (not_before, operator, part_number, serial_number)
    where input_revision > processed_revision;
select wall('component_queue', 'select, insert, update, delete');
select across('component_queue', 'select, update');

create table estimates (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    flight_hours double precision not null,
    recorded_at bigint not null,
    upload_id text collate "C" not null,
    body text not null,
    checksum bytea not null,
    primary key
        (operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at, upload_id)
);
select wall('estimates', 'select, insert, update, delete');

-- flight_hours: of the block's last observation.
create table states (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    block bigint not null,
    flight_hours double precision not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, part_number, serial_number, overhaul_index, generation, block)
);
select wall('states', 'select, insert, update, delete');

-- Append-only: what was served, one per lease at most. forecast_from_fh: as_of.flight_hours of a prognosis with a
-- forecast; null without one.
create table prognoses (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    fence bigint not null,
    issued_at bigint not null,
    body text not null,
    checksum bytea not null,
    forecast_from_fh double precision,
    primary key (operator, part_number, serial_number, overhaul_index, generation, fence)
);
create index prognoses_with_forecast
    on prognoses
        (operator, part_number, serial_number, overhaul_index, generation, forecast_from_fh, fence)
    where forecast_from_fh is not null;
select wall('prognoses', 'select, insert');

-- Append-only. Bodies are named by their hash.
create table sensor_configurations (
    operator text collate "C" not null,
    hash bytea not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, hash)
);
select wall('sensor_configurations', 'select, insert');

-- Append-only. In force from effective_from until that of the tail's next one.
create table tail_sensor_configurations (
    operator text collate "C" not null,
    tail text collate "C" not null,
    effective_from bigint not null,
    hash bytea not null,
    added_at bigint not null,
    checksum bytea not null,
    primary key (operator, tail, effective_from)
);
select wall('tail_sensor_configurations', 'select, insert');

-- Append-only. Names of events are taken for ever, also those of voided ones.
-- kind: 'finding_failed' or 'finding_serviceable'.
create table maintenance_events (
    operator text collate "C" not null,
    event_id text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    kind text collate "C" not null,
    occurred_at bigint not null,
    flight_hours double precision not null,
    received_at bigint not null,
    body text not null,
    checksum bytea not null,
    primary key (operator, event_id)
);
create index maintenance_events_of_component
    on maintenance_events (operator, part_number, serial_number, flight_hours, occurred_at, event_id);
select wall('maintenance_events', 'select, insert');

create table voided_events (
    operator text collate "C" not null,
    event_id text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    voided_at bigint not null,
    primary key (operator, event_id)
);
select wall('voided_events', 'select, insert');

-- Priors learned from finished lives. Bodies are named by their hash.
create table priors (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    model bytea not null,
    hash bytea not null,
    parent bytea not null,
    lives bigint not null,
    learned_at bigint not null,
    checksum bytea not null,
    body bytea not null,
    primary key (operator, part_number, model, hash)
);
select wall('priors', 'select, insert, update');

-- A cache of what a filter knows at the end of a block. digest: of everything that it is a function of.
create table checkpoints (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    overhaul_index bigint not null,
    generation bigint not null,
    block bigint not null,
    digest bytea not null,
    checksum bytea not null,
    body bytea not null,
    primary key (operator, part_number, serial_number, overhaul_index, generation, block)
);
select wall('checkpoints', 'select, insert, update, delete');
