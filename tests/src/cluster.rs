//! A Postgres cluster of a test's own, for tests that stop it or log in with passwords.

use std::{
    fs,
    net::TcpListener,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;

/// A throwaway cluster that listens on the loopback address and on a socket; it goes when dropped.
pub struct Cluster {
    folder: TempDir,
    programs: PathBuf,
    port: u16,
}

impl Cluster {
    /// Makes and starts a cluster whose superuser is `owner`, who needs no password over the socket. Over TCP
    /// everybody needs one if the owner has one. `None`, and a word why, where Postgres is not installed.
    pub fn start(owner_password: Option<&str>) -> Option<Self> {
        let Some(programs) = programs() else {
            println!("skipped: no Postgres (scripts/test installs it, or: apt-get install postgresql)");
            return None;
        };
        let folder = TempDir::with_prefix("actuary-postgres.").expect("a folder");
        let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a free port").port();
        let password_file = folder.path().join("password");
        fs::write(&password_file, owner_password.unwrap_or("none")).expect("it can be written");
        if is_root() {
            let owned = Command::new("chown").args(["--recursive", "postgres:"]).arg(folder.path()).status();
            assert!(owned.is_ok_and(|status| status.success()), "the user postgres is missing");
        }
        let cluster = Self { folder, programs, port };
        let data = cluster.data();
        let host_auth = if owner_password.is_some() { "scram-sha-256" } else { "trust" };
        let owner = ["--username", "owner", "--pwfile", password_file.to_str().expect("text")];
        let manner =
            ["--auth-local", "trust", "--auth-host", host_auth, "--encoding", "UTF8", "--no-locale", "--no-sync"];
        let made = cluster.run("initdb", &[&["--pgdata", &data], &owner[..], &manner].concat());
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let settings = format!(
            "port = {port}\nlisten_addresses = '127.0.0.1'\nunix_socket_directories = '{}'\nmax_connections = 300\n",
            cluster.folder.path().display()
        );
        let file = Path::new(&data).join("postgresql.conf");
        let existing = fs::read_to_string(&file).expect("initdb wrote it");
        fs::write(&file, existing + &settings).expect("it can be written");
        cluster.control(&["start", "--wait"]);
        Some(cluster)
    }

    /// The URL of a database, over TCP.
    pub fn url(&self, role: &str, database: &str) -> String {
        format!("postgres://{role}@{}/{database}", self.address())
    }

    /// Host and port.
    pub fn address(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// What `psql` answers to SQL as the superuser: a row a line, columns between bars.
    pub fn sql(&self, database: &str, sql: &str) -> String {
        let output = self.psql(database, &["--command", sql]);
        assert!(output.status.success(), "{sql}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text").trim_end().to_owned()
    }

    /// Runs `psql` as the superuser.
    pub fn psql(&self, database: &str, arguments: &[&str]) -> Output {
        let socket = self.folder.path().to_str().expect("text");
        let port = self.port.to_string();
        let login = ["--host", socket, "--port", &port, "--username", "owner", "--dbname", database];
        let manner = ["--no-psqlrc", "--tuples-only", "--no-align", "--set", "ON_ERROR_STOP=1"];
        let command = &mut Command::new(self.programs.join("psql"));
        command.args(login).args(manner).args(arguments).output().expect("psql starts")
    }

    /// Restarts the cluster as a crash would; returns once it accepts connections again.
    pub fn crash(&self) {
        self.control(&["restart", "--mode", "immediate", "--wait"]);
    }

    /// Stops the cluster as a crash would.
    pub fn stop(&self) {
        self.control(&["stop", "--mode", "immediate"]);
    }

    /// Starts it again; returns once it accepts connections.
    pub fn go_on(&self) {
        self.control(&["start", "--wait"]);
    }

    fn control(&self, action: &[&str]) {
        let log = self.folder.path().join("log");
        let place = ["--pgdata", &self.data(), "--log", log.to_str().expect("text"), "--silent"];
        let output = self.run("pg_ctl", &[&place, action].concat());
        assert!(output.status.success(), "{action:?}: {}", fs::read_to_string(log).unwrap_or_default());
    }

    fn data(&self) -> String {
        self.folder.path().join("data").to_str().expect("text").to_owned()
    }

    /// Postgres refuses to run as root.
    fn run(&self, program: &str, arguments: &[&str]) -> Output {
        let program = self.programs.join(program);
        let mut command = if is_root() {
            let mut command = Command::new("setpriv");
            command.args(["--reuid=postgres", "--regid=postgres", "--init-groups"]).arg(program);
            command
        } else {
            Command::new(program)
        };
        // A server keeps what it inherits: it must not hold the pipes of this process open.
        let said = self.folder.path().join("said");
        let file = |path: &Path| fs::File::create(path).expect("a file");
        let status = command
            .args(arguments)
            .current_dir("/")
            .stdout(file(&said))
            .stderr(file(&said))
            .status()
            .expect("the program starts");
        Output { status, stdout: Vec::new(), stderr: fs::read(said).unwrap_or_default() }
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = self.run("pg_ctl", &["--pgdata", &self.data(), "--mode", "immediate", "--silent", "stop"]);
    }
}

fn is_root() -> bool {
    fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0)
}

/// Where the programs of the newest Postgres are; Debian keeps them off the path.
fn programs() -> Option<PathBuf> {
    let versions = fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten();
    let mut folders: Vec<(u32, PathBuf)> = versions
        .filter_map(|entry| Some((entry.file_name().to_str()?.parse().ok()?, entry.path().join("bin"))))
        .collect();
    folders.sort();
    let on_path = std::env::var_os("PATH").map(|path| std::env::split_paths(&path).collect::<Vec<_>>());
    let all = folders.into_iter().rev().map(|(_, folder)| folder).chain(on_path.into_iter().flatten());
    all.into_iter().find(|folder| folder.join("initdb").exists())
}
