//! `report.html`: one page of numbered figures and tables that needs nothing else.

mod calibration;
mod errors;
mod lives;
mod tables;

use std::fmt::Write as _;

use crate::{
    Recorded,
    contest::{Judged, Replays},
    judgement::Metrics,
    terms::{Terms, escaped},
};

const STYLE: &str = include_str!("report.css");
/// Colours and dashes of the style.
const CLASSES: usize = 7;
/// Size of a chart, pixels.
const SIZE: [f64; 2] = [400.0, 270.0];

/// Of lives whose law may be told.
const ORACLE: &str = concat!(
    "<dt>Oracle</dt><dd>A filter that is told how the very life grows, and changes of growth once they have come: what ",
    "is left is the error of diagnoses, the noise of wear and the future. It bounds what can be known.</dd>",
);

/// The page.
pub fn page(metrics: &Metrics, judged: &Judged) -> String {
    let terms = judged.terms.escaped();
    let mut page = Page { judged, metrics, body: head(metrics, &terms), terms, figures: 0, tables: 0 };
    page.heading("Results");
    tables::errors(&mut page);
    tables::scores(&mut page);
    page.heading("Runs to failure");
    lives::history(&mut page);
    if page.terms.actuators {
        lives::observation_error(&mut page);
    }
    lives::predictions(&mut page);
    page.heading("Errors");
    errors::against_truth(&mut page);
    errors::against_time(&mut page);
    errors::at_remaining_lives(&mut page);
    errors::alpha_lambda(&mut page);
    page.heading("Calibration and sharpness");
    calibration::reliability(&mut page);
    calibration::histograms(&mut page);
    calibration::score_against_life(&mut page);
    calibration::coverage_against_life(&mut page);
    page.body += &words(metrics, &page.terms);
    format!(
        concat!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">",
            "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">",
            "<meta name=\"color-scheme\" content=\"light dark\">",
            "<title>Backtest of remaining life</title><style>{}</style></head><body>{}</body></html>\n"
        ),
        STYLE, page.body
    )
}

/// The page under construction.
struct Page<'a> {
    judged: &'a Judged<'a>,
    metrics: &'a Metrics,
    /// Without markup.
    terms: Terms,
    body: String,
    figures: usize,
    tables: usize,
}

/// One chart of a figure.
struct Panel {
    /// What is different about it; with markup.
    title: String,
    /// The chart.
    svg: String,
}

impl Page<'_> {
    fn heading(&mut self, text: &str) {
        self.put(format_args!("<h2>{text}</h2>"));
    }

    /// Panels under one caption, with a key above them; nothing without panels.
    fn figure(&mut self, caption: &str, key: &str, panels: Vec<Panel>) {
        if panels.is_empty() {
            return;
        }
        self.figures += 1;
        let panel = |panel: &Panel| format!("<div class=\"panel\"><h3>{}</h3>{}</div>", panel.title, panel.svg);
        let panels: String = panels.iter().map(panel).collect();
        let number = self.figures;
        self.put(format_args!(
            "<figure id=\"figure-{number}\">{key}<div class=\"panels\">{panels}</div><figcaption><b>Figure {number}.</b> {caption}</figcaption></figure>"
        ));
    }

    /// Rows under a caption.
    fn table(&mut self, caption: &str, head: &str, rows: &str) {
        self.tables += 1;
        let number = self.tables;
        self.put(format_args!(
            "<figure id=\"table-{number}\"><figcaption><b>Table {number}.</b> {caption}</figcaption><div class=\"scroll\"><table><thead>{head}</thead><tbody>{rows}</tbody></table></div></figure>"
        ));
    }

    fn put(&mut self, markup: std::fmt::Arguments) {
        self.body.write_fmt(markup).expect("writing to a string");
    }

    /// Names of the groups of runs: all, then the regimes.
    fn groups(&self) -> Vec<String> {
        self.metrics.estimators[0].groups().map(|(group, _)| group.to_owned()).collect()
    }

    /// Those that a figure splits into: the regimes, or all runs where there are none.
    fn split(&self) -> Vec<(usize, String)> {
        let groups: Vec<_> = self.groups().into_iter().enumerate().collect();
        if groups.len() > 1 { groups[1..].to_vec() } else { groups }
    }

    /// Runs of known failure in a group by its name.
    fn runs_of(&self, group: &str) -> Vec<usize> {
        let recorded = self.judged.recorded;
        let inside = |run: &usize| {
            let Recorded { run, regime, .. } = &recorded[*run];
            run.failure_fh.is_some() && (group == "all" || regime.as_deref() == Some(group))
        };
        (0..recorded.len()).filter(inside).collect()
    }

    /// Which line is which estimator.
    fn key(&self, more: &str) -> String {
        let item = |(i, replays): (usize, &Replays)| key_item(&class(i), replays.estimator);
        let items: String = self.judged.replays.iter().enumerate().map(item).collect();
        format!("<ul class=\"key\">{items}{more}</ul>")
    }
}

/// An item of a key: a sample of a line, and a text.
fn key_item(class: &str, text: &str) -> String {
    format!(
        "<li><svg class=\"sample\" viewBox=\"0 0 28 10\" aria-hidden=\"true\"><polyline class=\"line {class}\" points=\"0,5 28,5\"/></svg>{text}</li>"
    )
}

/// An item of a key: a sample of an area, and a text.
fn key_area(class: &str, text: &str) -> String {
    format!(
        "<li><svg class=\"sample\" viewBox=\"0 0 28 10\" aria-hidden=\"true\"><polygon class=\"area {class}\" points=\"0,0 28,0 28,10 0,10\"/></svg>{text}</li>"
    )
}

fn class(estimator: usize) -> String {
    format!("c{}", estimator % CLASSES)
}

fn head(metrics: &Metrics, Terms { time, .. }: &Terms) -> String {
    let settings = &metrics.settings;
    let names: Vec<&str> = metrics.estimators.iter().map(|judgement| judgement.estimator).collect();
    format!(
        concat!(
            "<h1>Backtest of remaining life</h1>",
            "<p class=\"soft\">{}: {} runs, {} of known failure. A prediction every {} {} from what was ",
            "observed until then and nothing else, {} draws, horizon {} {}. Brackets hold {:.0} % bootstrap intervals ",
            "over runs. Advisory; no maintenance credit.</p>"
        ),
        names.join(", "),
        metrics.runs.predicted,
        metrics.runs.judged,
        time.told(settings.every_fh),
        time.axis,
        settings.draws,
        time.told(settings.horizon_fh),
        time.name,
        100.0 * settings.interval_level
    )
}

/// What was noticed in reading the lives.
fn notes(lines: &[String]) -> String {
    let items: String = lines.iter().map(|line| format!("<li>{line}</li>")).collect();
    if items.is_empty() { items } else { format!("<h2>How the lives were read</h2><ul class=\"soft\">{items}</ul>") }
}

fn words(metrics: &Metrics, terms: &Terms) -> String {
    let settings = &metrics.settings;
    let sigma = settings.observation_sigma.iter();
    let sigma: Vec<String> =
        sigma.map(|(name, sigma)| format!("{} {:.4}", escaped(name), terms.deviation.of(*sigma))).collect();
    let error = match settings.failure_time_error_fh {
        Some([offset, sd]) => format!("{offset:+.0} &plusmn; {sd:.0} h"),
        None => "not known".to_owned(),
    };
    let (of, error) = match terms.actuators {
        true => (String::new(), format!("Error of the surrogate boundary in failure time: {error}. ")),
        false => (format!(" ({})", terms.deviation.axis), String::new()),
    };
    format!(
        concat!(
            "<h2>Words and settings</h2><dl>",
            "<dt>CRPS</dt><dd>Continuous ranked probability score: the distance between distribution and truth, in {}, ",
            "mean over all predictions before failure; less is better. What is beyond the horizon counts as the horizon.</dd>",
            "<dt>Coverage</dt><dd>Share of the central intervals that hold the true remaining life; as many as they promise ",
            "is best.</dd>",
            "<dt>Error</dt><dd>(predicted median &minus; true remaining life) / true remaining life; positive is too long.</dd>",
            "<dt>&alpha;-&lambda;</dt><dd>Whether at a share &lambda; of the life at least half of the draws lie within ",
            "&plusmn; 25 % of the true remaining life.</dd>",
            "<dt>Horizon</dt><dd>True remaining life when that is first so (&plusmn; 25 %), and from when on the median stays ",
            "within a tenth of the whole life of the truth until failure; medians over runs, zero for a run where it never is.</dd>",
            "<dt>Beyond, doubted</dt><dd>Share of the predictions whose median is beyond the horizon, and of those that ",
            "the estimator advises not to trust, because the life is unlike those that it knows.</dd>",
            "{}</dl><p class=\"soft\">Standard deviation of one observation: {}{}. {}{} ",
            "resamples of the runs. Actuary {}, seed {}.</p>{}"
        ),
        terms.time.words,
        if terms.actuators { ORACLE } else { "" },
        sigma.join(", "),
        of,
        error,
        settings.resamples,
        settings.code_version,
        settings.seed,
        notes(&terms.notes)
    )
}
