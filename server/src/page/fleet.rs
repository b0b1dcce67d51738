//! The fleet, worst first.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{Timestamp, UtilisationSource};
use proto::answer::RulAnswer;

use super::{
    html,
    words::{Badge, grouped, hours},
};
use crate::{answer, auth::Caller, refusal::Refusal, state::Shared};

/// Tails on the page; the rest is told over REST.
const MAX_TAILS: u32 = 500;

#[derive(Template)]
#[template(path = "fleet.html")]
struct FleetPage {
    now: Timestamp,
    tails: usize,
    more: bool,
    pending: String,
    rows: Vec<Row>,
    advisory: &'static str,
}

struct Row {
    badge: Badge,
    /// `None` while nobody knows where it is.
    place: Option<(String, String)>,
    part_number: String,
    serial_number: String,
    p10: String,
    p50: String,
    dates: String,
    /// How fast it wears, where that is known.
    pace: Option<String>,
    dominant_fault: String,
    as_of: String,
}

/// `GET /`
pub async fn get(Extract(shared): Extract<Shared>, caller: Caller) -> Result<Response, Refusal> {
    let state = &shared.state;
    let mut fleet = state.store.installed_fleet(caller.operator(), None, MAX_TAILS + 1).await?;
    let more = fleet.len() > MAX_TAILS as usize;
    fleet.truncate(MAX_TAILS as usize);
    let displaced = state.store.displaced(caller.operator()).await?;
    let all = fleet.iter().flat_map(|tail| &tail.installed).chain(&displaced);
    let mut bodies: Vec<(RulAnswer, bool)> = all.map(|one| (answer::rul(state, one, None), one.place_known)).collect();
    bodies.sort_by(|(a, _), (b, _)| worst_first(a, b));
    html(&FleetPage {
        now: (state.clock)(),
        tails: fleet.len(),
        more,
        pending: grouped(bodies.iter().map(|(body, _)| body.pending_uploads).sum::<u64>() as f64),
        rows: bodies.into_iter().map(Row::new).collect(),
        advisory: domain::ADVISORY,
    })
}

/// Orders by the need for attention, then by the 10 % quantile and the median; a censored quantile is the longest.
fn worst_first(a: &RulAnswer, b: &RulAnswer) -> std::cmp::Ordering {
    let quantiles = |body: &RulAnswer| {
        let rul = body.rul_fh.as_ref();
        let known = |quantile: Option<f64>| quantile.unwrap_or(f64::INFINITY);
        [known(rul.and_then(|rul| rul.p10)), known(rul.and_then(|rul| rul.p50))]
    };
    let (x, y) = (quantiles(a), quantiles(b));
    Badge::of(a).rank.cmp(&Badge::of(b).rank).then(x[0].total_cmp(&y[0])).then(x[1].total_cmp(&y[1]))
}

impl Row {
    fn new((body, place_known): (RulAnswer, bool)) -> Self {
        let rul = body.rul_fh.as_ref();
        let dates = body.end_of_life.as_ref().map(|end| {
            let date = |date: &Option<String>| date.clone().unwrap_or_else(|| "later".to_owned());
            let by = if end.utilisation_source == UtilisationSource::Plan { ", as planned" } else { "" };
            format!("{} \u{2013} {}{by}", date(&end.date_p10), date(&end.date_p50))
        });
        Self {
            badge: Badge::of(&body),
            p10: hours(&body, rul.and_then(|rul| rul.p10)),
            p50: hours(&body, rul.and_then(|rul| rul.p50)),
            dates: dates.unwrap_or_else(|| "unknown".to_owned()),
            pace: body.pace.as_ref().map(|pace| format!("wears at {:.2} of the reference pace", pace.now)),
            dominant_fault: body.dominant_fault.unwrap_or_else(|| "unknown".to_owned()),
            as_of: body
                .as_of
                .map_or_else(|| "nothing yet".to_owned(), |as_of| format!("{} fh", grouped(as_of.flight_hours))),
            place: place_known.then_some((body.tail, body.position)),
            part_number: body.part_number,
            serial_number: body.serial_number,
        }
    }
}
