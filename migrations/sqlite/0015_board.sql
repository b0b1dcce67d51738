-- What lists and answers say stands in one narrow row per component and one per tail. An older build would write
-- results and leave them behind.
update schema_info set version = 15, min_binary = 15;

-- Components at their places, ready to be told.
create table board_units (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    tail text not null,
    position text not null,
    place_known integer not null,
    overhaul_index integer not null,
    generation integer not null,
    prognosis_fence integer,
    standing text not null,
    as_of_at integer,
    body text not null,
    stamp integer not null,
    horizon_fh real,
    first_end_fh real,
    p05_fh real,
    p10_fh real,
    p25_fh real,
    p50_fh real,
    checksum blob not null,
    primary key (operator, part_number, serial_number)
) strict, without rowid;
create index board_units_on_tail on board_units (operator, tail, position, part_number, serial_number);
create index board_units_displaced on board_units (operator, part_number, serial_number) where place_known = 0;

-- The draws of the forecasts that are served.
create table board_curves (
    operator text not null,
    part_number text not null,
    serial_number text not null,
    draws integer not null,
    horizon_fh real not null,
    ends text not null,
    checksum blob not null,
    primary key (operator, part_number, serial_number)
) strict, without rowid;

-- Tails in short, and how much they fly.
create table board_tails (
    operator text not null,
    tail text not null,
    positions integer not null,
    failed integer not null,
    unknown integer not null,
    newest_inconsistent integer,
    newest_ok integer,
    newest_beyond_horizon integer,
    oldest integer,
    p10_fh real,
    flown_until integer,
    fh_per_day real,
    stamp integer not null,
    checksum blob not null,
    primary key (operator, tail)
) strict, without rowid;

-- Of uploads that were stored before, the body alone tells them.
alter table uploads add column flight_hours real;
