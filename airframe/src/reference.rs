//! The instrumented wing of reference: the sensor configuration that a tail has unless it brings its own.

use std::collections::BTreeMap;

use domain::{
    SensorConfiguration,
    sensor_configuration::{Effectiveness, HingePosition, Side, StrainGrating, Surface},
};

use crate::{
    beam::Beam,
    flight::HingeMoments,
    hinge::{HingeModel, hinge_rows},
    lifting_line::LiftingLine,
    section::{Section, SectionGeometry},
    strain::{Layout, STATIONS_M, strain_map},
    wing::Wing,
};

/// Collocation points of the reference wing: its maps are within 3e-6 of those with 2000 points.
pub const REFERENCE_POINTS: usize = 400;

/// Reference wavelengths of a station's three strain gratings, nm; each 10 nm window is its own.
const STRAIN_WAVELENGTHS_NM: [f64; 3] = [1532.0, 1542.0, 1552.0];
/// Reference wavelength of a station's free grating, nm.
const TEMPERATURE_WAVELENGTH_NM: f64 = 1562.0;
/// Relative gain noise of a strain reading.
const GAIN_NOISE: f64 = 0.01;

/// Hinge moments that the actuators of the reference wing work against on average: load 1.
pub const MEAN_HINGE_MOMENTS: HingeMoments = HingeMoments { flap_nm: 180.0, aileron_nm: 95.0 };

/// The beam of the reference wing.
pub fn reference_beam() -> Beam {
    Beam::new(LiftingLine::new(Wing::reference(), REFERENCE_POINTS))
}

/// The reference wing with this layout, A_z from the model and C_z from the whole lift of each surface;
/// actuators at `FLAP-L`, `FLAP-R`, `AIL-L` and `AIL-R`. Other hinge rows, noise or positions are put in
/// their fields.
pub fn reference_configuration(layout: Layout) -> SensorConfiguration {
    let beam = reference_beam();
    let gratings = layout.gratings().enumerate().map(|(i, (station, grating))| StrainGrating {
        station,
        place: grating.place(),
        wavelength_nm: STRAIN_WAVELENGTHS_NM[i % STRAIN_WAVELENGTHS_NM.len()],
        tare: 0.0,
        bonded_at: None,
    });
    SensorConfiguration {
        strain_gratings: gratings.collect(),
        temperature_wavelengths_nm: vec![TEMPERATURE_WAVELENGTH_NM; STATIONS_M.len()],
        gain_noise: GAIN_NOISE,
        strain_map: strain_map(&beam, &Section::new(SectionGeometry::reference()), layout),
        hinge_rows: hinge_rows(beam.lifting_line(), HingeModel::WholeLift),
        effectiveness: Effectiveness { flap: 1.0, aileron: 1.0 },
        positions: positions(),
    }
}

fn positions() -> BTreeMap<domain::Position, HingePosition> {
    let position =
        |name: &str, surface, side| (name.parse().expect("a position's name"), HingePosition { surface, side });
    BTreeMap::from([
        position("AIL-L", Surface::Aileron, Side::Left),
        position("AIL-R", Surface::Aileron, Side::Right),
        position("FLAP-L", Surface::Flap, Side::Left),
        position("FLAP-R", Surface::Flap, Side::Right),
    ])
}
