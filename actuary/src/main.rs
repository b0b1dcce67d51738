//! `actuary`: the one binary. Configuration, wiring and words; everything else lives in the crates.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a reader that leaves is no failure: see `say`")]

mod client;
mod clock;
mod command;
mod database;
mod default_model;
mod door;
mod environment;
mod exit;
mod files;
mod flights;
mod forecaster;
mod frame_key;
mod health;
mod hindsight;
mod http;
mod interrupt;
mod lesson;
mod overview;
mod progress;
mod say;
mod scorer;
mod service;
mod table;
mod telemetry;
mod terminal;
mod upkeep;
mod uplink;
mod work;

use std::process::ExitCode;

use clap::{FromArgMatches, Parser, Subcommand};

use crate::command::{
    backtest, backup, checks, completions, component, demo, diagnose, due, fleet, frame, healthcheck, loads, migrate,
    model, rebuild, restore, rul, serve, settings, simulate, token, train, verify, watch, what_if, worker,
};

/// Predicts the remaining life of aircraft electromechanical actuators.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Backtest(backtest::Arguments),
    Backup(backup::Arguments),
    Checks(checks::Arguments),
    Completions(completions::Arguments),
    Component(component::Arguments),
    Demo(demo::Arguments),
    Serve(serve::Arguments),
    Train(train::Arguments),
    Diagnose(diagnose::Arguments),
    Due(due::Arguments),
    Fleet(fleet::Arguments),
    Frame(frame::Arguments),
    Healthcheck(healthcheck::Arguments),
    Loads(loads::Arguments),
    Migrate(migrate::Arguments),
    Model(model::Arguments),
    Rebuild(rebuild::Arguments),
    Restore(restore::Arguments),
    Rul(rul::Arguments),
    Settings(settings::Arguments),
    Simulate(simulate::Arguments),
    Token(token::Arguments),
    Verify(verify::Arguments),
    Watch(watch::Arguments),
    WhatIf(what_if::Arguments),
    Worker(worker::Arguments),
}

fn main() -> ExitCode {
    // Nothing else installs one, so this cannot fail; whoever speaks TLS finds it.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let program = overview::program::<Cli>();
    let cli = match program.clone().try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => return exit::usage(&error),
    };
    environment::note_misspelt(&program);
    if let Err(error) = interrupt::watch() {
        return exit::code(Err(anyhow::Error::new(error).context("cannot listen for signals")));
    }
    let outcome = match cli.command {
        Command::Backtest(arguments) => backtest::run(arguments),
        Command::Backup(arguments) => backup::run(&arguments),
        Command::Checks(arguments) => checks::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, program),
        Command::Demo(arguments) => demo::run(arguments),
        Command::Serve(arguments) => serve::run(arguments),
        Command::Train(arguments) => train::run(arguments),
        Command::Diagnose(arguments) => diagnose::run(&arguments),
        Command::Due(arguments) => due::run(&arguments),
        Command::Frame(arguments) => frame::run(arguments),
        Command::Component(arguments) => component::run(&arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::Rul(arguments) => rul::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::WhatIf(arguments) => what_if::run(&arguments),
        Command::Healthcheck(arguments) => healthcheck::run(&arguments),
        Command::Loads(arguments) => loads::run(&arguments),
        Command::Migrate(arguments) => migrate::run(&arguments),
        Command::Model(arguments) => model::run(&arguments),
        Command::Rebuild(arguments) => rebuild::run(&arguments),
        Command::Restore(arguments) => restore::run(&arguments),
        Command::Settings(arguments) => settings::run(&arguments),
        Command::Simulate(arguments) => simulate::run(arguments),
        Command::Token(arguments) => token::run(arguments),
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Worker(arguments) => worker::run(arguments),
    };
    exit::code(outcome)
}
