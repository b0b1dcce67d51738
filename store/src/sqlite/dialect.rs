//! What SQLite says in its own words.

/// Leases the component that has waited longest until `$2`; `$1` is the present.
pub(super) const LEASE_NEXT: &str = "
    update component_queue set lease_until = $2, fence = fence + 1, attempts = attempts + 1
    where (operator, part_number, serial_number) = (
      select operator, part_number, serial_number from component_queue
      where input_revision > processed_revision and not_before <= $1 and lease_until <= $1
      order by not_before, operator, part_number, serial_number limit 1)
    returning operator, part_number, serial_number, input_revision, fence, attempts";

/// The number of uploads outside the partitions of their months: there are none.
macro_rules! uploads_without_partition {
    () => {
        "0"
    };
}

/// The whole part of a number that is not negative.
macro_rules! whole {
    ($number:literal) => {
        concat!("cast(", $number, " as integer)")
    };
}
