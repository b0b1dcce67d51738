//! A bundle of faults of an own diagnosis, from recorded lives.

use std::{path::Path, time::Instant};

use anyhow::Result;
use domain::{FaultGroup, FaultMeasure, FaultModel};
use evaluation::Records;
use pipeline::{Assessment, Bundle, ChainSettings, Provenance};
use prognosis::{GrowthLaw, REFERENCE_LIFE_FH, REFERENCE_LIMIT};

use super::{Arguments, refuse};
use crate::{
    exit::Failure,
    files::{
        bundle,
        output::OutputFile,
        records::{self, Measure, Teachers},
    },
    lesson::{FleetLesson, told_pace},
    say::{note, say},
};

/// What flight hours are called.
const HOURS: [&str; 6] = ["h", "hour", "hours", "fh", "flight hours", "flight_hours"];

/// Learns from the lives and writes the bundle.
pub fn run(base: &Path, arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    let base = bundle::read(base)?;
    let Teachers { lives, measures, mut notes } =
        records::read_teachers(&arguments.histories, &arguments.records, &arguments.stress)?;
    must_count_hours(&lives)?;
    must_have_one_nominal_value(&measures)?;
    let out = OutputFile::new(&arguments.out)?;
    let taught = FleetLesson::learn(&lives)?;
    notes.extend(taught.lesson.oddities());
    let provenance = Provenance {
        samples: 0,
        lives: lives.lives.len(),
        seed: 1,
        chain: ChainSettings::default(),
        dataset: None,
        histories: Some(super::content(&arguments.histories)?),
        code_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let measure = FaultMeasure {
        limits: measures.iter().map(|measure| measure.limit).collect(),
        sigma: measures.iter().zip(&taught.sigma).map(|(measure, sigma)| own_sigma(measure, *sigma)).collect(),
        characteristic_life_fh: taught.scale.characteristic_life,
    };
    let bundle = Bundle {
        format: Bundle::FORMAT,
        provenance,
        faults: fault_model(&measures),
        assessment: Assessment::Own(measure),
        loads: base.bundle().loads.clone(),
        prior: taught.lesson.clone().into(),
    };
    let model = super::write_taught(&bundle, &out)?;
    notes.iter().for_each(|line| note!("note: {line}"));
    say!("{} in {:.0} s", arguments.out.display(), started.elapsed().as_secs_f64());
    say!("bundle {}", model.summary().hash);
    report(&lives, &measures, &taught);
    Ok(())
}

/// A service counts the flight hours of its uploads.
fn must_count_hours(lives: &Records) -> Result<(), Failure> {
    let unit = &lives.time_unit;
    if HOURS.contains(&unit.to_lowercase().as_str()) {
        return Ok(());
    }
    Err(refuse(format!(
        "times are counted in {unit}, a service counts flight hours: convert them, or tell --time COLUMN:h where one is an hour"
    )))
}

/// A service knows one nominal value for all units.
fn must_have_one_nominal_value(measures: &[Measure]) -> Result<(), Failure> {
    match measures.iter().find(|measure| measure.is_nominal_by_unit()) {
        None => Ok(()),
        Some(Measure { name, .. }) => Err(refuse(format!(
            "--nominal {name}=first:N gives each unit a nominal value of its own, a service knows one for all: tell --nominal \
             {name}=VALUE"
        ))),
    }
}

/// Faults that each stand alone, with what is nominal.
fn fault_model(measures: &[Measure]) -> FaultModel {
    FaultModel {
        names: measures.iter().map(|measure| measure.name.clone()).collect(),
        nominal: measures.iter().map(|measure| measure.nominal).collect(),
        groups: (0..measures.len()).map(|index| FaultGroup::Free { index }).collect(),
    }
}

/// A reference deviation in the unit of its column.
fn own_sigma(measure: &Measure, sigma: f64) -> f64 {
    sigma / REFERENCE_LIMIT * (measure.limit - measure.nominal).abs()
}

/// What was learned, in the units of the table.
fn report(lives: &Records, measures: &[Measure], taught: &FleetLesson) {
    let FleetLesson { scale, sigma, lesson, pace, .. } = taught;
    let (count, failures) = (lives.lives.len(), lives.failures());
    say!("{count} lives taught, {failures} of them failed; the median life is {:.0} h", scale.characteristic_life);
    for (measure, sigma) in measures.iter().zip(sigma) {
        let Measure { name, nominal, limit, .. } = measure;
        say!("  {name}: from {nominal} to {limit}, one value +- {:.3}", own_sigma(measure, *sigma));
    }
    lesson.growth.laws.iter().for_each(law);
    pace.iter().for_each(|pace| say!("{}", told_pace(pace)));
    super::report_companions(&lesson.companions, &|fh| scale.time(fh));
}

fn law(GrowthLaw { coordinate, prior, share }: &GrowthLaw) {
    let weighed = prior.rates_per_h.iter().zip(&prior.one_sided.rate_weights).map(|(rate, weight)| rate * weight);
    let rate = weighed.sum::<f64>() * REFERENCE_LIFE_FH;
    let changes =
        prior.growth_changes.map(|changes| format!(", {:.0} % change in mid-life", 100.0 * changes.probability));
    let of_damage = match coordinate.exponent {
        0.0 => "as it is".to_owned(),
        exponent => format!("with the power {exponent} of damage"),
    };
    say!("growth of {:.0} %: {of_damage}, rate {rate:.2} per such life{}", 100.0 * share, changes.unwrap_or_default());
}
