//! How far medians are off.

use numerics::quantile;

use super::{Page, Panel, SIZE, class, escaped, key_area, key_item};
use crate::{
    backtest::{JUDGED_RULS_FH, RulSummary},
    chart::{Axis, Chart, Quantiles},
    contest::Replays,
};

/// The place of the median.
const MEDIAN: usize = 10;
/// Bins over the share of a life, and over the remaining life.
const SHARES: usize = 12;
const LIFE_BIN_FH: f64 = 250.0;
/// True remaining lives are drawn up to this, flight hours.
const LONGEST_FH: f64 = 4000.0;
/// Fewest predictions of a band.
const MIN_PREDICTIONS: usize = 5;
/// Relative errors are drawn within.
const ERROR_RANGE: [f64; 2] = [-1.0, 1.5];

/// Time, failure and predicted median of every prediction before failure of some runs; a censored median is
/// infinite.
fn medians(page: &Page, replays: &Replays, runs: &[usize]) -> Vec<[f64; 3]> {
    let of_run = |run: &usize| {
        let failure_fh = page.judged.recorded[*run].run.failure_fh.unwrap_or_default();
        let before = replays.runs[*run].predictions.iter().filter(move |p| p.t_fh < failure_fh);
        before.map(move |p: &RulSummary| [p.t_fh, failure_fh, p.quantiles_fh[MEDIAN].unwrap_or(f64::INFINITY)])
    };
    runs.iter().flat_map(of_run).collect()
}

/// 10, 50 and 90 % of the second of pairs, in bins of the first: three lines.
fn bands(pairs: &[(f64, f64)], width: f64, bins: usize) -> [Vec<(f64, f64)>; 3] {
    let mut lines = [Vec::new(), Vec::new(), Vec::new()];
    for bin in 0..bins {
        let inside = pairs.iter().filter(|(at, _)| (at / width) as usize == bin).map(|(_, value)| *value);
        let values = quantile::sorted(inside.collect());
        if values.len() < MIN_PREDICTIONS {
            continue;
        }
        for (line, level) in lines.iter_mut().zip([0.1, 0.5, 0.9]) {
            line.push(((bin as f64 + 0.5) * width, quantile::nearest(&values, level)));
        }
    }
    lines
}

/// One panel for each estimator, a band for each group.
fn panels(
    page: &Page,
    axes: [Axis; 2],
    reference: &[(f64, f64)],
    bins: (f64, usize),
    pair: impl Fn([f64; 3]) -> (f64, f64),
) -> Vec<Panel> {
    let groups = page.split();
    let panel = |replays: &Replays| {
        let mut chart = Chart::new(SIZE, axes[0], axes[1]);
        let of_group = |(_, group): &(usize, String)| {
            let pairs: Vec<_> = medians(page, replays, &page.runs_of(group)).into_iter().map(&pair).collect();
            bands(&pairs, bins.0, bins.1)
        };
        let lines: Vec<_> = groups.iter().map(of_group).collect();
        lines.iter().enumerate().for_each(|(i, [low, _, high])| chart.band(&class(i), low, high));
        chart.line("truth", reference);
        lines.iter().enumerate().for_each(|(i, [_, median, _])| chart.line(&class(i), median));
        let label = format!("{} against {}, {}", axes[1].name, axes[0].name, replays.estimator);
        Panel { title: replays.estimator.to_owned(), svg: chart.finish(&label) }
    };
    page.judged.replays.iter().map(panel).collect()
}

/// The key of the groups.
fn group_key(page: &Page, more: &str) -> String {
    let item = |(i, (_, group)): (usize, (usize, String))| key_item(&class(i), &escaped(&group));
    let items: String = page.split().into_iter().enumerate().map(item).collect();
    format!("<ul class=\"key\">{items}{}{more}</ul>", key_area("soft", "80 % of the predictions"))
}

/// Predicted medians against the truth, over all runs.
pub fn against_truth(page: &mut Page) {
    let (time, longest) = (&page.terms.time, page.terms.time.of(LONGEST_FH));
    let [true_life, median] = ["true remaining life", "predicted median"].map(|name| format!("{name}, {}", time.name));
    let x = Axis { name: &true_life, start: longest, end: 0.0 };
    let y = Axis { name: &median, start: 0.0, end: 1.5 * longest };
    let reference = [(longest, longest), (0.0, 0.0)];
    let bins = (time.of(LIFE_BIN_FH), (LONGEST_FH / LIFE_BIN_FH) as usize);
    let panels = panels(page, [x, y], &reference, bins, |[t_fh, failure_fh, median_fh]| {
        (time.of(failure_fh - t_fh), time.of(median_fh))
    });
    let key = group_key(page, &key_item("truth", "truth"));
    page.figure(
        concat!(
            "Predicted medians against the true remaining life, over all runs: median of the medians, and the range of ",
            "four fifths of them. A range that leaves the frame holds medians beyond it or beyond the horizon."
        ),
        &key,
        panels,
    );
}

/// Relative error over the share of life that has passed.
pub fn against_time(page: &mut Page) {
    let x = Axis { name: "share of the life that has passed", start: 0.0, end: 1.0 };
    let y = Axis { name: "relative error of the median", start: ERROR_RANGE[0], end: ERROR_RANGE[1] };
    let bins = (1.0 / SHARES as f64, SHARES);
    let panels = panels(page, [x, y], &[(0.0, 0.0), (1.0, 0.0)], bins, |[t_fh, failure_fh, median_fh]| {
        (t_fh / failure_fh, median_fh / (failure_fh - t_fh) - 1.0)
    });
    let key = group_key(page, "");
    page.figure(
        "Relative error of the predicted median over the life, over all runs; positive is too long.",
        &key,
        panels,
    );
}

/// Distributions of the errors that the first table has the medians of.
pub fn at_remaining_lives(page: &mut Page) {
    let (estimators, digits) = (page.judged.replays.len() as f64, page.terms.time.decimals());
    let panel = |(_, group): (usize, String)| {
        let x = Axis { name: "true remaining life", start: -0.5, end: JUDGED_RULS_FH.len() as f64 - 0.5 };
        let y = Axis { name: "relative error of the median", start: ERROR_RANGE[0], end: ERROR_RANGE[1] };
        let names = judged_lives(page).to_vec();
        let mut chart = Chart::new(SIZE, x, y).with_categories(names);
        chart.line("truth", &[(-0.5, 0.0), (JUDGED_RULS_FH.len() as f64, 0.0)]);
        for (i, replays) in page.judged.replays.iter().enumerate() {
            for which in 0..JUDGED_RULS_FH.len() {
                let place = which as f64 + 0.8 * ((i as f64 + 0.5) / estimators - 0.5);
                if let Some(quantiles) = errors_at(replays, &page.runs_of(&group), which) {
                    chart.quantiles(&class(i), place, 0.55 / estimators, quantiles);
                }
            }
        }
        let title = escaped(&group);
        Panel { svg: chart.finish(&format!("Distribution of errors at given remaining lives, {title} runs")), title }
    };
    let panels = page.split().into_iter().map(panel).collect();
    let key = page.key("");
    let [long, middle, short] = JUDGED_RULS_FH.map(|rul_fh| page.terms.time.of(rul_fh));
    let caption = format!(
        concat!(
            "Distribution over runs of the relative error of the median when {:.*}, {:.*} and {:.*} {} were truly left: boxes ",
            "hold half, whiskers four fifths of the runs. A whisker that leaves the frame holds errors beyond it."
        ),
        digits, long, digits, middle, digits, short, page.terms.time.name
    );
    page.figure(&caption, &key, panels);
}

/// The true remaining lives at which errors are judged, in words.
fn judged_lives(page: &Page) -> [String; 3] {
    let time = &page.terms.time;
    JUDGED_RULS_FH.map(|rul_fh| format!("{:.*} {}", time.decimals(), time.of(rul_fh), time.name))
}

/// 10, 25, 50, 75 and 90 % of the errors; `None` without one, or where most are censored.
fn errors_at(replays: &Replays, runs: &[usize], which: usize) -> Option<Quantiles> {
    let error = |run: &usize| replays.runs[*run].score.as_ref()?.median_errors[which];
    let errors = quantile::sorted(runs.iter().filter_map(error).collect());
    if errors.is_empty() || !quantile::nearest(&errors, 0.5).is_finite() {
        return None;
    }
    Some([0.1, 0.25, 0.5, 0.75, 0.9].map(|level| quantile::nearest(&errors, level).min(100.0)))
}

/// Share of the runs that meet the criterion over the share of life.
pub fn alpha_lambda(page: &mut Page) {
    let panel = |(place, group): (usize, String)| {
        let x = Axis { name: "share of the life that has passed, &#955;", start: 0.0, end: 1.0 };
        let mut chart = Chart::new(SIZE, x, Axis { name: "share of the runs", start: 0.0, end: 1.0 });
        for (i, judgement) in page.metrics.estimators.iter().enumerate() {
            let Some((_, scores)) = judgement.groups().nth(place) else { continue };
            let points = scores.board.alpha_lambda.iter().filter_map(|at| Some((at.lambda, at.met?)));
            let points: Vec<_> = points.collect();
            chart.line(&class(i), &points);
            points.iter().for_each(|&point| {
                chart.dot(&class(i), point, &format!("{}: {:.2}", judgement.estimator, point.1));
            });
        }
        let title = escaped(&group);
        Panel { svg: chart.finish(&format!("Runs that meet the criterion, {title}")), title }
    };
    let panels = page.split().into_iter().map(panel).collect();
    let key = page.key("");
    page.figure(
        "&alpha;-&lambda; accuracy: share of the runs with at least half of the draws within &plusmn; 25 % of the truth.",
        &key,
        panels,
    );
}
