//! What estimators know before a life begins: a boundary, priors and the noise of diagnoses.

use domain::FaultModel;
use prognosis::{
    Coordinate, EndedLife, FinishedLife, FitSettings, FleetPrior, NoHistory, NoNoise, Observation, PaceLaw, PaceLesson,
    fit_consistency, fit_failure_time_error, fit_growth_changes, fit_noise, fit_prior, surrogate::Surrogate,
};

use crate::Recorded;

/// Farther from the boundary, on average, no recorded failure is, flight hours.
const FARTHEST_END_FH: f64 = 300.0;

/// Boundary, priors and noise.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// What the faults are.
    pub faults: FaultModel,
    /// Says when life ends.
    pub surrogate: Surrogate,
    /// What earlier lives have taught; growth does not change.
    pub prior: FleetPrior,
    /// The same where growth may change, if that is known or was to be learned.
    pub changing_prior: Option<FleetPrior>,
    /// Standard deviation of one observation of each fault.
    pub sigma: Vec<f64>,
    /// Lengths of the lives that taught the prior, hours; none without their histories.
    pub lives_fh: Vec<f64>,
    /// What load and temperature do, where lives told it; all else is in damage-equivalent hours then.
    pub pace: Option<PaceLaw>,
}

/// Histories that teach nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unteachable {
    /// The noise of the observations is not known from them.
    #[error(transparent)]
    Noise(#[from] NoNoise),
    /// There are none.
    #[error(transparent)]
    History(#[from] NoHistory),
    /// They do not end where life ends.
    #[error(
        "its lives end {offset_fh:.0} h from where the surrogate ends them, on average; \
         each has to end with its failure"
    )]
    Ends {
        /// How far from there, on average, flight hours.
        offset_fh: f64,
    },
}

impl Knowledge {
    /// What a prior knows. Without its growth changes it stands for constant growth.
    pub fn new(faults: FaultModel, surrogate: Surrogate, prior: &FleetPrior, sigma: Vec<f64>) -> Self {
        Self {
            faults,
            surrogate,
            prior: without_growth_changes(prior),
            changing_prior: prior.growth_changes.is_some().then(|| prior.clone()),
            sigma,
            lives_fh: Vec::new(),
            pace: None,
        }
    }

    /// Lets another surrogate say when life ends. The known error was that of the one before.
    pub fn replace_surrogate(&mut self, surrogate: Surrogate) {
        self.surrogate = surrogate;
        self.priors().for_each(|prior| prior.failure_time_error = None);
    }

    fn priors(&mut self) -> impl Iterator<Item = &mut FleetPrior> {
        std::iter::once(&mut self.prior).chain(&mut self.changing_prior)
    }

    /// Tells the observations of a run their noise, and the oracle how growth may go on to change.
    pub fn prepare(&self, recorded: &mut Recorded) {
        self.set_noise(&mut recorded.run.observations);
        let may_change = recorded.growth_may_change();
        if let Some(law) = recorded.law.as_mut().filter(|_| may_change) {
            let changes = self.changing_prior.as_ref().and_then(|prior| prior.growth_changes);
            law.changes = Some(changes.unwrap_or_default());
        }
    }

    /// Tells observations their noise.
    fn set_noise(&self, observations: &mut [Observation]) {
        observations.iter_mut().for_each(|observation| observation.sigma.clone_from(&self.sigma));
    }

    /// Learns noise, priors and failure-time errors from the histories of lives that ended in failure.
    pub fn learn(
        &mut self,
        mut lives: Vec<Vec<Observation>>,
        growth_changes: bool,
        seed: u64,
    ) -> Result<(), Unteachable> {
        self.sigma = fit_noise(&lives, &self.faults)?;
        lives.iter_mut().for_each(|life| self.set_noise(life));
        self.prior = fit_prior(&lives, &self.faults, &FitSettings::default())?;
        self.learn_on(lives, growth_changes, seed)
    }

    /// The same where load and temperature may act; returns what was learned of that, believed or not.
    pub fn learn_with_pace(
        &mut self,
        mut lives: Vec<Vec<Observation>>,
        growth_changes: bool,
        seed: u64,
    ) -> Result<Option<PaceLesson>, Unteachable> {
        self.sigma = fit_noise(&lives, &self.faults)?;
        lives.iter_mut().for_each(|life| self.set_noise(life));
        self.prior = fit_prior(&lives, &self.faults, &FitSettings::default())?;
        let ended: Vec<EndedLife> = lives.into_iter().map(EndedLife::failed_at_last).collect();
        let lesson = PaceLaw::learn(&ended, &self.faults, (Coordinate::IDENTITY, &self.prior), None);
        self.pace = lesson.as_ref().filter(|lesson| lesson.is_believed()).map(|lesson| lesson.law.clone());
        let aged = |life: EndedLife| self.pace.as_ref().map_or(life.clone(), |law| life.aged(law)).observations;
        let lives: Vec<Vec<Observation>> = ended.into_iter().map(aged).collect();
        if self.pace.is_some() {
            self.prior = fit_prior(&lives, &self.faults, &FitSettings::default())?;
        }
        self.learn_on(lives, growth_changes, seed)?;
        Ok(lesson)
    }

    /// What rests on the prior of constant growth.
    fn learn_on(&mut self, lives: Vec<Vec<Observation>>, growth_changes: bool, seed: u64) -> Result<(), Unteachable> {
        self.changing_prior = None;
        if growth_changes {
            self.changing_prior = Some(fit_growth_changes(&self.prior, &lives, &self.faults)?);
        }
        for prior in [&mut self.prior].into_iter().chain(&mut self.changing_prior) {
            prior.consistency = fit_consistency(&lives, &self.faults, prior);
        }
        let finished = |observations: Vec<Observation>| FinishedLife {
            failure_fh: observations.last().expect("a history has a row").t_fh,
            observations,
        };
        let lives: Vec<FinishedLife> = lives.into_iter().map(finished).collect();
        self.lives_fh = lives.iter().map(|life| life.failure_fh).collect();
        for prior in [&mut self.prior].into_iter().chain(&mut self.changing_prior) {
            let error = fit_failure_time_error(&lives, &self.faults, prior, &self.surrogate, seed);
            if let Some(error) = error.filter(|error| error.offset_fh.abs() > FARTHEST_END_FH) {
                return Err(Unteachable::Ends { offset_fh: error.offset_fh });
            }
            prior.failure_time_error = error;
        }
        Ok(())
    }
}

/// The limits of what is like the fleet were learned with the changes.
fn without_growth_changes(prior: &FleetPrior) -> FleetPrior {
    let consistency = prior.consistency.filter(|_| prior.growth_changes.is_none());
    FleetPrior { growth_changes: None, consistency, ..prior.clone() }
}
