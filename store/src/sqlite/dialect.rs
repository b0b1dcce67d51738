//! The words of SQLite where Postgres has others.

/// Ends a query whose rows are written next: nobody else writes.
macro_rules! unless_locked {
    () => {
        ""
    };
}

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

/// Ends a query whose rows are written next: nobody else writes.
macro_rules! alone {
    () => {
        ""
    };
}
