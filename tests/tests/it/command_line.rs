//! Exit codes and single lines of error.

use std::{
    io::Write,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

fn refused(arguments: &[&str], code: i32, words: &str) {
    let output = tests::run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(stderr.contains(words), "{arguments:?}: {stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn bad_input_exits_with_2_and_says_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let motor = folder.path().join("motor.json");
    std::fs::write(&motor, r#"{"Vs": -48.0}"#).unwrap();
    let out = folder.path().join("bundle.json");
    refused(&["train", "--out", out.to_str().unwrap(), "--motor", motor.to_str().unwrap()], 2, "motor.json");
    assert!(!out.exists(), "nothing half-written");
    let weak = r#"{"Vs":24.0,"R":2.13,"L":0.00072,"k":0.0752,"Tmax":1.69,"Imax":22.5,"J":2.5e-5,"C":5e-5,"Ts":0.085,
        "Td":0.06,"gear":500.0,"bh":0.25,"Kpos":25.0,"Gp":0.02,"Gi":0.6,"Gd":2e-6,"tauD":5e-4,"wmax":560.0,
        "Ierr_tol":150.0,"BLK":1e-4,"endstop":0.6,"P":1.0,"noise":0.0,"Kload":0.0,"Cs":0.0}"#;
    std::fs::write(&motor, weak).unwrap();
    refused(&["train", "--out", out.to_str().unwrap(), "--motor", motor.to_str().unwrap()], 2, "no-load speed");
    refused(&["train", "--out", "x", "--samples", "1"], 2, "--samples");
    refused(&["demo", "--hours", "-1", "--exit"], 2, "--hours");
    refused(&["demo", "--swaps", "-1"], 2, "swaps must be 0 to 100 per 1000 flight hours, not -1");
    refused(&["simulate", "fleet", "--url", "http://127.0.0.1:9", "--overhauls", "NaN"], 2, "overhauls must be");
    refused(&["demo", "--missions", "holiday"], 2, "holiday is no mission: short-haul, cruise and training are");
    refused(&["demo", "--weak-transmission", "FLAP-L"], 2, "the fleet has EC-A001/AIL-L to EC-A003/AIL-R");
    refused(&["simulate", "fleet", "--url", "http://127.0.0.1:9", "--positions", "7"], 2, "--positions");
    refused(&["demo", "--colour"], 2, "--colour");
    refused(&[], 2, "a command is missing");
    refused(&["model"], 2, "a command is missing");
    refused(&["restore", "--from", folder.path().to_str().unwrap()], 2, "is no file");
    refused(&["simulate", "fleet", "--url", "nowhere"], 2, "http:// or https:// is missing, as in http://nowhere");
    refused(&["simulate", "fleet", "--url", "http://127.0.0.1:9", "--truth", "none/t.csv"], 2, "none/t.csv");
    refused(&["due", "--url", "127.0.0.1:8080"], 2, "as in http://127.0.0.1:8080");
    refused(&["healthcheck", "--url", "localhost:8080/readyz"], 2, "as in http://localhost:8080/readyz");
    refused(&["due", "--url", "ftp://127.0.0.1"], 2, "must begin with http:// or https://");
    refused(&["simulate", "history", "--runs", "0", "--seed", "1", "--out", "x"], 2, "--runs");
    let text = folder.path().join("text.sqlite");
    std::fs::write(&text, "this is no database, whatever its name says, and long enough to be sure of it").unwrap();
    refused(&["serve", "--database-url", &format!("sqlite:{}", text.display()), "--port", "0"], 2, "text.sqlite");
}

#[test]
fn a_service_for_others_needs_a_token_and_tls() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let serve = |further: &[&str], words: &str| {
        refused(&[&["serve", "--database-url", &database, "--port", "0"], further].concat(), 2, words);
    };
    serve(&["--listen", "0.0.0.0"], "--tls-cert");
    serve(&["--listen", "0.0.0.0", "--plaintext"], "actuary token create");
    serve(&["--listen", "somewhere"], "IP address");
    serve(&["--tls-cert", "absent.pem"], "--tls-key");
    serve(&["--tls-cert", "absent.pem", "--tls-key", "absent.key"], "absent.pem");
    serve(&["--client-ca", "absent.pem"], "--tls-cert");
    serve(&["--plaintext", "--tls-cert", "a.pem", "--tls-key", "a.key"], "--plaintext");
    serve(&["--allow-origin", "*"], "names everyone");
    serve(&["--allow-origin", "https://dash.example/"], "as in https://dash.example");
}

#[test]
fn a_token_on_a_command_line_is_not_repeated() {
    for token in ["5ec2e75ec2e7", "0123456789abcdef.5ec2e75ec2e7", "Bearer 5ec2e75ec2e7"] {
        for command in
            [&["due", "--token", token][..], &["simulate", "fleet", "--url", "http://127.0.0.1:9", "--token", token]]
        {
            let output = tests::run(command);
            assert_eq!(output.status.code(), Some(2), "{command:?}");
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(said.contains("--token") && !said.contains("5ec2e7"), "{said}");
        }
    }
}

#[test]
fn what_is_secret_in_an_address_is_not_repeated() {
    for url in ["http://me:5ec2e7@127.0.0.1:9/?t=5ec2e7", "me:5ec2e7@127.0.0.1:9", "http://me:5ec2e7@127.0.0.1:99999"] {
        for command in
            [&["due", "--url", url][..], &["healthcheck", "--url", url], &["simulate", "fleet", "--url", url]]
        {
            let output = tests::run(command);
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(!output.status.success() && said.contains("127.0.0.1:9") && !said.contains("5ec2e7"), "{said}");
        }
    }
    for command in [&["due", "--help"][..], &["healthcheck", "--help"], &["simulate", "fleet", "--help"]] {
        let mut help = Command::new(tests::binary());
        help.args(command).envs(["ACTUARY_URL", "ACTUARY_HEALTH_URL"].map(|name| (name, "http://me:5ec2e7@host")));
        assert!(!String::from_utf8(help.output().unwrap().stdout).unwrap().contains("5ec2e7"));
    }
}

#[test]
fn a_setting_that_is_misspelt_is_named() {
    let mut command = Command::new(tests::binary());
    command
        .args(["verify", "--database-url", "sqlite:absent.sqlite"])
        .env("ACTUARY_DATABASE_ULR", "sqlite:fleet.sqlite");
    let said = String::from_utf8(command.output().unwrap().stderr).unwrap();
    assert!(said.contains("ACTUARY_DATABASE_ULR is no setting: is ACTUARY_DATABASE_URL meant?"), "{said}");
}

/// What answers each connection with these bytes.
fn answering(bytes: &'static [u8]) -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for mut connection in listener.incoming().flatten() {
            let _ = std::io::Read::read(&mut connection, &mut [0; 4096]);
            let _ = connection.write_all(bytes);
        }
    });
    address.to_string()
}

#[test]
fn a_health_check_says_what_it_saw() {
    let well = answering(b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\nconnection: close\r\n\r\nok");
    let output = tests::run(&["healthcheck", "--url", &format!("http://me:5ec2e7@{well}")]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!((output.status.code(), said.trim()), (Some(0), &*format!("http://{well}/readyz answers 200 OK")));
    let ill = answering(
        b"HTTP/1.1 503 Service Unavailable\r\ncontent-length: 28\r\nconnection: close\r\n\r\nthe disk\nis full, at least so",
    );
    let ask = |scheme: &str, place: &str, code: i32, words: &str| {
        refused(&["healthcheck", "--url", &format!("{scheme}://{place}/x")], code, words);
    };
    ask("http", &ill, 1, "/x answers 503 Service Unavailable: the disk is full");
    ask("https", &well, 3, "if it speaks no TLS, its address begins with http://");
    ask("http", &answering(b"\x15\x03\x03\x00\x02\x02\x46"), 3, "if it speaks TLS, its address begins with https://");
    ask("http", "127.0.0.1:9", 3, "no service answers at http://127.0.0.1:9/x: Connection refused");
    let moved = answering(b"HTTP/1.1 302 Found\r\nlocation: /login\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
    ask("http", &moved, 3, "too many redirects");
    refused(&["due", "--url", &format!("http://{well}/v1/fleet/due")], 1, "answers oddly");
}

#[test]
fn an_absent_service_exits_with_3() {
    refused(&["simulate", "fleet", "--url", "http://127.0.0.1:9"], 3, "http://127.0.0.1:9");
}

#[test]
fn every_command_has_an_example() {
    let mut open = vec![Vec::new()];
    let mut commands = 0;
    while let Some(command) = open.pop() {
        let help = help(&command);
        let within: Vec<_> = subcommands(&help).collect();
        assert!(!within.is_empty() || help.contains("Example"), "{command:?}: {help}");
        commands += usize::from(within.is_empty());
        open.extend(within.into_iter().map(|name| [&command[..], &[name]].concat()));
    }
    assert!(commands >= 25, "only {commands} commands were found");
}

fn help(command: &[String]) -> String {
    let arguments: Vec<_> = command.iter().map(String::as_str).chain(["--help"]).collect();
    let output = tests::run(&arguments);
    assert!(output.status.success(), "{command:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The commands of a group, which its help lists between usage and options.
fn subcommands(help: &str) -> impl Iterator<Item = String> {
    let is_group = |line: &&str| line.starts_with("Usage:") && line.contains("<COMMAND>");
    let listed = help.lines().skip_while(|line| !is_group(line)).skip(1).take_while(|line| *line != "Options:");
    let name =
        |line: &str| line.strip_prefix("  ")?.split(' ').next().filter(|name| !name.is_empty()).map(str::to_owned);
    listed.filter_map(name).filter(|name| name != "help").collect::<Vec<_>>().into_iter()
}

/// Where nobody reads.
fn unread() -> Stdio {
    let (_, writer) = std::io::pipe().unwrap();
    writer.into()
}

#[test]
fn a_reader_that_leaves_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    assert!(tests::run(&["token", "create", "--scope", "ops", "--database-url", &database]).status.success());
    for command in [
        &["--help"][..],
        &["verify", "--database-url", &database],
        &["token", "list", "--database-url", &database],
        &["model", "list", "--database-url", &database],
        &["simulate", "response"],
    ] {
        let output = Command::new(tests::binary()).args(command).stdout(unread()).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{command:?}");
        let status = Command::new(tests::binary()).args(command).stdout(unread()).stderr(unread()).status().unwrap();
        assert_eq!(status.code(), Some(0), "{command:?}");
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = Command::new(tests::binary()).args(command).stdout(full).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{command:?}: {said}");
        assert!(said.contains("cannot write to standard output") && said.lines().count() == 1, "{command:?}: {said}");
    }
    let mut refused = Command::new(tests::binary());
    refused.args(["verify", "--database-url", "sqlite:absent.sqlite"]).stdout(unread()).stderr(unread());
    assert_eq!(refused.status().unwrap().code(), Some(2), "a failure stays one");
}

/// A log in a file is read by programs, and by people with `less`.
#[test]
fn a_log_in_a_file_has_no_colours_and_a_hangup_without_tls_is_a_line_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let mut command = Command::new(tests::binary());
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    command.args(["serve", "--database-url", &database, "--port", "0"]).stderr(std::fs::File::create(&log).unwrap());
    let service = tests::Service::spawn(command.env_remove("RUST_LOG")).unwrap();
    let written = || std::fs::read_to_string(&log).unwrap();
    let deadline = Instant::now() + Duration::from_secs(30);
    while !written().contains("SIGHUP") {
        service.signal("HUP");
        assert!(Instant::now() < deadline, "{}", written());
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(written().contains("SIGHUP changes nothing") && !written().contains('\x1b'), "{}", written());
    let (status, _) = service.terminate();
    assert!(status.success(), "a service that is told to end ends well");
}

#[tokio::test]
async fn a_service_to_which_nobody_listens_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let database = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let mut command = Command::new(tests::binary());
    command.args(["serve", "--database-url", &database, "--port", &free.port().to_string()]).env("RUST_LOG", "debug");
    let mut service = command.stdout(unread()).stderr(unread()).spawn().unwrap();
    let health = format!("http://{free}/healthz");
    let deadline = Instant::now() + Duration::from_secs(30);
    while !tests::http().get(&health).send().await.is_ok_and(|answer| answer.status().is_success()) {
        assert!(Instant::now() < deadline, "it does not answer: {:?}", service.try_wait());
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    // A caller that hangs up before its answer is there.
    for _ in 0..20 {
        let mut caller = std::net::TcpStream::connect(free).unwrap();
        caller.write_all(b"GET /openapi.json HTTP/1.1\r\nhost: here\r\n\r\n").unwrap();
    }
    assert!(tests::http().get(&health).send().await.unwrap().status().is_success());
    service.kill().unwrap();
    service.wait().unwrap();
}

#[test]
fn a_command_line_that_is_wrong_is_told_what_is_wrong_first_and_how_it_is_used_below() {
    let lines = |arguments: &[&str]| {
        let output = tests::run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        String::from_utf8(output.stderr).unwrap().lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let missing = lines(&["train"]);
    assert!(
        missing[0].starts_with("actuary: the following required arguments were not provided: --out"),
        "{missing:?}"
    );
    assert!(missing.iter().any(|line| line.starts_with("Usage: actuary train")), "{missing:?}");
    let odd = lines(&["demo", "--tail", "3"]);
    assert_eq!(odd[0], "actuary: unexpected argument '--tail' found");
    assert!(odd[1].contains("'--tails'") && odd.iter().any(|line| line.starts_with("Usage: ")), "{odd:?}");
    for (group, command) in [(&[][..], "  what-if "), (&["model"], "  activate "), (&["simulate"], "  history ")] {
        let said = lines(group);
        assert_eq!(said[0], "actuary: a command is missing", "{group:?}");
        assert!(said.iter().any(|line| line.starts_with(command)), "{group:?}: {said:?}");
    }
}

#[test]
fn shells_get_completions_of_every_command() {
    let help = String::from_utf8(tests::run(&["--help"]).stdout).unwrap();
    assert!(help.contains("Ask a running service:\n") && help.contains("--version"), "{help}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = String::from_utf8(tests::run(&["completions", shell]).stdout).unwrap();
        for name in ["due", "what-if", "backtest", "within-fh"] {
            assert!(script.contains(name), "{shell} completes {name}");
        }
    }
    refused(&["completions", "tcl"], 2, "possible values: bash, elvish, fish, powershell, zsh");
}
