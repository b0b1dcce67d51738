-- New generations are announced for all lives, and a digest is that of the generations that answer. A build that
-- takes the digest over all of them would find two equal databases different.
update schema_info set version = 6, min_binary = 6;

-- Generations after the first: those that have still to be made are among them.
create index generations_after_first
    on generations (model, operator, part_number, serial_number, overhaul_index, number)
    where number > 1;
