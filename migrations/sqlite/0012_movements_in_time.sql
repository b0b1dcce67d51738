-- What is around a moment is found without the past. At one time removals come before installs, and a removal is one
-- from its own place only: a build that orders them by name would tell other installations. Those that are there are
-- made anew (sealed: 0).
update schema_info set version = 12, min_binary = 12, sealed = 0;

drop index movements_of_place;
create index movements_of_place
    on movements (operator, tail, position, inward, part_number, serial_number, occurred_at, event_id);
create index movements_at_place_in_time on movements (operator, tail, position, occurred_at, inward, event_id);

create index installations_told_of_component
    on installations (operator, part_number, serial_number, from_at, from_name)
    where from_by = 'event';
create index installations_told_at_place
    on installations (operator, tail, position, from_at, from_name)
    where from_by = 'event';

-- Where components are now.
create index installations_present on installations (operator, part_number, serial_number) where to_at is null;

-- Names that differ in case only.
create index components_by_name on components (operator, lower(part_number), lower(serial_number));
