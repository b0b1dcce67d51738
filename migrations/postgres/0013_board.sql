-- What lists and answers say stands in one narrow row per component and one per tail. An older build would write
-- results and leave them behind.
update schema_info set version = 15, min_binary = 15;

-- Components at their places, ready to be told.
create table board_units (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    tail text collate "C" not null,
    position text collate "C" not null,
    place_known bigint not null,
    overhaul_index bigint not null,
    generation bigint not null,
    prognosis_fence bigint,
    standing text not null,
    as_of_at bigint,
    body text not null,
    stamp bigint not null,
    horizon_fh double precision,
    first_end_fh double precision,
    p05_fh double precision,
    p10_fh double precision,
    p25_fh double precision,
    p50_fh double precision,
    checksum bytea not null,
    primary key (operator, part_number, serial_number)
);
select wall('board_units', 'select, insert, update, delete');
select across('board_units', 'select (place_known, standing, as_of_at)');
create index board_units_on_tail on board_units (operator, tail, position, part_number, serial_number);
create index board_units_displaced on board_units (operator, part_number, serial_number) where place_known = 0;

-- The draws of the forecasts that are served.
create table board_curves (
    operator text collate "C" not null,
    part_number text collate "C" not null,
    serial_number text collate "C" not null,
    draws bigint not null,
    horizon_fh double precision not null,
    ends text not null,
    checksum bytea not null,
    primary key (operator, part_number, serial_number)
);
select wall('board_curves', 'select, insert, update, delete');

-- Tails in short, and how much they fly.
create table board_tails (
    operator text collate "C" not null,
    tail text collate "C" not null,
    positions bigint not null,
    failed bigint not null,
    unknown bigint not null,
    newest_inconsistent bigint,
    newest_ok bigint,
    newest_beyond_horizon bigint,
    oldest bigint,
    p10_fh double precision,
    flown_until bigint,
    fh_per_day double precision,
    stamp bigint not null,
    checksum bytea not null,
    primary key (operator, tail)
);
select wall('board_tails', 'select, insert, update, delete');

-- Of uploads that were stored before, the body alone tells them.
alter table uploads add column flight_hours double precision;
