//! From frames to an upload.
//!
//! Strain joins an actuator's frame that was measured in the same second on the same tail, and that it is sent with. So an
//! upload follows from what was sent, whatever came before it.

use domain::{FrameSubject, Invalid, MapSamples, Reading, Upload, UploadId};

use super::{Measured, MeasuredStrain};

/// The upload that a frame is, by whom its key speaks for, with the strain that was sent with it.
pub fn join(
    upload_id: UploadId,
    (measured, subject): (Measured, FrameSubject),
    strain: Option<(MeasuredStrain, FrameSubject)>,
) -> Result<Upload, Invalid> {
    let FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id } = subject else {
        return Err(Invalid::one("#", "the frame of an actuator is by a key for strain"));
    };
    if let Some((strain, subject)) = &strain {
        let mut invalid = Invalid::default();
        if !matches!(subject, FrameSubject::Strain { tail: of } if *of == tail) {
            invalid.push("#/strain", format!("its key does not speak for the strain of tail {tail}"));
        }
        if strain.recorded_at != measured.recorded_at {
            let (at, of) = (strain.recorded_at, measured.recorded_at);
            invalid.push("#/strain", format!("measured at {at}, which is not when the actuator was, {of}"));
        }
        invalid.into_result(Some(()))?;
    }
    let Measured { samples, load_ratio, sample_noise, .. } = measured;
    Ok(Upload {
        tail,
        upload_id,
        position,
        part_number,
        serial_number,
        flight_hours: measured.flight_hours,
        flight_cycles: measured.flight_cycles,
        recorded_at: measured.recorded_at,
        reading: Reading::Samples(MapSamples { mask_id, samples, load_ratio, sample_noise }),
        strain: strain.map(|(strain, _)| strain.strain),
        air_data: measured.air_data,
        temperature_c: measured.temperature_c,
        winding_temperature_c: measured.winding_temperature_c,
        on_ground: measured.on_ground,
    })
}
