//! The words of Postgres where SQLite has others.

/// Ends a query whose rows are written next: those that another transaction writes just now are passed over.
macro_rules! unless_locked {
    () => {
        " for no key update skip locked"
    };
}

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

/// Ends a query whose rows are taken until the transaction ends: whoever else wants to write them waits.
macro_rules! alone {
    () => {
        " for no key update"
    };
}
