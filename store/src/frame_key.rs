//! Frame keys as they are kept: whom each speaks for, and no secret.

use domain::{ContentHash, FrameKeyId, FrameSubject, OperatorId, Timestamp};

/// A frame key without its secret, which follows from the installation's and from this.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameKeyRecord {
    /// Its id.
    pub id: FrameKeyId,
    /// The operator whose aircraft write by it.
    pub operator: OperatorId,
    /// Whom it speaks for.
    pub subject: FrameSubject,
    /// The bundle whose mask an actuator is sampled by; `None` of a key for strain.
    pub bundle: Option<ContentHash>,
    /// Time at which it was made.
    pub made_at: Timestamp,
    /// Time at which it was revoked. No frame by it is taken then, whenever it was measured.
    pub revoked_at: Option<Timestamp>,
}
