//! What Postgres says in its own words.

/// Leases the component that has waited longest until `$2`; `$1` is the present. Components that another
/// transaction writes just now are passed over.
pub(super) const LEASE_NEXT: &str = "
    with next as (
      select operator, part_number, serial_number from component_queue
      where input_revision > processed_revision and not_before <= $1 and lease_until <= $1
      order by not_before, operator, part_number, serial_number limit 1
      for no key update skip locked)
    update component_queue q set lease_until = $2, fence = q.fence + 1, attempts = q.attempts + 1
    from next n
    where q.operator = n.operator and q.part_number = n.part_number and q.serial_number = n.serial_number
    returning q.operator, q.part_number, q.serial_number, q.input_revision, q.fence, q.attempts";

/// The whole part of a number that is not negative.
macro_rules! whole {
    ($number:literal) => {
        concat!("cast(trunc(", $number, ") as bigint)")
    };
}

/// The number of uploads outside the partitions of their months.
macro_rules! uploads_without_partition {
    () => {
        "uploads_without_partition()"
    };
}

/// The present in microseconds.
macro_rules! now {
    () => {
        "cast(extract(epoch from clock_timestamp()) * 1000000 as bigint)"
    };
}
