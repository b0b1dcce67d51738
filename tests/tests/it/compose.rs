//! The processes of `docker-compose.yml`, started by hand as that file says: the same commands, environment, secrets and
//! order, against a real Postgres; then traffic, and processes killed at random.
//!
//! Not covered for want of a container engine: the image, its file system and its user.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use numerics::Stream;
use serde::Deserialize;
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection};
use tests::{Service, binary, postgres::Cluster};

#[derive(Deserialize)]
struct Compose {
    services: HashMap<String, Described>,
    secrets: HashMap<String, Secret>,
}

#[derive(Deserialize)]
struct Described {
    #[serde(default)]
    command: Vec<String>,
    #[serde(default)]
    environment: HashMap<String, String>,
    #[serde(default)]
    secrets: Vec<String>,
    #[serde(default)]
    read_only: bool,
    #[serde(default)]
    cap_drop: Vec<String>,
    #[serde(default)]
    security_opt: Vec<String>,
    healthcheck: Option<Healthcheck>,
    deploy: Option<Deploy>,
}

#[derive(Deserialize)]
struct Healthcheck {
    test: Vec<String>,
}

#[derive(Deserialize)]
struct Deploy {
    replicas: usize,
}

#[derive(Deserialize)]
struct Secret {
    file: PathBuf,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

/// The file, its variables replaced by their defaults.
fn compose() -> Compose {
    let text = fs::read_to_string(root().join("docker-compose.yml")).unwrap();
    let mut parts = text.split("${");
    let mut whole = parts.next().unwrap().to_owned();
    for part in parts {
        let (variable, rest) = part.split_once('}').expect("a variable ends");
        whole += variable.split_once(":-").expect("a variable has a default").1;
        whole += rest;
    }
    serde_saphyr::from_str(&whole).unwrap()
}

/// A machine on which containers are processes: where their Postgres and their secrets are.
struct Machine {
    compose: Compose,
    postgres: String,
    secrets: PathBuf,
}

impl Machine {
    /// A process of a service, at a port of its own for its probes.
    fn command(&self, service: &str, arguments: &[&str]) -> Command {
        let described = &self.compose.services[service];
        let mut command = Command::new(binary());
        for (name, value) in &described.environment {
            let value = value.replace("postgres:5432", &self.postgres);
            command.env(name, value.replace("/run/secrets", self.secrets.to_str().expect("text")));
        }
        // The one thing that differs: nobody waits for two minutes until the leases of killed workers end.
        command.env("ACTUARY_LEASE_SECONDS", "10").args(arguments);
        command
    }

    /// Starts one as the file says; the ports inside a container are its own, so here they are any free ones.
    fn start(&self, service: &str) -> Service {
        let described = &self.compose.services[service];
        let replace = |argument: &String| match argument.as_str() {
            "0.0.0.0:8080" => "0.0.0.0:0".to_owned(),
            "9090" => "0".to_owned(),
            other => other.to_owned(),
        };
        let arguments: Vec<String> = described.command.iter().map(replace).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        for _ in 0..20 {
            if let Some(mut service) = Service::spawn(&mut self.command(service, &arguments)) {
                service.url = service.url.replace("0.0.0.0", "127.0.0.1");
                return service;
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        panic!("{service} does not start");
    }

    fn replicas(&self, service: &str) -> usize {
        self.compose.services[service].deploy.as_ref().map_or(1, |deploy| deploy.replicas)
    }
}

#[test]
fn nothing_in_the_compose_file_may_more_than_it_needs() {
    let compose = compose();
    for (name, service) in &compose.services {
        assert!(service.read_only, "{name}: its file system can be written");
        assert_eq!(service.cap_drop, ["ALL"], "{name}");
        assert_eq!(service.security_opt, ["no-new-privileges:true"], "{name}");
        assert!(name == "migrate" || service.healthcheck.is_some(), "{name} has no health check");
        for value in service.environment.values() {
            assert!(
                !value.contains("://")
                    || !value.split('@').next().unwrap().trim_start_matches("postgres://").contains(':'),
                "{name}: a password is in {value}"
            );
        }
    }
    let secret = |service: &str| &compose.services[service].secrets;
    assert_eq!(secret("server"), secret("worker"));
    assert!(!secret("server").contains(&"owner_password".to_owned()), "servers need not know the owner's password");
    assert!(compose.secrets.values().all(|secret| secret.file.starts_with("./secrets")));
    let ignored = fs::read_to_string(root().join(".gitignore")).unwrap();
    assert!(ignored.lines().any(|line| line == "secrets/"), "secrets could be committed");
    let check = &compose.services["server"].healthcheck.as_ref().unwrap().test;
    let dockerfile = fs::read_to_string(root().join("Dockerfile")).unwrap();
    assert!(dockerfile.contains(&format!("ENTRYPOINT [\"{}\"]", check[1])), "the check runs the image's binary");
    assert!(dockerfile.contains("\nUSER 65532"), "the image runs as nobody in particular");
}

/// As `deploy/roles.sql` does it with psql, and with passwords that are asked for.
async fn prepare(cluster: &Cluster, machine: &Machine) {
    let execute = async |url: &str, sql: String| {
        let mut connection = PgConnection::connect(url).await.unwrap();
        connection.execute(AssertSqlSafe(sql.as_str())).await.unwrap_or_else(|error| panic!("{sql}: {error}"));
    };
    let secret = |name: &str| fs::read_to_string(machine.secrets.join(name)).unwrap();
    let owner = format!("create role owner superuser login password '{}'", secret("owner_password"));
    execute(&cluster.url(), owner).await;
    execute(&cluster.url(), "create database actuary owner owner".to_owned()).await;
    let roles = fs::read_to_string(root().join("deploy/roles.sql")).unwrap();
    let sql: Vec<&str> = roles.lines().filter(|line| !line.starts_with('\\') && !line.starts_with("--")).collect();
    let sql = sql.join("\n").replace(":'password'", &format!("'{}'", secret("service_password")));
    execute(&cluster.url(), sql).await;
    let rules = "copy (select 'host all postgres 127.0.0.1/32 trust'
        union all select 'host all all 127.0.0.1/32 scram-sha-256') to '";
    let mut connection = PgConnection::connect(&cluster.url()).await.unwrap();
    let file: String = sqlx::query_scalar("show hba_file").fetch_one(&mut connection).await.unwrap();
    execute(&cluster.url(), format!("{rules}{file}'")).await;
    execute(&cluster.url(), "select pg_reload_conf()".to_owned()).await;
}

#[tokio::test]
async fn slow_what_the_compose_file_starts_loses_nothing_when_processes_are_killed() {
    let Some(cluster) = Cluster::start() else { return };
    let secrets = tempfile::tempdir().unwrap();
    for name in ["owner_password", "service_password"] {
        fs::write(secrets.path().join(name), format!("secret of {name}, & more?")).unwrap();
    }
    let address = cluster.url().split(['@', '/']).nth(3).expect("host and port").to_owned();
    let machine = Machine { compose: compose(), postgres: address, secrets: secrets.path().to_owned() };
    prepare(&cluster, &machine).await;

    let migrate = &machine.compose.services["migrate"].command;
    let migrate: Vec<&str> = migrate.iter().map(String::as_str).collect();
    for _ in 0..2 {
        let migrated = machine.command("migrate", &migrate).output().unwrap();
        assert!(migrated.status.success(), "{}", String::from_utf8_lossy(&migrated.stderr));
    }
    let create = ["token", "create", "--scope", "admin", "--name", "first"];
    let created = machine.command("server", &create).output().unwrap();
    assert!(created.status.success(), "{}", String::from_utf8_lossy(&created.stderr));
    let token = String::from_utf8(created.stdout).unwrap().trim().to_owned();
    let mut processes: Vec<(&str, Service)> = Vec::new();
    for service in ["server", "worker"] {
        processes.extend((0..machine.replicas(service)).map(|_| (service, machine.start(service))));
    }
    assert_eq!(processes.iter().filter(|(service, _)| *service == "server").count(), 2);
    assert_eq!(processes.iter().filter(|(service, _)| *service == "worker").count(), 3);

    let ports: Vec<u16> = processes[..2].iter().map(|(_, service)| service.port()).collect();
    let fleet = |server: usize| {
        let mut command = Command::new(binary());
        let url = format!("http://127.0.0.1:{}", ports[server]);
        command.args(["simulate", "fleet", "--url", &url, "--physics", "closed-form", "--tails", "2"]);
        command.args(["--hours", "40", "--start", "2026-01-01T00:00:00Z", "--seed", "5"]);
        command.env("ACTUARY_TOKEN", &token);
        command
    };
    // The same fleet through both servers at once: whoever comes second is a duplicate.
    let flying = [0, 1].map(|server| fleet(server).spawn().unwrap());
    let mut stream = Stream::new(3, &["compose"]);
    for _ in 0..8 {
        tokio::time::sleep(Duration::from_millis(600)).await;
        // Only workers: the address of a server outlives it in a container, and chaos tests kill servers.
        let number = 2 + ((stream.uniform() * 3.0) as usize).min(2);
        let (service, old) = processes.remove(number);
        old.kill();
        processes.insert(number, (service, machine.start(service)));
    }
    for flight in flying {
        let flown = flight.wait_with_output().unwrap();
        assert!(flown.status.success());
    }
    let again = fleet(1).output().unwrap();
    let words = String::from_utf8(again.stdout).unwrap();
    assert!(words.starts_with("0 uploads accepted"), "everything was there already: {words}");

    let mut database =
        PgConnection::connect(&format!("{}actuary", cluster.url().trim_end_matches("postgres"))).await.unwrap();
    let mut count =
        async |sql: &'static str| -> i64 { sqlx::query_scalar(sql).fetch_one(&mut database).await.unwrap() };
    while count("select count(*) from inbox").await > 0 {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let uploads = count("select count(*) from uploads").await;
    assert!(uploads > 0);
    assert_eq!(count("select count(*) from upload_keys").await, uploads);
    assert_eq!(
        count("select (select count(*) from estimates) + (select count(*) from set_aside)").await,
        uploads,
        "every upload was processed once"
    );
}
