//! What every endpoint promises. One that is not here fails the tests.

use proto::json::{
    CheckBody, MaintenanceBody, PlanBody, RetryBody, SensorConfigurationBody, SettingsBody, StretchBody, WhatIfBody,
};

use super::{names::Owner, principal::Kind, world};

/// Who may, beside nobody else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Allowed {
    /// Anyone at all.
    Everyone,
    /// The aircraft itself, and administrators.
    Uploaders,
    /// Everyone with a token.
    Known,
    /// Everyone with a token but aircraft.
    Readers,
    /// Planners and administrators.
    Planners,
    /// Administrators.
    Admins,
}

impl Allowed {
    /// Whether a kind of caller may at all, whatever it asks about.
    pub fn admits(self, kind: Kind) -> bool {
        let aircraft = matches!(kind, Kind::AircraftOne | Kind::AircraftTwo);
        match self {
            Self::Everyone => true,
            Self::Uploaders => aircraft || kind == Kind::Admin,
            Self::Known => kind.is_known(),
            Self::Readers => kind.is_known() && !aircraft,
            Self::Planners => matches!(kind, Kind::Planner | Kind::Admin),
            Self::Admins => kind == Kind::Admin,
        }
    }
}

/// What an endpoint promises.
#[derive(Debug, Clone, Copy)]
pub struct Expectation {
    /// Who may.
    pub allowed: Allowed,
    /// What a caller is answered who may, about what is its operator's.
    pub success: u16,
    /// What an aircraft is answered about another tail of its operator.
    pub other_tail: u16,
}

/// Of REST endpoints and pages, by method and path.
pub fn of_rest(method: &str, path: &str) -> Expectation {
    use Allowed::{Admins, Everyone, Known, Planners, Readers, Uploaders};
    let (allowed, success) = match (method, path) {
        ("get", "/healthz" | "/readyz" | "/version" | "/metrics" | "/openapi.json") => (Everyone, 200),
        ("get", "/docs/" | "/live.js" | "/docs/{file}" | "/problems" | "/problems/{kind}") => (Everyone, 200),
        ("get", "/docs") => (Everyone, 308),
        ("get", "/" | "/due" | "/scoreboard" | "/tails/{tail}/positions/{position}") => (Readers, 200),
        ("post", "/v1/tails/{tail}/uploads") => (Uploaders, 202),
        ("post", "/v1/uploads") => (Uploaders, 202),
        ("get", "/v1/uploads") => (Readers, 200),
        ("get", "/v1/uploads/{upload_id}") => (Known, 200),
        ("post", "/v1/uploads/{upload_id}/void" | "/v1/uploads/{upload_id}/retry") => (Planners, 200),
        ("post", "/v1/tails/{tail}/uploads/retry") => (Planners, 200),
        ("get", "/v1/tails" | "/v1/tails/{tail}" | "/v1/tails/{tail}/rul") => (Readers, 200),
        ("get", "/v1/tails/{tail}/positions/{position}/rul") => (Readers, 200),
        ("get", "/v1/tails/{tail}/positions/{position}/health") => (Readers, 200),
        ("get", "/v1/fleet/due" | "/v1/fleet/rul" | "/v1/fleet/scoreboard") => (Readers, 200),
        ("post", "/v1/tails/{tail}/positions/{position}/maintenance") => (Planners, 201),
        ("post", "/v1/tails/{tail}/positions/{position}/maintenance/{event_id}/void") => (Planners, 200),
        ("get", "/v1/tails/{tail}/sensor-configurations") => (Readers, 200),
        ("post", "/v1/tails/{tail}/sensor-configurations") => (Admins, 201),
        ("get", "/v1/tails/{tail}/plan") => (Readers, 200),
        ("put", "/v1/tails/{tail}/plan" | "/v1/tails/{tail}/checks") => (Planners, 200),
        ("get", "/v1/tails/{tail}/checks" | "/v1/checks" | "/v1/settings") => (Readers, 200),
        ("put", "/v1/checks" | "/v1/settings") => (Planners, 200),
        ("post", "/v1/tails/{tail}/positions/{position}/what-if") => (Readers, 200),
        ("get", "/v1/components/{part}/{serial}" | "/v1/components/{part}/{serial}/health") => (Readers, 200),
        ("get", "/v1/models" | "/v1/models/{hash}" | "/v1/models/{hash}/mask") => (Known, 200),
        _ => panic!("{method} {path}: nothing is expected of it yet: say here who may call it"),
    };
    // An aircraft does not learn which uploads the others have sent.
    let other_tail = if path == "/v1/uploads/{upload_id}" { 404 } else { 403 };
    Expectation { allowed, success, other_tail }
}

/// Of gRPC methods, by their path; in the words of gRPC.
pub fn of_grpc(path: &str) -> Expectation {
    let allowed = match path {
        "/actuary.v1.Ingest/Upload" | "/actuary.v1.Ingest/UploadStream" | "/actuary.v1.Ingest/UploadFrame" => {
            Allowed::Uploaders
        }
        "/actuary.v1.FleetHealth/ListTails"
        | "/actuary.v1.FleetHealth/GetTail"
        | "/actuary.v1.FleetHealth/GetRul"
        | "/actuary.v1.FleetHealth/ListHealth"
        | "/actuary.v1.FleetHealth/ListDue"
        | "/actuary.v1.FleetHealth/ListRul"
        | "/actuary.v1.FleetHealth/GetPlan"
        | "/actuary.v1.FleetHealth/GetChecks"
        | "/actuary.v1.FleetHealth/GetSettings"
        | "/actuary.v1.FleetHealth/WhatIf" => Allowed::Readers,
        "/actuary.v1.FleetHealth/SetPlan"
        | "/actuary.v1.FleetHealth/SetChecks"
        | "/actuary.v1.FleetHealth/SetSettings" => Allowed::Planners,
        "/actuary.v1.Models/List" | "/actuary.v1.Models/GetMask" => Allowed::Known,
        _ => panic!("{path}: nothing is expected of it yet: say here who may call it"),
    };
    // A stream goes on after a message that is refused.
    let other_tail = if path.ends_with("/UploadStream") { 0 } else { 7 };
    Expectation { allowed, success: 0, other_tail }
}

/// A value of a parameter, by its name.
pub fn parameter(endpoint: &str, name: &str, of: Owner) -> String {
    let value = match (name, endpoint) {
        ("tail", _) => of.tail(1),
        ("position", _) => of.position(),
        ("part", _) => of.part(),
        ("serial", _) => of.serial(1),
        ("upload_id", path) if path.ends_with("/retry") => of.upload(1, world::SET_ASIDE),
        ("upload_id", _) => of.upload(1, 0),
        ("event_id", _) => of.event(),
        ("hash", _) => return crate::in_process::service::Bundle::all()[0].model.summary().hash.to_string(),
        ("kind", _) => return "conflict".to_owned(),
        ("file", _) => return "swagger-ui.css".to_owned(),
        ("state", _) => return "processed".to_owned(),
        ("view", _) => return "states".to_owned(),
        ("limit", _) => return "2".to_owned(),
        ("part_number", _) => of.part(),
        ("status", _) => return "ok,failed".to_owned(),
        ("sort", _) => return "place".to_owned(),
        ("preview", _) => return "true".to_owned(),
        ("format", _) => return "csv".to_owned(),
        ("within_fh", _) => return "300".to_owned(),
        ("risk", _) => return "0.001".to_owned(),
        ("urgency", _) => return "failed,act_now,before_check,unknown,may_wait".to_owned(),
        ("life", _) => return "0".to_owned(),
        ("generation", _) => return "1".to_owned(),
        ("from_fh", _) => return "0".to_owned(),
        ("to_fh", _) => return "100000".to_owned(),
        ("cursor", "/v1/uploads") => of.upload(1, 0),
        ("cursor", "/v1/tails" | "/v1/checks") => of.tail(1),
        ("cursor", "/v1/fleet/rul") => format!("place_0_0_0_{}_{}", of.tail(1), of.position()),
        // A cursor after an upload is made of its name, and so belongs to a component.
        ("cursor", _) => of.upload(1, 0),
        _ => panic!("{endpoint}: there is no value for the parameter {name:?} yet"),
    };
    value.replace(' ', "%20")
}

/// A check of today.
fn check(name: &str) -> CheckBody {
    let date = world::now().to_string()[..10].to_owned();
    CheckBody { name: name.to_owned(), date: Some(date), ..CheckBody::default() }
}

/// The bodies of a request, each with its media type.
pub fn bodies(path: &str, media_types: &[String], of: Owner) -> Vec<(String, Vec<u8>)> {
    let body = |media_type: &String| {
        let bytes = match (path, media_type.as_str()) {
            // A new upload, since all that are there would be duplicates.
            ("/v1/tails/{tail}/uploads", "application/json") => world::json(&world::upload(of, 1, 50)),
            ("/v1/tails/{tail}/uploads", "application/x-ndjson") => {
                let lines = [50, 51].map(|number| world::json(&world::upload(of, 1, number)));
                lines.join(&b'\n')
            }
            ("/v1/uploads", proto::frame::MEDIA_TYPE) => world::frame(of),
            ("/v1/tails/{tail}/positions/{position}/maintenance", "application/json") => {
                let new = MaintenanceBody { event_id: format!("{}.new", of.event()), ..world::event(of) };
                world::json(&new)
            }
            ("/v1/tails/{tail}/uploads/retry", "application/json") => {
                let (from, to) = ("2020-01-01T00:00:00Z".to_owned(), world::now().to_string());
                world::json(&RetryBody { from, to, reason: None })
            }
            ("/v1/tails/{tail}/sensor-configurations", "application/json") => {
                // Its content is the same for all, because the answer names it by its hash.
                let mut new = world::configuration(of);
                new.configuration.strain_gratings[0].place = "new glue".to_owned();
                world::json(&SensorConfigurationBody { effective_from: world::now().to_string(), ..new })
            }
            ("/v1/tails/{tail}/plan", "application/json") => {
                let from = world::now().to_string();
                let stretch = StretchBody { from, utilisation_fh_per_day: Some(5.0), ..StretchBody::default() };
                world::json(&PlanBody { stretches: vec![stretch] })
            }
            ("/v1/tails/{tail}/checks", "application/json") => world::json(&[check("C-check")]),
            ("/v1/checks", "text/csv") => {
                let date = world::now().to_string();
                format!("tail,name,date\n{},A-check,{}\n", of.tail(1), &date[..10]).into_bytes()
            }
            ("/v1/settings", "application/json") => {
                world::json(&SettingsBody { risk: Some(0.07), ..SettingsBody::default() })
            }
            ("/v1/tails/{tail}/positions/{position}/what-if", "application/json") => {
                world::json(&WhatIfBody { utilisation_fh_per_day: Some(5.0), ..WhatIfBody::default() })
            }
            _ => panic!("{path}: there is no body of {media_type} yet"),
        };
        (media_type.clone(), bytes)
    };
    media_types.iter().map(body).collect()
}
