//! Exactly-once effects under faults: real servers, real workers, a real Postgres.
//!
//! What is sent: uploads of several components, three in ten of them twice, one in ten late, one by one and in
//! batches, over REST and gRPC, some to two servers at once. The clients send again whatever is not acknowledged. The
//! components belong to three operators, each with a token, who call all their things alike: whatever crosses from one
//! to another makes a conflict, an upload too many, or another digest.
//!
//! Faults: SIGKILL of servers and workers; SIGSTOP of them for longer than a lease, so that a zombie wakes with
//! results of a lease that another holds; connections that Postgres ends; Postgres itself restarted as by a crash.
//!
//! Not covered: power cuts (SIGKILL says nothing about fsync), several machines, damaged rows.
//!
//! Nondeterminism left on purpose: which uploads meet in one lease, and so which prognoses are issued. Whatever is
//! a function of the set of uploads must be the same: the digest over all estimates and states is compared with
//! that of a database that one undisturbed worker filled in the order of flights.
//!
//! Sizes: `ACTUARY_CHAOS_UPLOADS`, `ACTUARY_CHAOS_FAULTS`, `ACTUARY_CHAOS_SEED`.

mod client;
mod crew;
mod faults;
mod grpc;
mod traffic;
mod verdict;

use std::{
    path::Path,
    sync::{Arc, atomic::Ordering::Relaxed},
    time::{Duration, Instant},
};

use tests::postgres::Cluster;

use self::{
    client::{Ledger, fly},
    crew::Crew,
    faults::{Faults, Plan},
    traffic::Traffic,
};

/// Components per upload: lives are as long as a filter takes notice of.
const UPLOADS_PER_COMPONENT: usize = 250;

fn size(name: &str, otherwise: usize) -> usize {
    match std::env::var(name) {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("{name} is {text:?}, not a number")),
        Err(_) => otherwise,
    }
}

fn traffic(uploads: usize, seed: u64, mask: &traffic::Mask) -> Traffic {
    let components = uploads.div_ceil(UPLOADS_PER_COMPONENT).max(4);
    Traffic::new(components, uploads / components, seed, mask)
}

/// The digest of the same uploads in the order of flights, on SQLite with one worker that nothing disturbs.
async fn undisturbed(folder: &Path, traffic: &Traffic) -> String {
    let database = format!("sqlite:{}", folder.join("undisturbed.sqlite").display());
    let crew = Crew::alone(&database, folder);
    let ledger = Ledger::default();
    fly(traffic, &traffic.in_order(), crew.access(), &ledger, || true).await;
    assert_eq!(ledger.violations(), Vec::<String>::new());
    crew.settle().await;
    drop(crew);
    tests::digest(&database)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_faults_leave_no_trace() {
    let Some(cluster) = Cluster::start() else { return };
    let (uploads, faults, seed) =
        (size("ACTUARY_CHAOS_UPLOADS", 3000), size("ACTUARY_CHAOS_FAULTS", 40), size("ACTUARY_CHAOS_SEED", 1) as u64);
    let folder = tempfile::tempdir().unwrap();
    let begun = Instant::now();
    let cluster = Arc::new(cluster);
    let database = crew::database(&cluster).await;
    let crew = Arc::new(Crew::of(&database.service_url(), folder.path(), 2, 8));
    let traffic = traffic(uploads, seed, &traffic::Mask::of(crew.access()).await);
    let arrivals = traffic.disturbed();
    println!("{} uploads of {} components, {} arrivals", traffic.len(), traffic.components, arrivals.len());

    let ledger = Ledger::default();
    let plan = Plan { faults, arrivals: arrivals.len(), seed };
    let driver = Faults::start(plan, cluster.clone(), database.superuser_url(), crew.clone(), ledger.clone());
    // Traffic and faults keep step, so that all faults fall into the traffic.
    let (injected, done) = (driver.injected.clone(), ledger.done.clone());
    let may_go_on = move || done.load(Relaxed) * faults <= (injected.load(Relaxed) + 3) * plan.arrivals;
    fly(&traffic, &arrivals, crew.access(), &ledger, may_go_on).await;
    let report = driver.end().await;
    println!("all acknowledged after {:.0} s\n{report}", begun.elapsed().as_secs_f64());
    crew.settle().await;
    println!("all processed after {:.0} s\n{ledger}", begun.elapsed().as_secs_f64());
    verdict::within_walls(crew.access(), &traffic).await;
    drop(crew);

    assert_eq!(ledger.violations(), Vec::<String>::new());
    verdict::check(&database.superuser_url(), &traffic).await;
    assert_eq!(tests::digest(&database.service_url()), undisturbed(folder.path(), &traffic).await);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_any_number_of_workers_gives_the_digest_of_one() {
    let Some(cluster) = Cluster::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut digests = Vec::new();
    let mut sent = None;
    for workers in [1, 2, 4] {
        let database = crew::database(&cluster).await;
        let crew = Crew::of(&database.service_url(), folder.path(), 2, workers);
        let mask = traffic::Mask::of(crew.access()).await;
        let traffic = sent.get_or_insert_with(|| traffic(800, 2, &mask));
        let ledger = Ledger::default();
        fly(traffic, &traffic.disturbed(), crew.access(), &ledger, || true).await;
        crew.settle().await;
        drop(crew);
        assert_eq!(ledger.violations(), Vec::<String>::new());
        verdict::check(&database.superuser_url(), traffic).await;
        digests.push(tests::digest(&database.service_url()));
    }
    digests.push(undisturbed(folder.path(), &sent.unwrap()).await);
    digests.dedup();
    assert_eq!(digests.len(), 1, "{digests:?}");
}

/// How long a lease is: short, so that a stopped worker outsleeps it, but longer than an analysis on a busy machine.
const LEASE: Duration = Duration::from_secs(10);
