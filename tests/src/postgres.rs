//! Postgres for tests: throwaway clusters, and a fresh database for each test.
//!
//! `ACTUARY_TEST_POSTGRES` may name a running cluster by the URL of a superuser; whoever started it ends it.
//! Otherwise the processes of one target folder share one that the first of them starts. It is ended some
//! seconds after the last of them has, however that ended: a watcher waits for a lock that they hold.

use std::{
    fs::{self, File},
    hash::{DefaultHasher, Hash, Hasher},
    io::Write,
    net::TcpListener,
    os::unix::process::CommandExt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
    time::{SystemTime, UNIX_EPOCH},
};

use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection};

/// Names a running cluster.
pub const VARIABLE: &str = "ACTUARY_TEST_POSTGRES";
/// Owns the schema of test databases.
const OWNER: &str = "actuary_test_owner";
/// As whom the service logs in to test databases.
const SERVICE: &str = "actuary_test_service";
/// How long a shared cluster outlives the last process that used it, in seconds.
const GRACE_S: u32 = 10;

/// A database of its own, removed when dropped.
pub struct TestDatabase {
    name: String,
    cluster: String,
}

impl TestDatabase {
    /// A copy of a database that `migrate` was run on, given the URL of its owner and the name of the role that
    /// will serve it. `migrate` runs once for all tests of a binary. Without Postgres there is none, and it is
    /// said how to install it.
    pub async fn create(migrate: impl AsyncFnOnce(&str, &str)) -> Option<Self> {
        let cluster = shared_cluster()?;
        let template = template(cluster, migrate).await;
        let database = Self { name: fresh_name(), cluster: cluster.to_owned() };
        execute(cluster, format!("create database {} template {template} owner {OWNER}", database.name)).await;
        Some(database)
    }

    /// A database without a schema.
    pub async fn create_empty() -> Option<Self> {
        let cluster = shared_cluster()?;
        prepare_roles(cluster).await;
        let database = Self { name: fresh_name(), cluster: cluster.to_owned() };
        execute(cluster, format!("create database {} template template0 owner {OWNER}", database.name)).await;
        Some(database)
    }

    /// As a superuser.
    pub fn superuser_url(&self) -> String {
        database_url(&self.cluster, &self.name, None)
    }

    /// As the role that owns the schema.
    pub fn owner_url(&self) -> String {
        database_url(&self.cluster, &self.name, Some(OWNER))
    }

    /// As the role that serves.
    pub fn service_url(&self) -> String {
        database_url(&self.cluster, &self.name, Some(SERVICE))
    }

    /// Name of the role that serves.
    pub fn service_role(&self) -> &'static str {
        SERVICE
    }
}

impl Drop for TestDatabase {
    fn drop(&mut self) {
        let (cluster, name) = (self.cluster.clone(), self.name.clone());
        let removal = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
            runtime.block_on(async {
                // A cluster that is already gone took the database with it.
                let Ok(mut connection) = PgConnection::connect(&cluster).await else { return };
                let sql = format!("drop database if exists {name} with (force)");
                let _ = connection.execute(AssertSqlSafe(sql)).await;
            });
        });
        let _ = removal.join();
    }
}

/// The URL of a database of a cluster, as another role or as the superuser.
fn database_url(cluster: &str, name: &str, role: Option<&str>) -> String {
    let (scheme, rest) = cluster.split_once("://").expect("a URL");
    let (authority, _) = rest.split_once('/').unwrap_or((rest, ""));
    match role {
        None => format!("{scheme}://{authority}/{name}"),
        Some(role) => {
            let host = authority.rsplit_once('@').map_or(authority, |(_, host)| host);
            format!("{scheme}://{role}:{role}@{host}/{name}")
        }
    }
}

fn fresh_name() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("test_{}_{}", std::process::id(), since.as_nanos())
}

async fn execute(url: &str, sql: String) {
    let mut connection = PgConnection::connect(url).await.unwrap_or_else(|error| panic!("{url}: {error}"));
    connection.execute(AssertSqlSafe(sql.as_str())).await.unwrap_or_else(|error| panic!("{sql}: {error}"));
    connection.close().await.expect("the connection closes");
}

/// Makes the roles of test databases.
async fn prepare_roles(cluster: &str) {
    let lock = lock_file(&format!("roles of {cluster}"));
    lock.lock().expect("the lock is free at last");
    for (role, rights) in [(OWNER, "createrole"), (SERVICE, "")] {
        let sql = format!(
            "do $$ begin if not exists (select from pg_roles where rolname = '{role}')
             then create role {role} login {rights} password '{role}'; end if; end $$"
        );
        execute(cluster, sql).await;
    }
}

/// The database that those of this binary's tests are copies of.
async fn template(cluster: &str, migrate: impl AsyncFnOnce(&str, &str)) -> String {
    prepare_roles(cluster).await;
    let binary = std::env::current_exe().expect("a test has a path");
    let built = fs::metadata(&binary).and_then(|about| about.modified()).expect("a test was built");
    let name = format!("template_{:016x}", hash(&(&binary, built)));
    let lock = lock_file(&format!("{name} of {cluster}"));
    lock.lock().expect("the lock is free at last");
    let mut connection = PgConnection::connect(cluster).await.unwrap_or_else(|error| panic!("{cluster}: {error}"));
    let known: bool = sqlx::query_scalar("select exists (select from pg_database where datname = $1)")
        .bind(&name)
        .fetch_one(&mut connection)
        .await
        .expect("the cluster answers");
    if !known {
        // What a killed process left half done is not taken for done: it is named at the end.
        let draft = format!("{}_draft", fresh_name());
        execute(cluster, format!("create database {draft} template template0 owner {OWNER}")).await;
        migrate(&database_url(cluster, &draft, Some(OWNER)), SERVICE).await;
        execute(cluster, format!("alter database {draft} rename to {name}")).await;
    }
    name
}

fn hash(of: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    of.hash(&mut hasher);
    hasher.finish()
}

/// A file whose lock stands for a name, for all processes of the machine.
fn lock_file(name: &str) -> File {
    File::create(lock_path(name)).expect("a temporary file")
}

fn lock_path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("actuary-test-{:016x}.lock", hash(&name)))
}

/// The URL of the cluster that this process shares with others.
fn shared_cluster() -> Option<&'static str> {
    static SHARED: OnceLock<Option<(String, Option<File>)>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| {
        if let Some(url) = std::env::var(VARIABLE).ok().filter(|url| !url.is_empty()) {
            return Some((url, None));
        }
        let programs = Programs::find()?;
        let place = std::env::current_exe().expect("a test has a path").parent().map(Path::to_owned);
        let folder = std::env::temp_dir().join(format!("actuary-test-postgres-{:016x}", hash(&place)));
        let (url, in_use) = programs.shared(&folder);
        Some((url, Some(in_use)))
    });
    shared.as_ref().map(|(url, _)| url.as_str())
}

/// Where Postgres's own programs are, pg_dump among them; Debian keeps them off the path.
pub fn programs() -> Option<PathBuf> {
    Programs::find().map(|programs| programs.folder)
}

/// A cluster of one test, which may stop it and start it again. It ends with its process.
pub struct Cluster {
    programs: Programs,
    folder: PathBuf,
    port: u16,
    settings: Vec<String>,
    _in_use: File,
}

impl Cluster {
    /// Starts one; without Postgres there is none, and it is said how to install it.
    pub fn start() -> Option<Self> {
        Self::start_with(&[])
    }

    /// Starts one with settings, each `name=value`.
    pub fn start_with(settings: &[&str]) -> Option<Self> {
        let settings: Vec<_> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        let programs = Programs::find()?;
        let folder = std::env::temp_dir().join(format!("actuary-{}", fresh_name()));
        let in_use = lock_file(&folder.display().to_string());
        in_use.lock().expect("the lock is new");
        let port = programs.create(&folder, &settings);
        programs.watch(&folder, 0);
        Some(Self { programs, folder, port, settings, _in_use: in_use })
    }

    /// The URL of its superuser.
    pub fn url(&self) -> String {
        url(self.port)
    }

    /// An empty database in it, with the roles of test databases.
    pub async fn database(&self) -> TestDatabase {
        let cluster = self.url();
        prepare_roles(&cluster).await;
        let database = TestDatabase { name: fresh_name(), cluster };
        let sql = format!("create database {} template template0 owner {OWNER}", database.name);
        execute(&database.cluster, sql).await;
        database
    }

    /// Ends it as a crash of the server would.
    pub fn crash(&self) {
        self.programs.control(&self.folder, &["stop", "--mode", "immediate"]);
    }

    /// Starts it again; returns once it accepts connections.
    pub fn resume(&self) {
        self.programs.start(&self.folder, self.port, &self.settings);
    }

    /// The folder of its files.
    pub fn data(&self) -> PathBuf {
        data(&self.folder)
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let mut stop = self.programs.command("pg_ctl");
        let _ = stop.args(["stop", "--silent", "--mode", "immediate", "--pgdata"]).arg(data(&self.folder)).output();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn url(port: u16) -> String {
    format!("postgres://postgres@127.0.0.1:{port}/postgres")
}

fn data(folder: &Path) -> PathBuf {
    folder.join("data")
}

/// Where the programs of Postgres are, and how to run them: it refuses to run as root.
struct Programs {
    folder: PathBuf,
    as_postgres: bool,
}

impl Programs {
    /// Those of the newest version that is installed.
    fn find() -> Option<Self> {
        let versions = fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten();
        let mut versions: Vec<_> = versions.map(|version| version.path().join("bin")).collect();
        versions.sort_by_key(|path| version_of(path));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let found = versions
            .into_iter()
            .rev()
            .chain(std::env::split_paths(&path))
            .find(|bin| ["initdb", "pg_ctl"].iter().all(|program| bin.join(program).exists()));
        if found.is_none() {
            // Not by println, which is captured while a test runs.
            let _ = writeln!(std::io::stdout(), "skipped: no Postgres: apt-get install postgresql");
        }
        let user = Command::new("id").arg("-u").output().expect("id runs").stdout;
        found.map(|folder| Self { folder, as_postgres: user == b"0\n" })
    }

    fn command(&self, program: &str) -> Command {
        let program = self.folder.join(program);
        let mut command = if self.as_postgres {
            let mut command = Command::new("setpriv");
            command.args(["--reuid=postgres", "--regid=postgres", "--init-groups"]).arg(program);
            command
        } else {
            Command::new(program)
        };
        // It outlives the test, and must not keep its output open.
        command.current_dir("/").process_group(0).stdin(Stdio::null());
        command
    }

    /// The cluster in a folder that processes share, and the lock that says that this one uses it.
    fn shared(&self, folder: &Path) -> (String, File) {
        let in_use = lock_file(&folder.display().to_string());
        in_use.lock_shared().expect("the lock is free at last");
        let starting = lock_file(&format!("start of {}", folder.display()));
        starting.lock().expect("the lock is free at last");
        let port = fs::read_to_string(folder.join("port")).ok().and_then(|port| port.parse().ok());
        let port: u16 = port.unwrap_or_else(|| {
            let _ = fs::remove_dir_all(folder);
            let port = self.create(folder, &[]);
            self.watch(folder, GRACE_S);
            let mut file = File::create(folder.join("port")).expect("the folder is there");
            write!(file, "{port}").expect("the port is written");
            port
        });
        (url(port), in_use)
    }

    /// Makes a cluster in a new folder and starts it on a free port.
    fn create(&self, folder: &Path, settings: &[String]) -> u16 {
        let mut make = Command::new("install");
        make.args(["-d", "-m", "755"]);
        if self.as_postgres {
            make.args(["-o", "postgres", "-g", "postgres"]);
        }
        run(make.arg(folder));
        let initdb = &mut self.command("initdb");
        run(initdb
            .args(["--username=postgres", "--auth=trust", "--encoding=UTF8", "--locale=C", "--no-sync", "--pgdata"])
            .arg(data(folder)));
        let port = TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port();
        self.start(folder, port, settings);
        port
    }

    fn start(&self, folder: &Path, port: u16, settings: &[String]) {
        let mut options =
            format!("-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c max_connections=300");
        settings.iter().for_each(|setting| options += &format!(" -c {setting}"));
        let log = folder.join("log");
        let log = log.to_str().expect("a temporary path is text");
        self.control(folder, &["start", "--wait", "--log", log, "--options", &options]);
    }

    fn control(&self, folder: &Path, arguments: &[&str]) {
        run(self.command("pg_ctl").args(arguments).args(["--silent", "--pgdata"]).arg(data(folder)));
    }

    /// Lets a cluster end, and its folder go, some seconds after nobody holds its lock any longer.
    #[expect(clippy::zombie_processes, reason = "the watcher outlives this process")]
    fn watch(&self, folder: &Path, grace_s: u32) {
        const WATCH: &str = r#"
            lock=$1 grace=$2 folder=$3; shift 3
            while :; do
              flock -x "$lock" true
              sleep "$grace"
              [ -d "$folder" ] || exit 0
              flock -n -x "$lock" sh -c 'folder=$1; shift; "$@"; rm -rf "$folder"' end "$folder" "$@" && exit 0
            done"#;
        let mut stop = self.command("pg_ctl");
        stop.args(["stop", "--silent", "--mode", "immediate", "--pgdata"]).arg(data(folder));
        let mut watcher = Command::new("sh");
        watcher.args(["-c", WATCH, "watcher"]).arg(lock_path(&folder.display().to_string())).arg(grace_s.to_string());
        watcher.arg(folder).arg(stop.get_program()).args(stop.get_args());
        watcher.current_dir("/").process_group(0);
        watcher.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        watcher.spawn().expect("the watcher starts");
    }
}

/// The number that names a version's folder.
fn version_of(bin: &Path) -> u32 {
    let name = bin.parent().and_then(Path::file_name).and_then(|name| name.to_str());
    name.and_then(|name| name.parse().ok()).unwrap_or(0)
}

fn run(command: &mut Command) {
    let done = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(done.status.success(), "{command:?}: {}", String::from_utf8_lossy(&done.stderr));
}
