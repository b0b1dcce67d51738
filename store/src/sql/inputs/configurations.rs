//! A sensor configuration that comes into force.
//!
//! An estimate is a function of its upload and of the configuration in force when it was recorded. So
//! a configuration, whenever it arrives, sends the uploads of its period back to be estimated again.

use std::collections::BTreeSet;

use domain::{Act, Action, OperatorId, SensorConfiguration, TailNumber, Timestamp};
use serde_json::json;

use super::super::{
    Connection, Engine,
    access::audit::Trace,
    board::following::{self, Flown},
    ground::{
        row::encode,
        write::{Reach, Write},
    },
    places::{observed, sensor_configurations::Draft},
};
use super::corrections::{self, Span};
use crate::{Addition, StoreError};

impl Engine {
    pub(crate) async fn add_sensor_configuration(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        effective_from: Timestamp,
        configuration: &SensorConfiguration,
        act: Act,
    ) -> Result<Addition, StoreError> {
        let body = encode("sensor configuration", configuration)?;
        let (operator, tail) = (operator.clone(), tail.clone());
        let draft = Draft { operator, tail, effective_from, hash: configuration.id(), body, added_at: act.at };
        let detail = json!({ "effective_from": effective_from, "hash": draft.hash });
        let subject = draft.tail.to_string();
        let trace = Trace { act, action: Action::SensorConfigurationAdded, subject, detail };
        self.act(Add(draft), trace, |addition| *addition == Addition::Added).await
    }
}

struct Add(Draft);

impl Write for Add {
    type Output = Addition;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.0.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Addition, StoreError> {
        if let Some(known) = self.0.known(connection).await? {
            return Ok(if known == self.0.hash { Addition::Duplicate } else { Addition::Conflict });
        }
        self.0.insert(connection).await?;
        let (from, until) = (self.0.effective_from.micros(), self.0.superseded_at(connection).await?);
        let mut changed = BTreeSet::new();
        for period in observed::periods_of_tail(connection, &self.0.operator, &self.0.tail).await? {
            // An upload of the period's last moment may still be of this tail.
            let recorded_at = from.max(period.from_at)..until.min(period.to.0.saturating_add(1));
            if !recorded_at.is_empty() {
                let span = Span { recorded_at, only: None };
                corrections::send_back(connection, &period.component, span, self.0.added_at, now).await?;
                changed.insert(period.component);
            }
        }
        following::follow_all(connection, &self.0.operator, &changed, Flown::Otherwise).await?;
        Ok(Addition::Added)
    }
}
