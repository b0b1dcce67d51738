//! Aircraft that send again whatever was not acknowledged, and what they were told.

use std::{
    collections::HashMap,
    fmt,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
    time::Duration,
};

use numerics::Stream;
use reqwest::{Client, Response, StatusCode, header::RETRY_AFTER};
use serde_json::Value;

use super::{
    crew::Access,
    grpc,
    traffic::{Arrival, Traffic},
};

/// Clients at the same time.
const CLIENTS: usize = 8;
/// Most uploads in one body.
const BATCH: usize = 24;
const PAUSE: Duration = Duration::from_millis(50);
/// An answer that takes longer is not waited for; a server that was stopped gives none.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// What all clients were told.
#[derive(Clone, Default)]
pub struct Ledger {
    /// Arrivals that were acknowledged.
    pub done: Arc<AtomicUsize>,
    told: Arc<Mutex<Told>>,
}

#[derive(Default)]
struct Told {
    /// How often an upload was said to be new.
    accepted: HashMap<Arrival, u32>,
    duplicates: usize,
    /// Uploads that were acknowledged over gRPC.
    over_grpc: usize,
    /// Requests that were to be made again: refused with 503, or not answered.
    busy: usize,
    unanswered: usize,
    violations: Vec<String>,
}

impl Ledger {
    /// What must not have been answered.
    pub fn violations(&self) -> Vec<String> {
        let told = self.told.lock().unwrap();
        let twice = told.accepted.iter().filter(|(_, times)| **times > 1);
        let twice = twice.map(|(arrival, times)| format!("{arrival:?} was new {times} times"));
        told.violations.iter().cloned().chain(twice).collect()
    }

    /// A request is to be made again, because the server says so.
    pub fn busy(&self) {
        self.tell(|told| told.busy += 1);
    }

    /// A request was not answered.
    pub fn unanswered(&self) {
        self.tell(|told| told.unanswered += 1);
    }

    /// So many uploads were acknowledged over gRPC.
    pub fn over_grpc(&self, count: usize) {
        self.tell(|told| told.over_grpc += count);
    }

    /// Something was answered that must not be.
    pub fn violation(&self, what: String) {
        self.tell(|told| told.violations.push(what));
    }

    /// Takes note of what an upload was answered; the arrival again, unless it was acknowledged.
    pub fn answered(&self, one: Arrival, status: &str, answer: &dyn fmt::Debug) -> Option<Arrival> {
        match status {
            "accepted" => self.tell(|told| *told.accepted.entry(one).or_default() += 1),
            "duplicate" => self.tell(|told| told.duplicates += 1),
            "unavailable" => {
                self.busy();
                return Some(one);
            }
            _ => self.violation(format!("{one:?}: {answer:?}")),
        }
        None
    }

    fn tell(&self, f: impl FnOnce(&mut Told)) {
        f(&mut self.told.lock().unwrap());
    }
}

impl fmt::Display for Ledger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let told = self.told.lock().unwrap();
        write!(
            f,
            "{} acknowledged as new, {} as duplicates, {} of both over gRPC; {} requests were told to come back, {} were \
             not answered",
            told.accepted.len(),
            told.duplicates,
            told.over_grpc,
            told.busy,
            told.unanswered
        )
    }
}

/// Sends all arrivals, each component's in their order, and returns once every one is acknowledged.
pub async fn fly(
    traffic: &Traffic,
    arrivals: &[Arrival],
    access: &Access,
    ledger: &Ledger,
    may_go_on: impl Fn() -> bool,
) {
    let clients = (0..CLIENTS).map(|number| {
        let of_client = arrivals.iter().copied().filter(|arrival| arrival.component % CLIENTS == number).collect();
        let stream = Stream::new(number as u64, &["client"]);
        Aircraft { traffic, access, ledger, http: http(), stream }.send_all(of_client, &may_go_on)
    });
    futures_util::future::join_all(clients).await;
}

fn http() -> Client {
    tests::http_builder().timeout(PATIENCE).build().unwrap()
}

struct Aircraft<'a> {
    traffic: &'a Traffic,
    access: &'a Access,
    ledger: &'a Ledger,
    http: Client,
    stream: Stream,
}

impl Aircraft<'_> {
    async fn send_all(mut self, arrivals: Vec<Arrival>, may_go_on: &impl Fn() -> bool) {
        let mut of_component: HashMap<usize, Vec<Arrival>> = HashMap::new();
        let mut rest = arrivals.into_iter().peekable();
        while rest.peek().is_some() {
            while !may_go_on() {
                tokio::time::sleep(PAUSE).await;
            }
            // Arrivals of a component meet in one body; those of others wait in theirs.
            let size = if self.stream.uniform() < 0.3 { 1 } else { 1 + self.below(BATCH) };
            for arrival in rest.by_ref().take(size * 4) {
                of_component.entry(arrival.component).or_default().push(arrival);
            }
            let mut components: Vec<usize> = of_component.keys().copied().collect();
            components.sort_unstable();
            for component in components {
                let waiting = of_component.remove(&component).unwrap();
                for body in waiting.chunks(size) {
                    self.send(body).await;
                    self.ledger.done.fetch_add(body.len(), Relaxed);
                }
            }
        }
    }

    fn below(&mut self, end: usize) -> usize {
        ((self.stream.uniform() * end as f64) as usize).min(end - 1)
    }

    /// Sends one body until all of it is acknowledged: one in ten to two servers at once, four in ten over gRPC.
    async fn send(&mut self, body: &[Arrival]) {
        let over_grpc = self.stream.uniform() < 0.4;
        let first = self.below(self.access.servers.len());
        let second = (first + 1) % self.access.servers.len();
        if self.stream.uniform() < 0.1 {
            tokio::join!(self.deliver(first, body, over_grpc), self.deliver(second, body, over_grpc));
        } else {
            self.deliver(first, body, over_grpc).await;
        }
    }

    /// Tries one server after the other.
    async fn deliver(&self, mut server: usize, body: &[Arrival], over_grpc: bool) {
        let mut left = body.to_vec();
        loop {
            let to = (self.access.servers[server].as_str(), self.access.tokens[left[0].operator()].as_str());
            left = match over_grpc {
                true => grpc::attempt(self.traffic, self.ledger, to, &left).await,
                false => self.attempt(to, &left).await,
            };
            if left.is_empty() {
                return;
            }
            server = (server + 1) % self.access.servers.len();
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// What is still not acknowledged.
    async fn attempt(&self, (server, token): (&str, &str), body: &[Arrival]) -> Vec<Arrival> {
        let url = format!("{server}/v1/tails/{}/uploads", self.traffic.tail(body[0]));
        let request = match body {
            [one] => self.http.post(url).json(&self.traffic.body(*one)),
            many => {
                let lines: String = many.iter().map(|one| format!("{}\n", self.traffic.body(*one))).collect();
                self.http.post(url).header("content-type", "application/x-ndjson").body(lines)
            }
        };
        let Ok(answer) = request.bearer_auth(token).send().await else {
            self.ledger.unanswered();
            return body.to_vec();
        };
        match (answer.status(), body) {
            (StatusCode::SERVICE_UNAVAILABLE, _) if answer.headers().contains_key(RETRY_AFTER) => {
                self.ledger.busy();
                body.to_vec()
            }
            (StatusCode::ACCEPTED | StatusCode::OK, [one]) => self.acknowledged(*one, answer).await,
            (StatusCode::OK, many) => self.lines(many, answer).await,
            (status, _) => {
                let said = answer.text().await.unwrap_or_default();
                self.ledger.violation(format!("{body:?}: {status} {said}"));
                Vec::new()
            }
        }
    }

    async fn acknowledged(&self, one: Arrival, answer: Response) -> Vec<Arrival> {
        match answer.json::<Value>().await {
            Ok(answer) => self.line(one, &answer).into_iter().collect(),
            Err(_) => vec![one],
        }
    }

    /// One line answers each line; a connection that ends early answers only the first ones.
    async fn lines(&self, body: &[Arrival], mut answer: Response) -> Vec<Arrival> {
        let mut text = Vec::new();
        while let Ok(Some(chunk)) = answer.chunk().await {
            text.extend_from_slice(&chunk);
        }
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let mut left = body.to_vec();
        for line in String::from_utf8_lossy(&text[..whole]).lines() {
            let Ok(answer) = serde_json::from_str::<Value>(line) else { continue };
            let answered = body.iter().find(|one| answer["upload_id"] == self.traffic.upload_id(**one).as_str());
            let Some(place) = answered.and_then(|one| left.iter().position(|waiting| waiting == one)) else { continue };
            let one = left.remove(place);
            left.extend(self.line(one, &answer));
        }
        left
    }

    /// The arrival again, unless it was acknowledged.
    fn line(&self, one: Arrival, answer: &Value) -> Option<Arrival> {
        self.ledger.answered(one, answer["status"].as_str().unwrap_or_default(), answer)
    }
}
