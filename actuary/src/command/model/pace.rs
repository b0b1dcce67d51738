//! `actuary model pace`: tells a bundle what load and temperature do to wear.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use pipeline::{Bundle, Model};
use prognosis::{Coefficient, LifePrior, PaceLaw};

use crate::{
    exit::Failure,
    files::{bundle, output::OutputFile},
    say::say,
};

/// Tell a bundle the engineering values of the pace of wear, which hold until an operator's own lives teach better ones.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary model pace --model models/default.json --exponent 2 --exponent-sd 0.3 \\
    --temperature 0.3 --temperature-sd 0.1 --out paced.json\n\n\
    An hour at load L and temperature T, both relative to the bundle's references, wears like L^exponent exp(temperature T)\n\
    hours. Standard deviations say how sure that is; forecasts under other loads carry them.")]
pub struct Arguments {
    /// The bundle.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// The power of the load by which wear goes.
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true)]
    exponent: f64,
    /// Its standard deviation.
    #[arg(long, value_name = "SD", default_value_t = 0.3)]
    exponent_sd: f64,
    /// The coefficient of the temperature.
    #[arg(long, value_name = "BETA", default_value_t = 0.0, allow_negative_numbers = true)]
    temperature: f64,
    /// Its standard deviation.
    #[arg(long, value_name = "SD", default_value_t = 0.1)]
    temperature_sd: f64,
    /// The bundle to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Writes the bundle.
pub fn run(arguments: &Arguments) -> Result<()> {
    let model = bundle::read(&arguments.model)?;
    let out = OutputFile::new(&arguments.out)?;
    let law = PaceLaw::told(
        Coefficient { mean: arguments.exponent, sd: arguments.exponent_sd },
        Coefficient { mean: arguments.temperature, sd: arguments.temperature_sd },
    );
    if !law.acts() {
        return Err(Failure::BadInput("tell --exponent, --temperature or both, not zero".to_owned()).into());
    }
    let bytes = told(model.bundle(), law);
    let model = Model::from_bytes(&bytes)?;
    model.rehearse().map_err(|error| Failure::BadInput(error.to_string()))?;
    out.write(|writer| writer.write_all(&bytes))?;
    say!("{}\nbundle {}", arguments.out.display(), model.summary().hash);
    Ok(())
}

/// The file of a bundle that is told a law.
pub fn told(bundle: &Bundle, law: PaceLaw) -> Vec<u8> {
    let prior = LifePrior { pace: Some(law), ..bundle.prior.clone() };
    Bundle { prior, ..bundle.clone() }.to_bytes()
}
