//! Reasons why bytes are no frame, or none to be believed.

use domain::Invalid;

/// A reason why bytes are no frame, or none to be believed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The text is not base32.
    #[error("character {at} is none of base32 (A-Z, 2-7, without padding), or one too many or too few")]
    Text {
        /// The place of the character, from 1.
        at: usize,
    },
    /// Bytes are missing.
    #[error("the frame is cut: {bytes} bytes of {expected}")]
    Cut {
        /// Those that are there.
        bytes: usize,
        /// Those that its layout has.
        expected: usize,
    },
    /// There are more bytes than the layout has, or than one block takes.
    #[error("the frame has {bytes} bytes where {expected} are expected")]
    Long {
        /// Those that are there.
        bytes: usize,
        /// Those that are expected.
        expected: usize,
    },
    /// The layout is not known.
    #[error("frames of layout {0} are not read here, but of layout 1 (an actuator) and 2 (strain)")]
    Layout(u8),
    /// The key did not write it.
    #[error("no key in force here wrote this frame: the key is not known, or the frame was changed on its way")]
    NotAuthentic,
    /// The key wrote something that the layout does not say.
    #[error("the frame says what no frame does: {0}")]
    Content(Invalid),
}
