//! Collections.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One page of a collection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Page<T> {
    /// The items.
    pub items: Vec<T>,
    /// Where the next page begins (`cursor=`); null on the last.
    #[schema(required)]
    pub next_cursor: Option<String>,
}
