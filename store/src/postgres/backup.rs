//! What is done with an SQLite file has its own tools here.

use std::path::Path;

use super::Engine;
use crate::StoreError;

impl Engine {
    pub(crate) async fn copy_to(&self, _: &Path) -> Result<(), StoreError> {
        Err(StoreError::NotAFile)
    }

    pub(crate) async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        Err(StoreError::NotAFile)
    }
}
