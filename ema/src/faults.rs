//! The five electrical faults in physical terms.

use domain::FaultVector;
use thiserror::Error;

/// Largest shorted fraction of a phase that the models accept: beyond it the phase's time constant
/// falls below the models' step.
pub const MAX_SHORTED: f64 = 0.99;
/// Largest eccentricity that the models accept: at 1 the rotor touches the stator.
pub const MAX_ECCENTRICITY: f64 = 0.99;

/// Partial shorts of the three phases and static eccentricity of the rotor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ElectricalFaults {
    shorted: [f64; 3],
    eccentricity: f64,
    eccentricity_phase_rad: f64,
}

/// Faults outside the domain of the models.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum FaultError {
    /// A fault vector of another fault model.
    #[error("a vector of five electrical faults is needed, not of {0}")]
    Length(usize),
    /// A short that is negative, not finite or nearly complete.
    #[error("shorted fraction {value} of phase {phase} is outside [0, {MAX_SHORTED}]")]
    Shorted {
        /// 0, 1, 2 for A, B, C.
        phase: usize,
        /// The offending fraction.
        value: f64,
    },
    /// An eccentricity that is negative, not finite or of the size of the air gap.
    #[error("eccentricity {0} is outside [0, {MAX_ECCENTRICITY}]")]
    Eccentricity(f64),
    /// A direction that is not finite.
    #[error("eccentricity phase {0} rad is not finite")]
    EccentricityPhase(f64),
}

impl ElectricalFaults {
    /// Checked faults: shorted fractions 1 - N of phases A, B, C; eccentricity zeta as a fraction of
    /// the nominal air gap; phi, the direction of the *minimum* gap, as an electrical angle in rad.
    pub fn new(shorted: [f64; 3], eccentricity: f64, eccentricity_phase_rad: f64) -> Result<Self, FaultError> {
        for (phase, &value) in shorted.iter().enumerate() {
            if !(0.0..=MAX_SHORTED).contains(&value) {
                return Err(FaultError::Shorted { phase, value });
            }
        }
        if !(0.0..=MAX_ECCENTRICITY).contains(&eccentricity) {
            return Err(FaultError::Eccentricity(eccentricity));
        }
        if !eccentricity_phase_rad.is_finite() {
            return Err(FaultError::EccentricityPhase(eccentricity_phase_rad));
        }
        Ok(Self { shorted, eccentricity, eccentricity_phase_rad })
    }

    /// Shorted fractions 1 - N of phases A, B, C.
    pub fn shorted(&self) -> [f64; 3] {
        self.shorted
    }

    /// Healthy fractions N of phases A, B, C.
    pub fn healthy(&self) -> [f64; 3] {
        self.shorted.map(|shorted| 1.0 - shorted)
    }

    /// Eccentricity zeta, a fraction of the nominal air gap.
    pub fn eccentricity(&self) -> f64 {
        self.eccentricity
    }

    /// Direction phi of the minimum air gap, electrical rad.
    pub fn eccentricity_phase_rad(&self) -> f64 {
        self.eccentricity_phase_rad
    }

    /// How eccentricity changes the flux of each phase at an electrical angle: 1 + zeta cos(theta_e +
    /// phi + {0, +120, -120} deg) for A, B, C (Berri 2021, eq. 3.33-3.35, with the electrical angle).
    pub fn flux_factors(&self, angle_rad: f64) -> [f64; 3] {
        const THIRD: f64 = std::f64::consts::TAU / 3.0;
        let angle = angle_rad + self.eccentricity_phase_rad;
        [0.0, THIRD, -THIRD].map(|offset| 1.0 + self.eccentricity * libm::cos(angle + offset))
    }
}

impl TryFrom<&FaultVector> for ElectricalFaults {
    type Error = FaultError;

    /// Reads k = (1-N_a, 1-N_b, 1-N_c, (1 + zeta cos phi)/2, (1 + zeta sin phi)/2) (Berri 2021, section 6.2).
    fn try_from(faults: &FaultVector) -> Result<Self, FaultError> {
        let &[a, b, c, x, y] = faults.values() else {
            return Err(FaultError::Length(faults.values().len()));
        };
        let (x, y) = (2.0 * x - 1.0, 2.0 * y - 1.0);
        Self::new([a, b, c], libm::hypot(x, y), libm::atan2(y, x))
    }
}

impl From<&ElectricalFaults> for FaultVector {
    fn from(faults: &ElectricalFaults) -> Self {
        let [a, b, c] = faults.shorted;
        let (sin, cos) = libm::sincos(faults.eccentricity_phase_rad);
        let entry = |direction: f64| 0.5 * (1.0 + faults.eccentricity * direction);
        Self(vec![a, b, c, entry(cos), entry(sin)])
    }
}

#[cfg(test)]
mod tests {
    use domain::FaultModel;

    use super::*;

    #[test]
    fn a_fault_vector_survives_the_round_trip() {
        let vector = FaultVector(vec![0.2, 0.05, 0.0, 0.6, 0.55]);
        let back = FaultVector::from(&ElectricalFaults::try_from(&vector).unwrap());
        for (a, b) in vector.values().iter().zip(back.values()) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn no_fault_is_the_nominal_vector() {
        assert_eq!(FaultVector::from(&ElectricalFaults::default()).0, FaultModel::electrical().nominal);
    }

    #[test]
    fn vectors_outside_the_domain_are_refused_with_the_offending_value() {
        let refused = |values: &[f64]| ElectricalFaults::try_from(&FaultVector(values.to_vec())).unwrap_err();
        assert_eq!(refused(&[0.0; 4]), FaultError::Length(4));
        assert_eq!(refused(&[0.0, -0.1, 0.0, 0.5, 0.5]), FaultError::Shorted { phase: 1, value: -0.1 });
        assert!(matches!(refused(&[0.0, 0.0, f64::NAN, 0.5, 0.5]), FaultError::Shorted { phase: 2, .. }));
        assert_eq!(refused(&[0.0, 0.0, 0.0, 1.0, 0.5]), FaultError::Eccentricity(1.0));
    }
}
