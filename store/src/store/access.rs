//! Settings, tokens, frame keys and the audit log.

use domain::{Act, Actor, AuditRecord, FrameKeyId, OperatorId, Settings, TokenId};

use super::{Backend, Store, backend};
use crate::{AuditChain, FrameKeyRecord, OperatorSettings, Revocation, StoreError, TokenRecord};

impl Store {
    /// All operators that were ever heard of, in alphabetical order.
    pub async fn operators(&self) -> Result<Vec<OperatorId>, StoreError> {
        backend!(self, operators())
    }

    /// Keeps a new token, whose secret nobody but its owner knows.
    pub async fn create_token(&self, token: &TokenRecord, actor: Actor) -> Result<(), StoreError> {
        backend!(self, create_token(token, actor))
    }

    /// The tokens of an operator, revoked and expired ones too, the oldest first.
    pub async fn tokens(&self, operator: &OperatorId) -> Result<Vec<TokenRecord>, StoreError> {
        backend!(self, tokens(operator))
    }

    /// The token of this id, whoever's it is: only for finding out who calls.
    pub async fn token(&self, id: &TokenId) -> Result<Option<TokenRecord>, StoreError> {
        backend!(self, token(id))
    }

    /// Tells whether any token was ever created: from then on, callers must show one.
    pub async fn has_tokens(&self) -> Result<bool, StoreError> {
        backend!(self, has_tokens())
    }

    /// Revokes a token of this operator for ever; `None` for an unknown one. Idempotent.
    pub async fn revoke_token(
        &self,
        operator: &OperatorId,
        id: &TokenId,
        act: Act,
    ) -> Result<Option<Revocation>, StoreError> {
        backend!(self, revoke_token(operator, id, act))
    }

    /// Keeps a new frame key, whose secret follows from what is not here.
    pub async fn create_frame_key(&self, key: &FrameKeyRecord, actor: Actor) -> Result<(), StoreError> {
        backend!(self, create_frame_key(key, actor))
    }

    /// The frame keys of an operator, revoked ones too, the oldest first.
    pub async fn frame_keys(&self, operator: &OperatorId) -> Result<Vec<FrameKeyRecord>, StoreError> {
        backend!(self, frame_keys(operator))
    }

    /// The frame key of this id, if it is the operator's.
    pub async fn frame_key(&self, operator: &OperatorId, id: FrameKeyId) -> Result<Option<FrameKeyRecord>, StoreError> {
        backend!(self, frame_key(operator, id))
    }

    /// Revokes a frame key of this operator for ever; `None` for an unknown one. Idempotent.
    pub async fn revoke_frame_key(
        &self,
        operator: &OperatorId,
        id: FrameKeyId,
        act: Act,
    ) -> Result<Option<Revocation>, StoreError> {
        backend!(self, revoke_frame_key(operator, id, act))
    }

    /// The records of an operator's audit log, or of the installation's, from the first one after place
    /// `after` (0 for all), in their order.
    pub async fn audit(
        &self,
        operator: Option<&OperatorId>,
        after: u64,
        limit: u32,
    ) -> Result<Vec<AuditRecord>, StoreError> {
        backend!(self, audit(operator, after, limit))
    }

    /// Follows every chain of the audit log to its end, or to where it is broken.
    pub async fn verify_audit(&self) -> Result<Vec<AuditChain>, StoreError> {
        backend!(self, verify_audit())
    }

    /// Sets the settings of an operator, unless the same are in force; returns the version that is in force then.
    pub async fn set_settings(
        &self,
        operator: &OperatorId,
        settings: &Settings,
        act: Act,
    ) -> Result<OperatorSettings, StoreError> {
        backend!(self, set_settings(operator, settings, act))
    }

    /// The newest version of an operator's settings; `None` where none were ever set.
    pub async fn settings(&self, operator: &OperatorId) -> Result<Option<OperatorSettings>, StoreError> {
        backend!(self, settings(operator))
    }
}
