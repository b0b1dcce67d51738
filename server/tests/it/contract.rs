//! The interface's document is committed, and does not change behind the backs of those who call it.

use std::{env, fs, path::PathBuf};

use serde_json::Value;

use crate::{breaking::breaks, house::House};

/// Set to write the documents anew instead of comparing with them.
const WRITE: &str = "ACTUARY_WRITE_OPENAPI";

fn in_project(file: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", file].iter().collect()
}

fn read(file: &str) -> String {
    fs::read_to_string(in_project(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// A document without its prose and examples.
fn bare(mut document: Value) -> Value {
    strip(&mut document);
    document
}

fn strip(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, value| match key.as_str() {
                "example" | "tags" | "security" | "x-scopes" => false,
                // A field of an answer may be called so.
                "description" | "summary" => !value.is_string(),
                _ => true,
            });
            map.values_mut().for_each(strip);
        }
        Value::Array(list) => list.iter_mut().for_each(strip),
        _ => {}
    }
}

#[tokio::test]
async fn the_committed_document_is_the_one_that_is_served() {
    let served = House::open().await.read("/openapi.json").await;
    let text = serde_json::to_string_pretty(&served).unwrap() + "\n";
    if env::var_os(WRITE).is_some() {
        return fs::write(in_project("docs/openapi.json"), text).unwrap();
    }
    let differs = "docs/openapi.json is not what is served; to write it anew: \
        ACTUARY_WRITE_OPENAPI=1 cargo nextest run --workspace --test it -E 'test(the_committed_document)'";
    let committed = read("docs/openapi.json");
    let line = committed.lines().zip(text.lines()).position(|(committed, served)| committed != served);
    assert!(committed == text, "{differs} (it differs from line {})", line.unwrap_or_default() + 1);
}

/// After a release, `docs/openapi.released.json` is written anew.
#[tokio::test]
async fn callers_of_the_last_release_break_only_where_the_changelog_says_so() {
    let served = bare(House::open().await.read("/openapi.json").await);
    if env::var(WRITE).is_ok_and(|what| what == "release") {
        let text = serde_json::to_string(&served).unwrap() + "\n";
        return fs::write(in_project("docs/openapi.released.json"), text).unwrap();
    }
    let released: Value = serde_json::from_str(&read("docs/openapi.released.json")).unwrap();
    let changelog = read("CHANGELOG.md");
    let unreleased = changelog.split("\n## ").find(|part| part.starts_with("Unreleased")).unwrap_or_default();
    let told: Vec<&str> = unreleased.lines().filter(|line| line.starts_with("- Breaking:")).collect();
    let silent = breaks(&released, &served)
        .into_iter()
        .filter(|found| !told.iter().any(|line| line.contains(&format!("`{}`", found.operation))));
    let silent: Vec<_> = silent.collect();
    assert!(
        silent.is_empty(),
        "callers break, and CHANGELOG has no line `- Breaking: ...` under Unreleased that names the operation in \
        backticks: {silent:#?}"
    );
}
