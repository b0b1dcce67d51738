//! The reasons of a forecast and the doubts of it, in words for a planner.

use domain::{
    Doubt, DoubtKind, Ensemble, Explanation, PastCoverage,
    explanation::{Driver, Growth, Shift, Surprise},
};
use proto::answer::RulAnswer;

use super::words::grouped;

/// The distance from which on an observation is called surprising, standard deviations.
const SURPRISING: f64 = 2.0;
/// Within so many of its standard errors a movement is no shift.
const STANDARD_ERRORS: f64 = 2.0;

/// The reasons of a forecast.
pub struct Reasons {
    /// What drives the end of life.
    pub drivers: Vec<Bar>,
    /// Whether the growth has changed, sentence by sentence.
    pub growth: Vec<String>,
    /// How the prediction moved, and what was surprising.
    pub shift: Vec<String>,
    /// Who speaks, and how often forecasts like this one held, where past lives told.
    pub estimator: Vec<String>,
}

/// A share as a bar.
pub struct Bar {
    /// Whose share.
    pub label: String,
    /// The share.
    pub percent: String,
}

/// A reason not to trust a forecast.
pub struct Warning {
    /// The meaning of the kind.
    pub heading: &'static str,
    /// The figures.
    pub detail: String,
}

impl Reasons {
    /// The reasons of a forecast; `None` without one that tells any.
    pub fn of(body: &RulAnswer) -> Option<Self> {
        let Explanation { drivers, growth, shift } = body.explanation.as_ref()?;
        let told = Self {
            drivers: drivers.iter().map(bar).collect(),
            growth: growth.as_ref().map(grown).unwrap_or_default(),
            shift: shift.as_ref().map(moved).unwrap_or_default(),
            estimator: body.estimator.as_ref().map(speaking).unwrap_or_default(),
        };
        (!(told.drivers.is_empty() && told.growth.is_empty() && told.shift.is_empty())).then_some(told)
    }
}

impl Warning {
    /// What speaks against a forecast.
    pub fn all(body: &RulAnswer) -> Vec<Self> {
        let warning = |doubt: &Doubt| Self {
            heading: match doubt.kind {
                DoubtKind::Inconsistent => {
                    "The data contradicts the model of damage: its state is unknown, and the numbers are not to act on."
                }
                DoubtKind::OutsideTraining => {
                    "The forecast leads to where the assessment has learned nothing: take it with caution."
                }
                DoubtKind::Hours => {
                    "Uploads contradict one another: its state is unknown, and the numbers are not to act on."
                }
                DoubtKind::Gap => {
                    "The forecast reaches over a long stretch without data: more uploads will tell how the unit is now."
                }
            },
            detail: doubt.detail.clone(),
        };
        body.doubts.iter().flatten().map(warning).collect()
    }
}

fn bar(driver: &Driver) -> Bar {
    Bar { label: driver.faults.join(" and "), percent: format!("{:.0}", 100.0 * driver.share) }
}

/// Nothing where growth alone speaks.
fn speaking(Ensemble { weights, coverage_of_past_forecasts }: &Ensemble) -> Vec<String> {
    let Some(past) = coverage_of_past_forecasts else { return Vec::new() };
    let PastCoverage { lives, level_80, level_95, .. } = past;
    let mut members: Vec<(&String, &f64)> = weights.iter().filter(|(_, weight)| **weight >= 0.005).collect();
    members.sort_by(|a, b| b.1.total_cmp(a.1));
    let members: Vec<String> =
        members.into_iter().map(|(name, weight)| format!("{name} {:.0} %", 100.0 * weight)).collect();
    let held = format!(
        "Of {lives} past lives, each forecast by what the others teach, {:.0} % of the 80 % intervals and {:.0} % of the \
         95 % intervals held.",
        100.0 * level_80,
        100.0 * level_95
    );
    vec![format!("The possible futures are told by {}.", members.join(", ")), held]
}

fn grown(growth: &Growth) -> Vec<String> {
    let pace = format!(
        "It wears {:.2} \u{b1} {:.2} times as fast as a life whose growth never changes.",
        growth.multiplier, growth.sigma
    );
    let changed = 100.0 * growth.changed_probability;
    let change = match &growth.latest_change {
        Some(change) => format!(
            "Its growth changed with a probability of {changed:.0} %, the last time between {} and {} fh and by a \
             factor of {:.2} ({:.2} to {:.2}; each range holds with 80 %).",
            grouped(change.from_fh),
            grouped(change.to_fh),
            change.factor,
            change.factor_p10,
            change.factor_p90,
        ),
        None => format!("A change of its growth is not likely so far: {changed:.0} %."),
    };
    vec![pace, change]
}

fn moved(shift: &Shift) -> Vec<String> {
    let mut sentences = vec![travel(shift)];
    let surprising: Vec<&Surprise> = shift.surprises.iter().filter(|s| s.z.abs() >= SURPRISING).collect();
    if surprising.is_empty() && !shift.surprises.is_empty() {
        sentences.push(format!(
            "Nothing in the newest data was surprising: every fault came within {SURPRISING} standard deviations of \
             what was expected."
        ));
    }
    sentences.extend(surprising.into_iter().map(|surprise| {
        let side = if surprise.z > 0.0 { "more" } else { "less" };
        format!(
            "{} came out at {:.4} where {:.4} was expected: {:.1} standard deviations {side}.",
            surprise.fault,
            surprise.seen,
            surprise.expected,
            surprise.z.abs(),
        )
    }));
    sentences
}

fn travel(shift: &Shift) -> String {
    let since = format!("Since {} fh ({} fh ago)", grouped(shift.since.flight_hours), grouped(shift.passed_fh));
    let Some(moved_fh) = shift.moved_fh else {
        return format!("{since} the movement is not known: the median was, or is, beyond the horizon.");
    };
    let error = shift.standard_error_fh.map(|error| format!(" \u{b1} {}", grouped(error))).unwrap_or_default();
    let distance = grouped(moved_fh.abs());
    if shift.standard_error_fh.is_some_and(|error| moved_fh.abs() <= STANDARD_ERRORS * error) {
        return format!(
            "{since} the median end of life has not moved beyond the error of the draws: {distance}{error} fh."
        );
    }
    let direction = if moved_fh < 0.0 { "earlier" } else { "later" };
    format!("{since} the median end of life has moved {distance}{error} fh {direction}.")
}
