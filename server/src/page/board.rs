//! The fleet board: how many units stand on each rung, and tails against positions, the worst tails first.

use std::collections::{BTreeMap, BTreeSet};

use askama::Template;
use axum::{extract::State as Extract, http::Uri, response::Response};
use domain::{Day, OperatorId, Position, TailNumber, Urgency, redundancy::probability_lost};
use serde::Deserialize;
use store::{ListedUnit, Scope, UnitsAsked};

use super::{
    html,
    rung::{self, Rung},
    words::minute,
};
use crate::{
    asked::Asked,
    auth::Caller,
    judged::{self, Judged},
    present::Present,
    query::{self, Query},
    question::{self, Question, Sent},
    refusal::Refusal,
    state::{Shared, State},
};

/// Tails on a page.
const TAILS: usize = 50;

/// What is looked at.
#[derive(Debug, Clone, Deserialize)]
pub struct BoardQuery {
    #[serde(deserialize_with = "query::text")]
    by: Option<String>,
    #[serde(deserialize_with = "query::text")]
    check: Option<String>,
    #[serde(deserialize_with = "question::risk")]
    risk: Option<f64>,
    #[serde(deserialize_with = "urgency")]
    urgency: Option<Urgency>,
    #[serde(deserialize_with = "query::text")]
    search: Option<String>,
    #[serde(deserialize_with = "number")]
    page: Option<usize>,
}

fn urgency<'de, D: serde::Deserializer<'de>>(given: D) -> Result<Option<Urgency>, D::Error> {
    let named = |text: &str| match text {
        "" => Some(None),
        text => Urgency::ALL.into_iter().find(|urgency| urgency.as_str() == text).map(Some),
    };
    let rule = "failed, act_now, before_check, unknown or may_wait";
    query::optional(given, rule, named).map(Option::flatten)
}

fn number<'de, D: serde::Deserializer<'de>>(given: D) -> Result<Option<usize>, D::Error> {
    query::optional(given, "the number of a page, from 1", |text| text.parse().ok().filter(|page| *page >= 1))
}

#[derive(Template)]
#[template(path = "board.html")]
struct BoardPage {
    now: String,
    zone: String,
    /// What was asked, as it was typed.
    by: String,
    check: String,
    risk: f64,
    search: String,
    /// The rung that is looked at.
    chosen: &'static str,
    counts: Vec<Count>,
    units: usize,
    tails: usize,
    matrices: Vec<Matrix>,
    /// Units without a place.
    displaced: Vec<Cell>,
    /// Number of tails that are shown out of those that were found, and where the pages before and after are.
    shown: usize,
    found: usize,
    before: Option<String>,
    after: Option<String>,
    advisory: &'static str,
}

/// How many units stand on a rung.
struct Count {
    rung: Rung,
    meaning: String,
    units: usize,
    href: String,
    is_chosen: bool,
}

/// Tails with the same positions.
struct Matrix {
    positions: Vec<Position>,
    tails: Vec<TailRow>,
}

struct TailRow {
    tail: TailNumber,
    /// P(any failure before what they have to last for).
    any: String,
    /// By position; `None` where nothing is installed.
    cells: Vec<Option<Cell>>,
}

/// A unit on the board.
struct Cell {
    href: String,
    name: String,
    rung: Rung,
    date: String,
    /// What speaks against relying on it.
    data: Option<String>,
    is_uncertain: bool,
    is_looked_for: bool,
}

/// A unit, and how it stands.
struct Seen {
    listed: ListedUnit,
    judged: Judged,
    is_looked_for: bool,
}

/// `GET /`
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    asked: Asked,
    uri: Uri,
    Query(query): Query<BoardQuery>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let page = async |present: &Present| {
        let given = |text: &Option<String>| text.clone().filter(|text| !text.trim().is_empty());
        let sent = Sent { by: given(&query.by), check: given(&query.check), within_fh: None, risk: query.risk };
        let question = sent.checked(present)?;
        html(&BoardPage::read(state, present, operator, (&question, &query), &uri).await?)
    };
    asked.tell(&shared, Scope::Fleet, page).await
}

impl BoardPage {
    async fn read(
        state: &State,
        present: &Present,
        operator: &OperatorId,
        (question, query): (&Question, &BoardQuery),
        uri: &Uri,
    ) -> Result<Self, Refusal> {
        let open = |listed: &ListedUnit| judged::listed(present, question, listed).exceeds_risk.is_none();
        let listed = state.store.units(operator, UnitsAsked::default(), open).await?;
        let seen: Vec<Seen> = listed.into_iter().map(|listed| Seen::new(present, question, query, listed)).collect();
        let counts = counts(present, question, &seen, query.urgency, uri);
        let units = seen.len();
        let (placed, displaced): (Vec<Seen>, Vec<Seen>) = seen.into_iter().partition(|one| one.listed.unit.place_known);
        let mut by_tail: BTreeMap<TailNumber, Vec<Seen>> = BTreeMap::new();
        for one in placed {
            by_tail.entry(one.listed.unit.tail.clone()).or_default().push(one);
        }
        let tails = by_tail.len();
        by_tail.retain(|_, units| units.iter().any(|one| one.is_looked_for));
        let found = by_tail.len();
        let mut worst: Vec<(TailNumber, Vec<Seen>)> = by_tail.into_iter().collect();
        worst.sort_by_key(|(_, units)| rank(units));
        let number = query.page.unwrap_or(1);
        let mut on_page: Vec<_> = worst.into_iter().skip((number - 1).saturating_mul(TAILS)).take(TAILS).collect();
        draw(state, present, operator, (question, query), &mut on_page).await?;
        let today = present.today();
        let shown = on_page.len();
        let page_at = |number: usize| with(uri, "page", &number.to_string());
        Ok(Self {
            now: minute(present.now()),
            zone: present.zone().name().to_owned(),
            by: query.by.clone().unwrap_or_default(),
            check: query.check.clone().unwrap_or_default(),
            risk: question.risk.unwrap_or(present.settings().risk),
            search: query.search.clone().unwrap_or_default(),
            chosen: query.urgency.map(Urgency::as_str).unwrap_or_default(),
            counts,
            units,
            tails,
            matrices: matrices(present, today, on_page),
            displaced: displaced.iter().filter(|one| one.is_looked_for).map(|one| Cell::new(one, today)).collect(),
            shown,
            found,
            before: (number > 1).then(|| page_at(number - 1)),
            after: (number * TAILS < found).then(|| page_at(number + 1)),
            advisory: domain::ADVISORY,
        })
    }
}

/// Reads the draws of the units on a page: what is told of their tails together needs them all.
async fn draw(
    state: &State,
    present: &Present,
    operator: &OperatorId,
    (question, query): (&Question, &BoardQuery),
    on_page: &mut [(TailNumber, Vec<Seen>)],
) -> Result<(), Refusal> {
    for (tail, units) in on_page {
        let asked = UnitsAsked { tail: Some(tail), ..UnitsAsked::default() };
        let listed = state.store.units(operator, asked, |_| true).await?;
        *units = listed.into_iter().map(|listed| Seen::new(present, question, query, listed)).collect();
    }
    Ok(())
}

impl Seen {
    fn new(present: &Present, question: &Question, query: &BoardQuery, listed: ListedUnit) -> Self {
        let judged = judged::listed(present, question, &listed);
        let unit = &listed.unit;
        let wanted = query.search.as_deref().unwrap_or_default().trim().to_lowercase();
        let names =
            [unit.tail.as_str(), unit.position.as_str(), unit.part_number.as_str(), unit.serial_number.as_str()];
        let is_named = wanted.is_empty() || names.iter().any(|name| name.to_lowercase().contains(&wanted));
        let is_looked_for = is_named && query.urgency.is_none_or(|urgency| urgency == judged.urgency);
        Self { listed, judged, is_looked_for }
    }
}

/// The order of tails: by the most urgent of what is looked for, then by the first date.
fn rank(units: &[Seen]) -> (Option<Urgency>, i64) {
    let looked_for = || units.iter().filter(|one| one.is_looked_for).map(|one| &one.judged);
    let first = looked_for().filter_map(|judged| judged.p10_at).min();
    (looked_for().map(|judged| judged.urgency).min(), first.map_or(i64::MAX, |time| time.micros()))
}

fn counts(present: &Present, question: &Question, seen: &[Seen], chosen: Option<Urgency>, uri: &Uri) -> Vec<Count> {
    let settings = present.settings();
    let risk = rung::percent(question.risk.unwrap_or(settings.risk));
    let meaning = |urgency: Urgency| match urgency {
        Urgency::Failed => "failed".to_owned(),
        Urgency::ActNow => format!("act within {} days or {} fh", settings.act_within_days, settings.act_within_fh),
        Urgency::BeforeCheck => format!("do not reach their check (P > {risk})"),
        Urgency::Unknown => "unknown".to_owned(),
        Urgency::MayWait => "may wait".to_owned(),
    };
    let count = |urgency: Urgency| {
        let is_chosen = chosen == Some(urgency);
        Count {
            rung: Rung::new(urgency, "check"),
            meaning: meaning(urgency),
            units: seen.iter().filter(|one| one.judged.urgency == urgency).count(),
            href: with(uri, "urgency", if is_chosen { "" } else { urgency.as_str() }),
            is_chosen,
        }
    };
    Urgency::ALL.map(count).into()
}

/// The page with another value of a parameter, or without it; from its first part on unless that is asked for.
fn with(uri: &Uri, name: &str, value: &str) -> String {
    let others = uri.query().unwrap_or_default().split('&').filter(|pair| {
        let key = pair.split('=').next().unwrap_or_default();
        !pair.is_empty() && key != name && key != "page"
    });
    let own = (!value.is_empty()).then(|| format!("{name}={value}"));
    let query: Vec<String> = others.map(str::to_owned).chain(own).collect();
    if query.is_empty() { "/".to_owned() } else { format!("/?{}", query.join("&")) }
}

/// Tails by their sets of positions, in their order. A tail is shown among those that have what it has and more: a position
/// that is empty on it stands there.
fn matrices(present: &Present, today: Day, tails: Vec<(TailNumber, Vec<Seen>)>) -> Vec<Matrix> {
    let set = |units: &[Seen]| units.iter().map(|one| one.listed.unit.position.clone()).collect::<BTreeSet<_>>();
    let sets: BTreeSet<BTreeSet<Position>> = tails.iter().map(|(_, units)| set(units)).collect();
    let mut matrices: Vec<Matrix> = Vec::new();
    for (tail, units) in tails {
        let own = set(&units);
        let widest = sets.iter().filter(|other| other.is_superset(&own)).max_by_key(|other| other.len());
        let positions: Vec<Position> = widest.unwrap_or(&own).iter().cloned().collect();
        let cell = |position: &Position| {
            let at = units.iter().find(|one| one.listed.unit.position == *position);
            at.map(|one| Cell::new(one, today))
        };
        let cells = positions.iter().map(cell).collect();
        let row = TailRow { tail, any: any_failure(present, &units), cells };
        match matrices.iter_mut().find(|matrix| matrix.positions == positions) {
            Some(matrix) => matrix.tails.push(row),
            None => matrices.push(Matrix { positions, tails: vec![row] }),
        }
    }
    matrices
}

/// P(a function is lost, or a unit that serves none fails), as far as the units are known.
fn any_failure(present: &Present, units: &[Seen]) -> String {
    let mut unknown = 0;
    let mut left: BTreeMap<&Position, f64> = BTreeMap::new();
    for Seen { listed, judged, .. } in units {
        let p = match judged.urgency {
            Urgency::Failed => Some(1.0),
            Urgency::Unknown => None,
            _ => judged.before.p,
        };
        unknown += usize::from(p.is_none());
        left.insert(&listed.unit.position, p.unwrap_or(0.0));
    }
    let mut lasts = 1.0;
    for function in &present.settings().functions {
        if function.positions.iter().all(|position| left.contains_key(position)) {
            let failing: Vec<f64> = function.positions.iter().filter_map(|position| left.remove(position)).collect();
            lasts *= 1.0 - probability_lost(function.needed, &failing);
        }
    }
    lasts *= left.values().map(|p| 1.0 - p).product::<f64>();
    match unknown {
        0 => rung::percent(1.0 - lasts),
        _ if unknown == units.len() => "unknown".to_owned(),
        // Those that are unknown can only add to it.
        _ if lasts > 0.99 => format!("{unknown} unknown"),
        _ => format!("≥ {}, {unknown} unknown", rung::percent(1.0 - lasts).trim_start_matches("> ")),
    }
}

impl Cell {
    fn new(Seen { listed, judged, is_looked_for }: &Seen, today: Day) -> Self {
        let unit = &listed.unit;
        let date = match (judged.urgency, judged.was_due_by, judged.safe) {
            (Urgency::Failed | Urgency::Unknown, ..) => "—".to_owned(),
            (_, Some(day), _) => format!("was {}", rung::short(day, today)),
            (_, _, Some(safe)) => match safe.date {
                Some(day) => rung::short(day, today),
                None => format!("in {:.0} fh", safe.remaining_fh),
            },
            (_, _, None) => "later".to_owned(),
        };
        let data = rung::data(judged.status, judged.data_age_days);
        Self {
            href: format!("/tails/{}/positions/{}", unit.tail, unit.position),
            name: format!("{} {}", unit.part_number, unit.serial_number),
            rung: Rung::new(judged.urgency, &rung::until(&judged.before, today)),
            date,
            is_uncertain: data.is_some(),
            data,
            is_looked_for: *is_looked_for,
        }
    }
}
