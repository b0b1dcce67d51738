//! What motor and wing of a component tell of its loads, for its page.

use domain::{DisagreementKind, LoadAgreement, load_agreement::LoadsTold};
use proto::answer::RulAnswer;

use super::chart::{Chart, Sample};

/// Motor against wing.
pub struct Agreement {
    /// How they compare now.
    pub now: String,
    /// What stands out: the meaning of the kind, the figures.
    pub disagreements: Vec<(&'static str, String)>,
    /// Both over flight hours.
    pub chart: Option<Chart>,
}

impl Agreement {
    /// As told in an answer; `None` where they cannot be compared.
    pub fn of(body: &RulAnswer) -> Option<Self> {
        let LoadAgreement { flights, efficiency, efficiency_sigma, friction, friction_sigma, disagreements, course } =
            body.load_agreement.as_ref()?;
        let heading = |kind| match kind {
            DisagreementKind::Efficiency => "The transmission has lost efficiency.",
            DisagreementKind::Friction => "Friction has grown.",
            DisagreementKind::SensorConfiguration => "The wing is not read right.",
            DisagreementKind::Grating => "A strain grating may be gone.",
        };
        let told = |of: fn(&LoadsTold) -> f64| {
            course.iter().map(|told| Sample { x: told.flight_hours, low: of(told), high: of(told) }).collect()
        };
        let chart = Chart::new("Load, relative to the reference moment")
            .line("median", "by the wing", told(|told| told.wing))
            .line("second", "by the motor", told(|told| told.motor));
        Some(Self {
            now: format!(
                "By {flights} flights that both tell of, {:.1} \u{b1} {:.1} % of the expected efficiency is there, and {:.1} \u{b1} \
                 {:.1} % of the reference load in friction beyond the expected.",
                100.0 * efficiency,
                100.0 * efficiency_sigma,
                100.0 * friction,
                100.0 * friction_sigma
            ),
            disagreements: disagreements.iter().map(|one| (heading(one.kind), one.detail.clone())).collect(),
            chart: chart.with_zero().size(740.0, 240.0).draw(),
        })
    }
}
