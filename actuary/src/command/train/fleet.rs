//! The prior of a bundle's fleet, from recorded lives of its faults.

use std::{path::Path, time::Instant};

use anyhow::Result;
use domain::FaultModel;
use evaluation::Recorded;
use pipeline::{Bundle, Model, Provenance};
use prognosis::{EndedLife, Ending, Flight, LifePrior, Observation, fit_noise, learn_from_ended};

use super::{Arguments, refuse};
use crate::{
    exit::Failure,
    files::{
        bundle,
        histories::{self, Files, Recordings},
        output::OutputFile,
        stress,
    },
    say::{note, say},
};

const SEED: u64 = 1;
/// Farther from the boundary, on average, no recorded failure is, flight hours.
const FARTHEST_END_FH: f64 = 300.0;

/// Learns from the lives and writes the bundle.
pub fn run(base: &Path, arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    let model = bundle::read(base)?;
    let base = model.bundle();
    if base.measure().is_some() {
        let names = base.faults.names.join(", ");
        return Err(
            refuse(format!("the model takes faults of an own diagnosis: tell --limit of each ({names})")).into()
        );
    }
    let files = Files {
        histories: &arguments.histories,
        truths: &arguments.truth,
        growths: &[],
        laws: false,
        stress: &arguments.stress,
    };
    let Recordings { runs, notes } = histories::read_all(files, &base.faults)?;
    let lives = ended(runs, &base.faults, &arguments.stress, !arguments.truth.is_empty())?;
    let failures = lives.iter().filter(|life| life.ending == Ending::Failed).count();
    if failures == 0 {
        return Err(
            refuse(format!("none of the {} runs has failed: nothing can be learned of failure", lives.len())).into()
        );
    }
    let out = OutputFile::new(&arguments.out)?;
    let prior = learn(&model, &lives)?;
    let provenance = Provenance {
        lives: lives.len(),
        histories: Some(super::content(&arguments.histories)?),
        code_version: env!("CARGO_PKG_VERSION").to_owned(),
        ..base.provenance.clone()
    };
    let taught = super::write_taught(&Bundle { provenance, prior, ..base.clone() }, &out)?;
    notes.iter().for_each(|line| note!("note: {line}"));
    say!("{} in {:.0} s", arguments.out.display(), started.elapsed().as_secs_f64());
    say!("bundle {}", taught.summary().hash);
    report(&lives, failures, &taught.bundle().prior);
    Ok(())
}

/// Lives that are over, with the noise that they show: failed where that is told, or where nothing is told of any.
fn ended(
    runs: Vec<Recorded>,
    faults: &FaultModel,
    stress: &stress::Flags,
    told: bool,
) -> Result<Vec<EndedLife>, Failure> {
    let histories: Vec<Vec<Observation>> = runs.iter().map(|recorded| recorded.run.observations.clone()).collect();
    let sigma = fit_noise(&histories, faults).map_err(|error| refuse(error.to_string()))?;
    let ended = |(recorded, mut observations): (&Recorded, Vec<Observation>)| {
        observations.iter_mut().for_each(|seen| seen.sigma.clone_from(&sigma));
        let last_fh = observations.last()?.t_fh;
        let (end_fh, ending) = match recorded.run.failure_fh {
            Some(failure_fh) => (failure_fh, Ending::Failed),
            None if told => (last_fh, Ending::Removed),
            None => (last_fh, Ending::Failed),
        };
        let flights = if stress.act() { observations.iter().map(Flight::of).collect() } else { Vec::new() };
        Some(EndedLife { observations, flights, end_fh, ending })
    };
    Ok(runs.iter().zip(histories).filter_map(ended).collect())
}

/// The prior that these lives teach, unless they do not end where the bundle ends them.
fn learn(model: &Model, lives: &[EndedLife]) -> Result<LifePrior, Failure> {
    let bundle = model.bundle();
    let prior = learn_from_ended(&bundle.prior, lives, &bundle.faults, model.boundary(), SEED);
    let prior = prior.map_err(|error| refuse(error.to_string()))?;
    match prior.first().failure_time_error {
        Some(error) if error.offset_fh.abs() > FARTHEST_END_FH => Err(refuse(format!(
            "these lives end {:.0} h from where the model ends them, on average: each has to end with its failure, or --truth tells \
             when it failed",
            error.offset_fh
        ))),
        _ => Ok(prior),
    }
}

/// What was learned, in flight hours.
fn report(lives: &[EndedLife], failures: usize, prior: &LifePrior) {
    say!("{} lives taught, {failures} of them failed", lives.len());
    if let Some(error) = prior.first().failure_time_error {
        say!("failures come {:+.0} h from the crossing of the boundary, +- {:.0} h", error.offset_fh, error.sd_fh);
    }
    if let Some(companions) = &prior.companions {
        super::report_companions(companions, &|fh| fh);
    }
}
