//! Letting many uploads of a tail that are set aside be tried again at once.

use std::{collections::BTreeSet, ops::RangeInclusive};

use domain::{Act, Action, Component, OperatorId, SetAsideReason, TailNumber, Timestamp, UploadId};
use serde_json::json;

use super::super::{
    Connection, Engine,
    access::audit::{Trace, append},
    board::following::{self, Flown},
    ground::{
        key::{BindKey, UploadKey},
        row::parse,
        write::{Reach, Write},
    },
    places::observed,
    uploads::received,
};
use super::corrections;
use crate::{Released, StoreError};

/// Most uploads that are sent back in one transaction: others wait for it.
const MOST: usize = 500;

impl Engine {
    pub(crate) async fn retry_uploads(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        recorded_at: RangeInclusive<Timestamp>,
        reason: Option<SetAsideReason>,
        act: Act,
    ) -> Result<Released, StoreError> {
        self.write(RetryMany { operator: operator.clone(), tail: tail.clone(), recorded_at, reason, act }).await
    }
}

struct RetryMany {
    operator: OperatorId,
    tail: TailNumber,
    recorded_at: RangeInclusive<Timestamp>,
    reason: Option<SetAsideReason>,
    act: Act,
}

impl Write for RetryMany {
    type Output = Released;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Released, StoreError> {
        let (mut released, mut changed) = (Released::default(), BTreeSet::new());
        for component in self.components(connection).await? {
            for (recorded_at, upload_id) in self.set_aside(connection, &component).await? {
                if !self.is_of_tail(connection, &upload_id).await? {
                    continue;
                }
                if released.retried >= MOST as u64 {
                    released.remaining += 1;
                    continue;
                }
                let key = UploadKey { component: component.clone(), recorded_at, upload_id };
                corrections::try_again(connection, &component, &key, self.act.at, now).await?;
                released.retried += 1;
                changed.insert(component.clone());
            }
        }
        following::follow_all(connection, &self.operator, &changed, Flown::Otherwise).await?;
        if released.retried > 0 {
            append(connection, Some(&self.operator), &self.trace(&released)).await?;
        }
        Ok(released)
    }
}

impl RetryMany {
    fn trace(&self, released: &Released) -> Trace {
        let (from, to) = (self.recorded_at.start(), self.recorded_at.end());
        let reason = self.reason.map(SetAsideReason::as_str);
        Trace {
            act: self.act,
            action: Action::UploadsRetried,
            subject: self.tail.to_string(),
            detail: json!({ "from": from, "to": to, "reason": reason, "uploads": released.retried }),
        }
    }

    /// Components that were ever seen on the tail.
    async fn components(&self, connection: &mut Connection) -> Result<BTreeSet<Component>, StoreError> {
        let periods = observed::periods_of_tail(connection, &self.operator, &self.tail).await?;
        Ok(periods.into_iter().map(|period| period.component).collect())
    }

    /// Uploads of a component that are set aside for the reason and were recorded at the time, in its order.
    async fn set_aside(
        &self,
        connection: &mut Connection,
        component: &Component,
    ) -> Result<Vec<(i64, UploadId)>, StoreError> {
        let rows: Vec<(i64, String)> = sqlx::query_as(
            "select recorded_at, upload_id from uploads_set_aside
             where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at >= $4 and recorded_at <= $5
               and ($6 is null or reason = $6)
             order by recorded_at, upload_id",
        )
        .bind_component(component)
        .bind(self.recorded_at.start().micros())
        .bind(self.recorded_at.end().micros())
        .bind(self.reason.map(SetAsideReason::as_str))
        .fetch_all(connection)
        .await?;
        rows.into_iter().map(|(at, id)| Ok((at, parse("set_aside", &id)?))).collect()
    }

    async fn is_of_tail(&self, connection: &mut Connection, id: &UploadId) -> Result<bool, StoreError> {
        let found = received::find(connection, &self.operator, id).await?;
        Ok(found.is_some_and(|(upload, _)| upload.tail == self.tail))
    }
}
