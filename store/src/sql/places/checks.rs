//! Checks of tails: when they are in the hangar, by whom and when it was said.

use domain::{Checks, OperatorId, TailNumber};

use super::super::{
    Engine,
    ground::versions::{self, OfTail, VersionRow, Versioned, noun_of_tails},
};
use crate::{StoreError, TailChecks};

noun_of_tails!(Checks, "tail_checks");

impl Engine {
    /// The newest version of a tail's checks.
    pub(crate) async fn checks(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Option<TailChecks>, StoreError> {
        let newest = versions::newest(&mut *self.read(operator).await?, operator, tail).await?;
        Ok(newest.map(TailChecks::from))
    }

    /// The checks in force of the tails that have any, by tail.
    pub(crate) async fn fleet_checks(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<(TailNumber, TailChecks)>, StoreError> {
        let query = sqlx::query_as(
            "select c.operator, c.tail, c.version, c.set_at, c.set_by, c.body, c.checksum from tail_checks c
             where c.operator = $1 and c.tail > $2 and c.body <> '[]'
               and c.version = (select max(n.version) from tail_checks n where n.operator = $1 and n.tail = c.tail)
             order by c.tail limit $3",
        );
        let query = query.bind(operator.as_str()).bind(after.map_or("", TailNumber::as_str)).bind(i64::from(limit));
        let rows: Vec<VersionRow> = query.fetch_all(&mut *self.read(operator).await?).await?;
        let of_row = |row: VersionRow| Ok((row.tail(Checks::TABLE)?, row.read(Checks::TABLE)?.into()));
        rows.into_iter().map(of_row).collect()
    }
}

impl From<Versioned<Checks>> for TailChecks {
    fn from(Versioned { version, set_at, set_by, noun: checks }: Versioned<Checks>) -> Self {
        Self { version, set_at, set_by, checks }
    }
}
