//! One component: its faults and its remaining life over flight hours.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{FaultModel, FaultTrend, State as Block, rul::QUANTILE_LEVELS};
use proto::json::{LoadBody, LoadSource, RulBody};

use super::{
    chart::{Chart, Sample},
    html,
    reasons::{Reasons, Warning},
    words::{Badge, grouped, hours},
};
use crate::{answer, app::Shared, auth::Caller, parameters::Named, refusal::Refusal, rest::Place};

/// Blocks on a chart: 20,000 flight hours.
const MAX_BLOCKS: u32 = 1000;

#[derive(Template)]
#[template(path = "component.html")]
struct ComponentPage {
    body: RulBody,
    badge: Badge,
    as_of: String,
    load: Option<String>,
    /// The hours at which it was found failed.
    found_failed: Option<String>,
    warnings: Vec<Warning>,
    reasons: Option<Reasons>,
    /// Name of a quantile, its remaining life.
    quantiles: Vec<(&'static str, String)>,
    /// Within, probability.
    failures: Vec<(String, String)>,
    rul_chart: Option<Chart>,
    fault_charts: Vec<Chart>,
    /// Name, value with its sigma, trend.
    faults: Vec<(String, String, String)>,
}

/// `GET /tails/{tail}/positions/{position}`
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
) -> Result<Response, Refusal> {
    let state = &shared.state;
    let installed = answer::installed_at(state, caller.operator(), &place.tail, &place.position).await?;
    let body = answer::rul(state, &installed, None);
    let hours_now = installed.prognosis.as_ref().map_or(0.0, |prognosis| prognosis.as_of.flight_hours);
    let from_fh = hours_now - f64::from(MAX_BLOCKS) * domain::state::BLOCK_FH;
    let component = answer::component(caller.operator(), &installed);
    let blocks = state.store.states(&component, None, Some(from_fh.max(0.0)), None, None, MAX_BLOCKS).await?;
    let models = answer::fault_models(state).await?;
    let model = installed.prognosis.as_ref().map(|prognosis| prognosis.model);
    let faults = model.and_then(|model| models.iter().find(|(hash, _)| *hash == model)).map(|(_, faults)| faults);
    html(&ComponentPage {
        badge: Badge::of(&body),
        as_of: as_of(&body),
        load: body.load.as_ref().map(load),
        found_failed: body.found_failed_fh.map(grouped),
        warnings: Warning::all(&body),
        reasons: Reasons::of(&body),
        quantiles: quantiles(&body),
        failures: failures(&body),
        rul_chart: rul_chart(&blocks),
        fault_charts: fault_charts(&blocks, faults),
        faults: fault_rows(&body),
        body,
    })
}

fn as_of(body: &RulBody) -> String {
    let told = |as_of: &proto::json::AsOfBody| {
        format!("{} flight hours, recorded {}", grouped(as_of.flight_hours), as_of.recorded_at)
    };
    body.as_of.as_ref().map_or_else(|| "nothing judged yet".to_owned(), told)
}

fn load(load: &LoadBody) -> String {
    let source = match load.source {
        LoadSource::StrainAndAirData => "strain and air data",
        LoadSource::Strain => "strain alone",
        LoadSource::AirData => "air data alone",
    };
    let excluded: Vec<_> = load.excluded_sensors.iter().map(|sensor| (sensor + 1).to_string()).collect();
    let left_out = match excluded.as_slice() {
        [] => "no strain sensor left out".to_owned(),
        numbers => format!("strain sensors left out: {}", numbers.join(", ")),
    };
    format!("{:.1} \u{b1} {:.1} N m from {source}; {left_out}", load.hinge_moment_nm, load.sigma_nm)
}

fn quantiles(body: &RulBody) -> Vec<(&'static str, String)> {
    let Some(rul) = &body.rul_fh else { return Vec::new() };
    [
        ("5 %", rul.p05),
        ("10 %", rul.p10),
        ("25 %", rul.p25),
        ("50 %", rul.p50),
        ("75 %", rul.p75),
        ("90 %", rul.p90),
        ("95 %", rul.p95),
    ]
    .map(|(level, quantile)| (level, hours(body, quantile) + &draw_error(body, level)))
    .into()
}

/// The error of the draws, of the quantiles of which it is told.
fn draw_error(body: &RulBody, level: &str) -> String {
    let error = body.monte_carlo.as_ref().and_then(|draws| match level {
        "10 %" => draws.p10_error_fh,
        "50 %" => draws.median_error_fh,
        _ => None,
    });
    error.map(|error_fh| format!(" \u{b1} {}", grouped(error_fh))).unwrap_or_default()
}

fn failures(body: &RulBody) -> Vec<(String, String)> {
    let told = |failure: &proto::json::FailureProbability| {
        let p = failure.p.zip(failure.standard_error);
        let words = p.map_or_else(
            || "unknown beyond the horizon".to_owned(),
            |(p, error)| format!("{:.1} % \u{b1} {:.1}", 100.0 * p, 100.0 * error),
        );
        (format!("{} fh", grouped(failure.within_fh)), words)
    };
    body.probability_of_failure.iter().flatten().map(told).collect()
}

fn fault_rows(body: &RulBody) -> Vec<(String, String, String)> {
    let row = |(name, fault): (&String, &proto::json::Fault)| {
        let value = format!("{:.4} \u{b1} {:.4}", fault.value, fault.sigma);
        (name.clone(), value, format!("{:+.4}", fault.trend_per_1000_fh))
    };
    body.fault_vector.iter().flatten().map(row).collect()
}

/// The quantiles of remaining life as they were known at the end of each block; a censored one lies
/// at the horizon.
fn rul_chart(blocks: &[Block]) -> Option<Chart> {
    let horizon = blocks.iter().map(|block| block.horizon_fh).fold(0.0, f64::max);
    let at = |level: usize| move |block: &Block| block.rul_quantiles_fh[level].unwrap_or(block.horizon_fh);
    let sample = |low: usize, high: usize| -> Vec<Sample> {
        let of = |block: &Block| Sample { x: block.as_of.flight_hours, low: at(low)(block), high: at(high)(block) };
        blocks.iter().map(of).collect()
    };
    let censored = blocks.iter().any(|block| block.rul_quantiles_fh.iter().any(Option::is_none));
    let chart = Chart::new("Remaining useful life, flight hours")
        .band(
            "wide",
            &format!("{:.0} to {:.0} %", 100.0 * QUANTILE_LEVELS[0], 100.0 * QUANTILE_LEVELS[6]),
            sample(0, 6),
        )
        .band("narrow", "25 to 75 %", sample(2, 4))
        .line("median", "median", sample(3, 3));
    let chart = if censored { chart.rule(horizon, "horizon: beyond is unknown") } else { chart };
    chart.with_zero().size(940.0, 300.0).draw()
}

/// One chart per fault: the filtered value within two standard deviations.
fn fault_charts(blocks: &[Block], faults: Option<&FaultModel>) -> Vec<Chart> {
    let count = blocks.last().map_or(0, |block| block.faults.len());
    let chart = |i: usize| {
        let spread = |sigmas: f64| -> Vec<Sample> {
            let of = |block: &Block, fault: &FaultTrend| Sample {
                x: block.as_of.flight_hours,
                low: fault.value - sigmas * fault.sigma,
                high: fault.value + sigmas * fault.sigma,
            };
            blocks.iter().filter_map(|block| Some(of(block, block.faults.get(i)?))).collect()
        };
        let chart = Chart::new(&format!("Fault {}", blocks.last()?.faults[i].name))
            .band("wide", "two standard deviations", spread(2.0))
            .line("median", "filtered value", spread(0.0));
        let nominal = faults.and_then(|faults| faults.nominal.get(i).copied());
        let chart = match nominal {
            Some(nominal) => chart.rule(nominal, "nominal"),
            None => chart,
        };
        chart.size(370.0, 220.0).draw()
    };
    (0..count).filter_map(chart).collect()
}
