-- What maintenance found, priors learned from lives that it ended, prognoses by flight hours, and
-- checkpoints. A build that ignores learned priors would write wrong results.
update schema_info set version = 3, min_binary = 3;

-- Append-only. Names of events are taken for ever, also those of voided ones.
-- kind: 'finding_failed' or 'finding_serviceable'.
create table maintenance_events (
    operator text not null,
    event_id text not null,
    part_number text not null,
    serial_number text not null,
    kind text not null,
    occurred_at integer not null,
    flight_hours real not null,
    received_at integer not null,
    body text not null,
    checksum blob not null,
    primary key (operator, event_id)
) strict;
create index maintenance_events_of_component
    on maintenance_events (operator, part_number, serial_number, flight_hours, occurred_at, event_id);

create table voided_events (
    operator text not null,
    event_id text not null,
    part_number text not null,
    serial_number text not null,
    voided_at integer not null,
    primary key (operator, event_id)
) strict, without rowid;

-- The event that is the life's failure; null while there is none.
alter table lives add column ended_by text;
create index lives_ended on lives (operator, part_number) where ended_by is not null;

-- as_of.flight_hours of a prognosis with a forecast; null without one. In rows that were here before,
-- it may differ from the body's in the last digit. (A damaged body is left to whoever reads it.)
alter table prognoses add column forecast_from_fh real;
update prognoses set forecast_from_fh =
    case when json_valid(body) then
        case when json_type(body, '$.forecast.Ok') is not null
        then cast(json_extract(body, '$.as_of.flight_hours') as real) end
    end;
create index prognoses_with_forecast
    on prognoses
        (operator, part_number, serial_number, overhaul_index, generation, forecast_from_fh, fence)
    where forecast_from_fh is not null;

-- Append-only: priors learned from finished lives. Bodies are named by their hash.
create table priors (
    operator text not null,
    part_number text not null,
    model blob not null,
    hash blob not null,
    parent blob not null,
    lives integer not null,
    learned_at integer not null,
    checksum blob not null,
    body blob not null,
    primary key (operator, part_number, model, hash)
) strict;

-- A cache of what a filter knows at the end of a block. digest: of everything that it is a function of.
create table checkpoints (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    overhaul_index integer not null,
    generation integer not null,
    block integer not null,
    digest blob not null,
    checksum blob not null,
    body blob not null,
    primary key (operator, part_number, serial_number, overhaul_index, generation, block)
) strict;
