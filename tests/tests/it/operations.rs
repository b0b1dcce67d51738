//! Models in service, backups and rebuilds, by the binary beside a running service.
//!
//! Failures here: files that are no bundles; SIGKILL of the service after a backup that was taken under
//! traffic, on both databases; a damaged result. Not covered: a disk that is full.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::Duration,
};

use serde_json::{Value, json};
use tests::{
    Service, binary, items,
    postgres::{TestDatabase, programs},
};

/// Runs a command on a database; what it said, and its exit code.
fn actuary(database: &Path, arguments: &[&str]) -> Output {
    Command::new(binary()).args(arguments).args(["--database-url", &url(database)]).output().expect("the binary starts")
}

fn url(database: &Path) -> String {
    format!("sqlite:{}", database.display())
}

/// What a command says that succeeds.
fn said(database: &Path, arguments: &[&str]) -> String {
    let output = actuary(database, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The one line in which a command refuses.
fn refused(database: &Path, arguments: &[&str], code: i32) -> String {
    let output = actuary(database, arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    assert_eq!(errors.lines().count(), 1, "{arguments:?}: {errors}");
    errors
}

/// Uploads for a component again, as of its newest data, at the points of a mask.
async fn upload_at_mask(service: &Service, rul: &Value, mask: &Value) {
    let samples = vec![0.0752; mask["points"].as_array().unwrap().len()];
    let upload = json!({
        "upload_id": "old-mask", "position": rul["position"], "part_number": rul["part_number"],
        "serial_number": rul["serial_number"], "flight_hours": rul["as_of"]["flight_hours"],
        "recorded_at": rul["as_of"]["recorded_at"], "mask_id": mask["mask_id"], "samples": samples,
    });
    let url = format!("{}/v1/tails/{}/uploads", service.url, rul["tail"].as_str().unwrap());
    let answer = tests::http().post(url).json(&upload).send().await.unwrap();
    assert_eq!(answer.status().as_u16(), 202, "{}", answer.text().await.unwrap());
}

fn fleet(url: &str, hours: u32) -> Command {
    let mut command = Command::new(binary());
    command.args(["simulate", "fleet", "--url", url, "--physics", "closed-form", "--tails", "2", "--seed", "3"]);
    command.args(["--hours", &hours.to_string(), "--start", "2026-01-01T00:00:00Z"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn fly(url: &str, hours: u32) {
    let flown = fleet(url, hours).output().unwrap();
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
}

/// The bundle that ships, with one thing changed.
fn altered(folder: &Path, name: &str, alter: impl FnOnce(&mut Value)) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut bundle: Value = serde_json::from_slice(&fs::read(root.join("models/default.json")).unwrap()).unwrap();
    alter(&mut bundle);
    let file = folder.join(name);
    fs::write(&file, serde_json::to_vec(&bundle).unwrap()).unwrap();
    file
}

/// A bundle that publishes only the second mask of the one that ships, and reads samples by another constant.
fn second(folder: &Path) -> PathBuf {
    altered(folder, "second.json", |bundle| {
        bundle["masks"].as_array_mut().unwrap().remove(0);
        bundle["motor"]["k"] = json!(0.0751);
    })
}

fn models(database: &Path) -> Vec<Value> {
    let listed: Value = serde_json::from_str(&said(database, &["model", "list", "--json"])).unwrap();
    listed.as_array().unwrap().clone()
}

async fn until_no_life_waits(database: &Path) {
    for _ in 0..600 {
        if models(database).iter().all(|model| model["lives_waiting"] == 0) {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("generations are never made: {:?}", models(database));
}

async fn until_a_tail_is_known(service: &Service) {
    while items(service.get("/v1/tails").await).is_empty() {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// What must be the same whatever happened on the way; times of reading are not.
fn numbers(fleet: &[Value]) -> Vec<Value> {
    let kept = ["serial_number", "as_of", "rul_fh", "probability_of_failure", "fault_vector", "model"];
    fleet.iter().map(|rul| kept.iter().map(|name| rul[*name].clone()).collect()).collect()
}

fn digest(said: &str) -> &str {
    said.lines().find_map(|line| line.strip_prefix("digest ")).expect("a digest")
}

#[tokio::test]
async fn a_file_that_is_no_bundle_is_refused_in_one_line_and_nothing_of_it_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("fleet.sqlite");
    Service::start(&database, 0).kill();
    let before = models(&database);
    assert_eq!((before.len(), &before[0]["active"]), (1, &json!(true)));
    let text = folder.path().join("text.json");
    fs::write(&text, "no bundle").unwrap();
    let misfit = altered(folder.path(), "misfit.json", |bundle| {
        let mlp = bundle["with_load_ratio"]["mlp"].as_object_mut().unwrap();
        mlp.values_mut().find(|value| value.is_array()).unwrap().as_array_mut().unwrap().pop();
    });
    let unmeasured = altered(folder.path(), "unmeasured.json", |bundle| {
        bundle.as_object_mut().unwrap().remove("metrics");
    });
    let slipped = altered(folder.path(), "slipped.json", |bundle| bundle["prior"]["process_noise"] = json!(0.25));
    let few = altered(folder.path(), "few.json", |bundle| bundle["masks"][0]["bins"] = json!([3, 4]));
    for (file, words) in [
        (text, "not a model bundle"),
        (misfit, "#/with_load_ratio/mlp/"),
        (slipped, "#/prior/process_noise: 0.25 is outside 0.000001 to 0.01"),
        (unmeasured, "metrics"),
        (few, "2 points"),
        (folder.path().join("none.json"), "none.json"),
    ] {
        let line = refused(&database, &["model", "add", file.to_str().unwrap()], 2);
        assert!(line.contains(words), "{line}");
    }
    assert_eq!(models(&database), before);
    for (name, words) in [("0123456789abcdef", "there is none"), ("0123", "8 characters")] {
        assert!(refused(&database, &["model", "activate", name], 2).contains(words));
    }
}

#[tokio::test]
async fn slow_another_bundle_takes_over_beside_a_running_service_and_aircraft_keep_their_mask() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("fleet.sqlite");
    let service = Service::start(&database, 0);
    fly(&service.url, 30);
    let before = service.settled_fleet().await;
    let first = before[0]["model"].as_str().unwrap().to_owned();
    let serial = before[0]["serial_number"].as_str().unwrap().to_owned();
    let path = format!("/v1/components/EMA-48V/{serial}");
    let history = service.get(&format!("{path}/health")).await;

    let file = second(folder.path());
    said(&database, &["model", "add", file.to_str().unwrap()]);
    assert!(said(&database, &["model", "add", file.to_str().unwrap()]).contains("was there already"));
    let active =
        |models: Vec<Value>| -> Vec<bool> { models.iter().map(|model| model["active"].as_bool().unwrap()).collect() };
    assert_eq!(active(items(service.get("/v1/models").await)), [true, false]);
    let second = models(&database)[1]["hash"].as_str().unwrap().to_owned();
    assert_ne!(models(&database)[0]["mask_ids"][0], models(&database)[1]["mask_ids"][0]);

    said(&database, &["model", "activate", &second[..8], "--lives", "all"]);
    until_no_life_waits(&database).await;
    assert_eq!(active(items(service.get("/v1/models").await)), [false, true]);
    let after = service.settled_fleet().await;
    for (old, new) in before.iter().zip(&after) {
        assert_eq!((&old["generation"], &new["generation"]), (&json!(1), &json!(2)));
        assert_eq!((old["model"].as_str(), new["model"].as_str()), (Some(&*first), Some(&*second)));
        assert_eq!(old["as_of"], new["as_of"]);
        assert_ne!(old["fault_vector"], new["fault_vector"], "another bundle says something else");
    }

    let life = service.get(&path).await["lives"][0].clone();
    let states: Vec<_> = life["generations"].as_array().unwrap().iter().map(|one| one["state"].clone()).collect();
    assert_eq!(states, ["kept", "answers"], "{life}");
    assert_eq!(service.get(&format!("{path}/health?generation=1")).await["items"], history["items"]);
    assert_ne!(service.get(&format!("{path}/health")).await["items"], history["items"]);

    // The simulated aircraft fetch the mask of the active bundle; one that keeps the first bundle's, which the second
    // does not even publish, is understood, too.
    fly(&service.url, 40);
    let later = service.settled_fleet().await;
    assert!(later[0]["as_of"]["flight_hours"].as_f64() > after[0]["as_of"]["flight_hours"].as_f64());
    assert_ne!(later[0]["mask_id"], before[0]["mask_id"]);
    upload_at_mask(&service, &later[0], &service.get(&format!("/v1/models/{first}/mask")).await).await;
    let kept = service.settled_fleet().await;
    assert_eq!(service.get("/v1/uploads/old-mask").await["state"], "processed");
    assert_eq!(kept.len(), later.len());
    assert_eq!(items(service.get("/v1/uploads?state=set_aside").await).len(), 0);

    let port = service.port();
    service.kill();
    let service = Service::start(&database, port);
    assert_eq!(active(items(service.get("/v1/models").await)), [false, true], "a start undoes no activation");
    service.kill();
    assert!(said(&database, &["rebuild"]).contains("nothing was different"));
    assert!(said(&database, &["verify", "--digest"]).contains("rows match"));
}

#[tokio::test]
async fn slow_a_backup_taken_under_traffic_is_a_service_as_it_was_then() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("fleet.sqlite");
    let service = Service::start(&database, 0);
    let mut flying = fleet(&service.url, 60).spawn().unwrap();
    until_a_tail_is_known(&service).await;
    let backup = folder.path().join("moment.backup");
    let name = backup.to_str().unwrap();
    let taken = said(&database, &["backup", "--out", name]);
    assert!(flying.try_wait().unwrap().is_none(), "the fleet is still flying");
    assert!(refused(&database, &["backup", "--out", name], 2).contains("overwrites nothing"));
    assert!(flying.wait().unwrap().success());
    let expected = service.settled_fleet().await;
    service.kill();
    assert!(refused(&database, &["restore", "--from", name], 2).contains("overwrites nothing"));

    let restored = folder.path().join("restored.sqlite");
    let again = said(&restored, &["restore", "--from", name]);
    assert_eq!(digest(&again), digest(&taken));
    let names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert!(names.iter().all(|name| !name.to_string_lossy().starts_with(".actuary")), "{names:?}");

    let service = Service::start(&restored, 0);
    fly(&service.url, 60);
    assert_eq!(numbers(&service.settled_fleet().await), numbers(&expected));
    service.kill();
    let rebuilt = said(&restored, &["rebuild"]);
    assert!(rebuilt.contains("nothing was different"), "{rebuilt}");
    let digests = [&database, &restored].map(|one| tests::digest(&url(one)));
    assert_eq!(digests[0], digests[1]);
}

#[tokio::test]
async fn slow_a_backup_of_postgres_is_a_service_as_it_was_then() {
    let databases = [TestDatabase::create_empty().await, TestDatabase::create_empty().await];
    let [Some(database), Some(restored)] = databases else { return };
    let run = |url: &str, arguments: &[&str]| {
        let path = format!("{}:{}", programs().unwrap().display(), std::env::var("PATH").unwrap());
        let mut command = Command::new(binary());
        command.args(arguments).args(["--database-url", url]).env("PATH", path).output().unwrap()
    };
    let said = |url: &str, arguments: &[&str]| {
        let output = run(url, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let serve = |url: &str| {
        let mut command = Command::new(binary());
        // A restored database remembers the leases of the moment: they run out.
        Service::spawn(command.args(["serve", "--port", "0", "--lease-seconds", "3", "--database-url", url])).unwrap()
    };
    said(&database.owner_url(), &["migrate", "--service-role", database.service_role()]);
    let service = serve(&database.service_url());
    let folder = tempfile::tempdir().unwrap();
    let backup = folder.path().join("moment.backup");
    let name = backup.to_str().unwrap();
    let mut flying = fleet(&service.url, 60).spawn().unwrap();
    until_a_tail_is_known(&service).await;
    // Row-level security hides everything from its owner, and a backup without rows is none.
    let refused = run(&database.owner_url(), &["backup", "--out", name]);
    assert!(!refused.status.success() && !backup.exists());
    said(&database.superuser_url(), &["backup", "--out", name]);
    assert!(flying.try_wait().unwrap().is_none(), "the fleet is still flying");
    assert!(flying.wait().unwrap().success());
    let expected = numbers(&service.settled_fleet().await);
    service.kill();

    said(&restored.superuser_url(), &["restore", "--from", name]);
    let again = run(&restored.superuser_url(), &["restore", "--from", name]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8(again.stderr).unwrap().contains("overwrites nothing"));
    let service = serve(&restored.service_url());
    fly(&service.url, 60);
    assert_eq!(numbers(&service.settled_fleet().await), expected);
    service.kill();
    let digests = [&database, &restored].map(|one| tests::digest(&one.service_url()));
    assert_eq!(digests[0], digests[1]);
}

#[test]
fn an_interrupted_backup_or_restore_leaves_a_whole_file_or_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("fleet.sqlite");
    Service::start(&database, 0).kill();
    let whole = folder.path().join("whole.backup");
    said(&database, &["backup", "--out", whole.to_str().unwrap()]);
    for (attempt, signal) in ["INT", "TERM", "HUP", "INT", "TERM"].into_iter().enumerate() {
        let place = folder.path().join(format!("place-{attempt}"));
        fs::create_dir(&place).unwrap();
        let (copy, restored) = (place.join("moment.backup"), place.join("restored.sqlite"));
        let backup = ["backup", "--out", copy.to_str().unwrap(), "--database-url", &url(&database)].map(str::to_owned);
        let restore =
            ["restore", "--from", whole.to_str().unwrap(), "--database-url", &url(&restored)].map(str::to_owned);
        for arguments in [&backup[..], &restore[..]] {
            let mut child =
                Command::new(binary()).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            while child.try_wait().unwrap().is_none() {
                if fs::read_dir(&place).unwrap().next().is_some() {
                    tests::signal(child.id(), signal);
                    break;
                }
                std::thread::yield_now();
            }
            let status = child.wait().unwrap();
            let names: Vec<_> = fs::read_dir(&place).unwrap().map(|file| file.unwrap().file_name()).collect();
            if names.is_empty() {
                assert!(!status.success(), "{arguments:?}: nothing is there");
            } else if copy.exists() {
                assert_eq!(names.len(), 1, "{names:?}");
                said(&place.join("again.sqlite"), &["restore", "--from", copy.to_str().unwrap()]);
                fs::remove_dir_all(&place).unwrap();
                fs::create_dir(&place).unwrap();
            } else {
                said(&restored, &["verify"]);
            }
        }
    }
}

#[tokio::test]
async fn a_file_that_is_no_backup_restores_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (file, database) = (folder.path().join("text"), folder.path().join("fleet.sqlite"));
    fs::write(&file, "this is no database, whatever its name says, and long enough to be sure of it").unwrap();
    assert!(refused(&database, &["restore", "--from", file.to_str().unwrap()], 2).contains("is no backup"));
    assert!(refused(&database, &["restore", "--from", "nowhere"], 2).contains("nowhere"));
    assert!(
        refused(&database, &["backup", "--out", file.with_extension("out").to_str().unwrap()], 2).contains("fleet")
    );
    assert!(!database.exists());
    // A backup whose bytes were damaged is told apart before it gets the name of a database.
    let source = folder.path().join("source.sqlite");
    Service::start(&source, 0).kill();
    let backup = folder.path().join("whole.backup");
    said(&source, &["backup", "--out", backup.to_str().unwrap()]);
    let mut bytes = fs::read(&backup).unwrap();
    let at = bytes.windows(10).position(|window| window == b"map_length").expect("the bundle names its map");
    bytes[at] = b'M';
    fs::write(&backup, bytes).unwrap();
    let output = actuary(&database, &["restore", "--from", backup.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!database.exists());
}

#[tokio::test]
async fn a_copy_without_its_log_is_told_from_a_backup() {
    let folder = tempfile::tempdir().unwrap();
    let [database, copy, restored] =
        ["fleet.sqlite", "copy.sqlite", "restored.sqlite"].map(|name| folder.path().join(name));
    let _service = Service::start(&database, 0);
    fs::copy(&database, &copy).unwrap();
    for command in [&["verify"][..], &["migrate"], &["serve", "--port", "0"]] {
        let words = refused(&copy, command, 2);
        assert!(words.contains("copy.sqlite-wal is not beside it") && !words.contains("actuary migrate"), "{words}");
    }
    let from = |file: &Path| ["restore".to_owned(), "--from".to_owned(), file.display().to_string()];
    let arguments = from(&database);
    let words = refused(&restored, &arguments.each_ref().map(String::as_str), 2);
    assert!(words.contains("is no backup but a database"), "{words}");
    assert!(!restored.exists());
    let arguments = from(&copy);
    let accepted = actuary(&restored, &arguments.each_ref().map(String::as_str));
    let warned = String::from_utf8(accepted.stderr).unwrap();
    assert!(accepted.status.success() && warned.contains("what was in its log is not in it"), "{warned}");
    said(&restored, &["verify"]);
}
