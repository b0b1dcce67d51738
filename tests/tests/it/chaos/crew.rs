//! The processes: servers that answer and workers that work, on one database.

use std::{
    fs::{File, OpenOptions},
    path::{Path, PathBuf},
    process::Command,
    sync::Mutex,
    time::{Duration, Instant},
};

use serde_json::Value;
use tests::{
    Service, binary,
    postgres::{Cluster, TestDatabase},
    run,
};

use super::{LEASE, traffic::OPERATORS};

/// A database of the cluster, migrated by two at the same time.
pub async fn database(cluster: &Cluster) -> TestDatabase {
    let database = cluster.database().await;
    let (owner, role) = (database.owner_url(), database.service_role());
    std::thread::scope(|scope| {
        let migrations: Vec<_> = (0..2)
            .map(|_| scope.spawn(|| run(&["migrate", "--database-url", &owner, "--service-role", role])))
            .collect();
        for migration in migrations {
            let migrated = migration.join().unwrap();
            assert!(migrated.status.success(), "{}", String::from_utf8_lossy(&migrated.stderr));
        }
    });
    database
}

/// Where servers answer, and what each operator shows them.
#[derive(Clone, Default)]
pub struct Access {
    /// That never changes.
    pub servers: Vec<String>,
    /// By the operator's number.
    pub tokens: Vec<String>,
}

impl Access {
    /// A token for each operator, made before anything is served.
    fn to(database: &str) -> Self {
        let token = |operator: &&str| {
            let token = ["token", "create", "--scope", "admin", "--operator", operator, "--database-url", database];
            let created = run(&token);
            assert!(created.status.success(), "{}", String::from_utf8_lossy(&created.stderr));
            String::from_utf8(created.stdout).expect("text").trim().to_owned()
        };
        Self { servers: Vec::new(), tokens: OPERATORS.iter().map(token).collect() }
    }

    /// What the first server answers an operator.
    pub async fn get(&self, operator: usize, path: &str) -> Value {
        let request = tests::http().get(format!("{}{path}", self.servers[0])).bearer_auth(&self.tokens[operator]);
        request.send().await.expect("an answer").json().await.expect("JSON")
    }
}

/// Servers come first, workers after them.
pub struct Crew {
    database: String,
    log: PathBuf,
    servers: Vec<Mutex<Option<Service>>>,
    workers: Vec<Mutex<Option<Service>>>,
    access: Access,
}

impl Crew {
    /// So many servers, and as many workers of one lane.
    pub fn of(database: &str, folder: &Path, servers: usize, workers: usize) -> Self {
        let mut crew = Self::none(database, folder);
        for _ in 0..servers {
            let server = crew.server(&["--no-worker"], 0);
            crew.access.servers.push(server.url.clone());
            crew.servers.push(Mutex::new(Some(server)));
        }
        crew.workers = (0..workers).map(|_| Mutex::new(Some(crew.worker()))).collect();
        crew
    }

    /// One process that serves and works on one lane.
    pub fn alone(database: &str, folder: &Path) -> Self {
        let migrated = run(&["migrate", "--database-url", database]);
        assert!(migrated.status.success(), "{}", String::from_utf8_lossy(&migrated.stderr));
        let mut crew = Self::none(database, folder);
        let server = crew.server(&["--lanes", "1"], 0);
        crew.access.servers.push(server.url.clone());
        crew.servers.push(Mutex::new(Some(server)));
        crew
    }

    fn none(database: &str, folder: &Path) -> Self {
        let log = folder.join("processes.log");
        let access = Access::to(database);
        Self { database: database.to_owned(), log, servers: Vec::new(), workers: Vec::new(), access }
    }

    pub fn access(&self) -> &Access {
        &self.access
    }

    pub fn server_count(&self) -> usize {
        self.servers.len()
    }

    pub fn worker_count(&self) -> usize {
        self.workers.len()
    }

    /// SIGKILL, then another one at the same address.
    pub fn replace_server(&self, number: usize) {
        let mut place = self.servers[number].lock().unwrap();
        let old = place.take().expect("it was running");
        let port = old.port();
        old.kill();
        *place = Some(self.server(&["--no-worker"], port));
    }

    /// SIGKILL, then another one.
    pub fn replace_worker(&self, number: usize) {
        let mut place = self.workers[number].lock().unwrap();
        place.take().expect("it was running").kill();
        *place = Some(self.worker());
    }

    pub fn signal_server(&self, number: usize, signal: &str) {
        self.servers[number].lock().unwrap().as_ref().expect("it is running").signal(signal);
    }

    pub fn signal_worker(&self, number: usize, signal: &str) {
        self.workers[number].lock().unwrap().as_ref().expect("it is running").signal(signal);
    }

    /// Returns when nothing is pending.
    pub async fn settle(&self) {
        let mut deadline = Instant::now() + Duration::from_secs(120);
        let mut least = u64::MAX;
        loop {
            let pending = pending(&self.access.servers[0]).await;
            if pending == Some(0) {
                return;
            }
            // It need not be fast, but it must go on.
            if let Some(pending) = pending.filter(|pending| *pending < least) {
                (least, deadline) = (pending, Instant::now() + Duration::from_secs(120));
            }
            assert!(Instant::now() < deadline, "{least} uploads stay pending");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    fn server(&self, how: &[&str], port: u16) -> Service {
        let mut arguments = vec!["serve", "--port"];
        let port = port.to_string();
        arguments.push(&port);
        arguments.extend(how);
        self.spawn(&arguments)
    }

    fn worker(&self) -> Service {
        self.spawn(&["worker", "--lanes", "1", "--health-port", "0"])
    }

    /// Whoever keeps services alive starts them again when they cannot start, such as while a connection is ended.
    fn spawn(&self, arguments: &[&str]) -> Service {
        let lease = LEASE.as_secs().to_string();
        for _ in 0..20 {
            let mut command = Command::new(binary());
            command.args(arguments).args(["--database-url", &self.database, "--lease-seconds", &lease]);
            if let Some(service) = Service::spawn(command.stderr(self.log())) {
                return service;
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        panic!("{arguments:?} does not start: {}", std::fs::read_to_string(&self.log).unwrap_or_default());
    }

    fn log(&self) -> File {
        OpenOptions::new().create(true).append(true).open(&self.log).expect("a log")
    }
}

/// What a service says of the work that waits; `None` when it does not know.
async fn pending(url: &str) -> Option<u64> {
    let text = tests::http().get(format!("{url}/metrics")).send().await.ok()?.text().await.ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("actuary_pending_uploads "))?;
    line.parse::<f64>().ok().filter(|number| number.is_finite()).map(|number| number as u64)
}
