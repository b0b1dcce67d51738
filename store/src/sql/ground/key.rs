//! Keys: the columns by which rows of components, uploads and lives are found, and how they are bound.

use domain::{Component, Life, OperatorId, Upload, UploadId};
use sqlx::query::{Query, QueryAs};

use super::super::{Arguments, Database};
use super::row::{self, count};
use crate::StoreError;

/// One life of a component, and one of its generations: most often the newest, and the one that answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx_macros::FromRow)]
pub(crate) struct LifePointer {
    pub(crate) overhaul_index: i64,
    pub(crate) generation: i64,
}

impl LifePointer {
    pub(crate) fn life(&self, component: &Component) -> Result<Life, StoreError> {
        Ok(Life { component: component.clone(), overhaul_index: count("lives", self.overhaul_index)? })
    }
}

/// The key of a component, as the columns that lead every table.
#[derive(Debug, Clone, sqlx_macros::FromRow)]
pub(crate) struct ComponentColumns {
    operator: String,
    part_number: String,
    serial_number: String,
}

impl ComponentColumns {
    pub(crate) fn component(&self, table: &str) -> Result<Component, StoreError> {
        component_of(table, &self.operator, &self.part_number, &self.serial_number)
    }
}

/// A component out of the columns of its key.
pub(crate) fn component_of(
    table: &str,
    operator: &str,
    part_number: &str,
    serial_number: &str,
) -> Result<Component, StoreError> {
    Ok(Component {
        operator: row::parse::<OperatorId>(table, operator)?,
        part_number: row::parse(table, part_number)?,
        serial_number: row::parse(table, serial_number)?,
    })
}

/// The key of an upload, as the columns of every table that is about one.
#[derive(Debug, Clone)]
pub(crate) struct UploadKey {
    pub(crate) component: Component,
    pub(crate) recorded_at: i64,
    pub(crate) upload_id: UploadId,
}

impl UploadKey {
    pub(crate) fn new(component: &Component, upload: &Upload) -> Self {
        let (recorded_at, upload_id) = (upload.recorded_at.micros(), upload.upload_id.clone());
        Self { component: component.clone(), recorded_at, upload_id }
    }
}

/// Binds the columns of a key, in the order of the key.
pub(crate) trait BindKey<'q> {
    fn bind_component(self, component: &'q Component) -> Self;
    fn bind_upload(self, key: &'q UploadKey) -> Self;
}

impl<'q> BindKey<'q> for Query<'q, Database, Arguments> {
    fn bind_component(self, component: &'q Component) -> Self {
        self.bind(component.operator.as_str())
            .bind(component.part_number.as_str())
            .bind(component.serial_number.as_str())
    }

    fn bind_upload(self, key: &'q UploadKey) -> Self {
        self.bind_component(&key.component).bind(key.recorded_at).bind(key.upload_id.as_str())
    }
}

impl<'q, O> BindKey<'q> for QueryAs<'q, Database, O, Arguments> {
    fn bind_component(self, component: &'q Component) -> Self {
        self.bind(component.operator.as_str())
            .bind(component.part_number.as_str())
            .bind(component.serial_number.as_str())
    }

    fn bind_upload(self, key: &'q UploadKey) -> Self {
        self.bind_component(&key.component).bind(key.recorded_at).bind(key.upload_id.as_str())
    }
}
