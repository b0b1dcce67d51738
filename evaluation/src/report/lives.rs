//! Single runs: what was observed, how well, and what was predicted from it.

use numerics::quantile;

use super::{Page, Panel, SIZE, class, escaped, key_area, key_item};
use crate::{
    Recorded,
    backtest::{CRITERION, RulSummary},
    chart::{Axis, Chart},
    terms::Terms,
};

/// Length of the means that a history is drawn with, flight hours.
const MEAN_FH: f64 = 20.0;
/// Places of the 2.5, 10, 50, 90 and 97.5 % quantiles.
const LEVELS: [usize; 5] = [0, 2, 10, 18, 20];
/// Predicted lives are drawn up to this multiple of the whole life.
const TOP: f64 = 1.6;

/// The run of middling length of every group that figures split into, with the name of the group.
fn typical(page: &Page) -> Vec<(usize, String)> {
    let recorded = page.judged.recorded;
    let failure_fh = |run: &usize| recorded[*run].run.failure_fh.unwrap_or_default();
    let of_group = |(_, group): (usize, String)| {
        let mut runs = page.runs_of(&group);
        runs.sort_by(|a, b| failure_fh(a).total_cmp(&failure_fh(b)));
        runs.get(runs.len() / 2).map(|&run| (run, group))
    };
    page.split().into_iter().filter_map(of_group).collect()
}

/// The thesis's figure 7.1: faults over the life of a run.
pub fn history(page: &mut Page) {
    let names = &page.judged.faults.names;
    let terms = &page.terms;
    let panels = typical(page).into_iter().map(|(run, group)| {
        let Recorded { run, .. } = &page.judged.recorded[run];
        let failure = terms.time.of(run.failure_fh.unwrap_or_default().max(1.0));
        let series: Vec<_> = (0..names.len()).map(|entry| means(page, run, entry)).collect();
        let values = || series.iter().flatten().map(|(_, value)| *value);
        let [low, high] = [values().fold(0.0, f64::min), values().fold(0.05, f64::max)].map(|end| 1.05 * end);
        let x = Axis { name: &terms.time.axis, start: 0.0, end: 1.02 * failure };
        let mut chart = Chart::new(SIZE, x, Axis { name: &terms.deviation.axis, start: low, end: high });
        for (entry, points) in series.iter().enumerate() {
            chart.line(&class(entry), points);
        }
        chart.line("failure", &[(failure, low), (failure, high)]);
        let label = format!("Faults over the life of run {}", escaped(&run.id));
        Panel { svg: chart.finish(&label), title: escaped(&group) }
    });
    let items: String = names.iter().enumerate().map(|(entry, name)| key_item(&class(entry), &escaped(name))).collect();
    let key = format!("<ul class=\"key\">{items}{}</ul>", key_item("failure", "failure"));
    let panels = panels.collect();
    let ids: Vec<_> = typical(page).iter().map(|(run, _)| escaped(&page.judged.recorded[*run].run.id)).collect();
    let caption = format!(
        concat!("Runs to failure of middling length ({}): observed faults, means over {:.*} {}. {}"),
        ids.join(", "),
        terms.time.decimals(),
        terms.time.of(MEAN_FH),
        terms.time.name,
        terms.end
    );
    page.figure(&caption, &key, panels);
}

/// Means of an entry over equal stretches of a run.
fn means(page: &Page, run: &crate::backtest::Run, entry: usize) -> Vec<(f64, f64)> {
    let nominal = page.judged.faults.nominal[entry];
    let Terms { time, deviation, .. } = &page.terms;
    let stretch = |o: &prognosis::Observation| (o.t_fh / MEAN_FH) as u64;
    let mean = |chunk: &[prognosis::Observation]| {
        let n = chunk.len() as f64;
        let t_fh = chunk.iter().map(|o| o.t_fh).sum::<f64>() / n;
        let value = chunk.iter().map(|o| o.fault_vector.values()[entry] - nominal).sum::<f64>() / n;
        (time.of(t_fh), deviation.of(value))
    };
    run.observations.chunk_by(|a, b| stretch(a) == stretch(b)).map(mean).collect()
}

/// The thesis's figure 7.2: error of an observation of each fault.
pub fn observation_error(page: &mut Page) {
    let names = &page.judged.faults.names;
    let mut differences = vec![Vec::new(); names.len()];
    for Recorded { run, .. } in page.judged.recorded {
        for pair in run.observations.windows(2) {
            let values = pair[0].fault_vector.values().iter().zip(pair[1].fault_vector.values());
            for (differences, (a, b)) in differences.iter_mut().zip(values) {
                // At a bound of [0, 1] errors are cut off.
                if [a, b].iter().all(|k| (1e-9..=1.0 - 1e-9).contains(*k)) {
                    differences.push((b - a) * std::f64::consts::FRAC_1_SQRT_2);
                }
            }
        }
    }
    let differences: Vec<_> = differences.into_iter().map(quantile::sorted).collect();
    let widest =
        differences.iter().filter(|all| !all.is_empty()).map(|all| quantile::nearest(all, 0.98)).fold(1e-3, f64::max);
    let x = Axis { name: "fault", start: -0.6, end: names.len() as f64 - 0.4 };
    let y = Axis { name: "error of one observation", start: -1.15 * widest, end: 1.15 * widest };
    let mut chart = Chart::new(SIZE, x, y).with_categories(names.iter().map(|name| escaped(name)).collect());
    for (entry, all) in differences.iter().enumerate().filter(|(_, all)| !all.is_empty()) {
        let place = entry as f64;
        chart.quantiles(
            &class(entry),
            place,
            0.5,
            [0.025, 0.25, 0.5, 0.75, 0.975].map(|level| quantile::nearest(all, level)),
        );
        for end in [-1.0, 1.0] {
            let y = end * page.judged.sigma[entry];
            chart.line("truth", &[(place - 0.35, y), (place + 0.35, y)]);
        }
    }
    let key = format!("<ul class=\"key\">{}</ul>", key_item("truth", "&plusmn; standard deviation assumed"));
    let panel = Panel { title: "all runs".to_owned(), svg: chart.finish("Error of one observation of each fault") };
    page.figure(
        concat!(
            "Error of one observation of each fault, estimated from the differences of successive observations over ",
            "&radic;2, since the true faults are not known. Boxes hold half, whiskers 95 % of them."
        ),
        &key,
        vec![panel],
    );
}

/// The thesis's figures 7.3 and 7.4: predictions over a life, for every estimator, a figure for each group.
pub fn predictions(page: &mut Page) {
    for (run, group) in typical(page) {
        let replays = page.judged.replays.iter().enumerate();
        let told = replays.filter(|(_, replays)| !replays.runs[run].predictions.is_empty());
        let panels = told.map(|(i, replays)| Panel {
            title: replays.estimator.to_owned(),
            svg: life(page, run, &class(i), &replays.runs[run].predictions, replays.estimator),
        });
        let panels = panels.collect();
        let Recorded { run, .. } = &page.judged.recorded[run];
        let key = [
            key_item("c0 solid", "median"),
            key_area("c0", "80 % and 95 % intervals"),
            key_item("truth", "truth"),
            key_area("cone", "truth &plusmn; 25 %"),
        ]
        .concat();
        let caption = format!(
            concat!(
                "Predicted against true remaining life over run {}, {}, which failed at {:.*} {}. A triangle at the upper ",
                "edge is a median beyond it. The &alpha;-&lambda; criterion is met where half of the draws are in the cone."
            ),
            escaped(&run.id),
            escaped(&group),
            page.terms.time.decimals(),
            page.terms.time.of(run.failure_fh.unwrap_or_default()),
            page.terms.time.name
        );
        page.figure(&caption, &format!("<ul class=\"key\">{key}</ul>"), panels);
    }
}

fn life(page: &Page, run: usize, class: &str, predictions: &[RulSummary], estimator: &str) -> String {
    let (Recorded { run: recorded, .. }, time) = (&page.judged.recorded[run], &page.terms.time);
    let failure = time.of(recorded.failure_fh.unwrap_or_default().max(1.0));
    let (top, life) = (TOP * failure, format!("remaining life, {}", time.name));
    let x = Axis { name: &time.axis, start: 0.0, end: failure };
    let mut chart = Chart::new(SIZE, x, Axis { name: &life, start: 0.0, end: top });
    let cone = |factor: f64| (0.0, factor * failure);
    chart.area("cone", &[cone(1.0 + CRITERION.alpha), (failure, 0.0), cone(1.0 - CRITERION.alpha)]);
    chart.line("truth", &[(0.0, failure), (failure, 0.0)]);
    // What is censored counts as beyond the upper edge.
    let points = |level: usize| {
        let end = |end_fh: Option<f64>| end_fh.map_or(9.0 * top, |end_fh| time.of(end_fh));
        predictions.iter().map(|p| (time.of(p.t_fh), end(p.quantiles_fh[level]))).collect::<Vec<_>>()
    };
    let [lowest, low, median, high, highest] = LEVELS.map(points);
    chart.band(class, &lowest, &highest);
    chart.band(class, &low, &high);
    chart.line(&format!("{class} solid"), &median);
    for (prediction, (at, median)) in predictions.iter().zip(median) {
        let words = match median {
            median if median > 8.0 * top => "beyond the horizon".to_owned(),
            median => format!("{median:.*} {}", time.decimals(), time.name),
        };
        let title = format!("{estimator} at {} {}: {words}", time.told(prediction.t_fh), time.name);
        if median <= top { chart.dot(class, (at, median), &title) } else { chart.beyond(class, at, &title) }
    }
    chart.finish(&format!("Remaining life predicted by {estimator} over run {}", escaped(&recorded.id)))
}
