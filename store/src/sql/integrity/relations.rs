//! Relations between tables: rows that are missing, or that contradict the rows they follow from.
//!
//! Card. *What:* a checksum tells a row that was changed; one that vanished is told by the rows that rest on it or
//! that it rests on. *Rule:* each statement names rows that should be there and are not, or that are not what they
//! should be; none is named in a sound database, whatever happens to it meanwhile, because all is read as of one
//! moment.

use domain::{Timestamp, time::DAY_US};

use super::super::{Connection, events::recorded::FAILED, lives::endings::end_of_life};
use crate::{DamagedRow, StoreError, Verification};

/// A time for which nothing waits by itself.
const LONGEST_WAIT_US: i64 = 400 * DAY_US;

/// Rows that a statement finds missing or contradicted.
struct Relation {
    table: &'static str,
    detail: &'static str,
    /// Names them, one a row.
    sql: &'static str,
}

/// Finds rows of `k` for whose component a condition does not hold.
macro_rules! of_component {
    ($table:literal, $condition:literal) => {
        concat!(
            "select distinct k.operator || '/' || k.part_number || '/' || k.serial_number from ",
            $table,
            " k where ",
            $condition
        )
    };
}

/// Finds rows of `k` without the name of their upload.
macro_rules! without_upload {
    ($table:literal) => {
        concat!(
            "select k.operator || '/' || k.upload_id from ",
            $table,
            " k where not exists (
                select 1 from upload_keys u
                where u.operator = k.operator and u.upload_id = k.upload_id and u.part_number = k.part_number
                  and u.serial_number = k.serial_number and u.recorded_at = k.recorded_at)"
        )
    };
}

/// Counts the rows of a component of `k`.
macro_rules! counted {
    ($table:literal) => {
        concat!(
            "(select count(*) from ",
            $table,
            " n where n.operator = k.operator and n.part_number = k.part_number and n.serial_number = k.serial_number)"
        )
    };
}

/// Finds rows of `k` whose component is not enrolled.
macro_rules! without_component {
    ($table:literal) => {
        of_component!(
            $table,
            "not exists (
               select 1 from components c
               where c.operator = k.operator and c.part_number = k.part_number and c.serial_number = k.serial_number)"
        )
    };
}

const RELATIONS: &[Relation] = &[
    Relation {
        table: "uploads",
        detail: "it is missing, though its name is taken",
        sql: "
        select k.operator || '/' || k.upload_id from upload_keys k
        where not exists (
          select 1 from uploads u
          where u.operator = k.operator and u.part_number = k.part_number and u.serial_number = k.serial_number
            and u.recorded_at = k.recorded_at and u.upload_id = k.upload_id)",
    },
    Relation {
        table: "upload_keys",
        detail: "it is missing, though its upload is there",
        sql: without_upload!("uploads"),
    },
    Relation { table: "uploads", detail: "it is missing, though it waits", sql: without_upload!("inbox") },
    Relation { table: "uploads", detail: "it is missing, though it is set aside", sql: without_upload!("set_aside") },
    Relation { table: "uploads", detail: "it is missing, though it is excluded", sql: without_upload!("exclusions") },
    Relation { table: "uploads", detail: "it is missing, though it is voided", sql: without_upload!("voided") },
    Relation { table: "uploads", detail: "it is missing, though it was tried again", sql: without_upload!("retried") },
    Relation {
        table: "maintenance_events",
        detail: "it is missing, though it is voided",
        sql: "
        select k.operator || '/' || k.event_id from voided_events k
        where not exists (
          select 1 from maintenance_events e
          where e.operator = k.operator and e.event_id = k.event_id and e.part_number = k.part_number
            and e.serial_number = k.serial_number)",
    },
    Relation {
        table: "components",
        detail: "it is missing, though it has uploads",
        sql: without_component!("uploads"),
    },
    Relation {
        table: "components",
        detail: "it is missing, though it has events",
        sql: without_component!("maintenance_events"),
    },
    Relation { table: "components", detail: "it is missing, though it has lives", sql: without_component!("lives") },
    Relation {
        table: "components",
        detail: "it is missing, though it is queued",
        sql: without_component!("component_queue"),
    },
    Relation {
        table: "lives",
        detail: "its first life is missing",
        sql: of_component!(
            "components",
            "
        not exists (
          select 1 from lives l
          where l.operator = k.operator and l.part_number = k.part_number and l.serial_number = k.serial_number
            and l.overhaul_index = 0)"
        ),
    },
    Relation {
        table: "lives",
        detail: "there are not as many as its overhauls say",
        sql: concat!(
            "select k.operator || '/' || k.part_number || '/' || k.serial_number from components k where ",
            counted!("lives"),
            " <> 1 + (
          select count(*) from maintenance_events e
          where e.operator = k.operator and e.part_number = k.part_number and e.serial_number = k.serial_number
            and e.kind = 'overhaul'
            and not exists (select 1 from voided_events v where v.operator = e.operator and v.event_id = e.event_id))"
        ),
    },
    Relation {
        table: "lives",
        detail: "it does not begin where its overhaul says",
        sql: of_component!(
            "lives",
            "
        k.overhaul_index > 0 and not exists (
          select 1 from maintenance_events e
          where e.operator = k.operator and e.event_id = k.began_by and e.part_number = k.part_number
            and e.serial_number = k.serial_number and e.kind = 'overhaul' and e.flight_hours = k.began_fh
            and e.occurred_at = k.began_at
            and not exists (select 1 from voided_events v where v.operator = e.operator and v.event_id = e.event_id))"
        ),
    },
    Relation {
        table: "generations",
        detail: "the one that answers is missing",
        sql: of_component!(
            "lives",
            "
        not exists (
          select 1 from generations g
          where g.operator = k.operator and g.part_number = k.part_number and g.serial_number = k.serial_number
            and g.overhaul_index = k.overhaul_index and g.number = k.generation)"
        ),
    },
    Relation {
        table: "generations",
        detail: "one before another is missing",
        sql: of_component!(
            "generations",
            "
        k.number > 1 and not exists (
          select 1 from generations g
          where g.operator = k.operator and g.part_number = k.part_number and g.serial_number = k.serial_number
            and g.overhaul_index = k.overhaul_index and g.number = k.number - 1)"
        ),
    },
    Relation {
        table: "lives",
        detail: "it is missing, though it has a generation",
        sql: of_component!(
            "generations",
            "
        not exists (
          select 1 from lives l
          where l.operator = k.operator and l.part_number = k.part_number and l.serial_number = k.serial_number
            and l.overhaul_index = k.overhaul_index)"
        ),
    },
    Relation {
        table: "prognoses",
        detail: "the one that is served is missing",
        sql: of_component!(
            "lives",
            "
        k.prognosis_fence is not null and not exists (
          select 1 from prognoses p
          where p.operator = k.operator and p.part_number = k.part_number and p.serial_number = k.serial_number
            and p.overhaul_index = k.overhaul_index and p.generation = k.generation and p.fence = k.prognosis_fence
            and p.withdrawn_at is null)"
        ),
    },
    Relation {
        table: "estimates",
        detail: "there are not as many as its uploads say",
        sql: concat!(
            "select k.operator || '/' || k.part_number || '/' || k.serial_number from components k where (
          select count(*) from estimates e join lives l
            on l.operator = e.operator and l.part_number = e.part_number and l.serial_number = e.serial_number
           and l.overhaul_index = e.overhaul_index and l.generation = e.generation
          where e.operator = k.operator and e.part_number = k.part_number and e.serial_number = k.serial_number)
        + ",
            counted!("inbox"),
            " + ",
            counted!("set_aside"),
            " + ",
            counted!("voided"),
            " <> ",
            counted!("uploads")
        ),
    },
    Relation {
        table: "component_queue",
        detail: "it is missing, though it has uploads",
        sql: of_component!(
            "components",
            "
        exists (
          select 1 from uploads u
          where u.operator = k.operator and u.part_number = k.part_number and u.serial_number = k.serial_number)
        and not exists (
          select 1 from component_queue q
          where q.operator = k.operator and q.part_number = k.part_number and q.serial_number = k.serial_number)"
        ),
    },
    Relation {
        table: "component_queue",
        detail: "it does not wait, though its uploads do",
        sql: of_component!(
            "inbox",
            "
        not exists (
          select 1 from component_queue q
          where q.operator = k.operator and q.part_number = k.part_number and q.serial_number = k.serial_number
            and q.input_revision > q.processed_revision)"
        ),
    },
    Relation {
        table: "component_queue",
        detail: "its numbers contradict each other",
        sql: of_component!(
            "component_queue",
            "
        k.processed_revision < 0 or k.input_revision < k.processed_revision or k.attempts < 0 or k.fence < 0
        or exists (
          select 1 from lives l
          where l.operator = k.operator and l.part_number = k.part_number and l.serial_number = k.serial_number
            and (l.touched_revision < 0 or l.touched_revision > k.input_revision))
        or exists (
          select 1 from prognoses p
          where p.operator = k.operator and p.part_number = k.part_number and p.serial_number = k.serial_number
            and p.fence > k.fence)"
        ),
    },
    Relation {
        table: "installations",
        detail: "it is missing, though uploads saw it and no event says otherwise",
        sql: of_component!(
            "observed_installations",
            "
        not exists (
          select 1 from movements m
          where m.operator = k.operator and m.part_number = k.part_number and m.serial_number = k.serial_number)
        and not exists (
          select 1 from movements m
          where m.operator = k.operator and m.tail = k.tail and m.position = k.position)
        and not exists (
          select 1 from installations i
          where i.operator = k.operator and i.tail = k.tail and i.position = k.position and i.from_at = k.from_at
            and i.from_by = 'upload' and i.from_name = k.from_upload and i.part_number = k.part_number
            and i.serial_number = k.serial_number and i.to_at is not distinct from k.to_at
            and i.to_name is not distinct from k.to_upload)"
        ),
    },
    Relation {
        table: "installations",
        detail: "it is missing, though its component was installed last of all",
        sql: of_component!(
            "movements",
            "
        k.inward = 1
        and not exists (
          select 1 from movements m
          where m.operator = k.operator and m.part_number = k.part_number and m.serial_number = k.serial_number
            and m.occurred_at >= k.occurred_at and m.event_id <> k.event_id)
        and not exists (
          select 1 from movements m
          where m.operator = k.operator and m.tail = k.tail and m.position = k.position and m.inward = 1
            and m.occurred_at >= k.occurred_at and m.event_id <> k.event_id)
        and not exists (
          select 1 from installations i
          where i.operator = k.operator and i.tail = k.tail and i.position = k.position
            and i.part_number = k.part_number and i.serial_number = k.serial_number and i.to_at is null)"
        ),
    },
    Relation {
        table: "sensor_configurations",
        detail: "it is missing, though it is in force",
        sql: "
        select k.operator || '/' || k.tail from tail_sensor_configurations k
        where not exists (
          select 1 from sensor_configurations c where c.operator = k.operator and c.hash = k.hash)",
    },
    Relation {
        table: "bundles",
        detail: "one that judges lives is missing",
        sql: "
        select distinct k.operator from generations k
        where not exists (select 1 from bundles b where b.hash = k.model)",
    },
];

/// Looks for rows that are missing, and for rows that contradict others.
pub(super) async fn verify(
    connection: &mut Connection,
    now: Timestamp,
    found: &mut Verification,
) -> Result<(), StoreError> {
    for Relation { table, detail, sql } in RELATIONS {
        let named: Vec<String> = sqlx::query_scalar(*sql).fetch_all(&mut *connection).await?;
        tell(found, table, detail, named);
    }
    let named = sqlx::query_scalar(of_component!("component_queue", "k.not_before > $1 or k.lease_until > $1"));
    let named = named.bind(now.micros().saturating_add(LONGEST_WAIT_US)).fetch_all(&mut *connection).await?;
    tell(found, "component_queue", "it is not to be processed for more than a year", named);
    ends(connection, found).await
}

/// Operators that are not among all operators: as row-level security shows one operator at a time, nobody would ever read their rows.
pub(super) async fn verify_operators(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let named = sqlx::query_scalar(
        "select k.operator from lives k where not exists (select 1 from operators o where o.operator = k.operator)
         union
         select k.operator from component_queue k
         where not exists (select 1 from operators o where o.operator = k.operator)",
    );
    let named = named.fetch_all(connection).await?;
    tell(found, "operators", "it is missing, though it has rows", named);
    Ok(())
}

/// Lives that are ended by another event than findings say.
async fn ends(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let named = sqlx::query_scalar(concat!(
        "select l.operator || '/' || l.part_number || '/' || l.serial_number || '/' || cast(l.overhaul_index as text)
         from lives l where l.ended_by is distinct from ",
        end_of_life!("$1")
    ));
    let named = named.bind(FAILED).fetch_all(connection).await?;
    tell(found, "lives", "its end is not that of its findings", named);
    Ok(())
}

fn tell(found: &mut Verification, table: &'static str, detail: &str, named: Vec<String>) {
    found.damaged.extend(named.into_iter().map(|row| DamagedRow { table, row, detail: detail.to_owned() }));
}
