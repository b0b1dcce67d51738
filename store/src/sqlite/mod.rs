//! SQLite: one process owns the file, one writer task owns the writing connection.

use std::time::Duration;

use domain::{
    BundleSummary, Component, ContentHash, Estimate, OperatorId, Position, State, TailNumber, Timestamp, Upload,
    UploadId,
};

use crate::*;

pub(crate) struct Sqlite {}

impl Sqlite {
    pub(crate) async fn open(_url: &str, _options: Options) -> Result<Self, StoreError> {
        todo!()
    }
    pub(crate) async fn close(&self) {
        todo!()
    }
    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        todo!()
    }
    pub(crate) async fn register_bundle(
        &self,
        _summary: &BundleSummary,
        _body: &[u8],
        _now: Timestamp,
    ) -> Result<(), StoreError> {
        todo!()
    }
    pub(crate) async fn activate_bundle(&self, _hash: &ContentHash, _now: Timestamp) -> Result<(), StoreError> {
        todo!()
    }
    pub(crate) async fn bundles(&self) -> Result<Vec<BundleRecord>, StoreError> {
        todo!()
    }
    pub(crate) async fn bundle_body(&self, _hash: &ContentHash) -> Result<Option<Vec<u8>>, StoreError> {
        todo!()
    }
    pub(crate) async fn mask(&self, _id: &ContentHash) -> Result<Option<PublishedMask>, StoreError> {
        todo!()
    }
    pub(crate) async fn accept(
        &self,
        _operator: &OperatorId,
        _upload: Upload,
        _received_at: Timestamp,
    ) -> Result<Receipt, StoreError> {
        todo!()
    }
    pub(crate) async fn upload(
        &self,
        _operator: &OperatorId,
        _id: &UploadId,
    ) -> Result<Option<UploadRecord>, StoreError> {
        todo!()
    }
    pub(crate) async fn lease(&self, _duration: Duration) -> Result<Option<Lease>, StoreError> {
        todo!()
    }
    pub(crate) async fn work_available(&self) {
        todo!()
    }
    pub(crate) async fn life_inputs(&self, _lease: &Lease) -> Result<LifeInputs, StoreError> {
        todo!()
    }
    pub(crate) async fn complete(&self, _lease: &Lease, _results: LifeResults) -> Result<Completion, StoreError> {
        todo!()
    }
    pub(crate) async fn abandon(&self, _lease: &Lease, _retry_after: Duration) -> Result<(), StoreError> {
        todo!()
    }
    pub(crate) async fn pending(&self) -> Result<u64, StoreError> {
        todo!()
    }
    pub(crate) async fn tails(
        &self,
        _operator: &OperatorId,
        _after: Option<&TailNumber>,
        _limit: u32,
    ) -> Result<Vec<TailNumber>, StoreError> {
        todo!()
    }
    pub(crate) async fn installed(
        &self,
        _operator: &OperatorId,
        _tail: &TailNumber,
    ) -> Result<Vec<Installed>, StoreError> {
        todo!()
    }
    pub(crate) async fn installed_at(
        &self,
        _operator: &OperatorId,
        _tail: &TailNumber,
        _position: &Position,
    ) -> Result<Option<Installed>, StoreError> {
        todo!()
    }
    pub(crate) async fn installations(&self, _component: &Component) -> Result<Vec<Installation>, StoreError> {
        todo!()
    }
    pub(crate) async fn estimates(
        &self,
        _component: &Component,
        _from_fh: Option<f64>,
        _to_fh: Option<f64>,
        _after: Option<&LifeCursor>,
        _limit: u32,
    ) -> Result<Vec<Estimate>, StoreError> {
        todo!()
    }
    pub(crate) async fn states(
        &self,
        _component: &Component,
        _from_fh: Option<f64>,
        _to_fh: Option<f64>,
        _after: Option<u64>,
        _limit: u32,
    ) -> Result<Vec<State>, StoreError> {
        todo!()
    }
}
