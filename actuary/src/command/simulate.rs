//! `actuary simulate`: a fleet against a running service; histories, maps and responses on disk.

mod fleet;
mod history;
mod map;
mod response;

use anyhow::Result;
use clap::{Args, Subcommand, ValueEnum};
use ema::simulation::Model;
use simulator::Physics;

/// Simulate a fleet that uploads, histories of lives, back-EMF maps, or responses to commands.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Fleet(Box<fleet::Arguments>),
    History(history::Arguments),
    Map(map::Arguments),
    Response(Box<response::Arguments>),
}

/// Runs the simulation.
pub fn run(arguments: Arguments) -> Result<()> {
    match arguments.what {
        What::Fleet(arguments) => fleet::run(*arguments),
        What::History(arguments) => history::run(&arguments),
        What::Map(arguments) => map::run(&arguments),
        What::Response(arguments) => response::run(&arguments),
    }
}

/// A model of motor and drive on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModelName {
    /// The three-phase model, switched leg by leg.
    Hf,
    /// One equivalent phase: the sum over the active pair.
    Lf1,
    /// One equivalent phase with the shape functions of the thesis.
    Lf1Thesis,
}

impl From<ModelName> for Model {
    fn from(name: ModelName) -> Self {
        match name {
            ModelName::Hf => Self::HighFidelity,
            ModelName::Lf1 => Self::LowFidelity1,
            ModelName::Lf1Thesis => Self::LowFidelity1Thesis,
        }
    }
}

/// What makes the samples of a simulated aircraft, on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PhysicsName {
    /// The three-phase model.
    Hf,
    /// The closed form of the map, for load tests.
    ClosedForm,
}

impl From<PhysicsName> for Physics {
    fn from(name: PhysicsName) -> Self {
        match name {
            PhysicsName::Hf => Self::HighFidelity,
            PhysicsName::ClosedForm => Self::ClosedForm,
        }
    }
}
