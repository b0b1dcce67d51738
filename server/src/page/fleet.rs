//! The fleet, worst first.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{Timestamp, UtilisationSource};
use store::{ListedUnit, Outlook, Unit, WorstUnits};

use super::{
    html,
    words::{ATTENTION_FH, Badge, grouped, hours},
};
use crate::{answer, auth::Caller, present::Present, refusal::Refusal, state::Shared};

/// Actuators on the page, the worst first; the rest is told over REST.
const MOST: u32 = 500;

#[derive(Template)]
#[template(path = "fleet.html")]
struct FleetPage {
    now: Timestamp,
    tails: u64,
    components: u64,
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
    let (state, present) = (&shared.state, shared.state.present(caller.operator()).await?);
    let WorstUnits { units, components, tails, pending_uploads } =
        state.store.worst_units(caller.operator(), present.stale_before(), ATTENTION_FH, MOST).await?;
    let mut rows: Vec<Row> = units.into_iter().map(|listed| Row::new(&present, listed)).collect();
    // Units of equal rank stay in the order of their quantiles.
    rows.sort_by_key(|row| row.badge.rank);
    html(&FleetPage {
        now: present.now(),
        tails,
        components,
        pending: grouped(pending_uploads as f64),
        rows,
        advisory: domain::ADVISORY,
    })
}

impl Row {
    fn new(present: &Present, ListedUnit { unit, utilisation_fh_per_day, plan, .. }: ListedUnit) -> Self {
        let status = present.status_of_unit(&unit);
        let Unit { tail, position, place_known, part_number, serial_number, prognosis, .. } = unit;
        let (as_of, outlook) = prognosis.map(|prognosis| (prognosis.as_of, prognosis.outlook)).unzip();
        let outlook: Option<Outlook> = outlook.and_then(Result::ok);
        let quantile = |level: f64| outlook.as_ref().and_then(|outlook| outlook.quantile_fh(level));
        let (p10, p50, p90) = (quantile(0.1), quantile(0.5), quantile(0.9));
        let horizon_fh = outlook.as_ref().map(|outlook| outlook.horizon_fh);
        let schedule = as_of.as_ref().map(|as_of| plan.schedule(as_of.recorded_at, utilisation_fh_per_day));
        let end = schedule
            .filter(|_| outlook.is_some())
            .and_then(|schedule| answer::dates(present, [p10, p50, p90], &schedule));
        let dates = end.map(|end| {
            let date = |date: &Option<String>| date.clone().unwrap_or_else(|| "later".to_owned());
            let by = if end.utilisation_source == UtilisationSource::Plan { ", as planned" } else { "" };
            format!("{} \u{2013} {}{by}", date(&end.date_p10), date(&end.date_p50))
        });
        let pace = outlook.as_ref().and_then(|outlook| outlook.pace);
        let doubts = outlook.iter().flat_map(|outlook| &outlook.doubts).map(|doubt| doubt.kind);
        Self {
            badge: Badge::of_quantile(status, p10, doubts),
            p10: hours(horizon_fh, p10),
            p50: hours(horizon_fh, p50),
            dates: dates.unwrap_or_else(|| "unknown".to_owned()),
            pace: pace.map(|pace| format!("wears at {pace:.2} of the reference pace")),
            dominant_fault: outlook.map_or_else(|| "unknown".to_owned(), |outlook| outlook.dominant_fault),
            as_of: as_of
                .map_or_else(|| "nothing yet".to_owned(), |as_of| format!("{} fh", grouped(as_of.flight_hours))),
            place: place_known.then(|| (tail.to_string(), position.to_string())),
            part_number: part_number.to_string(),
            serial_number: serial_number.to_string(),
        }
    }
}
