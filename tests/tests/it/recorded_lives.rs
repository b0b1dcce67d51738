//! Lives that nobody simulated, from a table to forecasts in the unit of its times, as a user runs them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real").join(name).display().to_string()
}

/// A folder for the files of one test.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file and returns its path.
    fn file(&self, name: &str, content: &str) -> String {
        fs::write(self.path(name), content).unwrap();
        self.path(name).display().to_string()
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn metrics(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    fn output(&self, out: &str, arguments: &[&str]) -> Output {
        let out = self.path(out).display().to_string();
        Command::new(tests::binary())
            .args(["backtest", "--out", &out, "--draws", "100"])
            .args(arguments)
            .output()
            .unwrap()
    }

    /// What a backtest says on standard output and standard error.
    fn run(&self, out: &str, arguments: &[&str]) -> [String; 2] {
        let output = self.output(out, arguments);
        let said = [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap());
        assert!(output.status.success(), "{}", said[1]);
        said
    }

    /// What a refused backtest says in its one line; nothing is written.
    fn refused(&self, arguments: &[&str]) -> String {
        let output = self.output("refused", arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        assert!(!self.path("refused").exists(), "nothing half-written");
        stderr
    }
}

/// Rows of a predictions file by their first three fields.
fn predictions(text: &str) -> Vec<(String, String, f64, Vec<Option<f64>>)> {
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    assert!(header.starts_with("estimator,unit,t,mean,censored_fraction,q025,q05,"), "{header}");
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let numbers = fields[3..].iter().map(|field| field.parse().ok()).collect();
        (fields[0].to_owned(), fields[1].to_owned(), fields[2].parse().unwrap(), numbers)
    };
    lines.map(row).collect()
}

#[test]
fn cracks_are_forecast_in_cycles_by_one_command() {
    let bench = Bench::new();
    let arguments = ["--histories", &fixture("virkler.csv"), "--limit", "crack_mm=49.8", "--every", "10000"];
    let [printed, notes] = bench.run("out", &[&arguments[..], &["--estimator", "climatology"]].concat());
    assert!(printed.contains("CRPS cycles") && printed.contains("climatology"), "{printed}");
    assert!(notes.contains("34 of the 68 units teach") && notes.contains("34 are judged"), "{notes}");
    let metrics = bench.metrics("out/metrics.json");
    assert_eq!((&metrics["settings"]["unit"], &metrics["settings"]["every"]), (&"cycles".into(), &10_000.0.into()));
    assert_eq!((&metrics["lives"]["taught"], &metrics["lives"]["judged"]), (&34.into(), &34.into()));
    assert_eq!(metrics["faults"]["crack_mm"]["limit"], 49.8);
    let climatology = &metrics["estimators"]["climatology"];
    let crps = climatology["crps"].as_f64().unwrap();
    assert!((9_000.0..10_500.0).contains(&crps), "half of the specimens tell of the others: {crps} cycles");
    assert!(climatology["coverage_80_interval"]["low"].as_f64() < climatology["coverage_80"].as_f64());
    let rows = predictions(&bench.read("out/predictions.csv"));
    let of = |unit: &str| rows.iter().filter(|(_, row, ..)| row == unit).map(|(_, _, t, _)| *t).collect::<Vec<_>>();
    assert_eq!(of("2")[..3], [10_000.0, 20_000.0, 30_000.0], "the 2nd specimen is judged");
    assert!(of("1").is_empty(), "the 1st one teaches");
    let report = bench.read("out/report.html");
    for words in ["CRPS, cycles", "remaining life, cycles", "crack_mm", "share of the way from nominal to limit"] {
        assert!(report.contains(words), "the report should say {words}");
    }
    for foreign in ["flight hours", " h</th>", "assessment", "Oracle", "NaN", "inf", "_fh"] {
        assert!(!report.contains(foreign), "{foreign} in a report of cracks");
    }
}

/// Every figure is one of the unit: counted in thousands, it is a thousandth.
#[test]
fn the_unit_of_time_scales_all_figures() {
    let bench = Bench::new();
    let table = fs::read_to_string(fixture("virkler.csv")).unwrap();
    let in_thousands = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        match fields[1].parse::<f64>() {
            Ok(cycles) => format!("{},{},{}\n", fields[0], cycles / 1000.0, fields[2]),
            Err(_) => format!("{line}\n"),
        }
    };
    let thousands = bench.file("thousands.csv", &table.lines().map(in_thousands).collect::<String>());
    let run = |out: &str, file: &str, words: [&str; 4]| {
        let arguments = ["--histories", file, "--limit", "crack_mm=49.8", "--estimator", "climatology"];
        bench.run(out, &[&arguments[..], &words].concat());
        bench.metrics(&format!("{out}/metrics.json"))
    };
    let cycles = run("cycles", &fixture("virkler.csv"), ["--every", "8000", "--horizon", "400000"]);
    let thousands = run("thousands", &thousands, ["--every", "8", "--time", "cycles:kcycles"]);
    assert_eq!(thousands["settings"]["unit"], "kcycles");
    let figure =
        |metrics: &Value, path: &str| metrics["estimators"]["climatology"].pointer(path).unwrap().as_f64().unwrap();
    for path in ["/crps", "/crps_interval/low", "/doubts/trusted_crps"] {
        let ratio = figure(&cycles, path) / figure(&thousands, path);
        assert!((ratio / 1000.0 - 1.0).abs() < 1e-6, "{path}: {ratio}");
    }
    for path in ["/coverage_80", "/coverage_95", "/predictions"] {
        assert_eq!(figure(&cycles, path), figure(&thousands, path), "{path}");
    }
    let [a, b] = ["cycles", "thousands"].map(|out| predictions(&bench.read(&format!("{out}/predictions.csv"))));
    for ((_, unit, t, numbers), (_, other_unit, other_t, others)) in a.iter().zip(&b) {
        assert!(unit == other_unit && (t / other_t / 1000.0 - 1.0).abs() < 1e-9);
        let close = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => (a - 1000.0 * b).abs() <= 0.6,
            (a, b) => a == b,
        };
        let fraction = numbers[1] == others[1];
        assert!(fraction && close((&numbers[0], &others[0])) && numbers[2..].iter().zip(&others[2..]).all(close));
    }
}

#[test]
fn the_order_of_rows_changes_nothing() {
    let bench = Bench::new();
    let table = fs::read_to_string(fixture("gaaslaser.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    let (header, rows) = (lines[0], &lines[1..]);
    // Units keep their order, which is that of their first rows.
    let firsts = rows.iter().filter(|row| row.starts_with("0.0,")).copied();
    let others: Vec<&str> = rows.iter().filter(|row| !row.starts_with("0.0,")).copied().collect();
    let shuffled = (0..others.len()).map(|i| others[i * 101 % others.len()]);
    let shuffled: Vec<&str> = std::iter::once(header).chain(firsts).chain(shuffled).collect();
    let (ordered, shuffled) = (fixture("gaaslaser.csv"), bench.file("shuffled.csv", &shuffled.join("\n")));
    let arguments = |file| ["--histories", file, "--limit", "increase=6", "--time", "hours:h"];
    bench.run("ordered", &arguments(&ordered));
    bench.run("shuffled", &arguments(&shuffled));
    assert_eq!(bench.read("shuffled/predictions.csv"), bench.read("ordered/predictions.csv"));
    assert_eq!(bench.metrics("ordered/metrics.json")["settings"]["unit"], "h");
}

#[test]
fn lives_that_were_removed_or_go_on_are_never_taken_for_failures() {
    let bench = Bench::new();
    let arguments = ["--histories", &fixture("metalwear.csv"), "--limit", "microns=20", "--estimator", "climatology"];
    let [_, notes] = bench.run("out", &arguments);
    let metrics = bench.metrics("out/metrics.json");
    let count = |name: &str| metrics["lives"][name].as_u64().unwrap();
    assert!(count("taught_failures") < count("taught") && count("judged") < count("predicted"), "{metrics}");
    assert!(notes.contains("columns without a limit are ignored: grams"), "{notes}");
    assert!(notes.contains("taken to be removed there, not failed"), "{notes}");
    assert!(notes.contains("predicted, not judged"), "{notes}");
    let report = bench.read("out/report.html");
    assert!(report.contains("taken to be removed there"), "the report tells how lives were read");
}

#[test]
fn a_prior_of_its_own_teaches_and_all_histories_are_predicted() {
    let bench = Bench::new();
    let going_on = bench.file("going_on.csv", "specimen,cycles,crack_mm\nnew,0,9\nnew,60000,12\nnew,130000,19\n");
    let arguments = ["--prior", &fixture("virkler.csv"), "--histories", &going_on, "--limit", "crack_mm=49.8"];
    let [printed, notes] = bench.run("out", &[&arguments[..], &["--every", "20000"]].concat());
    assert!(notes.contains("unit new going on at the last time: predicted, not judged"), "{notes}");
    assert!(printed.contains("nothing to judge"), "{printed}");
    assert!(!bench.path("out/metrics.json").exists());
    let rows = predictions(&bench.read("out/predictions.csv"));
    let times: Vec<f64> = rows.iter().map(|(_, _, t, _)| *t).collect();
    assert_eq!(times[5..], [120_000.0, 130_000.0], "and from the newest observation on");
    assert!(rows.iter().all(|(_, unit, _, numbers)| unit == "new" && numbers[0].is_some_and(|mean| mean > 50_000.0)));
}

#[test]
fn what_makes_no_sense_of_recorded_lives_is_refused_in_one_line() {
    let bench = Bench::new();
    let cracks = fixture("virkler.csv");
    let says = |arguments: &[&str], words: &str| {
        let refused = bench.refused(&[&["--histories", &cracks][..], arguments].concat());
        assert!(refused.contains(words), "{refused} should say {words}");
    };
    let limit = ["--limit", "crack_mm=49.8"];
    let with = |more: &[&'static str]| [&limit[..], more].concat();
    says(&[], "what is failure? tell --limit NAME=VALUE");
    says(&["--limit", "length=49.8"], "virkler.csv: column length of --limit is missing");
    says(&["--limit", "crack_mm=9"], "virkler.csv, row 2, column crack_mm: the limit 9 is the nominal value, too");
    says(&["--limit", "crack_mm=5"], "the limit lies on the healthy side");
    says(&["--limit", "crack_mm=60"], "nothing can be learned of failure");
    says(&["--limit", "specimen=3"], "virkler.csv: column specimen cannot be two things at once");
    says(&["--limit", "crack_mm"], "--limit");
    says(&with(&["--nominal", "width=3"]), "--nominal tells of width, which has no --limit");
    says(&with(&["--time", "crack_mm"]), "cannot be two things at once");
    says(&with(&["--end", "ending"]), "virkler.csv: column ending is missing");
    says(&with(&["--model", "m.json"]), "cannot be used with '--model <FILE>'");
    says(&with(&["--truth", "t.csv"]), "cannot be used with '--truth <FILE>...'");
    says(&with(&["--labels", "l.csv"]), "cannot be used with '--labels <FILE>...'");
    says(&with(&["--growth", "g.csv"]), "cannot be used with '--growth <FILE>...'");
    says(&["--model", "m.json", "--sigma", "crack_mm=1"], "--sigma is for lives with --limit");
    says(&["--model", "m.json", "--split", "9"], "--split is for lives with --limit");
    says(&with(&["--split", "0"]), "--split");
    says(&with(&["--split", "68"]), "virkler.csv: has 68 units: 68 teach and none is left to judge");
    says(&with(&["--every", "0.001"]), "--every 0.001 cycles makes more than 10000 predictions");
    says(&with(&["--horizon", "0"]), "--horizon");
    says(&with(&["--estimator", "thesis"]), "--estimator thesis needs --model");
    let healthy = bench.file("healthy.csv", "unit,hours,increase,end\na,0,0,\na,9,3,removed\nb,0,0,\nb,9,2,removed\n");
    let arguments = ["--prior", &healthy, "--histories", &healthy, "--limit", "increase=6", "--end", "end"];
    let refused = bench.refused(&arguments);
    assert!(refused.contains("healthy.csv: none of the 2 units that teach passes a limit (increase 6)"), "{refused}");
}
