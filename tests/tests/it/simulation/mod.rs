//! The whole in motion: store, server and workers under a schedule, a network and a clock that one seed
//! determines. Every step is awaited before the next one, so a failing seed fails again.
//!
//! `ACTUARY_SEEDS=17` or `ACTUARY_SEEDS=0..1000` runs these seeds in the quick test.
//!
//! # Failures here
//! - Requests that are lost, arrive twice, or in another order; answers that are lost, after which the client
//!   asks again; clients that hang up while they are answered; conflicting contents under one name.
//! - Uploads and events that come late, in any order; uploads that say what cannot be; inputs that are taken
//!   back, also before they arrive.
//! - Workers that die between lease, computation and result; workers that stop for longer than their lease
//!   and then go on as if nothing had happened.
//! - A service that stops in order, or is dropped without closing anything, and comes back on the same
//!   database; days that pass at once.
//! - Changes under way: another model, sensor configurations for past times, tokens that are replaced while
//!   requests are under way that show the old one.
//!
//! # No failures here
//! - Loss of power and broken disks: `durability` kills real processes, and `store` is tested with damaged rows.
//! - Databases that answer with errors, or late; queues that are full.
//! - Clients that lie about their names, or send what is no upload: `server` tests bad input.
//! - Clocks that differ between machines, or that go backwards.
//! - Two threads inside one request: steps do not overlap. `store` has tests with real concurrency.
//! - Learned priors, and certificates instead of tokens: they have tests of their own.
//!
//! # Known nondeterminism
//! - SQLite's connections run on threads of their own, which does not matter as long as every answer is awaited. A
//!   client that hangs up awaits none: how far its request came depends on those threads. The ledger asks what
//!   became of it, and holds the service to that; what the schedule does next does not depend on it. On Postgres a
//!   write goes on after its client has gone, also after the ledger has asked: there nobody hangs up.
//! - Time-outs of the server (30 s) run on the machine's clock and must never be reached.

mod dice;
mod hands;
mod input;
mod installations;
mod ledger;
mod mix;
mod network;
mod operators;
mod question;
mod reference;
mod run;
mod story;

use crate::in_process::database::Database;
use mix::Mix;
use run::{Tally, run};

/// Seeds of the quick test.
const QUICK: std::ops::Range<u64> = 0..8;

/// What must happen somewhere among many runs, lest they prove nothing.
const EVERYTHING: [&str; 21] = [
    "activations",
    "activations for all lives",
    "conflicts",
    "done before",
    "duplicated requests",
    "hang-ups",
    "killed workers",
    "kills",
    "leaps",
    "lost answers",
    "lost requests",
    "new tokens",
    "refused tokens",
    "restarts",
    "results refused",
    "rests",
    "results written",
    "revoked tokens",
    "sleeping workers",
    "states",
    "unknown",
];

/// Seeds to run: those asked for, or the usual ones.
fn seeds(usual: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(asked) = std::env::var("ACTUARY_SEEDS") else { return usual };
    let number = |text: &str| text.parse::<u64>().unwrap_or_else(|_| panic!("ACTUARY_SEEDS={asked}: 17 or 0..1000"));
    match asked.split_once("..") {
        Some((from, to)) => number(from)..number(to),
        None => number(&asked)..number(&asked) + 1,
    }
}

/// Runs seeds one after the other, each on a database of its own.
async fn run_all(seeds: std::ops::Range<u64>) -> Tally {
    let mut total = Tally::new();
    for seed in seeds {
        add(&mut total, run(seed, Mix::draw(seed), Database::sqlite()).await.tally);
    }
    println!("{total:#?}");
    total
}

fn add(total: &mut Tally, tally: Tally) {
    for (what, count) in tally {
        *total.entry(what).or_default() += count;
    }
}

#[tokio::test]
async fn slow_whatever_goes_wrong_what_was_acknowledged_holds() {
    run_all(seeds(QUICK)).await;
}

#[tokio::test]
async fn slow_whatever_goes_wrong_in_many_runs_what_was_acknowledged_holds() {
    let total = run_all(100..130).await;
    for what in EVERYTHING {
        assert!(total.contains_key(what), "{what} never happened: {total:#?}");
    }
}

#[tokio::test]
async fn whatever_goes_wrong_postgres_holds_the_same() {
    let mut total = Tally::new();
    for seed in seeds(QUICK) {
        let Some(database) = Database::postgres().await else { return };
        let mix = Mix { hang_ups: 0.0, ..Mix::draw(seed) };
        add(&mut total, run(seed, mix, database).await.tally);
    }
    println!("{total:#?}");
}

#[tokio::test]
async fn a_seed_replays() {
    let mix = Mix { hang_ups: 0.0, ..Mix::draw(3) };
    let run = async || run(3, mix.clone(), Database::sqlite()).await;
    assert_eq!(run().await, run().await);
}
