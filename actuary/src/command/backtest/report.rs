//! `report.html`: one page that needs nothing else.

use std::fmt::Write as _;

use prognosis::backtest::{CRITERION, RulSummary, Scoreboard};

use super::{
    Judged,
    chart::{Axis, Chart},
    histories::Recorded,
    metrics::{Metrics, percent},
};

const STYLE: &str = include_str!("report.css");
/// Colours of the style.
const COLOURS: usize = 6;
/// Runs with a chart, over all regimes.
const CHARTS: usize = 6;
/// Where the 10, 50 and 90 % quantiles are.
const LOW: usize = 2;
const MEDIAN: usize = 10;
const HIGH: usize = 18;

/// The page.
pub fn page(metrics: &Metrics, judged: &Judged) -> String {
    let body = [head(metrics), table(metrics), runs(judged), reliability(metrics, judged), words(metrics)].concat();
    format!(
        concat!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">",
            "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">",
            "<title>Backtest of remaining life</title><style>{}</style></head><body>{}</body></html>\n"
        ),
        STYLE, body
    )
}

fn head(metrics: &Metrics) -> String {
    let settings = &metrics.settings;
    format!(
        concat!(
            "<h1>Backtest of remaining life</h1>",
            "<p class=\"soft\">{} runs, {} of known failure. A prediction every {} flight hours from what was observed ",
            "until then, {} draws, horizon {} h. Advisory; no maintenance credit.</p>"
        ),
        metrics.runs.predicted, metrics.runs.judged, settings.every_fh, settings.draws, settings.horizon_fh
    )
}

fn table(metrics: &Metrics) -> String {
    let mut rows = String::new();
    for judgement in &metrics.estimators {
        for (i, (group, board)) in judgement.groups().enumerate() {
            let class = if i == 0 { " class=\"first\"" } else { "" };
            write!(rows, "<tr{class}><td>{}</td><td>{}</td>{}</tr>", judgement.estimator, escaped(group), cells(board))
                .expect("writing to a string");
        }
    }
    format!(
        concat!(
            "<h2>Summary</h2><div class=\"scroll\"><table><thead><tr><th>estimator</th><th>group</th><th>runs</th>",
            "<th>predictions</th><th>CRPS<br>h</th><th>80 %<br>intervals</th><th>95 %<br>intervals</th>",
            "<th>80 %, last<br>1000 h</th><th>error at<br>3000 h</th><th>error at<br>1500 h</th>",
            "<th>error at<br>500 h</th><th>horizon<br>h</th></tr></thead><tbody>{}</tbody></table></div>"
        ),
        rows
    )
}

fn cells(board: &Scoreboard) -> String {
    let number = |value: Option<f64>, digits| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
    let share = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{:.0} %", 100.0 * value));
    let mut cells = vec![board.runs.to_string(), board.predictions.to_string(), number(board.crps_fh, 1)];
    cells.extend([board.coverage.level_80, board.coverage.level_95, board.coverage_below_1000_fh.level_80].map(share));
    cells.extend(board.at_rul.iter().map(|at| percent(at.runs, at.relative_error)));
    cells.push(number(board.prognostic_horizon.median_fh, 0));
    cells.iter().map(|cell| format!("<td>{cell}</td>")).collect()
}

fn runs(judged: &Judged) -> String {
    let chosen = chosen(judged.recorded);
    let charts: String = chosen.iter().enumerate().map(|(id, &run)| run_chart(id, run, judged)).collect();
    format!(
        concat!(
            "<h2>Predicted and true remaining life</h2><p>Median and 80 % interval of each prediction over the life of ",
            "some runs: short, middling and long ones. A triangle at the upper edge is a median beyond it.</p>",
            "{}<div class=\"charts\">{}</div>"
        ),
        key(
            judged,
            "<li><span class=\"cone\"></span>truth &plusmn; 25 %</li><li><span class=\"truth\"></span>truth</li>"
        ),
        charts
    )
}

/// Runs of known failure, spread over the length of life within each regime.
fn chosen(recorded: &[Recorded]) -> Vec<usize> {
    let known = |run: &usize| recorded[*run].run.failure_fh.is_some();
    let mut regimes: Vec<_> = (0..recorded.len()).filter(known).map(|run| &recorded[run].regime).collect();
    regimes.sort();
    regimes.dedup();
    regimes.truncate(CHARTS);
    let mut chosen = Vec::new();
    for regime in &regimes {
        let mut runs: Vec<usize> =
            (0..recorded.len()).filter(known).filter(|run| recorded[*run].regime == **regime).collect();
        runs.sort_by(|a, b| {
            let failure_fh = |run: usize| recorded[run].run.failure_fh.unwrap_or_default();
            failure_fh(*a).total_cmp(&failure_fh(*b))
        });
        let count = (CHARTS / regimes.len()).min(runs.len());
        chosen.extend((0..count).map(|i| runs[(2 * i + 1) * runs.len() / (2 * count)]));
    }
    chosen
}

fn run_chart(id: usize, run: usize, judged: &Judged) -> String {
    let Recorded { run: recorded, regime } = &judged.recorded[run];
    let failure_fh = recorded.failure_fh.unwrap_or_default().max(1.0);
    let top = 1.5 * failure_fh;
    let x = Axis { name: "flight hours", end: failure_fh };
    let mut chart = Chart::new(id, x, Axis { name: "remaining life, h", end: top });
    let cone = |factor: f64| (0.0, factor * failure_fh);
    chart.area("cone", &[cone(1.0 + CRITERION.alpha), (failure_fh, 0.0), cone(1.0 - CRITERION.alpha)]);
    chart.line("truth", &[(0.0, failure_fh), (failure_fh, 0.0)]);
    for (i, replays) in judged.replays.iter().enumerate() {
        draw_predictions(&mut chart, replays.estimator, &class(i), &replays.runs[run].predictions, top);
    }
    let name = escaped(&recorded.id);
    let regime = regime.as_ref().map_or(String::new(), |regime| format!(", {}", escaped(regime)));
    let caption = format!("run {name}{regime}: failed at {failure_fh:.0} h");
    format!("<figure><h3>{caption}</h3>{}</figure>", chart.finish(&caption))
}

/// Interval and median; what is censored counts as beyond the upper edge.
fn draw_predictions(chart: &mut Chart, estimator: &str, class: &str, predictions: &[RulSummary], top: f64) {
    let points = |level: usize| {
        predictions.iter().map(move |p| (p.t_fh, p.quantiles_fh[level].unwrap_or(2.0 * top))).collect::<Vec<_>>()
    };
    let mut interval = points(HIGH);
    interval.extend(points(LOW).into_iter().rev());
    chart.area(class, &interval);
    chart.line(class, &points(MEDIAN));
    for prediction in predictions {
        let t_fh = prediction.t_fh;
        match prediction.quantiles_fh[MEDIAN] {
            Some(median) if median <= top => {
                chart.dot(class, (t_fh, median), &format!("{estimator} at {t_fh} h: {median:.0} h"));
            }
            Some(median) => chart.beyond(class, t_fh, &format!("{estimator} at {t_fh} h: {median:.0} h")),
            None => chart.beyond(class, t_fh, &format!("{estimator} at {t_fh} h: beyond the horizon")),
        }
    }
}

fn reliability(metrics: &Metrics, judged: &Judged) -> String {
    let groups: Vec<&str> = metrics.estimators[0].groups().map(|(group, _)| group).collect();
    let chart = |(place, group): (usize, &&str)| {
        let id = CHARTS + place;
        let mut chart = Chart::new(
            id,
            Axis { name: "predicted probability", end: 1.0 },
            Axis { name: "share of failures", end: 1.0 },
        );
        chart.line("truth", &[(0.0, 0.0), (1.0, 1.0)]);
        for (i, judgement) in metrics.estimators.iter().enumerate() {
            let board = judgement.groups().nth(place).map(|(_, board)| board);
            let Some(pit) = board.and_then(|board| board.pit.as_ref()) else { continue };
            let (mut below, mut points) = (0.0, vec![(0.0, 0.0)]);
            for (bin, share) in pit.iter().enumerate() {
                below += share;
                points.push(((bin + 1) as f64 / pit.len() as f64, below));
            }
            chart.line(&class(i), &points);
            points.iter().for_each(|&point| chart.dot(&class(i), point, &format!("{:.2}", point.1)));
        }
        let caption = format!("{} runs", escaped(group));
        format!("<figure><h3>{caption}</h3>{}</figure>", chart.finish(&format!("Reliability, {caption}")))
    };
    format!(
        concat!(
            "<h2>Reliability</h2><p>How often the failure came before the time that was given this probability. On the ",
            "dashed line probabilities mean what they say; above it failures come earlier than predicted.</p>",
            "{}<div class=\"charts\">{}</div>"
        ),
        key(judged, "<li><span class=\"truth\"></span>calibrated</li>"),
        groups.iter().enumerate().map(chart).collect::<String>()
    )
}

fn words(metrics: &Metrics) -> String {
    let sigma: Vec<String> = metrics
        .settings
        .observation_sigma
        .iter()
        .map(|(name, sigma)| format!("{} {sigma:.4}", escaped(name)))
        .collect();
    let error = match metrics.settings.failure_time_error_fh {
        Some([offset, sd]) => format!("{offset:+.0} &plusmn; {sd:.0} h"),
        None => "not known".to_owned(),
    };
    format!(
        concat!(
            "<h2>Words</h2><p><b>CRPS</b>: continuous ranked probability score, mean over all predictions before ",
            "failure; the distance between distribution and truth, in hours; less is better. <b>Intervals</b>: share of ",
            "the central intervals that hold the true remaining life; as many as they promise is best. <b>Error at</b>: ",
            "median over runs of the relative error of the median when so much life was truly left. <b>Horizon</b>: true ",
            "remaining life when half of the draws first lie within &plusmn; 25 % of it, median over runs. ",
            "<b>Censored</b>: beyond the horizon, which counts as the horizon in the score.</p>",
            "<p class=\"soft\">Standard deviation of one observation: {}. Error of the surrogate boundary in failure ",
            "time: {}. Actuary {}, seed {}.</p>"
        ),
        sigma.join(", "),
        error,
        metrics.settings.code_version,
        metrics.settings.seed
    )
}

/// Which colour is which estimator.
fn key(judged: &Judged, more: &str) -> String {
    let item = |(i, replays): (usize, &super::Replays)| {
        format!("<li><span class=\"{}\"></span>{}</li>", class(i), replays.estimator)
    };
    format!("<ul class=\"key\">{}{more}</ul>", judged.replays.iter().enumerate().map(item).collect::<String>())
}

fn class(estimator: usize) -> String {
    format!("c{}", estimator % COLOURS)
}

/// Text from a file, without markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
