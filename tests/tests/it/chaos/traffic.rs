//! Uploads without an aircraft: made once, from a seed.

use domain::Timestamp;
use numerics::Stream;
use proto::{grpc::from_upload, json::UploadBody, v1::UploadRequest};
use serde_json::{Value, json};
use tests::items;

use super::crew::Access;

/// Whose components fly. They call their tails, components and uploads alike.
pub const OPERATORS: [&str; 3] = ["north", "east", "south"];
/// When every component is new.
const START: &str = "2024-01-01T00:00:00Z";
/// Hours of each flight; there are two a day.
const FLIGHT_FH: f64 = 4.0;
/// How many arrivals later a late upload arrives, at most.
const LATEST: usize = 60;

/// The mask that uploads are sampled by.
pub struct Mask {
    id: String,
    points: usize,
}

impl Mask {
    /// That of the active bundle.
    pub async fn of(access: &Access) -> Self {
        let get = async |path: String| access.get(0, &path).await;
        let model = items(get("/v1/models".to_owned()).await)[0]["hash"].as_str().unwrap().to_owned();
        let mask = get(format!("/v1/models/{model}/mask")).await;
        Self { id: mask["mask_id"].as_str().unwrap().to_owned(), points: mask["points"].as_array().unwrap().len() }
    }
}

/// One upload of one component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Arrival {
    pub component: usize,
    pub flight: usize,
}

impl Arrival {
    /// The number of its operator.
    pub fn operator(self) -> usize {
        self.component % OPERATORS.len()
    }

    /// Which of the operator's components it is of.
    fn number(self) -> usize {
        self.component / OPERATORS.len()
    }
}

/// All uploads of a fleet; each component is on a tail of its own.
pub struct Traffic {
    pub components: usize,
    flights: usize,
    seed: u64,
    mask: (String, usize),
}

impl Traffic {
    pub fn new(components: usize, flights: usize, seed: u64, mask: &Mask) -> Self {
        Self { components, flights, seed, mask: (mask.id.clone(), mask.points) }
    }

    /// How many different uploads there are.
    pub fn len(&self) -> usize {
        self.components * self.flights
    }

    pub fn tail(&self, arrival: Arrival) -> String {
        format!("EC-{:04}", arrival.number())
    }

    pub fn upload_id(&self, arrival: Arrival) -> String {
        format!("{}.{}", arrival.number(), arrival.flight)
    }

    /// The component's hours at the end of the flight; no two operators have the same.
    pub fn flight_hours(&self, arrival: Arrival) -> f64 {
        FLIGHT_FH * (arrival.flight + 1) as f64 + 0.5 * arrival.operator() as f64
    }

    /// Damage grows a little; which motor it is decides how fast, and the noise.
    pub fn body(&self, arrival: Arrival) -> Value {
        let Arrival { component, flight } = arrival;
        let mut stream = Stream::new(self.seed, &["chaos", &component.to_string(), &flight.to_string()]);
        let age = flight as f64 / self.flights as f64;
        let wear = 1.0 - (0.005 + 0.02 * (component % 5) as f64 / 5.0) * age.powi(3);
        let samples: Vec<f64> = (0..self.mask.1).map(|_| 0.0752 * (wear + 0.01 * stream.normal())).collect();
        let start: Timestamp = START.parse().unwrap();
        json!({
            "upload_id": self.upload_id(arrival), "position": "AIL-L", "part_number": "EMA-48V",
            "serial_number": format!("C{}", arrival.number()), "flight_hours": self.flight_hours(arrival),
            "recorded_at": start.plus_hours(12.0 * (flight + 1) as f64).to_string(), "mask_id": self.mask.0,
            "samples": samples, "load_ratio": 0.1, "sample_noise": 0.01, "temperature_c": 15.0,
        })
    }

    /// The same in protobuf's words.
    pub fn message(&self, arrival: Arrival) -> UploadRequest {
        let body: UploadBody = serde_json::from_value(self.body(arrival)).expect("a body");
        from_upload(body.into_upload(self.tail(arrival).parse().expect("a tail")).expect("an upload"))
    }

    /// Each upload once, flight by flight.
    pub fn in_order(&self) -> Vec<Arrival> {
        let of_flight = |flight| (0..self.components).map(move |component| Arrival { component, flight });
        (0..self.flights).flat_map(of_flight).collect()
    }

    /// Three in ten twice, one in ten late; components take turns.
    pub fn disturbed(&self) -> Vec<Arrival> {
        let mut timed: Vec<(f64, Arrival)> = Vec::new();
        for component in 0..self.components {
            let mut stream = Stream::new(self.seed, &["arrivals", &component.to_string()]);
            for flight in 0..self.flights {
                let arrival = Arrival { component, flight };
                let late = if stream.uniform() < 0.1 { LATEST as f64 * stream.uniform() } else { 0.0 };
                timed.push((flight as f64 + late, arrival));
                if stream.uniform() < 0.3 {
                    timed.push((flight as f64 + late + LATEST as f64 * stream.uniform(), arrival));
                }
            }
        }
        timed.sort_by(|(a, x), (b, y)| a.total_cmp(b).then(x.cmp(y)));
        timed.into_iter().map(|(_, arrival)| arrival).collect()
    }
}
