//! What the end-to-end tests share: the real binary, real processes, real sockets.

pub mod postgres;

use std::{
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, ExitStatus, Output, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;

/// The binary, beside the tests in the target folder.
pub fn binary() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let binary = test.ancestors().nth(2).expect("tests lie two folders below the binary").join("actuary");
    assert!(binary.exists(), "{} is missing: cargo build --workspace --bin actuary", binary.display());
    binary
}

/// A client for services without TLS.
pub fn http() -> reqwest::Client {
    http_builder().build().expect("a client")
}

/// The same, to be tuned.
pub fn http_builder() -> reqwest::ClientBuilder {
    // Whoever is first installs it.
    let _ = rustls::crypto::ring::default_provider().install_default();
    reqwest::Client::builder().tls_certs_only([])
}

/// Runs `actuary` to its end.
pub fn run(arguments: &[&str]) -> Output {
    Command::new(binary()).args(arguments).output().expect("the binary starts")
}

/// The digest that `actuary verify --digest` prints of a database, once every row with a checksum was read.
pub fn digest(database_url: &str) -> String {
    let output = run(&["verify", "--digest", "--database-url", database_url]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).expect("text");
    let is_digest = |line: &&str| line.len() == 64 && line.bytes().all(|byte| byte.is_ascii_hexdigit());
    said.lines().find(is_digest).unwrap_or_else(|| panic!("no digest: {said}")).to_owned()
}

/// Sends a process a signal, such as `STOP`.
pub fn signal(id: u32, name: &str) {
    let sent = Command::new("kill").args(["-s", name, &id.to_string()]).status().expect("kill is there");
    assert!(sent.success(), "signal {name} to process {id}");
}

/// A service, or a worker with probes, in a process of its own; killed without warning when dropped.
pub struct Service {
    child: Child,
    // Kept open: a closed pipe would end a service that still speaks.
    _stdout: BufReader<ChildStdout>,
    /// `http://` and its address.
    pub url: String,
}

impl Service {
    /// Starts `actuary serve` on a database file; port 0 takes any free one.
    pub fn start(database: &Path, port: u16) -> Self {
        let mut command = Command::new(binary());
        command.args(["serve", "--database-url", &format!("sqlite:{}", database.display())]);
        Self::spawn(command.args(["--port", &port.to_string()])).expect("the service says where it listens")
    }

    /// Starts a process of the binary; `None` when it ends before it says where it answers.
    pub fn spawn(command: &mut Command) -> Option<Self> {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the binary starts");
        let mut stdout = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        stdout.read_line(&mut line).expect("a line of text");
        let Some((_, url)) = line.trim().split_once(" on ") else {
            child.wait().expect("it ended");
            return None;
        };
        Some(Self { child, _stdout: stdout, url: url.to_owned() })
    }

    /// The process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal, such as `STOP`.
    pub fn signal(&self, name: &str) {
        signal(self.child.id(), name);
    }

    /// SIGTERM; how it ended, and after how long.
    pub fn terminate(mut self) -> (ExitStatus, Duration) {
        let begun = Instant::now();
        self.signal("TERM");
        let status = self.child.wait().expect("it ended");
        (status, begun.elapsed())
    }

    /// The port it listens on.
    pub fn port(&self) -> u16 {
        self.url.rsplit(':').next().and_then(|port| port.parse().ok()).expect("a port")
    }

    /// SIGKILL: no warning, no clean-up.
    pub fn kill(mut self) {
        self.child.kill().expect("it was running");
        self.child.wait().expect("it ended");
    }

    /// The JSON that a path answers with.
    pub async fn get(&self, path: &str) -> Value {
        serde_json::from_str(&self.text(path).await).expect("JSON")
    }

    /// The text that a path answers with.
    pub async fn text(&self, path: &str) -> String {
        let answer = http().get(format!("{}{path}", self.url)).send().await.expect("an answer");
        assert!(answer.status().is_success(), "GET {path}: {}", answer.status());
        answer.text().await.expect("text")
    }

    /// The RUL objects of the fleet, once nothing is pending.
    pub async fn settled_fleet(&self) -> Vec<Value> {
        let deadline = Instant::now() + Duration::from_secs(240);
        loop {
            let fleet = self.fleet().await;
            let settled = fleet.iter().all(|rul| rul["pending_uploads"] == 0);
            if !fleet.is_empty() && settled {
                return fleet;
            }
            assert!(Instant::now() < deadline, "uploads stay pending");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    async fn fleet(&self) -> Vec<Value> {
        let mut fleet = Vec::new();
        for tail in items(self.get("/v1/tails").await) {
            let tail = tail["tail"].as_str().expect("a tail").to_owned();
            fleet.extend(items(self.get(&format!("/v1/tails/{tail}/rul")).await));
        }
        fleet
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The items of a page.
pub fn items(page: Value) -> Vec<Value> {
    page["items"].as_array().expect("a page").clone()
}
