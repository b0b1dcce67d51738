//! The right wing as a beam: shear force, bending moment and torsion along the span.
//!
//! T(y) = int_y L' ds + sum_{h > y} L_h, M_b its integral from the tip (Berri 2021, eq. 4.6 and 4.7,
//! corrected: both in terms of (s - y)), and
//! M_t(y) = int_y [q c^2 c_m + L'(x_ref - x_ac)] ds + sum_{h > y} L_h (x_ref - x_h) - sum_{act > y} L_ac c_a/2
//! (eq. 4.8, with the lever arm of the control force added). L' is the lift without what the control
//! surfaces add; that is carried by their hinges, half each, and the actuator holds the moment about
//! the hinge line. The reference axis runs through the aerodynamic centres, so that L' has no lever.

use domain::sensor_configuration::FLIGHT_PRODUCTS;

use crate::{
    lifting_line::{Basis, LiftingLine, Loading},
    products::Products,
    wing::ControlSurface,
};

/// What a section carries for all that is outboard of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SectionLoads {
    /// Shear force T, N, up.
    pub shear_n: f64,
    /// Bending moment M_b, N m, tip-up.
    pub bending_nm: f64,
    /// Torsion M_t about the reference axis, N m, nose-up.
    pub torsion_nm: f64,
}

/// Loads along the span of a wing.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    line: LiftingLine,
}

impl Beam {
    /// The beam under a lifting line.
    pub fn new(line: LiftingLine) -> Self {
        Self { line }
    }

    /// Its lifting line.
    pub fn lifting_line(&self) -> &LiftingLine {
        &self.line
    }

    /// Loads at `y_m` per unit of each flight-condition product z.
    pub fn unit_loads(&self, y_m: f64) -> [SectionLoads; FLIGHT_PRODUCTS] {
        let wing = self.line.wing();
        let distributed = |basis, scale: f64| outboard(&self.line.unit_loading(basis), scale, y_m);
        let mut pressure = distributed(Basis::Incidence, -wing.zero_lift_angle_rad);
        pressure.torsion_nm = wing.pitching_moment_coefficient * wing.outboard_chord_squared_m3(y_m);
        [
            pressure,
            distributed(Basis::Incidence, 1.0),
            distributed(Basis::Roll, 1.0),
            self.surface_loads(Basis::Flap, &wing.flap, y_m),
            self.surface_loads(Basis::Aileron, &wing.aileron, y_m),
        ]
    }

    /// Loads at `y_m` in a flight condition given by its products.
    pub fn loads(&self, y_m: f64, products: &Products) -> SectionLoads {
        let unit = self.unit_loads(y_m);
        unit.iter().zip(products).fold(SectionLoads::default(), |sum, (unit, z)| SectionLoads {
            shear_n: sum.shear_n + z * unit.shear_n,
            bending_nm: sum.bending_nm + z * unit.bending_nm,
            torsion_nm: sum.torsion_nm + z * unit.torsion_nm,
        })
    }

    /// A surface's whole lift on the right wing, through its hinges and its actuator.
    fn surface_loads(&self, basis: Basis, surface: &ControlSurface, y_m: f64) -> SectionLoads {
        let lift_m2 = self.line.unit_loading(basis).right_wing_lift_m2();
        let axis_x_m = self.line.wing().axis_chord_fraction * surface.wing_chord_m;
        let hinge_x_m = surface.wing_chord_m - surface.chord_m;
        let mut loads = SectionLoads::default();
        for hinge_m in surface.hinges_m.into_iter().filter(|hinge_m| *hinge_m > y_m) {
            loads.shear_n += 0.5 * lift_m2;
            loads.bending_nm += 0.5 * lift_m2 * (hinge_m - y_m);
            loads.torsion_nm += 0.5 * lift_m2 * (axis_x_m - hinge_x_m);
        }
        if surface.actuator_m > y_m {
            loads.torsion_nm -= 0.5 * surface.chord_m * lift_m2;
        }
        loads
    }
}

fn outboard(loading: &Loading, scale: f64, y_m: f64) -> SectionLoads {
    SectionLoads {
        shear_n: scale * loading.outboard_lift_m2(y_m),
        bending_nm: scale * loading.outboard_moment_m3(y_m),
        torsion_nm: 0.0,
    }
}
