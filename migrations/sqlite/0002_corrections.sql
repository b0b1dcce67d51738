-- Uploads that are set aside with a code, voided, or sent back to be estimated again; sensor
-- configurations. A build that ignores voids and configurations would write wrong results.
update schema_info set version = 2, min_binary = 2;

-- since: when the upload began to wait.
create table waiting (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    since integer not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;
insert into waiting (operator, part_number, serial_number, recorded_at, upload_id, since)
select w.operator, w.part_number, w.serial_number, w.recorded_at, w.upload_id, u.received_at
from inbox w cross join uploads u
where u.operator = w.operator and u.part_number = w.part_number and u.serial_number = w.serial_number
  and u.recorded_at = w.recorded_at and u.upload_id = w.upload_id;
drop table inbox;
alter table waiting rename to inbox;

-- Uploads that have no estimate. reason: a code; detail: words.
create table not_estimated (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    reason text not null,
    detail text not null,
    set_aside_at integer not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;
insert into not_estimated
    (operator, part_number, serial_number, recorded_at, upload_id, reason, detail, set_aside_at)
select operator, part_number, serial_number, recorded_at, upload_id, 'not_estimable', reason, set_aside_at
from set_aside;
drop table set_aside;
alter table not_estimated rename to set_aside;

-- Uploads that have an estimate, but do not count in their life by a rule over the whole of it.
create table exclusions (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    overhaul_index integer not null,
    generation integer not null,
    reason text not null,
    detail text not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id, overhaul_index, generation)
) strict, without rowid;

create table voided (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    recorded_at integer not null,
    upload_id text not null,
    voided_at integer not null,
    primary key (operator, part_number, serial_number, recorded_at, upload_id)
) strict, without rowid;

-- Both kinds; exclusions in the generation that answers.
create view uploads_set_aside as
select operator, part_number, serial_number, recorded_at, upload_id, reason, detail from set_aside
union all
select x.operator, x.part_number, x.serial_number, x.recorded_at, x.upload_id, x.reason, x.detail
from exclusions x cross join lives l
where l.operator = x.operator and l.part_number = x.part_number and l.serial_number = x.serial_number
  and l.overhaul_index = x.overhaul_index and l.generation = x.generation;

create view uploads_processed as
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

-- The fence of the prognosis that is served; null while there is none.
alter table lives add column prognosis_fence integer;
update lives set prognosis_fence = (
    select max(p.fence) from prognoses p
    where p.operator = lives.operator and p.part_number = lives.part_number
      and p.serial_number = lives.serial_number and p.overhaul_index = lives.overhaul_index
      and p.generation = lives.generation);

-- Append-only. Bodies are named by their hash.
create table sensor_configurations (
    operator text not null,
    hash blob not null,
    body text not null,
    checksum blob not null,
    primary key (operator, hash)
) strict;

-- Append-only. In force from effective_from until that of the tail's next one.
create table tail_sensor_configurations (
    operator text not null,
    tail text not null,
    effective_from integer not null,
    hash blob not null,
    added_at integer not null,
    checksum blob not null,
    primary key (operator, tail, effective_from)
) strict, without rowid;
