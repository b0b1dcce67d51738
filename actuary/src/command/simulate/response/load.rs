//! The load on the command line: constant, or of an aircraft's elevator.

use airframe::Doublet;
use clap::{Args, ValueEnum};
use ema::{manoeuvre::Signal, motor::Motor};

use super::cases;
use crate::exit::Failure;

/// Seconds between hinge moments; they are linear in between.
const STEP_S: f64 = 1e-3;
/// When the doublet begins, and how long each of its deflections lasts, s.
const DOUBLET_FROM_S: f64 = 1.0;
const DOUBLET_HALF_S: f64 = 1.0;
/// Gentle enough for the linearised aircraft.
const LARGEST_DOUBLET_DEG: f64 = 10.0;

/// What the actuator works against.
#[derive(Debug, Args)]
#[command(next_help_heading = "Load")]
pub struct LoadArguments {
    /// What loads the actuator.
    #[arg(long, value_enum, default_value_t = LoadName::Constant)]
    load: LoadName,
    /// Constant load against positive motion, N m at the motor shaft [default: 0].
    #[arg(long, value_name = "NM", value_parser = cases::finite)]
    load_nm: Option<f64>,
    /// Deflection of the elevator from 1 to 2 s, and its opposite from 2 to 3 s, degrees [default: 2].
    #[arg(long, value_name = "DEG", value_parser = cases::finite)]
    doublet_deg: Option<f64>,
    /// Torque at the actuator's output per hinge moment of the elevator [default: 0.3].
    #[arg(long, value_name = "GAIN", value_parser = cases::positive)]
    linkage: Option<f64>,
    /// Efficiency of the gears under an opposing load, in place of the motor's; that of an aiding one follows from it.
    #[arg(long, value_name = "SHARE", value_parser = efficiency)]
    efficiency: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoadName {
    /// The same all the time.
    Constant,
    /// The hinge moment of an F-16's elevator in a doublet, through linkage and gears.
    F16,
}

impl LoadArguments {
    /// The motor with the gears asked for.
    pub fn applied_to(&self, motor: Motor) -> Motor {
        Motor { opposing_efficiency: self.efficiency.unwrap_or(motor.opposing_efficiency), ..motor }
    }

    /// Time that the load asks for, s.
    pub fn duration_s(&self) -> Option<f64> {
        (self.load == LoadName::F16).then_some(DOUBLET_FROM_S + 2.0 * DOUBLET_HALF_S + 2.0)
    }

    /// The load at the motor shaft for so long, N m.
    pub fn signal(&self, motor: &Motor, duration_s: f64) -> Result<Signal, Failure> {
        let misplaced = |option: &str, given: bool, name: &str| match given {
            true => Err(Failure::BadInput(format!("{option} means nothing to --load {name}"))),
            false => Ok(()),
        };
        if self.load == LoadName::Constant {
            misplaced("--doublet-deg", self.doublet_deg.is_some(), "constant")?;
            misplaced("--linkage", self.linkage.is_some(), "constant")?;
            return Ok(Signal::constant(self.load_nm.unwrap_or(0.0)));
        }
        misplaced("--load-nm", self.load_nm.is_some(), "f16")?;
        let amplitude_deg = self.doublet_deg.unwrap_or(2.0);
        if amplitude_deg.abs() > LARGEST_DOUBLET_DEG {
            let most = format!("at most {LARGEST_DOUBLET_DEG} degrees either way");
            return Err(Failure::BadInput(format!("--doublet-deg {amplitude_deg}: {most}")));
        }
        let doublet = Doublet { amplitude_deg, from_s: DOUBLET_FROM_S, half_s: DOUBLET_HALF_S };
        let moments_nm = doublet.hinge_moments_nm(STEP_S, (duration_s / STEP_S).ceil() as usize + 1);
        let (gears, linkage) = (motor.transmission(), self.linkage.unwrap_or(0.3));
        Ok(Signal::series(STEP_S, moments_nm.into_iter().map(|moment_nm| gears.load_nm(linkage * moment_nm)).collect()))
    }
}

/// Parses an efficiency.
fn efficiency(text: &str) -> Result<f64, String> {
    cases::finite(text).and_then(|share| match share > 0.0 && share <= 1.0 {
        true => Ok(share),
        false => Err("must be above 0 and at most 1".to_owned()),
    })
}
