//! What recorded lives teach, with the scale and the noise that they are read by.

use domain::FaultModel;
use evaluation::Records;
use prognosis::{
    EndedLife, Lesson, NoResiduals, Observation, PaceLaw, PaceLesson, REFERENCE_LIMIT, Scale, fit_residual_noise,
    scale::reference_faults,
};

use crate::exit::Failure;

const SEED: u64 = 1;
/// What is learned of growth is sought about the pace of the reference.
const USUAL_PACE: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// What lives of one fleet have taught, in reference hours and deviations.
#[derive(Debug)]
pub struct FleetLesson {
    /// The measure of their time.
    pub scale: Scale,
    /// Their faults.
    pub faults: FaultModel,
    /// Standard deviation of one observation of each fault.
    pub sigma: Vec<f64>,
    /// All else.
    pub lesson: Lesson,
    /// What was learned of the pace, believed or not, where lives tell of load or temperature.
    pub pace: Option<PaceLesson>,
}

impl FleetLesson {
    /// Learns from lives one of which failed at least.
    pub fn learn(teach: &Records) -> Result<Self, Failure> {
        let scale = teach.scale().expect("a failure teaches");
        let faults = reference_faults(teach.faults.clone());
        let sigma = noise(teach, &scale)?;
        let lesson = Lesson::learn_with_pace(&teach.ended(&scale, &sigma), &faults, SEED);
        let (lesson, pace) = lesson.map_err(|error| Failure::BadInput(error.to_string()))?;
        Ok(Self { scale, faults, sigma, lesson, pace })
    }
}

/// Standard deviation of one observation of each fault, in reference deviations: as told, or as the lives that teach show.
fn noise(teach: &Records, scale: &Scale) -> Result<Vec<f64>, Failure> {
    let told: Vec<Option<f64>> =
        teach.sigma.iter().map(|sigma| sigma.map(|severity| severity * REFERENCE_LIMIT)).collect();
    if told.iter().all(Option::is_some) {
        return Ok(told.into_iter().flatten().collect());
    }
    let lives = teach.ended(scale, &vec![0.0; teach.faults.len()]);
    let histories: Vec<Vec<Observation>> =
        lives.into_iter().map(|EndedLife { observations, .. }| observations).collect();
    let found = fit_residual_noise(&histories, teach.faults.len()).map_err(|error| {
        let (NoResiduals::Few { fault, .. } | NoResiduals::Constant { fault }) = error;
        Failure::BadInput(format!("column {}: {error}; tell it by --sigma {0}=VALUE", teach.faults[fault]))
    })?;
    Ok(told.into_iter().zip(found).map(|(told, found)| told.unwrap_or(found)).collect())
}

/// What lives taught of the pace of wear, in words.
pub fn told_pace(lesson: &PaceLesson) -> String {
    let PaceLaw { exponent, temperature, missions, .. } = &lesson.law;
    let (gain, is) = (lesson.gain, if lesson.is_believed() { "believed" } else { "not believed, both count as 0" });
    let usual = missions.mean.exp();
    let far = match lesson.is_believed() && !USUAL_PACE.contains(&usual) {
        true => format!(
            "; these lives wear at {usual:.2} times the pace of the reference: tell a reference near what they flew"
        ),
        false => String::new(),
    };
    format!(
        "wear goes with load to the power {:.2} (sd {:.2}) and exp({:.3} x temperature) (sd {:.3}): {is}, by {gain:.1} nats of evidence{far}",
        exponent.mean, exponent.sd, temperature.mean, temperature.sd
    )
}
