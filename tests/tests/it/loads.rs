//! `actuary loads` on flight cases.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use tests::run;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/loads").join(name)
}

fn loads(params: &Path, cases: &Path, out: &Path) -> Output {
    let [params, cases, out] = [params, cases, out].map(|file| file.to_str().expect("a plain path"));
    run(&["loads", "--params", params, "--cases", cases, "--out", out])
}

/// Rows below the header, by field.
fn rows(text: &str) -> Vec<Vec<&str>> {
    text.lines().skip(1).map(|line| line.split(',').collect()).collect()
}

#[test]
fn it_writes_what_an_independent_estimator_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("loads.csv");
    for set in ["A_faulty", "D_faulty"] {
        let done = loads(&fixture(&format!("{set}_params.json")), &fixture(&format!("{set}.csv")), &out);
        assert!(done.status.success(), "{done:?}");
        let files = [out.clone(), fixture(&format!("{set}_oracle.csv"))];
        let [found, expected] = files.map(|file| fs::read_to_string(file).expect("a table"));
        assert_eq!(found.lines().next(), expected.lines().next());
        let (found, expected) = (rows(&found), rows(&expected));
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!((found[0], found[5]), (expected[0], expected[5]));
            for (found, expected) in found[1..5].iter().zip(&expected[1..5]) {
                let number = |text: &str| text.parse::<f64>().expect("a number");
                assert!((number(found) / number(expected) - 1.0).abs() < 1e-7, "{found} instead of {expected}");
            }
        }
    }
}

/// The first case of layout D with some fields replaced, estimated: its row, and the summary.
fn with_fields(replace: &[(&str, &str)]) -> (Vec<String>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let (cases, out) = (folder.path().join("cases.csv"), folder.path().join("loads.csv"));
    let text = fs::read_to_string(fixture("D_valid.csv")).expect("cases");
    let mut lines = text.lines();
    let header: Vec<_> = lines.next().expect("a header").split(',').collect();
    let mut fields: Vec<_> = lines.next().expect("a case").split(',').collect();
    for (name, value) in replace {
        fields[header.iter().position(|column| column == name).expect("a column")] = value;
    }
    fs::write(&cases, format!("{}\n{}\n", header.join(","), fields.join(","))).expect("written");
    let done = loads(&fixture("D_params.json"), &cases, &out);
    assert!(done.status.success(), "{done:?}");
    let table = fs::read_to_string(&out).expect("a table");
    let row = rows(&table)[0].iter().map(|field| (*field).to_owned()).collect();
    (row, String::from_utf8(done.stderr).expect("text"))
}

#[test]
fn missing_peaks_are_left_out_and_the_air_data_answer_for_too_many() {
    let (row, _) = with_fields(&[("lambda_nm_04", ""), ("lambda_nm_09", "nan")]);
    assert_eq!(row[5], "4;9");
    let (row, summary) = with_fields(&[("lambdaT_nm_1", "")]);
    assert_eq!(row[5], "3;4;5");
    assert!(summary.contains("1 by air data alone"), "{summary}");
    let (row, summary) = with_fields(&[("q_meas", "")]);
    assert_eq!(row[1..].join(","), ",,,,");
    assert!(summary.contains("1 without a load"), "{summary}");
}

#[test]
fn bad_input_is_named_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    let (cases, out) = (folder.path().join("cases.csv"), folder.path().join("loads.csv"));
    let text = fs::read_to_string(fixture("D_valid.csv")).expect("cases");
    fs::write(&cases, text.replacen("lambdaT_nm_3", "lambdaT", 1)).expect("written");
    let refused = |params: &str, cases: &Path| {
        let done = loads(&fixture(params), cases, &out);
        assert_eq!(done.status.code(), Some(2), "{done:?}");
        String::from_utf8(done.stderr).expect("text")
    };
    let line = refused("D_params.json", &cases);
    assert!(line.ends_with("cases.csv: column lambdaT_nm_3 is missing\n"), "{line}");
    let line = refused("D_valid.csv", &fixture("D_valid.csv"));
    assert!(line.contains("D_valid.csv: expected value at line 1"), "{line}");
    assert!(!out.exists());
}
