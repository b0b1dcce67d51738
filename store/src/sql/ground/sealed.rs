//! Rows without a body: one checksum covers every column that answers rest on.
//!
//! Where components are, which life has ended, which upload waits: that stands in columns, which statements compare.
//! Their checksum is made here when a row is written, and compared wherever one is read. The name that it covers is
//! that of the table with the values of the columns, so that no row passes for another's, nor a column for another.

use futures_util::StreamExt;
use sqlx::{Connection as _, FromRow, query::Query};

use super::super::{Arguments, Connection, Database};
use super::check;
use crate::StoreError;

// What the macro names where it is called.
pub(crate) use super::row::{checksum, name_text};

/// A statement with its parameters.
pub(crate) type Statement<'q> = Query<'q, Database, Arguments>;

/// Rows that get their checksum in one transaction.
const BATCH: usize = 1000;

/// A row of which one checksum covers all columns.
pub(crate) trait Sealed: for<'r> FromRow<'r, <Database as sqlx::Database>::Row> + Send + Sync + Unpin {
    /// Its table.
    const TABLE: &'static str;
    /// All rows.
    const ALL: &'static str;
    /// The rows that have no checksum yet.
    const UNSEALED: &'static str;
    /// Writes a row: its columns, then its checksum.
    const INSERT: &'static str;
    /// The same, unless there is one of this key.
    const INSERT_NEW: &'static str;
    /// Writes the checksum of the row of a key.
    const SEAL: &'static str;

    /// The checksum that it must have.
    fn seal(&self) -> Vec<u8>;
    /// The checksum that it has.
    fn stored_seal(&self) -> Option<&[u8]>;
    /// Its columns as text, to name it by.
    fn name(&self) -> String;
    /// Binds all columns that the checksum covers.
    fn bind_columns<'q>(&'q self, statement: Statement<'q>) -> Statement<'q>;
    /// Binds the columns of its key.
    fn bind_key<'q>(&'q self, statement: Statement<'q>) -> Statement<'q>;

    /// Refuses a row whose checksum does not hold, or that has none.
    fn check(&self) -> Result<(), StoreError> {
        let detail = match self.stored_seal() {
            None => "it has no checksum",
            Some(stored) if stored == self.seal() => return Ok(()),
            Some(_) => "its checksum does not hold",
        };
        Err(StoreError::Corrupt { row: self.name(), detail: detail.to_owned() })
    }

    /// The row, if its checksum holds.
    fn checked(self) -> Result<Self, StoreError>
    where
        Self: Sized,
    {
        self.check().map(|()| self)
    }
}

/// Declares a row: its table, the name that its checksum is read by, the columns of its key, its other columns that the
/// checksum covers, the parameters of all of them with the checksum, and the condition that finds it by its key, from
/// the second parameter on.
macro_rules! sealed {
    (
        $(#[$doc:meta])*
        $row:ident of $table:literal, checksum $checksum:literal,
        key { $first:ident: $first_type:ty $(, $key:ident: $key_type:ty)* $(,)? }
        columns { $($column:ident: $type:ty),* $(,)? }
        $(further { $($further:ident: $further_type:ty),* $(,)? })?
        values $values:literal where $condition:literal
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, sqlx_macros::FromRow)]
        pub(crate) struct $row {
            pub(crate) $first: $first_type,
            $(pub(crate) $key: $key_type,)*
            $(pub(crate) $column: $type,)*
            $($(pub(crate) $further: $further_type,)*)?
            #[sqlx(rename = $checksum)]
            pub(crate) checksum: Option<Vec<u8>>,
        }

        impl sealed::Sealed for $row {
            const TABLE: &'static str = $table;
            const ALL: &'static str = concat!(
                "select ", stringify!($first), $(", ", stringify!($key),)* $(", ", stringify!($column),)*
                $($(", ", stringify!($further),)*)? ", checksum as ", $checksum, " from ", $table,
                " order by ", stringify!($first), $(", ", stringify!($key),)*
            );
            const UNSEALED: &'static str = concat!(
                "select ", stringify!($first), $(", ", stringify!($key),)* $(", ", stringify!($column),)*
                $($(", ", stringify!($further),)*)? ", checksum as ", $checksum, " from ", $table, " where checksum is null"
            );
            const INSERT: &'static str = concat!(
                "insert into ", $table, " (", stringify!($first), $(", ", stringify!($key),)*
                $(", ", stringify!($column),)* $($(", ", stringify!($further),)*)? ", checksum) values (", $values, ")"
            );
            const INSERT_NEW: &'static str = concat!(
                "insert into ", $table, " (", stringify!($first), $(", ", stringify!($key),)*
                $(", ", stringify!($column),)* $($(", ", stringify!($further),)*)? ", checksum) values (", $values, ") on conflict do nothing"
            );
            const SEAL: &'static str = concat!("update ", $table, " set checksum = $1 where ", $condition);

            fn seal(&self) -> Vec<u8> {
                sealed::checksum(
                    &($table, &self.$first, $(&self.$key,)* $(&self.$column,)* $(($(&self.$further,)*),)?),
                    &[],
                )
            }

            fn stored_seal(&self) -> Option<&[u8]> {
                self.checksum.as_deref()
            }

            fn name(&self) -> String {
                sealed::name_text(&($table, &self.$first, $(&self.$key,)*))
            }

            fn bind_columns<'q>(
                &'q self,
                statement: sealed::Statement<'q>,
            ) -> sealed::Statement<'q> {
                self.bind_key(statement)$(.bind(&self.$column))*$($(.bind(&self.$further))*)?
            }

            fn bind_key<'q>(&'q self, statement: sealed::Statement<'q>) -> sealed::Statement<'q> {
                statement.bind(&self.$first)$(.bind(&self.$key))*
            }
        }
    };
}
pub(crate) use sealed;

/// Writes a row with its checksum.
pub(crate) async fn insert<R: Sealed>(connection: &mut Connection, row: &R) -> Result<(), StoreError> {
    row.bind_columns(sqlx::query(R::INSERT)).bind(row.seal()).execute(connection).await?;
    Ok(())
}

/// Writes a row with its checksum, unless there is one of its key; tells whether there was none.
pub(crate) async fn insert_new<R: Sealed>(connection: &mut Connection, row: &R) -> Result<bool, StoreError> {
    let written = row.bind_columns(sqlx::query(R::INSERT_NEW)).bind(row.seal()).execute(connection).await?;
    Ok(written.rows_affected() == 1)
}

/// Gives a checksum to the rows of a table that were there before it had any: read on one connection, written on
/// another, some in a transaction. What was interrupted goes on where it was.
pub(crate) async fn seal_all<R: Sealed>(reader: &mut Connection, writer: &mut Connection) -> Result<(), StoreError> {
    let mut batches = sqlx::query_as::<_, R>(R::UNSEALED).fetch(reader).chunks(BATCH);
    while let Some(batch) = batches.next().await {
        let mut transaction = writer.begin().await?;
        for row in batch {
            let row = row?;
            row.bind_key(sqlx::query(R::SEAL).bind(row.seal())).execute(&mut *transaction).await?;
        }
        transaction.commit().await?;
    }
    Ok(())
}

/// Lists a table with the columns that its checksum covers.
#[cfg(test)]
pub(crate) async fn list<R: Sealed>(covered: &mut Vec<String>) -> Result<(), StoreError> {
    let columns = R::ALL.strip_prefix("select ").and_then(|rest| rest.split_once(", checksum as"));
    covered.push(format!("{}: {}", R::TABLE, columns.expect("columns, then the checksum").0));
    Ok(())
}

/// Checks every row of a table.
pub(crate) async fn verify<R: Sealed>(
    connection: &mut Connection,
    found: &mut crate::Verification,
) -> Result<(), StoreError> {
    check::each(connection, R::TABLE, R::ALL, found, |row: R| row.check()).await
}
