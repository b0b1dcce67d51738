//! Lives that fly missions, as a file of histories: what the service would have been told, beside what is hidden.

use std::{collections::BTreeMap, fs, path::Path, process::Command};

/// The tables of a small fleet in the closed form.
fn flown(folder: &Path) -> [String; 2] {
    let output = simulate(folder, &["--runs", "3", "--missions", "short-haul,cruise", "--upload-every", "10"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    ["histories.csv", "truth.csv"].map(|name| fs::read_to_string(folder.join(name)).unwrap())
}

fn simulate(folder: &Path, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(tests::binary());
    command.args(["simulate", "history", "--seed", "11", "--physics", "closed-form", "--out"]);
    command.arg(folder).args(arguments).output().unwrap()
}

/// Rows of a table by column.
fn rows(table: &str) -> Vec<BTreeMap<&str, &str>> {
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    lines.map(|line| header.iter().copied().zip(line).collect()).collect()
}

fn number(row: &BTreeMap<&str, &str>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn flown_lives_are_told_by_strain_and_diagnosis_up_to_the_flight_in_which_they_end() {
    let folder = tempfile::tempdir().unwrap();
    let [histories, truth] = flown(&folder.path().join("a"));
    assert_eq!(flown(&folder.path().join("b")), [histories.clone(), truth.clone()], "the same seed, the same files");
    let (histories, truth) = (rows(&histories), rows(&truth));
    assert_eq!(truth.len(), 3);
    for life in &truth {
        let own: Vec<_> = histories.iter().filter(|row| row["run_id"] == life["run_id"]).collect();
        let last = own.last().unwrap();
        assert_eq!(number(last, "t_fh"), number(life, "t_failure_fh"), "the last row is the failure");
        assert!(own.len() > 40 && own.len() == number(life, "n_obs") as usize, "{} rows", own.len());
        let errors = own.iter().map(|row| (number(row, "load") / number(row, "true_load")).ln().abs()).collect();
        let error = median(errors);
        assert!((0.001..0.05).contains(&error), "the strain tells the load to {error}");
        assert!(own.iter().all(|row| (number(row, "temp") - number(row, "true_temp")).abs() < 1e-3));
        // p 2, beta .3: the hours of the flights kept, by their true pace, are the life's equivalent hours.
        let pace = |row: &&BTreeMap<_, _>| number(row, "true_load").powi(2) * (0.3 * number(row, "true_temp")).exp();
        let mean_pace = own.iter().map(pace).sum::<f64>() / own.len() as f64;
        assert!((mean_pace / number(life, "pace") - 1.0).abs() < 0.1, "{mean_pace}, not {}", life["pace"]);
        let wear = |row: &BTreeMap<_, _>| {
            let shorts = (1..=3).map(|i| number(row, &format!("k{i}")));
            shorts.chain([(number(row, "k4") - 0.5).abs()]).fold(0.0, f64::max)
        };
        assert!(wear(last) > wear(own[0]) + 0.05, "it has worn: {last:?}");
    }
    let pace = |mission| truth.iter().find(|life| life["mission"] == mission).map(|life| number(life, "pace")).unwrap();
    assert!(pace("short-haul") > pace("cruise"));
}

#[test]
fn what_cannot_be_flown_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, reason) in [
        (&["--runs", "3", "--missions", "holiday"][..], "holiday is no mission"),
        (&["--runs", "3", "--upload-every", "2"], "--missions"),
        (&["--runs", "3", "--missions", "cruise", "--upload-every", "0"], "--upload-every"),
        (&["--runs", "1000", "--missions", "cruise"], "--runs 1000: at most 999 lives fly --missions"),
        (&["--runs", "3", "--missions", "cruise", "--scenario", "maintenance"], "--scenario"),
    ] {
        let output = simulate(&folder.path().join("none"), arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.lines().next().is_some_and(|line| line.contains(reason)), "{arguments:?}: {stderr}");
    }
    assert!(!folder.path().join("none").exists());
}
