//! `actuary diagnose`: fault vectors of the maps of a dataset folder.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::Result;
use clap::Args;
use domain::{Diagnosis, LoadRatio, Mask, Outcome};
use numerics::Stream;
use pipeline::{Measurement, Model};
use rayon::prelude::*;

use crate::{
    exit::Failure,
    files::{
        bundle,
        dataset::{self, Maps},
        output::OutputFile,
    },
    say::note,
};

/// Diagnose the maps of a dataset folder as an aircraft would send them: sampled at the bundle's mask.
///
/// Uses R.csv (load ratio per point) where there is one, else r.csv (mean of each map); never reads K.csv.
/// Fields of Y.csv and R.csv that are empty, or say NaN, NA or null, are values that no pass gave.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  actuary diagnose --model bundle.json --dataset bench/ --noise 0.01 --seed 1 --out k.csv

Writes one row a map: the faults, the standard deviation of each (sigma_...), and plausible (true|false).
A map with too few usable values has empty fields and plausible = false.")]
pub struct Arguments {
    /// The bundle.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// The folder with theta.csv, Y.csv and, optional, R.csv or r.csv.
    #[arg(long, value_name = "DIR")]
    dataset: PathBuf,
    /// Standard deviation of noise to add to every sample, in units of the nominal back-EMF constant.
    #[arg(long, value_name = "SD", default_value_t = 0.0, allow_negative_numbers = true)]
    noise: f64,
    /// Seed of that noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The table to write; an existing one is replaced once the new one is complete.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Diagnoses every map and writes the table.
pub fn run(arguments: &Arguments) -> Result<()> {
    if !(0.0..=1.0).contains(&arguments.noise) {
        return Err(Failure::BadInput(format!("--noise {}: must be 0 to 1", arguments.noise)).into());
    }
    let model = bundle::read(&arguments.model)?;
    let chain = model.bundle().maps().ok_or_else(|| {
        let file = arguments.model.display();
        Failure::BadInput(format!("{file}: the model reads no maps: its uploads bring faults of their own"))
    })?;
    let (k_nom, mask) = (chain.motor.back_emf_v_s_rad, &chain.masks[0]);
    let mut maps = dataset::read_maps(&arguments.dataset, k_nom)?;
    maps.maps.iter_mut().flatten().flatten().for_each(|y| *y /= k_nom);
    if maps.bins != mask.map_length() {
        let (folder, bins, length) = (arguments.dataset.display(), maps.bins, mask.map_length());
        return Err(Failure::BadInput(format!("{folder}: maps of {bins} bins, but the bundle's have {length}")).into());
    }
    let out = OutputFile::new(&arguments.out)?;
    let noise = Noise { sd: arguments.noise, stream: Stream::new(arguments.seed, &["diagnose", "noise"]) };
    let indices = 0..maps.maps.len();
    let rows: Vec<_> = indices.into_par_iter().map(|index| diagnose(&model, mask, &maps, index, &noise)).collect();
    out.write(|writer| write(writer, &model.bundle().faults.names, &rows))?;
    let implausible = rows.iter().flatten().filter(|row| !row.is_plausible()).count();
    let none = rows.iter().filter(|row| row.is_none()).count();
    note!("{} maps diagnosed ({implausible} not plausible), {none} could not be", rows.len() - none);
    Ok(())
}

/// Noise to add to samples, in units of k_nom.
struct Noise {
    sd: f64,
    stream: Stream,
}

impl Noise {
    /// `sample` with noise; every point of the mask draws, so that a missing one shifts no other.
    fn onto(&self, stream: &mut Stream, sample: Option<f64>) -> Option<f64> {
        let noise = self.sd * stream.normal();
        sample.map(|y| y + noise)
    }

    /// What an upload would state of it; without any, the bundle's own assumption holds.
    fn stated(&self) -> Option<f64> {
        (self.sd > 0.0).then_some(self.sd)
    }
}

/// The diagnosis of one map, in units of k_nom; `None` where its usable values are too few or absurd.
fn diagnose(model: &Model, mask: &Mask, maps: &Maps, index: usize, noise: &Noise) -> Option<Diagnosis> {
    let mut stream = noise.stream.substream(index as u64);
    let sample = |&bin: &usize| noise.onto(&mut stream, maps.maps[index][bin]);
    let samples: Vec<_> = mask.bins().iter().map(sample).collect();
    let load_ratio = maps.load_ratios[index].as_ref().map(|ratio| match ratio {
        LoadRatio::Mean(r) => LoadRatio::Mean(*r),
        LoadRatio::PerSample(r) => LoadRatio::PerSample(mask.bins().iter().map(|&bin| r[bin]).collect()),
    });
    let measurement = Measurement { samples: &samples, load_ratio: load_ratio.as_ref(), noise: noise.stated() };
    match model.diagnose(&measurement, mask) {
        Ok(Outcome::Diagnosed(diagnosis)) => Some(diagnosis),
        Ok(Outcome::Undiagnosable { .. }) | Err(_) => None,
    }
}

fn write(writer: &mut dyn Write, names: &[String], rows: &[Option<Diagnosis>]) -> io::Result<()> {
    let sigmas = names.iter().map(|name| format!("sigma_{name}"));
    let header: Vec<_> = names.iter().cloned().chain(sigmas).collect();
    writeln!(writer, "{},plausible", header.join(","))?;
    for row in rows {
        match row {
            Some(found) => {
                for value in found.fault_vector.values().iter().chain(&found.sigma) {
                    write!(writer, "{value:.8},")?;
                }
                writeln!(writer, "{}", found.is_plausible())?;
            }
            None => writeln!(writer, "{}false", ",".repeat(header.len()))?,
        }
    }
    Ok(())
}
