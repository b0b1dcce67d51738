//! Work: leases, inputs and results of workers, and lessons.

use std::time::Duration;

use domain::{Component, ContentHash, OperatorId, PartNumber};

use super::{Backend, Store, backend};
use crate::{
    Checkpoint, Completion, FinishedLife, Lease, Lesson, LifeInputs, LifeResults, RemovedLife, StoreError, WorkFigures,
};

impl Store {
    /// Leases the component that has waited longest, if one waits and is not leased or backing off: for `duration`,
    /// and for longer after attempts that ended without a result ([`Lease::duration`]).
    pub async fn lease(&self, duration: Duration) -> Result<Option<Lease>, StoreError> {
        backend!(self, lease(duration))
    }

    /// Returns when there is something to lease. It looks into the queue after it has begun to
    /// listen, so that work accepted between an empty [`Store::lease`] and this call is not missed.
    pub async fn work_available(&self) {
        backend!(self, work_available())
    }

    /// Inputs from which the results of each life of the leased component that has something to process are computed
    /// from, the oldest life first.
    pub async fn life_inputs(&self, lease: &Lease) -> Result<Vec<LifeInputs>, StoreError> {
        backend!(self, life_inputs(lease))
    }

    /// What the results of the life that a component is in rest on, in the generation that answers, without what waits to
    /// be estimated; `None` for an unknown component. Nothing can be written for it: that takes a lease.
    pub async fn present_life(&self, component: &Component) -> Result<Option<LifeInputs>, StoreError> {
        backend!(self, present_life(component))
    }

    /// Tells whether a life of the leased component has inputs that were stored since the lease.
    pub async fn newer_input_waits(&self, lease: &Lease, overhaul_index: u32) -> Result<bool, StoreError> {
        backend!(self, newer_input_waits(lease, overhaul_index))
    }

    /// The checkpoint of the latest block among `wanted` that is stored with the digest wanted, of one
    /// generation of a life. A damaged one is as if it were not there.
    pub async fn checkpoint(
        &self,
        component: &Component,
        overhaul_index: u32,
        generation: u32,
        wanted: &[(u64, ContentHash)],
    ) -> Result<Option<Checkpoint>, StoreError> {
        backend!(self, checkpoint(component, overhaul_index, generation, wanted))
    }

    /// Writes results and ends the lease. Inputs stored since the lease leave the component waiting.
    pub async fn complete(&self, lease: &Lease, results: Vec<LifeResults>) -> Result<Completion, StoreError> {
        backend!(self, complete(lease, results))
    }

    /// Ends the lease without a result; the component waits for `retry_after`. Without effect when
    /// the lease is no longer held.
    pub async fn abandon(&self, lease: &Lease, retry_after: Duration) -> Result<(), StoreError> {
        backend!(self, abandon(lease, retry_after))
    }

    /// Lessons that can be learned now, by operator and part number: each part number of an operator of which at
    /// least [`Lesson::MIN_LIVES`] lives judged by the active bundle have ended, and at least
    /// [`Lesson::GROWTH`] times as many as its newest prior was learned from. A lesson stays until such a
    /// prior is added; while it is claimed, it is not listed.
    pub async fn lessons(&self) -> Result<Vec<Lesson>, StoreError> {
        backend!(self, lessons())
    }

    /// Claims a lesson, so that no other worker takes it meanwhile; tells whether it could still be claimed. A
    /// claim ends with the prior, or after `duration`, which grows like that of a lease with the attempts that
    /// taught nothing ([`Lease::duration`]): a lesson that fails is tried again less and less often.
    pub async fn claim_lesson(&self, lesson: &Lesson, duration: Duration) -> Result<bool, StoreError> {
        backend!(self, claim_lesson(lesson, duration))
    }

    /// Hands back a lesson that was claimed and not taken to its end, as if nobody had tried it.
    pub async fn release_lesson(&self, lesson: &Lesson) -> Result<(), StoreError> {
        backend!(self, release_lesson(lesson))
    }

    /// The finished lives of a part number that are judged by a bundle, with their histories, by serial
    /// number and life.
    pub async fn finished_lives(
        &self,
        operator: &OperatorId,
        part_number: &PartNumber,
        model: &ContentHash,
    ) -> Result<Vec<FinishedLife>, StoreError> {
        backend!(self, finished_lives(operator, part_number, model))
    }

    /// The lives of a part number that are judged by a bundle and were over before they failed, with their histories, by
    /// serial number and life.
    pub async fn removed_lives(
        &self,
        operator: &OperatorId,
        part_number: &PartNumber,
        model: &ContentHash,
    ) -> Result<Vec<RemovedLife>, StoreError> {
        backend!(self, removed_lives(operator, part_number, model))
    }

    /// Number of uploads that wait to be processed, over all operators.
    pub async fn pending(&self) -> Result<u64, StoreError> {
        backend!(self, pending())
    }

    /// Figures of the work that waits.
    pub async fn work_figures(&self) -> Result<WorkFigures, StoreError> {
        backend!(self, work_figures())
    }

    /// Tells whether anything waits for a worker: an upload, or a generation that has still to be made.
    pub async fn work_waits(&self) -> Result<bool, StoreError> {
        backend!(self, work_waits())
    }
}
