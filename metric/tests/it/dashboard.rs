//! `dashboards/fleet.json` asks for metrics and labels that there are, and shows every metric.

use std::collections::BTreeSet;

use metric::{ALL, Metric, MetricKind};
use serde_json::Value;

/// Words of the query language that are no metric.
const WORDS: [&str; 8] = ["by", "changes", "histogram_quantile", "increase", "label_values", "max", "rate", "sum"];
/// Labels that every series has by being scraped, and that of a bucket.
const SCRAPED: [&str; 3] = ["instance", "job", "le"];

/// A query in its parts, without what is in quotes and in brackets.
#[derive(Debug, Default)]
struct Query {
    metrics: BTreeSet<String>,
    labels: BTreeSet<String>,
}

fn is_word(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

impl Query {
    fn read(text: &str) -> Self {
        let unquoted: String = text.split('"').step_by(2).collect();
        let mut query = Self::default();
        let (mut inside, mut word, mut after_by) = (Vec::new(), String::new(), false);
        for letter in unquoted.chars().chain([' ']) {
            if is_word(letter) {
                word.push(letter);
                continue;
            }
            query.take(&std::mem::take(&mut word), inside.last().copied(), &mut after_by);
            match letter {
                // Parentheses behind `by` hold labels, as braces do.
                '(' if after_by => inside.push('{'),
                '(' | '{' | '[' => inside.push(letter),
                ')' | '}' | ']' => drop(inside.pop()),
                ' ' => continue,
                _ => {}
            }
            after_by = false;
        }
        assert_eq!((inside.len(), text.matches('"').count() % 2), (0, 0), "{text}: what is opened is closed");
        query
    }

    fn take(&mut self, word: &str, inside: Option<char>, after_by: &mut bool) {
        if word.is_empty() || inside == Some('[') || word.starts_with(|first: char| first.is_ascii_digit()) {
            return;
        }
        if inside == Some('{') {
            self.labels.insert(word.to_owned());
        } else {
            *after_by = word == "by";
            self.metrics.extend((!WORDS.contains(&word)).then(|| word.to_owned()));
        }
    }
}

/// The metric that a series belongs to: histograms are told by three.
fn of_series(series: &str) -> Option<Metric> {
    ALL.into_iter().find(|metric| match metric.kind {
        MetricKind::Counter | MetricKind::Gauge => series == metric.name,
        MetricKind::Seconds | MetricKind::Numbers => {
            ["_bucket", "_count", "_sum"].iter().any(|end| series.strip_suffix(end) == Some(metric.name))
        }
    })
}

/// The queries of the dashboard, each with the labels by which its lines are named.
fn queries() -> Vec<(String, Vec<String>)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../dashboards/fleet.json");
    let dashboard: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let targets = dashboard["panels"].as_array().unwrap().iter().filter_map(|panel| panel["targets"].as_array());
    let shown = targets.flatten().map(|target| {
        let named = target["legendFormat"].as_str().unwrap().split("{{").skip(1);
        let named = named.map(|rest| rest.split_once("}}").expect("closed").0.trim().to_owned());
        (target["expr"].as_str().unwrap().to_owned(), named.collect())
    });
    let variables = dashboard["templating"]["list"].as_array().unwrap().iter();
    let asked = variables.filter_map(|variable| variable["query"]["query"].as_str());
    shown.chain(asked.map(|query| (query.replace(", job", ""), Vec::new()))).collect()
}

#[test]
fn the_dashboard_asks_for_metrics_and_labels_that_there_are_and_shows_every_metric() {
    let mut shown = BTreeSet::new();
    for (text, named) in queries() {
        let query = Query::read(&text);
        assert!(!query.metrics.is_empty(), "{text}");
        let metrics =
            query.metrics.iter().map(|series| of_series(series).unwrap_or_else(|| panic!("{text}: {series}")));
        let metrics: Vec<Metric> = metrics.collect();
        for label in &query.labels {
            let known = metrics.iter().any(|metric| metric.labels.contains(&label.as_str()));
            assert!(known || SCRAPED.contains(&label.as_str()), "{text}: {label}");
        }
        for label in named {
            assert!(query.labels.contains(&label), "{text}: a line is named by {label}, which is summed up");
        }
        shown.extend(metrics.iter().map(|metric| metric.name));
    }
    let missing: Vec<_> = ALL.iter().map(|metric| metric.name).filter(|name| !shown.contains(name)).collect();
    assert!(missing.is_empty(), "not shown: {missing:?}");
}

#[test]
fn metrics_have_one_prefix_and_say_by_their_names_how_they_behave() {
    for metric in ALL {
        let Metric { name, kind, .. } = metric;
        assert!(name.starts_with("actuary_"), "{name}");
        assert_eq!(name.ends_with("_total"), kind == MetricKind::Counter, "{name}");
        assert!(kind != MetricKind::Seconds || name.ends_with("_seconds"), "{name}");
        for naming in ["tail", "position", "part_number", "serial_number", "operator"] {
            assert!(!metric.labels.contains(&naming), "{name} names a {naming}");
        }
    }
}

#[test]
fn a_query_is_read_into_metrics_and_labels() {
    let query =
        Query::read("histogram_quantile(0.5, sum by (le, route) (rate(a_bucket{job=~\"$job\", b!=\"c(\"}[$__x]))) + d");
    assert_eq!(query.metrics, ["a_bucket", "d"].map(str::to_owned).into());
    assert_eq!(query.labels, ["b", "job", "le", "route"].map(str::to_owned).into());
}
