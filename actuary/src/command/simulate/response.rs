//! `actuary simulate response`: what faults do to the response, as a table and as a chart.

mod cases;
mod chart;
mod load;

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::Result;
use clap::{Args, ValueEnum};
use ema::{
    manoeuvre::{Manoeuvre, Signal},
    motor::Motor,
    response::{Harmonic, ResponsePoint, StepFigures, TrackingFigures, simulate_response},
    simulation::Settings,
};
use rayon::prelude::*;

use self::{
    cases::{Case, FaultArguments},
    load::LoadArguments,
};
use super::ModelName;
use crate::{
    exit::Failure,
    files::{motor, output::OutputFile},
    say::say,
};

/// More points than this make a file that nobody opens.
const MOST_POINTS: f64 = 1e6;

/// Simulate the response of the actuator to a command, under faults of one or several sizes.
///
/// Prints figures of each response; writes the responses as a table and as a chart where asked to.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  actuary simulate response --friction 1,2,3 --svg step.svg --csv step.csv
  actuary simulate response --command ramp --rate-rad-s 1e-4 --friction 1,2,4 --svg stick-slip.svg
  actuary simulate response --friction 1,2,4 --duration-s 4 --svg limit-cycle.svg
  actuary simulate response --command sine --amplitude-rad 0.02 --backlash-rad 0,1e-3,3e-3 --svg backlash.svg
  actuary simulate response --gain 0.5,0.75,1,1.25,1.5 --svg gain.svg
  actuary simulate response --load f16 --efficiency 0.8 --command sine --csv elevator.csv
  actuary simulate response --model lf1 --short-a 0,0.2,0.4 --eccentricity 0.2 --csv short.csv

Columns of the table: curve, time_s, command_rad, output_rad, motor_rad, speed_rad_s (motor), current_a
(mean of the active pair since the row before), load_nm (at the motor shaft, against positive motion)."
)]
pub struct Arguments {
    /// What the actuator is asked to do.
    #[arg(long, value_enum, default_value_t = CommandName::Step)]
    command: CommandName,
    /// Height of the step or amplitude of the sine, rad at the output [default: 0.1].
    #[arg(long, value_parser = cases::finite)]
    amplitude_rad: Option<f64>,
    /// Slope of the ramp, rad/s at the output [default: 0.01].
    #[arg(long, value_parser = cases::finite)]
    rate_rad_s: Option<f64>,
    /// Frequency of the sine, Hz [default: 0.5].
    #[arg(long, value_parser = cases::positive)]
    frequency_hz: Option<f64>,
    /// Simulated time, s; without it 0.5 for a step, 4 for a ramp, three periods of a sine, and 5 under an elevator.
    #[arg(long, value_parser = cases::positive)]
    duration_s: Option<f64>,
    /// Time between rows of the table, s.
    #[arg(long, default_value_t = 1e-3, value_parser = cases::positive)]
    interval_s: f64,
    /// Model of motor and drive.
    #[arg(long, value_enum, default_value_t = ModelName::Hf)]
    model: ModelName,
    /// Parameters of the motor (JSON); the 48 V reference actuator without it.
    #[arg(long, value_name = "FILE")]
    motor: Option<PathBuf>,
    /// Table to write.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Chart to write.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    load: LoadArguments,
    #[command(flatten)]
    faults: FaultArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CommandName {
    /// From zero to the amplitude at once.
    Step,
    /// From zero at a constant rate.
    Ramp,
    /// About zero, from zero.
    Sine,
}

/// What the actuator is asked to do, for how long.
struct Command {
    name: CommandName,
    signal: Signal,
    frequency_hz: f64,
    duration_s: f64,
    words: String,
    load_nm: Signal,
}

/// The response of one case.
struct Response {
    case: Case,
    points: Vec<ResponsePoint>,
}

/// Simulates, prints and writes the responses.
pub fn run(arguments: &Arguments) -> Result<()> {
    let motor = arguments.load.applied_to(motor::read(arguments.motor.as_deref())?);
    let command = Command::of(arguments, &motor)?;
    let cases = arguments.faults.cases(&motor)?;
    let csv = arguments.csv.as_deref().map(OutputFile::new).transpose()?;
    let svg = arguments.svg.as_deref().map(OutputFile::new).transpose()?;
    let responses: Vec<_> = cases.into_par_iter().map(|case| simulate(arguments, &command, case)).collect();
    if let Some(csv) = csv {
        csv.write(|writer| write_table(writer, &command.load_nm, &responses))?;
    }
    if let Some(svg) = svg {
        let title = format!("Response to {}, {}", command.words, model_words(arguments.model));
        let chart = chart::draw(&title, &responses);
        svg.write(|writer| writer.write_all(chart.as_bytes()))?;
    }
    print_figures(&command, &responses);
    Ok(())
}

impl Command {
    fn of(arguments: &Arguments, motor: &Motor) -> Result<Self, Failure> {
        let name = arguments.command;
        let misplaced = |option: &str, given: bool, of: &[CommandName]| match given && !of.contains(&name) {
            true => Err(Failure::BadInput(format!("{option} means nothing to a {}", name.word()))),
            false => Ok(()),
        };
        misplaced("--amplitude-rad", arguments.amplitude_rad.is_some(), &[CommandName::Step, CommandName::Sine])?;
        misplaced("--rate-rad-s", arguments.rate_rad_s.is_some(), &[CommandName::Ramp])?;
        misplaced("--frequency-hz", arguments.frequency_hz.is_some(), &[CommandName::Sine])?;
        let amplitude = arguments.amplitude_rad.unwrap_or(0.1);
        let rate = arguments.rate_rad_s.unwrap_or(0.01);
        let frequency_hz = arguments.frequency_hz.unwrap_or(0.5);
        if amplitude == 0.0 {
            return Err(Failure::BadInput("--amplitude-rad 0: nothing would move".to_owned()));
        }
        let (signal, duration_s, words) = match name {
            CommandName::Step => (Signal::constant(amplitude), 0.5, format!("a step of {amplitude} rad")),
            CommandName::Ramp => (Signal::ramp(rate), 4.0, format!("a ramp of {rate} rad/s")),
            CommandName::Sine => {
                let words = format!("a sine of {amplitude} rad at {frequency_hz} Hz");
                (Signal::sine(amplitude, frequency_hz), 3.0 / frequency_hz, words)
            }
        };
        let duration_s = arguments.duration_s.or(arguments.load.duration_s()).unwrap_or(duration_s);
        if !(duration_s / arguments.interval_s).le(&MOST_POINTS) || duration_s > 3600.0 {
            let reason = "at most an hour, and a million rows a curve";
            return Err(Failure::BadInput(format!("{duration_s} s every {} s: {reason}", arguments.interval_s)));
        }
        let load_nm = arguments.load.signal(motor, duration_s)?;
        Ok(Self { name, signal, frequency_hz, duration_s, words, load_nm })
    }
}

impl CommandName {
    fn word(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Ramp => "ramp",
            Self::Sine => "sine",
        }
    }
}

fn model_words(model: ModelName) -> &'static str {
    match model {
        ModelName::Hf => "three-phase model",
        ModelName::Lf1 => "single-phase model",
        ModelName::Lf1Thesis => "single-phase model with shape functions",
    }
}

fn simulate(arguments: &Arguments, command: &Command, case: Case) -> Response {
    let model = arguments.model.into();
    let manoeuvre = Manoeuvre { load_nm: command.load_nm.clone(), ..Manoeuvre::following(command.signal.clone()) };
    let settings = Settings::new(model, command.duration_s);
    let Case { motor, electrical, .. } = &case;
    let points = simulate_response(model, motor, electrical, &manoeuvre, &settings, arguments.interval_s);
    Response { case, points }
}

fn write_table(writer: &mut dyn Write, load_nm: &Signal, responses: &[Response]) -> io::Result<()> {
    writeln!(writer, "curve,time_s,command_rad,output_rad,motor_rad,speed_rad_s,current_a,load_nm")?;
    for Response { case, points } in responses {
        for point in points {
            let ResponsePoint { time_s, command_rad, output_rad, motor_rad, speed_rad_s, current_a } = point;
            write!(writer, "{},{time_s:.6},{command_rad:.8},{output_rad:.8},", case.label)?;
            writeln!(writer, "{motor_rad:.6},{speed_rad_s:.4},{current_a:.4},{:.6}", load_nm.at(*time_s))?;
        }
    }
    Ok(())
}

fn print_figures(command: &Command, responses: &[Response]) {
    let width = responses.iter().map(|response| response.case.label.chars().count()).max().unwrap_or(0);
    let milli = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{:.1}", 1e3 * value));
    say!("{:width$}  {}", "", heading(command.name));
    for Response { case, points } in responses {
        let figures = match command.name {
            CommandName::Step => {
                let StepFigures { rise_s, settling_s, overshoot, static_error_rad } = StepFigures::from_points(points);
                let (rise, settling, overshoot) = (milli(rise_s), milli(settling_s), 100.0 * overshoot);
                format!("{rise:>8}  {settling:>11}  {overshoot:>11.2}  {:>17.4}", 1e3 * static_error_rad)
            }
            CommandName::Ramp => tracking(points, 0.5 * command.duration_s),
            CommandName::Sine => {
                let harmonic = Harmonic::from_points(points, command.frequency_hz);
                let gain = harmonic.map_or_else(|| "-".to_owned(), |found| format!("{:.4}", found.gain));
                let phase =
                    harmonic.map_or_else(|| "-".to_owned(), |found| format!("{:.2}", found.phase_rad.to_degrees()));
                format!("{}  {gain:>6}  {phase:>10}", tracking(points, 1.0 / command.frequency_hz))
            }
        };
        say!("{:width$}  {figures}", case.label);
    }
}

fn heading(command: CommandName) -> &'static str {
    match command {
        CommandName::Step => " rise ms  settling ms  overshoot %  static error mrad",
        CommandName::Ramp => "rms error mrad  max error mrad  standstill %",
        CommandName::Sine => "rms error mrad  max error mrad  standstill %    gain  phase, deg",
    }
}

/// Figures of following, the start left out.
fn tracking(points: &[ResponsePoint], from_s: f64) -> String {
    let last_s = points.last().map_or(0.0, |point| point.time_s);
    let TrackingFigures { rms_error_rad, max_error_rad, standstill } =
        TrackingFigures::from_points(points, from_s.min(last_s));
    format!("{:>14.4}  {:>14.4}  {:>12.1}", 1e3 * rms_error_rad, 1e3 * max_error_rad, 100.0 * standstill)
}
