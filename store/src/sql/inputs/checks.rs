//! Checks that are set for tails.
//!
//! A check enters no prognosis: it says what a forecast is asked for, so nothing waits to be computed by it.

use domain::{Act, Action, Checks, OperatorId, TailNumber, Timestamp};
use serde_json::json;

use super::super::{
    Connection, Engine,
    access::audit::{self, Trace},
    ground::{
        versions::{self, Versioned},
        write::{Reach, Write},
    },
};
use crate::{StoreError, TailChecks};

impl Engine {
    pub(crate) async fn set_checks(
        &self,
        operator: &OperatorId,
        checks: &[(TailNumber, Checks)],
        act: Act,
    ) -> Result<Vec<TailChecks>, StoreError> {
        self.write(Set { operator: operator.clone(), checks: checks.to_vec(), act }).await
    }
}

struct Set {
    operator: OperatorId,
    checks: Vec<(TailNumber, Checks)>,
    act: Act,
}

impl Write for Set {
    /// The versions in force.
    type Output = Vec<TailChecks>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<Vec<TailChecks>, StoreError> {
        let mut in_force = Vec::with_capacity(self.checks.len());
        for (tail, checks) in &self.checks {
            let newest = versions::newest(connection, &self.operator, tail).await?;
            let (version, is_new) = Versioned::set(newest, checks, self.act);
            if is_new {
                versions::insert(connection, &self.operator, tail, &version).await?;
                let detail = json!({ "checks": checks.iter().len() });
                let trace = Trace { act: self.act, action: Action::ChecksSet, subject: tail.to_string(), detail };
                audit::append(connection, Some(&self.operator), &trace).await?;
            }
            in_force.push(version.into());
        }
        Ok(in_force)
    }
}
