//! The way down by uplink frames: an upload as one or two blocks of text.

use std::{fmt::Debug, future::Future, pin::Pin};

use domain::{FrameSubject, TailNumber, Upload};
use proto::{
    frame::{KeyCard, Measured, MeasuredStrain, to_base32},
    json::UploadBody,
};

use crate::FleetError;

/// A key on its way.
pub type Fetched<'a> = Pin<Box<dyn Future<Output = Result<KeyCard, String>> + Send + 'a>>;

/// Where aircraft have their frame keys from.
pub trait FrameKeys: Debug + Send + Sync {
    /// The key of a subject, or why it has none.
    fn card<'a>(&'a self, subject: &'a FrameSubject) -> Fetched<'a>;
}

/// The frames of an upload after a flight, a line each.
pub async fn frames(
    keys: &dyn FrameKeys,
    tail: &TailNumber,
    body: UploadBody,
    flight: u32,
) -> Result<String, FleetError> {
    let name = body.upload_id.clone();
    let refused = |reason: String| FleetError::Refused { name: name.clone(), reason };
    let upload = body.into_upload(tail.clone()).map_err(|invalid| refused(invalid.to_string()))?;
    let mut lines = String::new();
    if upload.strain.is_some() {
        let card = keys.card(&FrameSubject::Strain { tail: tail.clone() }).await.map_err(refused)?;
        let strain = MeasuredStrain::of(&upload, &card.subject).map_err(|invalid| refused(invalid.to_string()))?;
        let frame = strain.map(|strain| strain.frame(flight, &card.key)).transpose();
        let frame = frame.map_err(|invalid| refused(invalid.to_string()))?;
        lines.extend(frame.map(|frame| to_base32(frame.bytes()) + "\n"));
    }
    let card = keys.card(&subject(&upload).ok_or_else(|| refused("no samples".to_owned()))?).await.map_err(refused)?;
    let frame = Measured::of(&upload, &card.subject).and_then(|measured| measured.frame(flight, &card.key));
    let frame = frame.map_err(|invalid| refused(invalid.to_string()))?;
    Ok(lines + &to_base32(frame.bytes()) + "\n")
}

/// Whom the key of an upload speaks for.
fn subject(upload: &Upload) -> Option<FrameSubject> {
    let mask_id = upload.reading.mask_id()?;
    let Upload { tail, position, part_number, serial_number, .. } = upload.clone();
    Some(FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id })
}
