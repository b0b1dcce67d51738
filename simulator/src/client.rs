//! The REST client of a simulated aircraft and its mechanics: fetches the mask, uploads, reports maintenance,
//! and tries again when told to.

use std::{collections::BTreeSet, sync::Arc, time::Duration};

use domain::{ContentHash, Coordinate, Mask, Position, SerialNumber, TailNumber};
use proto::{
    answer::{MaskAnswer, ModelItem, Page},
    frame::MEDIA_TYPE,
    json::{ComponentBody, MaintenanceBody, Problem, UploadBody},
};
use reqwest::{RequestBuilder, Response, StatusCode, Url, header::CONTENT_TYPE};
use serde::de::DeserializeOwned;

use crate::{
    FleetError,
    uplink::{self, FrameKeys},
};

/// How often an upload is tried before the service counts as not reachable.
const ATTEMPTS: u32 = 12;
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Talks to one service.
#[derive(Debug, Clone)]
pub struct Client {
    http: reqwest::Client,
    base: Url,
    /// Where aircraft that send frames have their keys from.
    frames: Option<Arc<dyn FrameKeys>>,
}

/// What became of something that the service answered with success.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sent {
    /// New to the service.
    Accepted,
    /// The service had it already.
    Duplicate,
}

/// What the service has heard of a unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heard {
    /// Hours since new of its newest upload; 0 without one.
    pub flight_hours: f64,
    /// Maintenance events.
    pub events: BTreeSet<String>,
}

impl Client {
    /// A client of the service at `base`, such as `http://127.0.0.1:8080`; `http` knows by what to be admitted there.
    pub fn new(http: reqwest::Client, mut base: Url) -> Self {
        if !base.path().ends_with('/') {
            base.set_path(&format!("{}/", base.path()));
        }
        Self { http, base, frames: None }
    }

    /// One by which aircraft send frames instead of JSON.
    pub fn with_frames(self, keys: Arc<dyn FrameKeys>) -> Self {
        Self { frames: Some(keys), ..self }
    }

    /// The first mask of the active bundle, as bins of a map of `map_length`.
    pub async fn mask(&self, map_length: usize) -> Result<Mask, FleetError> {
        let models: Page<ModelItem> = self.get("v1/models").await?.ok_or(FleetError::NoModel)?;
        let active = models.items.into_iter().find(|model| model.active).ok_or(FleetError::NoModel)?;
        let body: MaskAnswer =
            self.get(&format!("v1/models/{}/mask", active.hash)).await?.ok_or(FleetError::NoModel)?;
        let coordinate = Coordinate::ElectricalAngleRad;
        if body.coordinate != coordinate.as_str() {
            return Err(FleetError::UnknownCoordinate(body.coordinate));
        }
        let width = std::f64::consts::TAU / map_length as f64;
        let bins = body.points.iter().map(|point| (point / width) as usize).collect();
        let mask = Mask::new(coordinate, map_length, bins).map_err(FleetError::BadMask)?;
        let promised: Option<ContentHash> = body.mask_id.parse().ok();
        if promised != Some(mask.id()) {
            return Err(FleetError::ForeignMask { mask_id: body.mask_id, map_length });
        }
        Ok(mask)
    }

    /// What the service has heard of a unit.
    pub async fn heard(&self, part_number: &str, serial_number: &SerialNumber) -> Result<Heard, FleetError> {
        let body: Option<ComponentBody> = self.get(&format!("v1/components/{part_number}/{serial_number}")).await?;
        let Some(ComponentBody { lives, events, .. }) = body else { return Ok(Heard::default()) };
        let newest = lives.into_iter().filter_map(|life| life.last).map(|last| last.flight_hours);
        Ok(Heard {
            flight_hours: newest.fold(0.0, f64::max),
            events: events.into_iter().map(|event| event.event_id).collect(),
        })
    }

    /// Uploads after a flight, which is counted over the life of the unit.
    pub async fn upload(&self, tail: &TailNumber, body: UploadBody, flight: u32) -> Result<Sent, FleetError> {
        let name = body.upload_id.clone();
        match &self.frames {
            None => self.post(&format!("v1/tails/{tail}/uploads"), &name, |post| post.json(&body)).await,
            Some(keys) => {
                let frames = uplink::frames(keys.as_ref(), tail, body, flight).await?;
                let framed = |post: RequestBuilder| post.header(CONTENT_TYPE, MEDIA_TYPE).body(frames.clone());
                self.post("v1/uploads", &name, framed).await
            }
        }
    }

    /// Reports a maintenance event.
    pub async fn report(
        &self,
        tail: &TailNumber,
        position: &Position,
        body: &MaintenanceBody,
    ) -> Result<Sent, FleetError> {
        let path = format!("v1/tails/{tail}/positions/{position}/maintenance");
        self.post(&path, &body.event_id, |post| post.json(body)).await
    }

    /// Sends what has a name, and tries again as long as the service is overloaded or away.
    async fn post(
        &self,
        path: &str,
        name: &str,
        filled: impl Fn(RequestBuilder) -> RequestBuilder,
    ) -> Result<Sent, FleetError> {
        let url = self.url(path);
        let mut pause = FIRST_PAUSE;
        let mut attempts = 0;
        loop {
            let failed = match filled(self.http.post(url.clone())).send().await {
                Ok(answer) if matches!(answer.status(), StatusCode::ACCEPTED | StatusCode::CREATED) => {
                    return Ok(Sent::Accepted);
                }
                Ok(answer) if answer.status() == StatusCode::OK => return Ok(Sent::Duplicate),
                Ok(answer) if answer.status().is_client_error() && answer.status() != StatusCode::TOO_MANY_REQUESTS => {
                    return Err(refusal(name, answer).await);
                }
                Ok(answer) => FleetError::Overloaded(answer.status()),
                Err(error) => self.unreachable(error),
            };
            attempts += 1;
            if attempts == ATTEMPTS {
                return Err(failed);
            }
            tokio::time::sleep(pause).await;
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<Option<T>, FleetError> {
        let answer = self.http.get(self.url(path)).send().await.map_err(|error| self.unreachable(error))?;
        match answer.status() {
            StatusCode::NOT_FOUND => Ok(None),
            StatusCode::OK => answer.json().await.map(Some).map_err(|error| FleetError::BadAnswer(error.to_string())),
            status if status.is_client_error() => Err(refusal(&format!("GET {path}"), answer).await),
            status => Err(FleetError::BadAnswer(format!("GET {path}: {status}"))),
        }
    }

    fn url(&self, path: &str) -> Url {
        self.base.join(path).expect("a path of checked names")
    }

    fn unreachable(&self, error: reqwest::Error) -> FleetError {
        FleetError::NotReachable { url: self.base.clone(), error }
    }
}

async fn refusal(name: &str, answer: Response) -> FleetError {
    let status = answer.status();
    let reason = match answer.json::<Problem>().await {
        Ok(problem) => words(&problem),
        Err(_) => status.to_string(),
    };
    FleetError::Refused { name: name.to_owned(), reason }
}

/// A problem in one line, the offending fields included.
fn words(problem: &Problem) -> String {
    let fields = problem.errors.iter().map(|field| match &field.pointer {
        Some(pointer) => format!("{pointer}: {}", field.detail),
        None => field.detail.clone(),
    });
    [problem.title.clone(), problem.detail.clone()].into_iter().chain(fields).collect::<Vec<_>>().join("; ")
}
