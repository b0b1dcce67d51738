-- The operators take turns in the queue, and of each one what is known goes before what is new. An older build goes by
-- age alone, which changes no result.
update schema_info set version = 10 where version < 10;

create index component_queue_turns
    on component_queue (operator, (processed_revision = 0), not_before, part_number, serial_number)
    where input_revision > processed_revision;
