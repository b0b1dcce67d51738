//! Tails in short, and how much they fly: one row each.

use domain::{OperatorId, Status, TailNumber, Timestamp};

use super::super::{
    Connection,
    ground::{
        row::count,
        sealed::{self, Sealed, sealed},
    },
    places::utilisation::Flown,
};
use super::units::stamp;
use crate::{StoreError, TailInShort};

const TAILS: &str = "board_tails";

sealed! {
    /// A tail in short: its components, counted by how they stand while their data are fresh, with the newest data of
    /// each kind and the oldest of all; and the flight hours per day of the days before one.
    TailBoardRow of "board_tails", checksum "tail_board_checksum",
    key { operator: String, tail: String }
    columns {
        positions: i64,
        failed: i64,
        unknown: i64,
        newest_inconsistent: Option<i64>,
        newest_ok: Option<i64>,
        newest_beyond_horizon: Option<i64>,
        oldest: Option<i64>,
        p10_fh: Option<f64>,
        flown_until: Option<i64>,
        fh_per_day: Option<f64>,
        stamp: i64,
    }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14"
    where "operator = $2 and tail = $3"
}

/// The columns of a row `b`.
macro_rules! tail_columns {
    () => {
        "b.operator, b.tail, b.positions, b.failed, b.unknown, b.newest_inconsistent, b.newest_ok,
         b.newest_beyond_horizon, b.oldest, b.p10_fh, b.flown_until, b.fh_per_day, b.stamp,
         b.checksum as tail_board_checksum "
    };
}

/// What the components on a tail sum up to.
#[derive(sqlx_macros::FromRow)]
struct Sums {
    positions: i64,
    failed: i64,
    unknown: i64,
    newest_inconsistent: Option<i64>,
    newest_ok: Option<i64>,
    newest_beyond_horizon: Option<i64>,
    oldest: Option<i64>,
    p10_fh: Option<f64>,
}

impl TailBoardRow {
    fn new(operator: &OperatorId, tail: &TailNumber, sums: Sums, flown: Flown) -> Self {
        let row = Self {
            operator: operator.to_string(),
            tail: tail.to_string(),
            positions: sums.positions,
            failed: sums.failed,
            unknown: sums.unknown,
            newest_inconsistent: sums.newest_inconsistent,
            newest_ok: sums.newest_ok,
            newest_beyond_horizon: sums.newest_beyond_horizon,
            oldest: sums.oldest,
            p10_fh: sums.p10_fh,
            flown_until: flown.until,
            fh_per_day: flown.fh_per_day,
            stamp: 0,
            checksum: None,
        };
        Self { stamp: stamp(&[&row.seal()]), ..row }
    }

    pub(crate) fn flown(&self) -> Flown {
        Flown { until: self.flown_until, fh_per_day: self.fh_per_day }
    }

    /// What it tells of its tail in short.
    pub(crate) fn in_short(&self, tail: TailNumber) -> Result<TailInShort, StoreError> {
        let newest = |standing, at: Option<i64>| at.map(|at| (standing, Some(Timestamp::from_micros(at))));
        let standing = [
            (self.failed > 0).then_some((Status::Failed, None)),
            (self.unknown > 0).then_some((Status::InsufficientHistory, None)),
            newest(Status::Inconsistent, self.newest_inconsistent),
            newest(Status::Current, self.newest_ok),
            newest(Status::BeyondHorizon, self.newest_beyond_horizon),
            // Once it is stale, so is the tail; until then it is no worse than the others.
            newest(Status::BeyondHorizon, self.oldest),
        ];
        Ok(TailInShort {
            tail,
            positions: count(TAILS, self.positions)?,
            p10_fh: self.p10_fh,
            standing: standing.into_iter().flatten().collect(),
        })
    }
}

/// The row of a tail.
pub(crate) async fn find(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Option<TailBoardRow>, StoreError> {
    let query =
        sqlx::query_as(concat!("select ", tail_columns!(), "from board_tails b where b.operator = $1 and b.tail = $2"));
    Ok(query.bind(operator.as_str()).bind(tail.as_str()).fetch_optional(connection).await?)
}

/// The rows of an operator's tails behind `after` up to `last`.
pub(crate) async fn of_tails(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    last: &str,
) -> Result<Vec<TailBoardRow>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select ",
        tail_columns!(),
        "from board_tails b where b.operator = $1 and b.tail > $2 and b.tail <= $3 order by b.tail"
    ));
    Ok(query.bind(operator.as_str()).bind(after).bind(last).fetch_all(connection).await?)
}

/// Sums up the components on a tail.
pub(crate) async fn derived(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    flown: Flown,
) -> Result<TailBoardRow, StoreError> {
    let sums = sqlx::query_as(
        "select count(*) as positions,
                coalesce(sum(case when standing = 'failed' then 1 else 0 end), 0) as failed,
                coalesce(sum(case when standing = 'insufficient_history' then 1 else 0 end), 0) as unknown,
                max(case when standing = 'inconsistent' then as_of_at end) as newest_inconsistent,
                max(case when standing = 'current' then as_of_at end) as newest_ok,
                max(case when standing = 'beyond_horizon' then as_of_at end) as newest_beyond_horizon,
                min(case when standing in ('inconsistent', 'current', 'beyond_horizon') then as_of_at end) as oldest,
                min(p10_fh) as p10_fh
         from board_units where operator = $1 and tail = $2 and place_known = 1",
    );
    let sums = sums.bind(operator.as_str()).bind(tail.as_str()).fetch_one(connection).await?;
    Ok(TailBoardRow::new(operator, tail, sums, flown))
}

/// Whether an upload of a component waits that was ever seen on a tail.
pub(crate) async fn waits(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select exists (
           select 1 from observed_installations o
           join component_queue q on q.operator = o.operator and q.part_number = o.part_number
                and q.serial_number = o.serial_number
           where o.operator = $1 and o.tail = $2 and q.input_revision > q.processed_revision)",
    );
    Ok(query.bind(operator.as_str()).bind(tail.as_str()).fetch_one(connection).await?)
}

/// Takes a tail's row until the transaction ends, so that of two that change what is on it the later one sees all.
pub(super) async fn hold(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Option<TailBoardRow>, StoreError> {
    let sql = concat!("select ", tail_columns!(), "from board_tails b where b.operator = $1 and b.tail = $2", alone!());
    let hold = || sqlx::query_as(sql).bind(operator.as_str()).bind(tail.as_str());
    if let Some(row) = hold().fetch_optional(&mut *connection).await? {
        return Ok(Some(row));
    }
    let nothing = derived(connection, operator, tail, Flown::default()).await?;
    sealed::insert_new(connection, &nothing).await?;
    Ok(hold().fetch_optional(connection).await?)
}

/// Writes what has changed of a tail's row, which is held.
pub(super) async fn replace(connection: &mut Connection, row: &TailBoardRow) -> Result<(), StoreError> {
    let update = sqlx::query(
        "update board_tails set
           positions = $3, failed = $4, unknown = $5, newest_inconsistent = $6, newest_ok = $7,
           newest_beyond_horizon = $8, oldest = $9, p10_fh = $10, flown_until = $11, fh_per_day = $12, stamp = $13,
           checksum = $14
         where operator = $1 and tail = $2",
    );
    row.bind_columns(update).bind(row.seal()).execute(connection).await?;
    Ok(())
}
