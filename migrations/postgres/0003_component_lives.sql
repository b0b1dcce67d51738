-- A component has a life more with every overhaul. A build that knows only the newest would leave the
-- others unprocessed.
update schema_info set version = 5, min_binary = 5;

-- The component's input_revision when the life last got something to process: it waits while this is more
-- than the component's processed_revision.
alter table lives add column touched_revision bigint not null default 0;
