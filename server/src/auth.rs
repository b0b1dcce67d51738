//! Who calls.

use std::convert::Infallible;

use axum::{extract::FromRequestParts, http::request::Parts};
use domain::OperatorId;
use tonic::{Request, Status};

/// Who calls: everyone is the same operator, as long as callers cannot be told apart.
#[derive(Debug, Clone, Default)]
pub struct Caller {
    operator: OperatorId,
}

impl Caller {
    /// Who makes a gRPC call.
    pub fn of<T>(_: &Request<T>) -> Result<Self, Status> {
        Ok(Self::default())
    }

    /// Whose data it may reach.
    pub fn operator(&self) -> &OperatorId {
        &self.operator
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Infallible;

    async fn from_request_parts(_: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self::default())
    }
}
