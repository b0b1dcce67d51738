-- Checksums over the columns of rows that have no body, and where the chains of the audit log end. A build that
-- knows none of them would write rows without, which are refused.
update schema_info set version = 8, min_binary = 8;

-- 1 once every row has its checksum: from then on, a row without one is damaged.
alter table schema_info add column sealed bigint not null default 0;

alter table operators add column checksum bytea;
alter table tails add column checksum bytea;
alter table components add column checksum bytea;
-- Over all columns but touched_revision, which each upload changes and no answer rests on.
alter table lives add column checksum bytea;
alter table generations add column checksum bytea;
alter table installations add column checksum bytea;
alter table observed_installations add column checksum bytea;
alter table movements add column checksum bytea;
alter table upload_keys add column checksum bytea;
alter table inbox add column checksum bytea;
alter table set_aside add column checksum bytea;
alter table exclusions add column checksum bytea;
alter table voided add column checksum bytea;
alter table voided_events add column checksum bytea;

-- Over what is changed in rows whose other columns have their checksum: when a prognosis was withdrawn (null while
-- it stands), and which bundle is active since when.
alter table prognoses add column withdrawal_checksum bytea;
grant update (withdrawal_checksum) on prognoses to actuary_service;
alter table bundles add column activation_checksum bytea;

-- Rows that are written from now on have one; of those that are here, actuary migrate says so when it has sealed them.
do $$
declare
    walled text;
begin
    foreach walled in array array[
        'operators', 'tails', 'components', 'lives', 'generations', 'installations', 'observed_installations',
        'movements', 'upload_keys', 'inbox', 'set_aside', 'exclusions', 'voided', 'voided_events'
    ] loop
        execute format('alter table %I add constraint %I check (checksum is not null) not valid',
            walled, walled || '_sealed');
    end loop;
end $$;
alter table bundles add constraint bundles_sealed check (activation_checksum is not null) not valid;

-- A server of an older build that still runs would change rows and leave their checksums behind: it is refused, and
-- nothing that it is sent gets lost, because nothing of that is acknowledged.
create function refuse_unsealed() returns trigger language plpgsql as $$
begin
    raise exception 'a row of % was to change without its checksum: stop the server of an older build', tg_table_name;
end $$;
create trigger sealed before update of generation, prognosis_fence, ended_by, began_by, began_fh, began_at on lives
    for each row when (
        new.checksum is not distinct from old.checksum
        and (new.generation, new.prognosis_fence, new.ended_by, new.began_by, new.began_fh, new.began_at)
            is distinct from
            (old.generation, old.prognosis_fence, old.ended_by, old.began_by, old.began_fh, old.began_at))
    execute function refuse_unsealed();
create trigger sealed before update of to_at, to_upload on observed_installations
    for each row when (
        new.checksum is not distinct from old.checksum
        and (new.to_at, new.to_upload) is distinct from (old.to_at, old.to_upload))
    execute function refuse_unsealed();
create trigger sealed before update of withdrawn_at on prognoses
    for each row when (
        new.withdrawal_checksum is not distinct from old.withdrawal_checksum
        and new.withdrawn_at is distinct from old.withdrawn_at)
    execute function refuse_unsealed();
create trigger sealed before update of active, activated_at on bundles
    for each row when (
        new.activation_checksum is not distinct from old.activation_checksum
        and (new.active, new.activated_at) is distinct from (old.active, old.activated_at))
    execute function refuse_unsealed();

-- Damaged ones are made anew.
grant delete on tails to actuary_service;

-- The newest record of each chain of the audit log, and how many tokens its operator was ever given.
create table anchors (
    operator text collate "C" primary key,
    sequence bigint not null,
    hash bytea not null,
    tokens bigint not null,
    checksum bytea
);
select wall('anchors', 'select, insert, update');
select across('anchors', 'select');
