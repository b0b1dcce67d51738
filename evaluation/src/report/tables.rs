//! The tables of the report.

use std::fmt::Write as _;

use super::{Page, escaped};
use crate::{
    backtest::{FIRST_JUDGED_FH, Interval, JUDGED_RULS_FH, LATE_FH},
    judgement::{GroupScores, percent},
    terms::Unit,
};

/// Regimes of the printed table of the thesis, and its median relative errors at 3000, 1500 and 500 h.
const THESIS: [(&str, [f64; 3]); 2] = [("constant", [0.239, -0.1885, -0.1704]), ("varying", [2.4364, 0.5011, 0.1895])];

/// The thesis's table 7.1: errors of the median at given true remaining lives.
pub fn errors(page: &mut Page) {
    let mut rows = String::new();
    for (_, group) in page.split() {
        if let Some((_, printed)) = THESIS.iter().find(|(regime, _)| *regime == group) {
            let cells: String = printed.iter().map(|&error| format!("<td>{}</td>", percent(1, Some(error)))).collect();
            row(&mut rows, true, "Berri 2021, on its own runs", &group, &format!("<td>50</td>{cells}"));
        }
        for (i, judgement) in page.metrics.estimators.iter().enumerate() {
            let Some((_, scores)) = judgement.groups().find(|(name, _)| *name == group) else { continue };
            let first = i == 0 && THESIS.iter().all(|(regime, _)| *regime != group);
            row(&mut rows, first, judgement.estimator, &group, &error_cells(scores));
        }
    }
    let time = &page.terms.time;
    let caption = format!(
        concat!(
            "Median over runs of the relative error of the predicted median, when so much life was truly left. ",
            "A run counts where it lived at least {:.*} {} before. At a long true remaining life a calibrated median is ",
            "too short on average, because long lives are the ones that get there."
        ),
        time.decimals(),
        time.of(FIRST_JUDGED_FH),
        time.name
    );
    let lives = JUDGED_RULS_FH.map(|rul_fh| format!("<th>{:.*} {}</th>", time.decimals(), time.of(rul_fh), time.name));
    let head = format!("<tr><th>estimator</th><th>runs</th><th>judged</th>{}</tr>", lives.concat());
    page.table(&caption, &head, &with_minus_signs(&rows));
}

fn error_cells(scores: &GroupScores) -> String {
    let mut cells = format!("<td>{}</td>", scores.board.runs);
    for (at, interval) in scores.board.at_rul.iter().zip(&scores.intervals.at_rul) {
        let count = if at.runs < scores.board.runs { format!(" <i>n = {}</i>", at.runs) } else { String::new() };
        let range = interval.map_or(String::new(), |Interval { low, high }| {
            format!("<br><small>[{:+.0}, {:+.0}]{count}</small>", 100.0 * low, 100.0 * high)
        });
        write!(cells, "<td>{}{range}</td>", percent(at.runs, at.relative_error)).expect("writing to a string");
    }
    cells
}

/// All scores with their intervals.
pub fn scores(page: &mut Page) {
    let mut rows = String::new();
    for group in page.groups() {
        for (i, judgement) in page.metrics.estimators.iter().enumerate() {
            let Some((_, scores)) = judgement.groups().find(|(name, _)| *name == group) else { continue };
            row(&mut rows, i == 0, judgement.estimator, &group, &score_cells(scores, &page.terms.time));
        }
    }
    let judged_by_oracle = oracle_words(page);
    let caption = format!(
        "{}{judged_by_oracle}",
        concat!(
            "Scores. The difference is that of the mean CRPS to the first estimator on the same runs: an interval without ",
            "zero is a difference that the choice of runs does not explain; below it the share of runs that are better. ",
            "Coverage, gap and the last column are in per cent."
        )
    );
    let head = scores_head(&page.terms.time);
    page.table(&caption, &head, &with_minus_signs(&rows));
}

fn scores_head(time: &Unit) -> String {
    let (unit, late) = (&time.name, format!("{:.*}", time.decimals(), time.of(LATE_FH)));
    format!(
        concat!(
            "<tr><th>estimator</th><th>runs</th><th>CRPS<br>{unit}</th><th>difference<br>{unit}</th><th>80 %<br>covers</th>",
            "<th>95 %<br>covers</th><th>80 %, last<br>{late} {unit}</th><th>95 %, last<br>{late} {unit}</th>",
            "<th>horizon<br>&plusmn; 25 %, {unit}</th><th>horizon<br>10 % of life, {unit}</th><th>relative<br>accuracy</th>",
            "<th>gap<br>closed</th><th>beyond,<br>doubted</th></tr>"
        ),
        unit = unit,
        late = late
    )
}

/// Which runs the oracle was told of, and what its gap is.
fn oracle_words(page: &Page) -> String {
    let Some(runs) = page.metrics.runs.judged_by_oracle else { return String::new() };
    let left_out = page.metrics.runs.judged - runs;
    let words = match left_out {
        0 => String::new(),
        _ => format!(
            " The law of {left_out} of {} runs is not known: the oracle and what is compared with it leave them out.",
            page.metrics.runs.judged
        ),
    };
    format!(
        "{words} Gap closed: the share of the way from the CRPS of climatology to that of the oracle, on the same runs."
    )
}

fn score_cells(scores: &GroupScores, time: &Unit) -> String {
    let GroupScores { board, intervals, against_first, oracle_gap, doubts } = scores;
    let hours = |value: Option<f64>, interval: Option<Interval>| {
        cell(value, interval, |value| format!("{:.*}", time.decimals(), time.of(value)))
    };
    let share = |value, interval| cell(value, interval, |value| format!("{:.0}", 100.0 * value));
    let difference = match against_first {
        Some(comparison) => {
            let signed = |value| format!("{:+.*}", time.decimals(), time.of(value));
            let range =
                comparison.interval_fh.map_or(String::new(), |i| format!("[{}, {}], ", signed(i.low), signed(i.high)));
            let better = 100.0 * comparison.better_runs;
            format!("<td>{}<br><small>{range}{better:.0} %</small></td>", signed(comparison.crps_difference_fh))
        }
        None => "<td>&ndash;</td>".to_owned(),
    };
    let late = board.coverage_below_1000_fh;
    [
        hours(board.crps_fh, intervals.crps_fh),
        difference,
        share(board.coverage.level_80, intervals.coverage_80),
        share(board.coverage.level_95, intervals.coverage_95),
        share(late.level_80, intervals.coverage_80_below_1000_fh),
        share(late.level_95, intervals.coverage_95_below_1000_fh),
        hours(board.prognostic_horizon.median_fh, intervals.horizon_fh),
        hours(board.life_horizon.sustained_median_fh, intervals.sustained_life_horizon_fh),
        cell(board.cumulative_relative_accuracy, None, |value| format!("{value:.2}")),
        share(oracle_gap.as_ref().map(|gap| gap.closed), oracle_gap.as_ref().and_then(|gap| gap.interval)),
        undecided_or_doubted(board.undecided, doubts.doubted),
    ]
    .concat()
}

/// Two shares, one over the other.
fn undecided_or_doubted(undecided: Option<f64>, doubted: Option<f64>) -> String {
    let per_cent = |share: Option<f64>| share.map_or("&ndash;".to_owned(), |share| format!("{:.1}", 100.0 * share));
    format!("<td>{}<br><small>{}</small></td>", per_cent(undecided), per_cent(doubted))
}

/// A value over its interval.
fn cell(value: Option<f64>, interval: Option<Interval>, written: impl Fn(f64) -> String) -> String {
    let Some(value) = value else { return "<td>&ndash;</td>".to_owned() };
    let range =
        interval.map_or(String::new(), |i| format!("<br><small>[{}, {}]</small>", written(i.low), written(i.high)));
    format!("<td>{}{range}</td>", written(value))
}

fn row(rows: &mut String, first: bool, estimator: &str, group: &str, cells: &str) {
    let class = if first { " class=\"first\"" } else { "" };
    write!(rows, "<tr{class}><td>{estimator}</td><td>{}</td>{cells}</tr>", escaped(group))
        .expect("writing to a string");
}

/// Numbers are written with hyphens; a page has a sign for minus.
fn with_minus_signs(rows: &str) -> String {
    ["[-", ", -", ">-"]
        .iter()
        .fold(rows.to_owned(), |rows, hyphen| rows.replace(hyphen, &hyphen.replace('-', "&minus;")))
}
