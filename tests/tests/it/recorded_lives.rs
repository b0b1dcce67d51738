//! Lives that nobody simulated, from a table to forecasts in the unit of its times, as a user runs them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use domain::ContentHash;
use serde_json::Value;

/// All estimators of lives of any unit.
const ESTIMATORS: [&str; 7] =
    ["mixture", "growth", "similarity", "climatology", "mixed-exponential", "mixed-brownian", "mixed-polynomial"];

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
        assert!(stderr.lines().skip(1).all(|line| line.starts_with("Usage:")), "{stderr}");
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

/// The cracks of the first specimens.
fn first_specimens(count: usize) -> String {
    let table = fs::read_to_string(fixture("virkler.csv")).unwrap();
    let kept = |line: &&str| line.split(',').next().unwrap().parse::<usize>().is_ok_and(|specimen| specimen <= count);
    let rows: Vec<&str> = table.lines().skip(1).filter(kept).collect();
    format!("specimen,cycles,crack_mm\n{}\n", rows.join("\n"))
}

#[test]
fn slow_cracks_are_forecast_in_cycles_by_one_command() {
    let bench = Bench::new();
    let arguments = ["--histories", &fixture("virkler.csv"), "--limit", "crack_mm=49.8", "--every", "10000"];
    let [printed, notes] = bench.run("out", &arguments);
    assert!(printed.contains("CRPS cycles") && printed.contains("mixture"), "{printed}");
    assert!(notes.contains("34 of the 68 units teach") && notes.contains("34 are judged"), "{notes}");
    let metrics = bench.metrics("out/metrics.json");
    assert_eq!((&metrics["settings"]["unit"], &metrics["settings"]["every"]), (&"cycles".into(), &10_000.0.into()));
    assert_eq!((&metrics["lives"]["taught"], &metrics["lives"]["judged"]), (&34.into(), &34.into()));
    assert_eq!(metrics["faults"]["crack_mm"]["limit"], 49.8);
    let figure = |name: &str, figure: &str| metrics["estimators"][name][figure].as_f64().unwrap();
    let climatology = figure("climatology", "crps");
    assert!((9_000.0..10_500.0).contains(&climatology), "how long specimens last: {climatology} cycles");
    assert!(figure("mixture", "crps") < 6_500.0 && figure("growth", "crps") < 9_000.0, "{printed}");
    assert!((0.72..0.95).contains(&figure("mixture", "coverage_80")), "{printed}");
    let rows = predictions(&bench.read("out/predictions.csv"));
    assert_eq!(rows[0].0, "mixture", "the default comes first");
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

/// A table of lasers with other times and currents.
fn lasers(time: impl Fn(f64) -> f64, increase: impl Fn(f64) -> f64) -> String {
    let table = fs::read_to_string(fixture("gaaslaser.csv")).unwrap();
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [seen, at] = [fields[0], fields[2]].map(|field| field.parse::<f64>().unwrap());
        format!("{},{},{}\n", increase(seen), fields[1], time(at))
    };
    format!("increase,unit,hours\n{}", table.lines().skip(1).map(row).collect::<String>())
}

/// Every figure of every estimator is one of the unit: twice the times are twice the remaining lives, to the last bit for a power
/// of two. What a value is counted in, and from where, changes nothing.
#[test]
fn units_of_time_and_of_damage_scale_figures_and_nothing_else() {
    let bench = Bench::new();
    let plain = |value: f64| value;
    let run = |out: &str, table: &str, limit: &str| {
        let file = bench.file(&format!("{out}.csv"), table);
        let arguments = ["--histories", &file, "--limit", limit];
        bench.run(out, &[&arguments[..], &ESTIMATORS.map(|name| ["--estimator", name]).concat()].concat());
        bench.metrics(&format!("{out}/metrics.json"))
    };
    let hours = run("hours", &lasers(plain, plain), "increase=6");
    let quarters = run("quarters", &lasers(|t| 4.0 * t, plain), "increase=6");
    let months = run("months", &lasers(|t| t / 730.5, plain), "increase=6");
    let other = run("other", &lasers(plain, |x| 3.0 - 8.0 * x), "increase=-45");
    let figure =
        |metrics: &Value, name: &str, path: &str| metrics["estimators"][name].pointer(path).unwrap().as_f64().unwrap();
    for name in ESTIMATORS {
        for path in ["/crps", "/crps_interval/low", "/doubts/trusted_crps"] {
            let [hours, quarters, months, other] =
                [&hours, &quarters, &months, &other].map(|metrics| figure(metrics, name, path));
            assert_eq!(quarters, 4.0 * hours, "{name} {path}");
            assert!((months * 730.5 / hours - 1.0).abs() < 1e-9, "{name} {path}: {months} {hours}");
            assert!((other / hours - 1.0).abs() < 1e-9, "{name} {path}: {other} {hours}");
        }
        for path in ["/coverage_80", "/coverage_95", "/predictions"] {
            let [hours, quarters, months] = [&hours, &quarters, &months].map(|metrics| figure(metrics, name, path));
            assert_eq!((quarters, months), (hours, hours), "{name} {path}");
        }
    }
    let [a, b] = ["hours", "quarters"].map(|out| predictions(&bench.read(&format!("{out}/predictions.csv"))));
    for ((name, unit, t, numbers), (other_name, other_unit, other_t, others)) in a.iter().zip(&b) {
        assert_eq!((name, unit), (other_name, other_unit));
        assert!((4.0 * t - other_t).abs() < 1e-6 * other_t, "{t} {other_t}");
        // Written to hundredths.
        let close = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => (4.0 * a - b).abs() < 0.03,
            (a, b) => a == b,
        };
        let rest = numbers[2..].iter().zip(&others[2..]).all(close);
        assert!(rest && numbers[1] == others[1] && close((&numbers[0], &others[0])), "{numbers:?} {others:?}");
    }
}

/// What the mixture says of recorded lives, as written; a change of numbers changes it, and belongs into CHANGELOG.
#[test]
fn forecasts_of_recorded_lives_stay_as_they_are() {
    let bench = Bench::new();
    let cracks = bench.file("cracks.csv", &first_specimens(12));
    let (lasers, wear) = (fixture("gaaslaser.csv"), fixture("metalwear.csv"));
    let sets = [
        (
            "cracks",
            [cracks.as_str(), "crack_mm=49.8"],
            "74fd3b0af7a8b3e036786077ca9c9394486d3ef7a7c2ec23eb2e3524b0f2b382",
        ),
        ("lasers", [lasers.as_str(), "increase=6"], "70ad92d525fe47de4215b2f092df26311de78b65c87458f76ad3d200a31e720b"),
        ("wear", [wear.as_str(), "microns=30"], "dc022a4637b94bc55918327d39d502d3dd33918ed7c049505e85f093601f6a1d"),
    ];
    for (out, [file, limit], expected) in sets {
        bench.run(out, &["--histories", file, "--limit", limit, "--estimator", "mixture"]);
        let digest = ContentHash::of(bench.read(&format!("{out}/predictions.csv")).as_bytes());
        assert_eq!(digest.to_string(), expected, "{out}");
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
    let arguments = ["--histories", &fixture("metalwear.csv"), "--limit", "microns=30", "--estimator", "climatology"];
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
    let prior = bench.file("prior.csv", &first_specimens(8));
    let arguments = ["--prior", &prior, "--histories", &going_on, "--limit", "crack_mm=49.8"];
    let [printed, notes] = bench.run("out", &[&arguments[..], &["--every", "20000"]].concat());
    assert!(notes.contains("unit new going on at the last time: predicted, not judged"), "{notes}");
    assert!(printed.contains("nothing to judge"), "{printed}");
    assert!(!bench.path("out/metrics.json").exists());
    let rows = predictions(&bench.read("out/predictions.csv"));
    let of_default = rows.iter().filter(|(name, ..)| name == "mixture");
    let times: Vec<f64> = of_default.map(|(_, _, t, _)| *t).collect();
    assert_eq!(times[5..], [120_000.0, 130_000.0], "and from the newest observation on");
    assert!(rows.iter().all(|(_, unit, _, numbers)| unit == "new" && numbers[0].is_some_and(|mean| mean > 30_000.0)));
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
    says(&with(&["--every", "1e9"]), "--every 1000000000 cycles leaves nothing to predict: the longest life has");
    says(&with(&["--horizon", "9000", "--every", "9001"]), "--horizon 9000 cycles is shorter than --every 9001 cycles");
    says(&with(&["--horizon", "0"]), "--horizon");
    says(&with(&["--estimator", "thesis"]), "--estimator thesis needs --model");
    let healthy = bench.file("healthy.csv", "unit,hours,increase,end\na,0,0,\na,9,3,removed\nb,0,0,\nb,9,2,removed\n");
    let arguments = ["--prior", &healthy, "--histories", &healthy, "--limit", "increase=6", "--end", "end"];
    let refused = bench.refused(&arguments);
    assert!(refused.contains("healthy.csv: none of the 2 units that teach passes a limit (increase 6)"), "{refused}");
}
