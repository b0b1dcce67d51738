//! One component: its faults and its remaining life over flight hours.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{AsOf, HingeLoad, LoadSource};
use proto::answer::RulAnswer;
use serde::Deserialize;
use store::{Installed, LifeBeginning};

use super::{
    course::Course,
    earlier::EarlierPage,
    html,
    reasons::{Reasons, Warning},
    record::Record,
    words::{Badge, day, grouped, hours},
};
use crate::{
    answer,
    auth::Caller,
    history,
    path::{Named, Place},
    query::{self, Query},
    refusal::Refusal,
    state::Shared,
};

#[derive(Template)]
#[template(path = "component.html")]
struct ComponentPage {
    body: RulAnswer,
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
    course: Course,
    /// Name, value with its sigma, trend.
    faults: Vec<(String, String, String)>,
    /// Since when it is here.
    since: String,
    /// Whether and when it was overhauled.
    overhauled: String,
    record: Record,
}

/// The life that is shown.
#[derive(Deserialize)]
pub struct Wanted {
    #[serde(deserialize_with = "query::life")]
    life: Option<u32>,
}

/// `GET /tails/{tail}/positions/{position}`: the present life of what is installed there, or an earlier `life`.
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    Query(Wanted { life: wanted }): Query<Wanted>,
) -> Result<Response, Refusal> {
    let state = &shared.state;
    let installed = answer::installed_at(state, caller.operator(), &place.tail, &place.position).await?;
    let component = answer::component(caller.operator(), &installed);
    let known = answer::record(state, &component).await?;
    let events = state.store.events(&component).await?;
    let shown = wanted.unwrap_or(installed.overhaul_index);
    let course = Course::read(state, &component, history::life(&component, &known.lives, Some(shown))?).await?;
    let record = Record::new(&installed, shown, known, events);
    if shown != installed.overhaul_index {
        return html(&EarlierPage::new(installed, course, record));
    }
    let body = answer::rul(state, &installed, None);
    html(&ComponentPage {
        badge: Badge::of(&body),
        as_of: as_of(&body),
        since: day(installed.since),
        overhauled: overhauled(&installed),
        load: body.load.as_ref().map(load),
        found_failed: body.found_failed_fh.map(grouped),
        warnings: Warning::all(&body),
        reasons: Reasons::of(&body),
        quantiles: quantiles(&body),
        failures: failures(&body),
        faults: fault_rows(&body),
        course,
        record,
        body,
    })
}

/// Tells in words whether it was overhauled, and when.
fn overhauled(installed: &Installed) -> String {
    let Some(LifeBeginning { flight_hours, occurred_at, .. }) = &installed.began else {
        return "never overhauled".to_owned();
    };
    let when = format!("at {} flight hours on {}", grouped(*flight_hours), day(*occurred_at));
    match installed.overhaul_index {
        1 => format!("overhauled {when}, which began a new life"),
        times => format!("overhauled {times} times, the last time {when}, which began a new life"),
    }
}

fn as_of(body: &RulAnswer) -> String {
    let told = |as_of: &AsOf| format!("{} flight hours, recorded {}", grouped(as_of.flight_hours), as_of.recorded_at);
    body.as_of.as_ref().map_or_else(|| "nothing judged yet".to_owned(), told)
}

fn load(load: &HingeLoad) -> String {
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

fn quantiles(body: &RulAnswer) -> Vec<(&'static str, String)> {
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
fn draw_error(body: &RulAnswer, level: &str) -> String {
    let error = body.monte_carlo.as_ref().and_then(|draws| match level {
        "10 %" => draws.p10_error_fh,
        "50 %" => draws.median_error_fh,
        _ => None,
    });
    error.map(|error_fh| format!(" \u{b1} {}", grouped(error_fh))).unwrap_or_default()
}

fn failures(body: &RulAnswer) -> Vec<(String, String)> {
    let told = |failure: &proto::answer::FailureProbability| {
        let p = failure.p.zip(failure.standard_error);
        let words = p.map_or_else(
            || "unknown beyond the horizon".to_owned(),
            |(p, error)| format!("{:.1} % \u{b1} {:.1}", 100.0 * p, 100.0 * error),
        );
        (format!("{} fh", grouped(failure.within_fh)), words)
    };
    body.probability_of_failure.iter().flatten().map(told).collect()
}

fn fault_rows(body: &RulAnswer) -> Vec<(String, String, String)> {
    let row = |(name, fault): (&String, &proto::answer::Fault)| {
        let value = format!("{:.4} \u{b1} {:.4}", fault.value, fault.sigma);
        (name.clone(), value, format!("{:+.4}", fault.trend_per_1000_fh))
    };
    body.fault_vector.iter().flatten().map(row).collect()
}
