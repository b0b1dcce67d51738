//! Uplink frames on their way in: who wrote them, and the upload that they are.
//!
//! Whether a key is unknown, another operator's, or did not write the frame is one refusal, found by the same computation;
//! that a key was revoked is told only of frames that it wrote.

use domain::{FrameKeyId, FrameSubject, Invalid, Upload};
use proto::frame::{self, Content, Frame, FrameError, InstallationKey, join};
use store::FrameKeyRecord;

use crate::{auth::Caller, refusal::Refusal, state::Shared};

/// The frames of one upload, as they came.
#[derive(Debug)]
pub struct Frames(Vec<Frame>);

impl Frames {
    /// The frames in a body: their bytes, one frame behind the other, or base32, a frame a line.
    pub fn in_body(body: &[u8]) -> Result<Self, Refusal> {
        if body.first().is_some_and(|first| *first >= b' ') {
            let text = String::from_utf8_lossy(body);
            let frames = text.lines().map(str::trim).filter(|line| !line.is_empty());
            let frame = |line| Frame::parse(&frame::from_base32(line)?);
            return Ok(Self(frames.map(frame).collect::<Result<_, FrameError>>()?));
        }
        let mut frames = Vec::new();
        let mut rest = body;
        while frames.is_empty() || !rest.is_empty() {
            let (frame, left) = Frame::parse_first(rest)?;
            frames.push(frame);
            rest = left;
        }
        Ok(Self(frames))
    }

    /// A frame, and that of its strain unless it is empty.
    pub fn of(frame: &[u8], strain: &[u8]) -> Result<Self, Refusal> {
        let told = [frame, strain].into_iter().enumerate().filter(|(i, bytes)| *i == 0 || !bytes.is_empty());
        Ok(Self(told.map(|(_, bytes)| Frame::parse(bytes)).collect::<Result<_, FrameError>>()?))
    }

    /// The upload that they are, if keys of the caller's operator wrote them.
    pub async fn into_upload(self, shared: &Shared, caller: &Caller) -> Result<Upload, Refusal> {
        let Some(installation) = &shared.state.frame_key else {
            let why = "this service was given no key for frames (--frame-key-file)";
            return Err(Refusal::Unavailable(why.to_owned()));
        };
        let (mut actuators, mut strains) = (Vec::new(), Vec::new());
        if self.0.len() > 2 {
            return Err(not_one());
        }
        for frame in self.0 {
            let (content, subject) = open(shared, caller, installation, &frame).await?;
            match content {
                Content::Actuator(measured) => {
                    actuators.push((frame.key().upload_id(frame.counter()), (measured, subject)))
                }
                Content::Strain(strain) => strains.push((strain, subject)),
            }
        }
        match (actuators.pop(), strains.pop()) {
            (Some((upload_id, measured)), strain) if actuators.is_empty() => Ok(join(upload_id, measured, strain)?),
            _ => Err(not_one()),
        }
    }
}

fn not_one() -> Refusal {
    Invalid::one("#", "the frame of one actuator is expected, with or without that of its strain").into()
}

/// What a frame says, and whom its key speaks for.
async fn open(
    shared: &Shared,
    caller: &Caller,
    installation: &InstallationKey,
    frame: &Frame,
) -> Result<(Content, FrameSubject), Refusal> {
    let operator = caller.operator();
    let record = shared.state.store.frame_key(operator, frame.key()).await?;
    let subject = record.as_ref().map_or_else(|| nobody(frame.key()), |record| record.subject.clone());
    let read = frame.open(&installation.derive(frame.key(), operator, &subject));
    match (record, read) {
        (None, _) | (_, Err(FrameError::NotAuthentic)) => Err(FrameError::NotAuthentic.into()),
        (Some(FrameKeyRecord { id, revoked_at: Some(at), .. }), _) => Err(Refusal::FrameKeyRevoked { id, at }),
        (Some(_), read) => Ok((read?, subject)),
    }
}

/// Whom a key speaks for that nobody has: its frames are looked at like others.
fn nobody(id: FrameKeyId) -> FrameSubject {
    let [a, b, ..] = id.bytes();
    FrameSubject::Strain { tail: format!("{a:02X}{b:02X}").parse().expect("a tail") }
}
