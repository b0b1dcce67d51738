//! Anchors: the ends of the audit log's chains, kept beside the log itself, so that one that was emptied or cut is
//! told.
//!
//! An anchor is moved in the transaction that appends to its chain. It also counts the tokens that its operator was
//! given, so that a service whose tokens are gone does not take itself for one that never had any.

use domain::ContentHash;

use super::super::{
    Connection,
    ground::{
        row::hash,
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

const ANCHORS: &str = "anchors";

sealed! {
    /// The newest record of a chain, and how many tokens its operator was ever given.
    AnchorRow of "anchors", checksum "anchor_checksum",
    key { operator: String }
    columns { sequence: i64, hash: Vec<u8>, tokens: i64 }
    values "$1, $2, $3, $4, $5" where "operator = $2"
}

/// The end of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Anchor {
    pub(crate) sequence: i64,
    pub(crate) hash: ContentHash,
    /// Number of tokens that were ever created.
    pub(crate) tokens: i64,
}

/// The anchor of a chain, which is called like its operator; that of the installation is empty.
pub(super) async fn find(connection: &mut Connection, chain: &str) -> Result<Option<Anchor>, StoreError> {
    let sql = "select operator, sequence, hash, tokens, checksum as anchor_checksum from anchors where operator = $1";
    let row: Option<AnchorRow> = sqlx::query_as(sql).bind(chain).fetch_optional(connection).await?;
    row.map(|row| {
        let row = row.checked()?;
        Ok(Anchor { sequence: row.sequence, hash: hash(ANCHORS, &row.hash)?, tokens: row.tokens })
    })
    .transpose()
}

/// Moves the anchor of a chain.
pub(super) async fn put(connection: &mut Connection, chain: &str, anchor: Anchor) -> Result<(), StoreError> {
    let Anchor { sequence, hash, tokens } = anchor;
    let hash = hash.bytes().to_vec();
    let row = AnchorRow { operator: chain.to_owned(), sequence, hash, tokens, checksum: None };
    let query = sqlx::query(
        "insert into anchors (operator, sequence, hash, tokens, checksum) values ($1, $2, $3, $4, $5)
         on conflict (operator) do update set
           sequence = excluded.sequence, hash = excluded.hash, tokens = excluded.tokens, checksum = excluded.checksum",
    );
    row.bind_columns(query).bind(row.seal()).execute(connection).await?;
    Ok(())
}

/// Names all chains that have an anchor and can be seen.
pub(super) async fn chains(connection: &mut Connection) -> Result<Vec<String>, StoreError> {
    Ok(sqlx::query_scalar("select operator from anchors order by operator").fetch_all(connection).await?)
}

/// Tells whether any operator was ever given a token.
pub(super) async fn know_tokens(connection: &mut Connection) -> Result<bool, StoreError> {
    let sql = "select exists (select 1 from anchors where tokens <> 0)";
    Ok(sqlx::query_scalar(sql).fetch_one(connection).await?)
}

/// Checks every anchor.
pub(crate) async fn verify(connection: &mut Connection, found: &mut crate::Verification) -> Result<(), StoreError> {
    sealed::verify::<AnchorRow>(connection, found).await
}
