//! Signatures whose SQL follows.
#![allow(clippy::unimplemented, unused_variables, reason = "published ahead of the implementation")]

use domain::{Component, OperatorId, SensorConfiguration, TailNumber, Timestamp, UploadId};

use super::Sqlite;
use crate::{
    Addition, ComponentRecord, Digest, InstalledTail, Retrial, StoreError, TailConfiguration, UploadRecord,
    UploadStateKind, Voiding, WorkFigures,
};

impl Sqlite {
    pub(crate) async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn uploads(
        &self,
        operator: &OperatorId,
        state: UploadStateKind,
        after: Option<&UploadId>,
        limit: u32,
    ) -> Result<Vec<UploadRecord>, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn void_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        now: Timestamp,
    ) -> Result<Option<Voiding>, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn retry_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        now: Timestamp,
    ) -> Result<Option<Retrial>, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn add_sensor_configuration(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        effective_from: Timestamp,
        configuration: &SensorConfiguration,
        now: Timestamp,
    ) -> Result<Addition, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn sensor_configurations(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Vec<TailConfiguration>, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn work_figures(&self) -> Result<WorkFigures, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn digest(&self) -> Result<Digest, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn installed_fleet(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<InstalledTail>, StoreError> {
        unimplemented!()
    }
    pub(crate) async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        unimplemented!()
    }
}
