//! What readers ask, and what answers must be whatever goes on behind them.

use std::collections::{BTreeMap, BTreeSet};

use domain::{InstallationSource, Status, UploadStateKind};
use proto::{
    answer::{DueAnswer, HealthItem, ModelItem, Page, RulAnswer, StateItem, TailAnswer, TailItem},
    json::{
        ComponentBody, MaintenanceBody, MaintenanceKind, ScoreboardBody, SensorConfigurationItem, UploadStatusBody,
    },
};
use serde::de::DeserializeOwned;

use super::{
    installations::{self, Place, Unit},
    ledger::{Book, Ledger},
    story::word,
};
use crate::in_process::service::{Answer, Bundle};

/// A read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Question {
    /// All tails.
    Tails,
    /// What is installed on a tail.
    Tail(String),
    /// Remaining lives on a tail.
    Ruls(String),
    /// The remaining life at a place.
    Rul(Place),
    /// The estimates of what sits at a place.
    Health(Place),
    /// The sensor configurations of a tail.
    Configurations(String),
    /// A component.
    Component(Unit),
    /// Its estimates.
    Estimates(Unit),
    /// Its states.
    States(Unit),
    /// What became of an upload.
    Upload(String),
    /// Uploads in a state.
    Uploads(UploadStateKind),
    /// The due list.
    Due,
    /// The scoreboard.
    Scoreboard,
    /// All bundles.
    Models,
    /// A page for people.
    Page(String),
}

impl Question {
    /// Everything that can be asked about what an operator has sent.
    pub fn all(book: &Book) -> Vec<Self> {
        let places = installations::places(book);
        let tails: BTreeSet<String> = places.iter().map(|(tail, _)| tail.clone()).collect();
        let mut all = vec![Self::Tails, Self::Due, Self::Scoreboard, Self::Models];
        all.extend(["/", "/due", "/scoreboard"].map(|page| Self::Page(page.to_owned())));
        use UploadStateKind::{Pending, Processed, SetAside, Voided};
        all.extend([Pending, Processed, SetAside, Voided].map(Self::Uploads));
        for tail in tails {
            all.extend([Self::Tail(tail.clone()), Self::Ruls(tail.clone()), Self::Configurations(tail)]);
        }
        for place in places {
            all.push(Self::Page(format!("/tails/{}/positions/{}", place.0, place.1)));
            all.extend([Self::Rul(place.clone()), Self::Health(place)]);
        }
        for unit in book.components() {
            all.extend([Self::Component(unit.clone()), Self::Estimates(unit.clone()), Self::States(unit)]);
        }
        all.extend(book.uploads.keys().map(|id| Self::Upload(id.to_string())));
        all
    }

    /// Where it is asked.
    pub fn path(&self) -> String {
        match self {
            Self::Tails => "/v1/tails?limit=1000".to_owned(),
            Self::Tail(tail) => format!("/v1/tails/{tail}"),
            Self::Ruls(tail) => format!("/v1/tails/{tail}/rul"),
            Self::Rul((tail, position)) => format!("/v1/tails/{tail}/positions/{position}/rul"),
            Self::Health((tail, position)) => format!("/v1/tails/{tail}/positions/{position}/health?limit=1000"),
            Self::Configurations(tail) => format!("/v1/tails/{tail}/sensor-configurations"),
            Self::Component((part, serial)) => format!("/v1/components/{part}/{serial}"),
            Self::Estimates((part, serial)) => format!("/v1/components/{part}/{serial}/health?limit=1000"),
            Self::States((part, serial)) => format!("/v1/components/{part}/{serial}/health?view=states&limit=1000"),
            Self::Upload(id) => format!("/v1/uploads/{id}"),
            Self::Uploads(state) => {
                let state = serde_json::to_value(state).expect("a word");
                format!("/v1/uploads?state={}&limit=1000", state.as_str().expect("a word"))
            }
            Self::Due => "/v1/fleet/due?risk=0.001&limit=1000".to_owned(),
            Self::Scoreboard => "/v1/fleet/scoreboard".to_owned(),
            Self::Models => "/v1/models".to_owned(),
            Self::Page(path) => path.clone(),
        }
    }

    /// Judges an answer by what was acknowledged; says what is wrong with it.
    pub fn judge(&self, answer: &Answer, ledger: &Ledger, operator: usize) -> Result<(), String> {
        keeps_within(answer, operator, "")?;
        let book = &ledger.books[operator];
        let installed = installations::installed(book);
        match self {
            Self::Rul(place) | Self::Health(place) if !installed.contains_key(place) => has_status(answer, 404),
            Self::Tail(tail) | Self::Ruls(tail) if !known_tails(book).contains(tail) => has_status(answer, 404),
            Self::Configurations(tail)
                if !known_tails(book).contains(tail)
                    && !book.configurations.keys().any(|(of, _)| of.as_str() == tail) =>
            {
                has_status(answer, 404)
            }
            Self::Page(path) if path.starts_with("/tails/") => {
                let known =
                    installed.keys().any(|(tail, position)| *path == format!("/tails/{tail}/positions/{position}"));
                has_status(answer, if known { 200 } else { 404 })
            }
            Self::Page(_) => has_status(answer, 200),
            Self::Tails => tails(read(answer)?, book),
            Self::Tail(tail) => {
                let body: TailAnswer = read(answer)?;
                let here =
                    body.positions.iter().map(|item| ((tail.clone(), item.position.clone()), unit_of(&item.prognosis)));
                same(here.collect(), on_tail(&installed, tail))?;
                body.positions.iter().try_for_each(|item| rul(&item.prognosis, book))
            }
            Self::Ruls(tail) => {
                let body: Page<RulAnswer> = read(answer)?;
                let here = body.items.iter().map(|rul| ((rul.tail.clone(), rul.position.clone()), unit_of(rul)));
                same(here.collect(), on_tail(&installed, tail))?;
                body.items.iter().try_for_each(|item| rul(item, book))
            }
            Self::Rul(place) => {
                let body: RulAnswer = read(answer)?;
                same(Some(&unit_of(&body)), installed.get(place))?;
                rul(&body, book)
            }
            Self::Health(_) => read::<Page<HealthItem>>(answer).and_then(|page| estimates(&page, book)),
            Self::Estimates(_) => read::<Page<HealthItem>>(answer).and_then(|page| estimates(&page, book)),
            Self::States(_) => read::<Page<StateItem>>(answer).map(drop),
            Self::Configurations(tail) => {
                let body: Page<SensorConfigurationItem> = read(answer)?;
                let listed: Vec<_> = body.items.iter().map(|item| item.effective_from.clone()).collect();
                let known = book.configurations.keys().filter(|(of, _)| of.as_str() == tail);
                same(listed, known.map(|(_, from)| from.to_string()).collect())
            }
            Self::Component(unit) => component(&read(answer)?, unit, book),
            Self::Upload(id) => upload(&read(answer)?, id, book),
            Self::Uploads(state) => {
                let body: Page<UploadStatusBody> = read(answer)?;
                let wrong = body.items.iter().find(|item| item.state != *state);
                wrong.map_or(Ok(()), |item| Err(format!("{} among {state:?}: {:?}", item.upload_id, item.state)))?;
                body.items.iter().try_for_each(|item| upload(item, &item.upload_id, book))
            }
            Self::Due => read::<DueAnswer>(answer).map(drop),
            Self::Scoreboard => read::<ScoreboardBody>(answer).map(drop),
            Self::Models => {
                let body: Page<ModelItem> = read(answer)?;
                same(body.items.len(), Bundle::all().len())
            }
        }
    }
}

/// Nothing that belongs to another operator is in an answer, beyond what the question itself tells.
pub fn keeps_within(answer: &Answer, operator: usize, asked: &str) -> Result<(), String> {
    let mut body = String::from_utf8_lossy(&answer.body).into_owned();
    for told in asked.split(['/', '?', '&', '=']).filter(|told| !told.is_empty()) {
        body = body.replace(told, "");
    }
    let headers = format!("{:?}", answer.headers);
    let foreign = (0..3).filter(|other| *other != operator).map(word);
    for word in foreign {
        if body.contains(word) || headers.contains(word) {
            return Err(format!("{word} leaks: {body}"));
        }
    }
    match answer.status.as_u16() {
        500.. => Err(format!("{}: {body}", answer.status)),
        _ => Ok(()),
    }
}

fn has_status(answer: &Answer, status: u16) -> Result<(), String> {
    let body = || String::from_utf8_lossy(&answer.body).into_owned();
    if answer.status == status { Ok(()) } else { Err(format!("{} instead of {status}: {}", answer.status, body())) }
}

/// A good answer: every number that must be there is one.
fn read<T: DeserializeOwned>(answer: &Answer) -> Result<T, String> {
    has_status(answer, 200)?;
    let text = || String::from_utf8_lossy(&answer.body).into_owned();
    serde_json::from_slice(&answer.body).map_err(|error| format!("{error}: {}", text()))
}

fn same<T: PartialEq + std::fmt::Debug>(served: T, expected: T) -> Result<(), String> {
    if served == expected { Ok(()) } else { Err(format!("{served:?} instead of {expected:?}")) }
}

fn on_tail(installed: &BTreeMap<Place, Unit>, tail: &str) -> BTreeMap<Place, Unit> {
    installed.iter().filter(|((of, _), _)| of == tail).map(|(place, unit)| (place.clone(), unit.clone())).collect()
}

fn unit_of(rul: &RulAnswer) -> Unit {
    (rul.part_number.clone(), rul.serial_number.clone())
}

/// Tails that were named by an upload, or by an event that moved something.
fn known_tails(book: &Book) -> BTreeSet<String> {
    let moves = |body: &MaintenanceBody| matches!(body.kind, MaintenanceKind::Install | MaintenanceKind::Remove);
    let moved = book.events.values().map(|event| &event.content).filter(|event| moves(&event.body));
    let moved = moved.map(|event| event.tail.clone());
    book.uploads.values().map(|upload| upload.content.tail.to_string()).chain(moved).collect()
}

fn tails(page: Page<TailItem>, book: &Book) -> Result<(), String> {
    same(page.items.iter().map(|item| item.tail.clone()).collect(), known_tails(book))?;
    let installed = installations::installed(book);
    page.items.iter().try_for_each(|item| same(item.positions, on_tail(&installed, &item.tail).len()))
}

/// A remaining life says nothing that is not known, and all that is.
fn rul(body: &RulAnswer, book: &Book) -> Result<(), String> {
    let unit = unit_of(body);
    // A prognosis stands until a worker has come by, also where an upload was taken back since.
    let of_unit = book
        .uploads
        .values()
        .map(|upload| &upload.content)
        .filter(|upload| (upload.part_number.as_str(), upload.serial_number.as_str()) == (&unit.0, &unit.1));
    let names: BTreeSet<&str> = of_unit.map(|upload| upload.upload_id.as_str()).collect();
    if let Some(as_of) = &body.as_of
        && !names.contains(as_of.upload_id.as_str())
    {
        return Err(format!("{unit:?}: rests on {}, which was never acknowledged", as_of.upload_id));
    }
    if body.pending_uploads > names.len() as u64 {
        return Err(format!("{unit:?}: {} of {} uploads are pending", body.pending_uploads, names.len()));
    }
    let has_forecast = body.rul_fh.is_some();
    same(body.missing.is_none(), has_forecast)?;
    same(body.probability_of_failure.is_some(), has_forecast)?;
    match body.status {
        Status::Failed => {}
        Status::InsufficientHistory => same(has_forecast, false)?,
        Status::Stale | Status::Inconsistent | Status::Current => same(has_forecast, true)?,
        Status::BeyondHorizon => same(body.rul_fh.as_ref().and_then(|rul| rul.p50), None)?,
    }
    if body.found_failed_fh.is_some() {
        same(body.status, Status::Failed)?;
    }
    if let Some(rul) = &body.rul_fh {
        let quantiles = [rul.p05, rul.p10, rul.p25, rul.p50, rul.p75, rul.p90, rul.p95];
        let ordered = quantiles.map(|quantile| quantile.unwrap_or(f64::INFINITY));
        if !ordered.is_sorted() || ordered[0] < 0.0 {
            return Err(format!("{unit:?}: quantiles {quantiles:?}"));
        }
    }
    Ok(())
}

fn estimates(page: &Page<HealthItem>, book: &Book) -> Result<(), String> {
    let key = |item: &HealthItem| (item.flight_hours, item.recorded_at, item.upload_id.clone());
    if !page.items.windows(2).all(|pair| key(&pair[0]) < key(&pair[1])) {
        return Err("estimates are not in the order of the life".to_owned());
    }
    let known: BTreeSet<&str> = book.uploads.keys().map(|id| id.as_str()).collect();
    let stranger = page.items.iter().find(|item| !known.contains(item.upload_id.as_str()));
    stranger.map_or(Ok(()), |item| Err(format!("{} was never acknowledged", item.upload_id)))
}

fn component(body: &ComponentBody, unit: &Unit, book: &Book) -> Result<(), String> {
    let served = body.installations.iter().map(|item| {
        (
            (item.tail.clone(), item.position.clone()),
            item.source == InstallationSource::Event,
            item.from.clone(),
            item.to.clone(),
        )
    });
    let periods = installations::periods(book).into_iter().filter(|period| period.unit == *unit);
    let expected =
        periods.map(|period| (period.place, period.told, period.from.to_string(), period.to.map(|to| to.to_string())));
    same(served.collect::<Vec<_>>(), expected.collect())?;
    let served: BTreeSet<_> =
        body.events.iter().map(|event| (event.event_id.clone(), event.voided_at.is_some())).collect();
    let mine = book.events.iter().filter(|(_, event)| {
        (&event.content.body.part_number, &event.content.body.serial_number) == (&unit.0, &unit.1)
    });
    same(served, mine.clone().map(|(id, event)| (id.clone(), event.voided)).collect())?;
    let standing = || mine.clone().filter(|(_, event)| !event.voided).map(|(_, event)| &event.content.body);
    let overhauls = standing().filter(|body| body.kind == MaintenanceKind::Overhaul).count();
    same(body.lives.iter().map(|life| life.life as usize).collect::<Vec<_>>(), (0..=overhauls).collect())?;
    let failures = standing().filter(|body| body.outcome == Some(domain::Finding::Failed)).count();
    let failed = body.lives.iter().filter(|life| life.found_failed_fh.is_some()).count();
    same(failed > 0, failures > 0)
}

fn upload(body: &UploadStatusBody, id: &str, book: &Book) -> Result<(), String> {
    let (_, known) =
        book.uploads.iter().find(|(known, _)| known.as_str() == id).ok_or(format!("{id} was never sent"))?;
    same(body.received_at.clone(), known.received_at.to_string())?;
    same(
        (body.flight_hours, body.serial_number.as_str()),
        (known.content.flight_hours, known.content.serial_number.as_str()),
    )?;
    same(body.state == UploadStateKind::Voided, known.voided)
}
