//! Tokens by the command line, beside a running service; their secrets are said once and nowhere else.

use std::{
    fs::{self, File},
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Output, Stdio},
    time::Duration,
};

use serde_json::Value;

/// A service that logs all that it can log to a file.
struct Talkative {
    child: Child,
    stdout: BufReader<ChildStdout>,
    log: PathBuf,
    url: String,
}

impl Talkative {
    fn start(database: &str, log: PathBuf) -> Self {
        let mut child = Command::new(tests::binary())
            .args(["serve", "--database-url", database, "--port", "0"])
            .env("RUST_LOG", "trace")
            .stdout(Stdio::piped())
            .stderr(File::create(&log).unwrap())
            .spawn()
            .unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        stdout.read_line(&mut line).unwrap();
        let url = line.trim().split_once(" on ").expect("the address").1.to_owned();
        Self { child, stdout, log, url }
    }

    /// Kills it; everything that it has said.
    fn end(mut self) -> String {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
        let mut said = String::new();
        while self.stdout.read_line(&mut said).unwrap() > 0 {}
        let log = fs::read_to_string(&self.log).unwrap();
        assert!(log.len() > 1000, "the log is on");
        said + &log
    }
}

fn actuary(arguments: &[&str], database: &str) -> Output {
    let output = tests::run(&[arguments, &["--database-url", database]].concat());
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{arguments:?}: {output:?}");
    output
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A new token, and its id.
fn create(arguments: &[&str], database: &str) -> (String, String) {
    let output = actuary(&[&["token", "create"], arguments].concat(), database);
    assert!(output.status.success(), "{output:?}");
    let token = out(&output).strip_suffix('\n').expect("one line").to_owned();
    let (id, secret) = token.split_once('.').expect("id.secret");
    assert_eq!((id.len(), secret.len()), (16, 64), "{token}");
    assert!(err(&output).contains(id) && !err(&output).contains(secret), "{}", err(&output));
    (id.to_owned(), token)
}

fn list(database: &str) -> Vec<Value> {
    let output = actuary(&["token", "list", "--json"], database);
    assert!(output.status.success(), "{output:?}");
    serde_json::from_str(&out(&output)).unwrap()
}

/// What a file and its companions hold.
fn bytes(database: &Path) -> Vec<u8> {
    let folder = fs::read_dir(database.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
    let name = database.file_name().unwrap().to_string_lossy().into_owned();
    let own = folder.filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(&name));
    own.flat_map(|path| fs::read(path).unwrap()).collect()
}

fn holds(haystack: &[u8], needle: &[u8]) -> bool {
    haystack.windows(needle.len()).any(|window| window == needle)
}

#[tokio::test]
async fn tokens_come_and_go_beside_a_service_and_their_secrets_are_said_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fleet.sqlite");
    let database = format!("sqlite:{}", path.display());
    let service = Talkative::start(&database, folder.path().join("log"));

    let (admin, admin_token) = create(&["--scope", "admin", "--name", "the first"], &database);
    let aircraft = ["--scope", "aircraft", "--tail", "EC-MXA", "--expires", "90d"];
    let (aircraft, aircraft_token) = create(&aircraft, &database);
    let listed = list(&database);
    assert_eq!(listed.len(), 2);
    let (first, second) = (&listed[0], &listed[1]);
    assert_eq!(
        (&first["id"], &first["scope"], &first["name"]),
        (&admin.clone().into(), &"admin".into(), &"the first".into())
    );
    assert_eq!((&first["tail"], &first["expires_at"], &first["status"]), (&Value::Null, &Value::Null, &"valid".into()));
    assert_eq!((&second["id"], &second["tail"]), (&aircraft.clone().into(), &"EC-MXA".into()));
    assert!(second["expires_at"].is_string());

    // The service looks at tokens in all the ways that it may say something about.
    let http = tests::http();
    let wrong =
        format!("{}{}", &admin_token[..admin_token.len() - 1], if admin_token.ends_with('0') { '1' } else { '0' });
    for (token, path) in [
        (&admin_token, "/v1/tails"),
        (&aircraft_token, "/v1/tails"),
        (&aircraft_token, "/v1/models"),
        (&wrong, "/v1/tails"),
        (&admin_token, "/nowhere"),
    ] {
        let answer = http.get(format!("{}{path}", service.url)).bearer_auth(token).send().await.unwrap();
        assert!(answer.status().as_u16() < 500, "{path}: {}", answer.status());
        assert!(!answer.text().await.unwrap().contains(token.split_once('.').unwrap().1), "{path}");
    }
    let basic = http.get(format!("{}/v1/tails", service.url)).basic_auth(&admin, admin_token.split('.').nth(1));
    assert!(basic.send().await.unwrap().status().as_u16() < 500);

    let revoked = actuary(&["token", "revoke", &admin], &database);
    assert!(revoked.status.success() && err(&revoked).contains("1 of operator default"), "{revoked:?}");
    let again = actuary(&["token", "revoke", &admin], &database);
    assert!(again.status.success() && err(&again).contains("before"), "{again:?}");
    assert_eq!(list(&database)[0]["status"], "revoked");
    let table = out(&actuary(&["token", "list"], &database));
    assert!(table.lines().count() == 3 && table.contains("aircraft EC-MXA"), "{table}");

    let verified = actuary(&["verify", "--audit"], &database);
    assert!(verified.status.success(), "{verified:?}");
    assert!(out(&verified).contains("operator default: 3 records, the newest is "), "{}", out(&verified));

    tokio::time::sleep(Duration::from_millis(100)).await;
    let said = service.end() + &table + &out(&verified);
    let kept = bytes(&path);
    for token in [admin_token, aircraft_token] {
        let (id, secret) = token.split_once('.').unwrap();
        assert!(holds(&kept, id.as_bytes()), "the files are looked at");
        for at in 0..secret.len() - 16 {
            assert!(!said.contains(&secret[at..at + 16]), "the secret of {id} was said");
            assert!(!holds(&kept, &secret.as_bytes()[at..at + 16]), "the secret of {id} was kept");
        }
    }
}

#[test]
fn the_first_token_may_come_before_the_first_service() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let listed = actuary(&["token", "list"], &database);
    assert_eq!(listed.status.code(), Some(2), "{listed:?}");
    create(&["--scope", "admin"], &database);
    assert_eq!(list(&database).len(), 1);
}

#[test]
fn what_would_make_no_token_is_refused_without_repeating_a_secret() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let (id, token) = create(&["--scope", "ops"], &database);
    let unknown = "0123456789abcdef";
    for (arguments, words) in [
        (vec!["create", "--scope", "root"], "aircraft"),
        (vec!["create", "--scope", "aircraft"], "tail"),
        (vec!["create", "--scope", "ops", "--tail", "EC-MXA"], "EC-MXA"),
        (vec!["create", "--scope", "aircraft", "--tail", "ec-mxa"], "ec-mxa"),
        (vec!["create", "--scope", "ops", "--expires", "2020-01-01"], "2020-01-01"),
        (vec!["create", "--scope", "ops", "--expires", "soon"], "soon"),
        (vec!["create", "--scope", "ops", "--operator", "A B"], "A B"),
        (vec!["revoke", unknown], unknown),
        (vec!["revoke", &token], "id"),
        (vec!["revoke", "nonsense"], "id"),
    ] {
        let refused = actuary(&[&["token"], &arguments[..]].concat(), &database);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {refused:?}");
        let said = err(&refused);
        assert!(said.lines().next().is_some_and(|line| line.contains(words)), "{arguments:?}: {said}");
        assert!(!said.contains(token.split_once('.').unwrap().1), "{said}");
        assert!(refused.stdout.is_empty());
    }
    assert_eq!(list(&database).len(), 1);
    assert_eq!(list(&database)[0]["id"], id);
}

#[test]
fn an_audit_log_that_was_altered_fails_verification_at_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fleet.sqlite");
    let database = format!("sqlite:{}", path.display());
    for _ in 0..3 {
        create(&["--scope", "ops", "--name", "someone"], &database);
    }
    assert_eq!(actuary(&["verify"], &database).status.code(), Some(0));
    alter(&path, r#""name":"someone""#, r#""name":"nobody!""#);
    for arguments in [&["verify", "--audit"][..], &["verify"]] {
        let refused = actuary(arguments, &database);
        assert_eq!(refused.status.code(), Some(1), "{refused:?}");
        assert!(out(&refused).contains("audit log of operator default: record 1: "), "{}", out(&refused));
    }
}

/// Changes a text in a database file, everywhere, by one of the same length.
fn alter(path: &Path, from: &str, to: &str) {
    assert_eq!(from.len(), to.len());
    let mut bytes = fs::read(path).unwrap();
    let places: Vec<_> = (0..bytes.len() - from.len()).filter(|&at| bytes[at..].starts_with(from.as_bytes())).collect();
    assert!(!places.is_empty());
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    }
    fs::write(path, bytes).unwrap();
}
