//! The examples of the pages in `docs` work as they are printed.

use std::{
    fs,
    net::TcpListener,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Command,
};

use tests::{Service, postgres::Cluster};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

/// The blocks of a page that are fenced as `sh` and nothing else, one after the other.
fn script(page: &str) -> String {
    let mut script = String::new();
    let mut inside = false;
    for line in page.lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            line if inside => script += &format!("{line}\n"),
            _ => {}
        }
    }
    script
}

/// A Python that can speak gRPC, as `scripts/test` installs it.
fn python() -> Option<PathBuf> {
    let environment = root().join("target/python");
    let imports = "import grpc, grpc_tools";
    let works = Command::new(environment.join("bin/python")).args(["-c", imports]).output();
    works.is_ok_and(|output| output.status.success()).then_some(environment)
}

fn bash(folder: &Path, script: &str) -> String {
    let output = Command::new("bash").args(["-euo", "pipefail", "-c", script]).current_dir(folder).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}\n{err}");
    out.into_owned()
}

#[tokio::test]
async fn the_integrators_page_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let page = fs::read_to_string(root().join("docs/integrators.md")).unwrap();
    let page = page.replace("127.0.0.1:8080", service.url.trim_start_matches("http://"));
    let (rest, grpc) = page.split_once("## 5.").expect("REST comes first, gRPC is section 5");

    let said = bash(folder.path(), &script(rest));
    assert_eq!(said.matches(r#""status":"accepted""#).count(), 6, "three uploads and a backlog of three: {said}");
    assert!(said.contains(r#""hinge_moment_nm""#), "the load of the upload with strain: {said}");
    assert!(said.contains("insufficient_history"), "{said}");
    assert!(said.contains(r##""pointer":"#/flight_hours""##), "the refusal names the field: {said}");
    assert!(said.contains(r#""voided""#), "{said}");
    assert!(said.contains("there is no forecast for position AIL-L of tail EC-MXA yet"), "{said}");
    assert_eq!(said.matches(r#""mission":"short-haul""#).count(), 2, "set and read: {said}");

    assert!(said.contains("status 304"), "nothing had changed: {said}");

    let Some(python) = python() else {
        println!("skipped: no Python with grpcio in target/python (scripts/test installs it)");
        return;
    };
    symlink(python, folder.path().join(".venv")).unwrap();
    symlink(root().join("proto"), folder.path().join("proto")).unwrap();
    let said = bash(folder.path(), &script(grpc));
    assert_eq!(said.matches("UPLOAD_STATUS_ACCEPTED").count(), 10, "{said}");
    assert!(said.contains("STATUS_INSUFFICIENT_HISTORY") && said.contains("INVALID_ARGUMENT"), "{said}");
}

#[tokio::test]
async fn the_page_of_credentials_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    let page = fs::read_to_string(root().join("docs/credentials.md")).unwrap();
    let page = page.replace("127.0.0.1:8080", service.url.trim_start_matches("http://"));
    let bin = tests::binary();
    let path = format!("export PATH={}:$PATH\n", bin.parent().expect("a folder").display());
    let said = bash(folder.path(), &format!("{path}{}", script(&page)));
    assert!(said.contains(r#""items":[]"#), "the keeper reads: {said}");
    assert!(said.contains(r#""status":401"#) && said.contains(r#""status":403"#), "{said}");
    assert!(said.contains("revoked") && said.contains("aircraft EC-MXA"), "{said}");
    assert!(said.contains("operator default: 4 records"), "{said}");
    let secret = fs::read_to_string(folder.path().join("keeper.token")).unwrap();
    assert!(!said.contains(secret.trim().split_once('.').expect("id.secret").1));
}

#[test]
fn the_uplink_page_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(root().join("docs/uplink.md")).unwrap();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let bin = tests::binary();
    let path = format!("export PATH={}:$PATH ACTUARY_PORT={port}\n", bin.parent().expect("a folder").display());
    let stop = "trap 'kill $(jobs -p) 2> /dev/null || true' EXIT\n";
    let said = bash(folder.path(), &format!("{path}{stop}{}", script(&page.replace("8080", &port.to_string()))));
    assert!(said.contains("EMA-500 SN-0001 at AIL-L of EC-MXA") && said.contains("the strain of EC-MXA"), "{said}");
    assert!(said.contains("1234.5 h") && said.contains(r#""status":"accepted""#), "{said}");
    assert!(said.contains(r#""flight_hours":1234.5"#), "what became of it: {said}");
}

#[test]
fn slow_the_training_page_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(root().join("docs/training.md")).unwrap();
    let bin = tests::binary();
    let path = format!("export PATH={}:$PATH\n", bin.parent().expect("a folder").display());
    let said = bash(folder.path(), &format!("{path}{}", script(&page)));
    assert!(said.contains("k1,k2,k3,k4,k5,sigma_k1"), "{said}");
    assert!(said.contains("exit code 2"), "{said}");
    assert!(!folder.path().join("never.json").exists(), "nothing is left of a refused training");
    assert!(folder.path().join("verdict/report.html").exists() && folder.path().join("response.svg").exists());
}

#[test]
fn slow_the_operations_page_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(root().join("docs/operations.md")).unwrap();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let bin = tests::binary();
    let path = format!("export PATH={}:$PATH\n", bin.parent().expect("a folder").display());
    let stop = "trap 'kill $(jobs -p) 2> /dev/null || true' EXIT\n";
    let said = bash(folder.path(), &format!("{path}{stop}{}", script(&page.replace("8080", &port.to_string()))));
    assert!(said.contains("rows match their checksums"), "{said}");
    assert!(said.contains("lives wait to be judged anew"), "{said}");
    assert!(said.contains("nothing was different"), "{said}");
    let digests: Vec<_> = said.lines().filter_map(|line| line.strip_prefix("digest ")).collect();
    assert_eq!((digests.len(), digests[0]), (2, digests[1]), "what was backed up is what was restored: {said}");
    assert!(folder.path().join("fleet.sqlite").exists() && folder.path().join("fleet.sqlite.broken").exists());
}

#[test]
fn slow_the_deployment_page_can_be_pasted_into_a_shell() {
    let Some(cluster) = Cluster::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(root().join("docs/deployment.md")).unwrap();
    let free = || TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a free port").port();
    let page = page.replace("18080", &free().to_string()).replace("19090", &free().to_string());
    let (bin, url) = (tests::binary(), cluster.url());
    let address = url.split(['@', '/']).nth(3).expect("host and port");
    // Processes in the background must not outlive a script that fails.
    let before = format!(
        "export PATH={}:$PATH ADMIN_URL={url} POSTGRES={address}\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n",
        bin.parent().expect("a folder").display()
    );
    let said = bash(folder.path(), &format!("{before}{}", script(&page)));
    assert!(said.contains("up to date") && said.contains("uploads accepted"), "{said}");
}

#[tokio::test]
async fn slow_the_page_of_real_lives_can_be_pasted_into_a_shell() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("fleet.sqlite"), 0);
    symlink(root().join("models"), folder.path().join("models")).unwrap();
    for set in ["virkler.csv", "gaaslaser.csv", "metalwear.csv"] {
        fs::copy(root().join("tests/data/real").join(set), folder.path().join(set)).unwrap();
    }
    let page = fs::read_to_string(root().join("docs/real-lives.md")).unwrap();
    let page = page.replace("127.0.0.1:8080", service.url.trim_start_matches("http://"));
    let bin = tests::binary();
    let path = format!("export PATH={}:$PATH\n", bin.parent().expect("a folder").display());
    let said = bash(folder.path(), &format!("{path}{}", script(&page)));
    assert!(said.contains("CRPS cycles") && said.contains("CRPS h"), "{said}");
    for out in ["cracks", "lasers", "wear"] {
        for file in ["predictions.csv", "metrics.json", "report.html"] {
            assert!(folder.path().join(out).join(file).exists(), "{out}/{file}");
        }
    }
    assert!(said.contains("of them failed") && said.contains("increase: from 0 to 6"), "{said}");
    assert!(said.contains("judges the lives that begin from now on"), "{said}");
    assert_eq!(said.matches(r#""status":"accepted""#).count(), 8, "{said}");
    assert!(said.contains(r#""fault_vector":{"increase""#) && said.contains(r#""rul_fh":{"mean":"#), "{said}");
}
