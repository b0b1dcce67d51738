//! One component: its faults and its remaining life over flight hours.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{AsOf, HingeLoad, LoadSource, Pace, UtilisationSource};
use proto::answer::RulAnswer;
use serde::Deserialize;
use store::{Installed, LifeBeginning};

use super::{
    agreement::Agreement,
    course::Course,
    earlier::EarlierPage,
    html,
    reasons::{Reasons, Warning},
    record::Record,
    rung::{self, Rung},
    what_if::{Typed, WhatIfForm},
    words::{day, grouped, hours, percent},
};
use crate::{
    answer::{self, RulQuestion},
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
    rung: Rung,
    /// Why its data are not to be relied on.
    data: Option<String>,
    /// Where the flight hours per day come from.
    flown_by: &'static str,
    as_of: String,
    load: Option<String>,
    pace: Option<String>,
    /// The hours at which it was found failed.
    found_failed: Option<String>,
    warnings: Vec<Warning>,
    reasons: Option<Reasons>,
    agreement: Option<Agreement>,
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
    what_if: WhatIfForm,
}

/// The life that is shown, and what is asked about its flights to come.
#[derive(Deserialize)]
pub struct Wanted {
    #[serde(deserialize_with = "query::life")]
    life: Option<u32>,
    #[serde(deserialize_with = "query::text")]
    utilisation: Option<String>,
    #[serde(deserialize_with = "query::text")]
    load_factor: Option<String>,
    #[serde(deserialize_with = "query::text")]
    temperature_offset: Option<String>,
    #[serde(deserialize_with = "query::text")]
    by: Option<String>,
    #[serde(deserialize_with = "query::text")]
    within_fh: Option<String>,
}

impl Wanted {
    /// What is asked about other flights, as it was typed.
    fn typed(self) -> Typed {
        let text = |typed: Option<String>| typed.unwrap_or_default().trim().to_owned();
        Typed {
            utilisation: text(self.utilisation),
            load_factor: text(self.load_factor),
            temperature_offset: text(self.temperature_offset),
            by: text(self.by),
            within_fh: text(self.within_fh),
        }
    }
}

/// `GET /tails/{tail}/positions/{position}`: the present life of what is installed there, or an earlier `life`.
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    Query(wanted): Query<Wanted>,
) -> Result<Response, Refusal> {
    let state = &shared.state;
    let installed = answer::installed_at(state, caller.operator(), &place.tail, &place.position).await?;
    let component = answer::component(caller.operator(), &installed);
    let known = answer::record(state, &component).await?;
    let events = state.store.events(&component).await?;
    let shown = wanted.life.unwrap_or(installed.overhaul_index);
    let course = Course::read(state, &component, history::life(&component, &known.lives, Some(shown))?).await?;
    let record = Record::new(&installed, shown, known, events);
    if shown != installed.overhaul_index {
        return html(&EarlierPage::new(installed, course, record));
    }
    let present = state.present(caller.operator()).await?;
    let body = answer::rul(&present, &installed, &RulQuestion::default());
    let what_if = WhatIfForm::of(&shared, caller.operator(), &place, wanted.typed()).await?;
    html(&ComponentPage {
        rung: Rung::new(body.urgency, &rung::until(&body.before, present.today())),
        data: rung::data(body.status, body.data_age_days),
        flown_by: flown_by(&body),
        as_of: as_of(&body),
        since: day(installed.since),
        overhauled: overhauled(&installed),
        load: body.load.as_ref().map(load),
        pace: body.pace.as_ref().map(pace),
        found_failed: body.found_failed_fh.map(grouped),
        warnings: Warning::all(&body),
        reasons: Reasons::of(&body),
        agreement: Agreement::of(&body),
        quantiles: quantiles(&body),
        failures: failures(&body),
        faults: fault_rows(&body),
        course,
        record,
        what_if,
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

fn pace(pace: &Pace) -> String {
    let faster = match pace.now {
        now if (0.995..1.005).contains(&now) => "as fast as".to_owned(),
        now => format!("{now:.2} times as fast as"),
    };
    let motor = match pace.motor_share {
        share if share > 0.0 => format!(", for {} by the motor alone", percent(share)),
        _ => String::new(),
    };
    let seen = pace
        .seen_loads
        .map_or_else(String::new, |[least, greatest]| format!("; past lives have flown {least:.2} to {greatest:.2}"));
    format!(
        "wears {faster} at the reference load and temperature: load {:.2}, exponent {:.1} \u{b1} {:.1}, temperature \
         coefficient {:.2} \u{b1} {:.2}; the load is known for {} of its hours{motor}{seen}",
        pace.load,
        pace.exponent,
        pace.exponent_sigma,
        pace.temperature_coefficient,
        pace.temperature_coefficient_sigma,
        percent(pace.known_share),
    )
}

/// Where the flight hours per day come from.
fn flown_by(body: &RulAnswer) -> &'static str {
    match body.end_of_life.as_ref().map(|end| end.utilisation_source) {
        Some(UtilisationSource::Plan) => "By the tail's plan",
        _ => "As the tail has flown lately",
    }
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
    .map(|(level, quantile)| (level, hours(body.horizon_fh, quantile) + &draw_error(body, level)))
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
