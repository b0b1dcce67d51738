//! Versions of what is shown, out of sums that no two states of the board share: a row's stamp changes with what it says,
//! and revisions and versions only grow.

use domain::{ContentHash, OperatorId};

use super::super::Engine;
use crate::{Scope, StoreError, Version};

/// The sums over the units and tails for which conditions hold.
macro_rules! sums {
    ($units:literal, $queue:literal, $tails:literal) => {
        concat!(
            "select (select count(*) from board_units u where u.operator = $1",
            $units,
            "),
                    (select cast(coalesce(sum(u.stamp), 0) as bigint) from board_units u where u.operator = $1",
            $units,
            "),
                    (select cast(coalesce(sum(q.input_revision), 0) as bigint) from component_queue q
                     where q.operator = $1",
            $queue,
            "),
                    (select cast(coalesce(sum(q.processed_revision), 0) as bigint) from component_queue q
                     where q.operator = $1",
            $queue,
            "),
                    (select count(*) from tails t where t.operator = $1",
            $tails,
            "),
                    (select cast(coalesce(sum(t.stamp), 0) as bigint) from board_tails t where t.operator = $1",
            $tails,
            "),
                    (select count(*) from tail_plans t where t.operator = $1",
            $tails,
            "),
                    (select count(*) from tail_checks t where t.operator = $1",
            $tails,
            "),
                    (select count(*) from operator_settings s where s.operator = $1)"
        )
    };
}

impl Engine {
    pub(crate) async fn version(&self, operator: &OperatorId, scope: Scope<'_>) -> Result<Version, StoreError> {
        let commits = self.commits();
        if let Some(known) = self.known_version(commits, operator, scope) {
            return Ok(known);
        }
        type Sums = (i64, i64, i64, i64, i64, i64, i64, i64, i64);
        let mut transaction = self.read(operator).await?;
        let sums: Sums = match scope {
            Scope::Fleet => {
                let query = sqlx::query_as(sums!("", "", "")).bind(operator.as_str());
                query.fetch_one(&mut *transaction).await?
            }
            Scope::Tail(tail) => {
                let query = sqlx::query_as(sums!(
                    " and u.tail = $2",
                    " and (q.part_number, q.serial_number) in (
                        select u.part_number, u.serial_number from board_units u where u.operator = $1 and u.tail = $2)",
                    " and t.tail = $2"
                ));
                query.bind(operator.as_str()).bind(tail.as_str()).fetch_one(&mut *transaction).await?
            }
        };
        let version = Version(ContentHash::of_json(&sums));
        self.keep_version(commits, operator, scope, version);
        Ok(version)
    }
}
