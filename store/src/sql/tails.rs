//! Tails that were ever heard of.

use domain::{OperatorId, TailNumber};

use super::{
    Connection,
    sealed::{self, sealed},
};
use crate::StoreError;

sealed! {
    /// A tail that was ever heard of.
    TailRow of "tails", checksum "tail_checksum",
    key { operator: String, tail: String }
    columns {}
    values "$1, $2, $3" where "operator = $2 and tail = $3"
}

/// Enrols a tail, unless it is known.
pub(super) async fn enrol(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<(), StoreError> {
    let row = TailRow { operator: operator.to_string(), tail: tail.to_string(), checksum: None };
    sealed::insert_new(connection, &row).await.map(|_| ())
}
