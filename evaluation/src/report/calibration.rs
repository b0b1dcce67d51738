//! Whether probabilities mean what they say, and how sharp they are.

use domain::scoreboard::{RulBin, Scoreboard};

use super::{Page, Panel, SIZE, class, escaped, key_item};
use crate::{
    backtest::BIN_FH,
    chart::{Axis, Chart},
    terms::Unit,
};

/// Fewest predictions of a point.
const MIN_PREDICTIONS: usize = 10;
/// The score is drawn up to this, flight hours.
const WORST_FH: f64 = 1000.0;
/// A histogram is drawn up to this multiple of an even one.
const TALLEST: f64 = 4.0;

/// One panel for each group, a line for each estimator.
fn lines(
    page: &Page,
    axes: [Axis; 2],
    truth: &[(f64, f64)],
    points: impl Fn(&Scoreboard) -> Vec<(f64, f64)>,
) -> Vec<Panel> {
    let panel = |(place, group): (usize, String)| {
        let mut chart = Chart::new(SIZE, axes[0], axes[1]);
        chart.line("truth", truth);
        for (i, judgement) in page.metrics.estimators.iter().enumerate() {
            let Some((_, scores)) = judgement.groups().nth(place) else { continue };
            let points = points(&scores.board);
            chart.line(&class(i), &points);
            for &(x, y) in &points {
                chart.dot(&class(i), (x, y), &format!("{}: {y:.2}", judgement.estimator));
            }
        }
        let title = escaped(&group);
        Panel { svg: chart.finish(&format!("{} against {}, {title} runs", axes[1].name, axes[0].name)), title }
    };
    page.split().into_iter().map(panel).collect()
}

/// How often failures came before the time that was given a probability.
pub fn reliability(page: &mut Page) {
    let x = Axis { name: "predicted probability", start: 0.0, end: 1.0 };
    let y = Axis { name: "share of failures", start: 0.0, end: 1.0 };
    let panels = lines(page, [x, y], &[(0.0, 0.0), (1.0, 1.0)], |board| {
        let Some(pit) = &board.pit else { return Vec::new() };
        let mut below = 0.0;
        let upper = pit.iter().enumerate().map(|(bin, share)| {
            below += share;
            ((bin + 1) as f64 / pit.len() as f64, below)
        });
        std::iter::once((0.0, 0.0)).chain(upper).collect()
    });
    let key = page.key(&key_item("truth", "calibrated"));
    page.figure(
        concat!(
            "Reliability: how often the failure came before the time that was given this probability. On the dashed line ",
            "probabilities mean what they say; above it failures come earlier than predicted."
        ),
        &key,
        panels,
    );
}

/// Histograms of the probability integral transform, a panel for each estimator.
pub fn histograms(page: &mut Page) {
    let groups = page.split();
    let panel = |judgement: &crate::judgement::Judgement| {
        let x = Axis { name: "probability integral transform", start: 0.0, end: 1.0 };
        let mut chart = Chart::new(SIZE, x, Axis { name: "relative frequency", start: 0.0, end: TALLEST });
        for (i, (place, _)) in groups.iter().enumerate() {
            let board = judgement.groups().nth(*place).map(|(_, scores)| &scores.board);
            let Some(pit) = board.and_then(|board| board.pit.as_ref()) else { continue };
            let width = 1.0 / (pit.len() * groups.len()) as f64;
            for (bin, share) in pit.iter().enumerate() {
                let from = (bin * groups.len() + i) as f64 * width;
                chart.bar(&class(i), [from, from + 0.9 * width], share * pit.len() as f64);
            }
        }
        chart.line("truth", &[(0.0, 1.0), (1.0, 1.0)]);
        let label = format!("Histogram of the probability integral transform, {}", judgement.estimator);
        Panel { title: judgement.estimator.to_owned(), svg: chart.finish(&label) }
    };
    let panels = page.metrics.estimators.iter().map(panel).collect();
    let items = groups
        .iter()
        .enumerate()
        .map(|(i, (_, group))| super::key_area(&format!("{} dense", class(i)), &escaped(group)));
    let key = format!("<ul class=\"key\">{}{}</ul>", items.collect::<String>(), key_item("truth", "calibrated"));
    page.figure(
        concat!(
            "Probability integral transform: where in its predicted distribution the truth lay. Even is calibrated; a hump ",
            "is too wide, high ends are too narrow, a slope to the right is too short. Bars that leave the frame are cut."
        ),
        &key,
        panels,
    );
}

/// Middle of a bin of true remaining life.
fn middle_fh(bin: &RulBin) -> f64 {
    0.5 * (bin.from_fh + bin.to_fh.unwrap_or(bin.from_fh + BIN_FH))
}

/// The axis of true remaining life, to the right as time goes.
fn life_axis<'a>(page: &Page, name: &'a str) -> Axis<'a> {
    let bins = &page.metrics.estimators[0].all.board.by_rul;
    let end = bins.last().map_or(1.0, |bin| bin.from_fh + BIN_FH);
    Axis { name, start: page.terms.time.of(end), end: 0.0 }
}

fn points(board: &Scoreboard, time: &Unit, value: impl Fn(&RulBin) -> Option<f64>) -> Vec<(f64, f64)> {
    let told = board.by_rul.iter().filter(|bin| bin.predictions >= MIN_PREDICTIONS);
    told.filter_map(|bin| Some((time.of(middle_fh(bin)), value(bin)?))).collect()
}

/// The score against the true remaining life.
pub fn score_against_life(page: &mut Page) {
    let time = &page.terms.time;
    let [life, score] = ["true remaining life", "CRPS"].map(|name| format!("{name}, {}", time.name));
    let y = Axis { name: &score, start: 0.0, end: time.of(WORST_FH) };
    let told = |board: &Scoreboard| points(board, time, |bin| bin.crps_fh.map(|crps_fh| time.of(crps_fh)));
    let panels = lines(page, [life_axis(page, &life), y], &[], told);
    let [width, worst] = [BIN_FH, WORST_FH].map(|fh| format!("{:.*} {}", time.decimals(), time.of(fh), time.name));
    let caption = format!(
        concat!(
            "CRPS against the true remaining life, means over bins of {}, the last one open. An estimator that leaves ",
            "the frame is more than {} off."
        ),
        width, worst
    );
    page.figure(&caption, &page.key(""), panels);
}

/// Coverage against the true remaining life.
pub fn coverage_against_life(page: &mut Page) {
    let time = &page.terms.time;
    let life = format!("true remaining life, {}", time.name);
    let x = life_axis(page, &life);
    let y = Axis { name: "share covered by 80 % intervals", start: 0.0, end: 1.0 };
    let told = |board: &Scoreboard| points(board, time, |bin| bin.coverage.level_80);
    let panels = lines(page, [x, y], &[(x.start, 0.8), (0.0, 0.8)], told);
    let key = page.key(&key_item("truth", "promised"));
    page.figure(
        concat!(
            "Coverage of the central 80 % intervals against the true remaining life. Given the true remaining life no ",
            "estimator covers evenly: very long and very short lives are rare and lie in the tails."
        ),
        &key,
        panels,
    );
}
