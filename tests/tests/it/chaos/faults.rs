//! What goes wrong, one thing after the other, in step with the traffic.

use std::{
    collections::BTreeMap,
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed},
    },
    time::{Duration, Instant},
};

use numerics::Stream;
use sqlx::{Connection, PgConnection};
use tests::postgres::Cluster;
use tokio::{runtime::Handle, task::JoinHandle};

use super::{LEASE, client::Ledger, crew::Crew};

/// Longer than a lease, so that another takes over meanwhile.
const STOPPED: Duration = Duration::from_secs(LEASE.as_secs() + 1);
/// Servers hold no lease; nobody waits for an answer for longer.
const SERVER_STOPPED: Duration = Duration::from_secs(4);
/// How many workers may be stopped at the same time.
const MOST_STOPPED: usize = 3;

/// How many faults there are, over how many arrivals.
#[derive(Clone, Copy)]
pub struct Plan {
    pub faults: usize,
    pub arrivals: usize,
    pub seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    ServerKilled,
    WorkerKilled,
    WorkerStopped,
    ServerStopped,
    ConnectionsEnded,
    PostgresCrashed,
}

impl Fault {
    /// A crash of Postgres comes first, so that even few faults have one.
    fn of(number: usize, stream: &mut Stream) -> Self {
        let chance = stream.uniform();
        match number {
            0 => Self::PostgresCrashed,
            1 => Self::WorkerStopped,
            _ if chance < 0.15 => Self::ServerKilled,
            _ if chance < 0.50 => Self::WorkerKilled,
            _ if chance < 0.67 => Self::WorkerStopped,
            _ if chance < 0.70 => Self::ServerStopped,
            _ if chance < 0.97 => Self::ConnectionsEnded,
            _ => Self::PostgresCrashed,
        }
    }
}

/// What went wrong, and how long it took to serve again after Postgres accepted connections.
#[derive(Default)]
pub struct Report {
    faults: BTreeMap<Fault, usize>,
    ready_after: Vec<Duration>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let longest = self.ready_after.iter().max().copied().unwrap_or_default();
        write!(f, "{:?}; servers ready at most {:.2} s after Postgres accepted", self.faults, longest.as_secs_f64())
    }
}

/// A driver of faults.
pub struct Faults {
    /// How many have been injected.
    pub injected: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
    driver: JoinHandle<Report>,
}

impl Faults {
    pub fn start(plan: Plan, cluster: Arc<Cluster>, superuser: String, crew: Arc<Crew>, ledger: Ledger) -> Self {
        let (injected, stop) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        let mut driver = Driver {
            stream: Stream::new(plan.seed, &["faults"]),
            plan,
            cluster,
            superuser,
            crew,
            ledger,
            injected: injected.clone(),
            stop: stop.clone(),
            stopped: Vec::new(),
            report: Report::default(),
        };
        Self { injected, stop, driver: tokio::task::spawn_blocking(move || driver.run()) }
    }

    /// Lets everything go on that was stopped, and tells what there was.
    pub async fn end(self) -> Report {
        self.stop.store(true, Relaxed);
        self.driver.await.expect("the driver ended well")
    }
}

struct Driver {
    stream: Stream,
    plan: Plan,
    cluster: Arc<Cluster>,
    /// The database's URL.
    superuser: String,
    crew: Arc<Crew>,
    ledger: Ledger,
    injected: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
    /// Stopped workers, and until when.
    stopped: Vec<(usize, Instant)>,
    report: Report,
}

impl Drop for Driver {
    /// Traffic must not wait for faults that never come.
    fn drop(&mut self) {
        self.injected.store(self.plan.faults, Relaxed);
    }
}

impl Driver {
    fn run(&mut self) -> Report {
        for number in 0..self.plan.faults {
            // In step with the traffic.
            while self.ledger.done.load(Relaxed) * self.plan.faults < number * self.plan.arrivals {
                if self.stop.load(Relaxed) {
                    break;
                }
                self.wake(Instant::now());
                std::thread::sleep(Duration::from_millis(5));
            }
            self.wake(Instant::now());
            let fault = Fault::of(number, &mut self.stream);
            self.inject(fault);
            *self.report.faults.entry(fault).or_default() += 1;
            self.injected.fetch_add(1, Relaxed);
        }
        self.wake(Instant::now() + STOPPED);
        std::mem::take(&mut self.report)
    }

    fn inject(&mut self, fault: Fault) {
        match fault {
            Fault::ServerKilled => {
                let number = self.below(self.crew.server_count());
                self.crew.replace_server(number);
            }
            Fault::WorkerKilled => {
                let number = self.running_worker();
                self.crew.replace_worker(number);
            }
            Fault::WorkerStopped => {
                if self.stopped.len() >= MOST_STOPPED {
                    let (_, first) = self.stopped[0];
                    std::thread::sleep(first.saturating_duration_since(Instant::now()));
                    self.wake(first);
                }
                let number = self.running_worker();
                self.crew.signal_worker(number, "STOP");
                self.stopped.push((number, Instant::now() + STOPPED));
            }
            Fault::ServerStopped => {
                let number = self.below(self.crew.server_count());
                self.crew.signal_server(number, "STOP");
                std::thread::sleep(SERVER_STOPPED);
                self.crew.signal_server(number, "CONT");
            }
            Fault::ConnectionsEnded => Handle::current().block_on(end_connections(&self.superuser)),
            Fault::PostgresCrashed => {
                self.cluster.crash();
                self.cluster.resume();
                let accepted = Instant::now();
                Handle::current().block_on(ready(&self.crew.access().servers));
                self.report.ready_after.push(accepted.elapsed());
            }
        }
    }

    /// Lets those go on that were stopped until then.
    fn wake(&mut self, now: Instant) {
        let crew = &self.crew;
        self.stopped.retain(|(number, until)| {
            let due = *until <= now;
            if due {
                crew.signal_worker(*number, "CONT");
            }
            !due
        });
    }

    fn running_worker(&mut self) -> usize {
        loop {
            let number = self.below(self.crew.worker_count());
            if self.stopped.iter().all(|(stopped, _)| *stopped != number) {
                return number;
            }
        }
    }

    fn below(&mut self, end: usize) -> usize {
        ((self.stream.uniform() * end as f64) as usize).min(end - 1)
    }
}

/// Ends a few connections of servers and workers.
async fn end_connections(superuser: &str) {
    let mut connection = PgConnection::connect(superuser).await.expect("Postgres answers");
    let sql = "select pg_terminate_backend(pid) from (
                 select pid from pg_stat_activity where application_name = 'actuary' order by random() limit 4) as chosen";
    sqlx::query(sql).execute(&mut connection).await.expect("a superuser may");
    connection.close().await.expect("it closes");
}

/// Returns when all servers say that they are ready.
async fn ready(servers: &[String]) {
    let deadline = Instant::now() + Duration::from_secs(60);
    for server in servers {
        while !tests::http()
            .get(format!("{server}/readyz"))
            .send()
            .await
            .is_ok_and(|answer| answer.status().is_success())
        {
            assert!(Instant::now() < deadline, "{server} is not ready a minute after Postgres accepted");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}
