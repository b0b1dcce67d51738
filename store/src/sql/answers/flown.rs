//! How tails fly: what is planned for them, and how much they flew of late.

use std::collections::BTreeMap;

use domain::{OperatorId, TailNumber};

use super::{
    super::Engine,
    installed::{Flown, flown},
};
use crate::{Planned, StoreError};

impl Engine {
    /// How a tail flies.
    pub(crate) async fn planned(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Planned, StoreError> {
        Ok(Flown::of_tail(&mut *self.read(operator).await?, operator, tail).await?.planned())
    }

    /// How the tails behind `after` up to `last` fly, as far as anything is known of them.
    pub(crate) async fn fleet_planned(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        last: &TailNumber,
    ) -> Result<BTreeMap<TailNumber, Planned>, StoreError> {
        let after = after.map_or("", TailNumber::as_str);
        let flown = flown(&mut *self.read(operator).await?, operator, after, last.as_str()).await?;
        Ok(flown.into_iter().map(|(tail, flown)| (tail, flown.planned())).collect())
    }
}
