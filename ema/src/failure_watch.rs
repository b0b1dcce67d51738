//! When a wearing actuator fails: the first faulty verdict of the assessment function.

use crate::{
    assessment::assess_faults,
    lf2::{Faults, Parameters},
    wear_law::FAULTS,
};

/// How fast each margin of the assessment can change, per unit of the sum of absolute changes of the
/// faults, and how rough it is: bounds with room over what random pairs of states show.
const MARGIN_RATES: [f64; 4] = [0.4, 2.0, 6.0, 0.8];
const MARGIN_ROUGHNESS: [f64; 4] = [5e-4, 1e-4, 0.2, 5e-3];

/// Watches one actuator for its first faulty verdict. It asks the assessment function only when the
/// state has moved so far since the last answer that a margin could have been used up.
#[derive(Debug, Clone)]
pub struct FailureWatch {
    parameters: Parameters,
    assessed: [f64; FAULTS],
    margins: [f64; 4],
    assessments: usize,
}

impl FailureWatch {
    /// Begins to watch an actuator with these parameters of the assessment.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: parameters.clone(),
            assessed: [0.0; FAULTS],
            margins: [f64::NEG_INFINITY; 4],
            assessments: 0,
        }
    }

    /// Whether the assessment function calls the actuator faulty at this deviation from nominal.
    pub fn is_faulty(&mut self, deviation: &[f64; FAULTS]) -> bool {
        let moved: f64 = deviation.iter().zip(&self.assessed).map(|(now, then)| (now - then).abs()).sum();
        let reach = MARGIN_RATES.iter().zip(MARGIN_ROUGHNESS).map(|(rate, roughness)| rate * moved + roughness);
        if self.margins.iter().zip(reach).all(|(&margin, reach)| margin > reach) {
            return false;
        }
        self.assessed = *deviation;
        self.margins = assess_faults(&self.parameters, &faults(deviation)).margins();
        self.assessments += 1;
        self.margins.iter().any(|&margin| margin < 0.0)
    }

    /// How often the assessment function was asked.
    pub fn assessments(&self) -> usize {
        self.assessments
    }
}

/// The faults at a deviation from nominal.
fn faults(deviation: &[f64; FAULTS]) -> Faults {
    let [a, b, c, d, e] = *deviation;
    Faults::electrical([a, b, c, d + 0.5, e + 0.5].map(|k| k.clamp(0.0, 1.0)))
}
