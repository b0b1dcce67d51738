//! What must hold, by a plain model: what every operator was acknowledged, and who may hold which component.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Component, SensorConfiguration, TailNumber, Timestamp, Upload, UploadId};
use proto::json::MaintenanceBody;
use store::{Completion, Lease};

use super::{hands::LEASE, input::Input, operators};

/// All that the service acknowledged, and the leases that it gave.
#[derive(Default)]
pub struct Ledger {
    /// By operator.
    pub books: Vec<Book>,
    /// What changed anything, in the order in which it did.
    pub effects: Vec<Effect>,
    leases: BTreeMap<Component, Held>,
}

/// What one operator was acknowledged.
#[derive(Default)]
pub struct Book {
    /// Uploads by name.
    pub uploads: BTreeMap<UploadId, Stored<Upload>>,
    /// Events by name, with tail and position.
    pub events: BTreeMap<String, Stored<Reported>>,
    /// Sensor configurations by tail and time.
    pub configurations: BTreeMap<(TailNumber, Timestamp), SensorConfiguration>,
}

/// An event and where it was reported.
#[derive(Debug, Clone, PartialEq)]
pub struct Reported {
    /// The aircraft.
    pub tail: String,
    /// The position on it.
    pub position: String,
    /// What happened.
    pub body: MaintenanceBody,
}

/// Something that the service keeps for ever.
#[derive(Debug, Clone)]
pub struct Stored<T> {
    /// What.
    pub content: T,
    /// When it was received.
    pub received_at: Timestamp,
    /// Whether it counts no longer.
    pub voided: bool,
}

/// Something that changed what the service knows.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "most of them are inputs")]
pub enum Effect {
    /// An operator's input.
    Input {
        /// Whose.
        operator: usize,
        /// What.
        input: Input,
        /// When it was received.
        at: Timestamp,
    },
    /// Lives that begin from now on are judged by this bundle, or all lives are.
    Activation {
        /// Its number.
        bundle: usize,
        /// Whether it is for all lives.
        all_lives: bool,
    },
}

struct Held {
    fence: i64,
    until: Timestamp,
    /// An input since may have ended it.
    revised: bool,
}

impl Ledger {
    /// Nothing is known yet.
    pub fn new(operators: usize) -> Self {
        Self { books: (0..operators).map(|_| Book::default()).collect(), ..Self::default() }
    }

    /// The statuses with which an input may be answered now.
    pub fn expected(&self, operator: usize, input: &Input) -> &'static [u16] {
        let book = &self.books[operator];
        match input {
            Input::Upload(upload) => stored(book.uploads.get(&upload.upload_id), upload, &[202]),
            Input::Event { body, .. } => stored(book.events.get(&body.event_id), &reported(input), &[201]),
            Input::Configuration { tail, from, configuration } => {
                match book.configurations.get(&(tail.clone(), *from)) {
                    None => &[201],
                    Some(known) if *known == **configuration => &[200],
                    Some(_) => &[409],
                }
            }
            Input::VoidUpload(id) => {
                if book.uploads.contains_key(id) {
                    &[200]
                } else {
                    &[404]
                }
            }
            Input::VoidEvent { tail, position, event_id } => match book.events.get(event_id.as_str()) {
                Some(event) if event.content.tail == tail.as_str() && event.content.position == position.as_str() => {
                    &[200]
                }
                _ => &[404],
            },
            Input::Retry(id) => match book.uploads.get(id) {
                None => &[404],
                Some(upload) if upload.voided => &[409],
                // Whether it is set aside is the workers' to say.
                Some(_) => &[200, 409],
            },
        }
    }

    /// Takes note of an answer.
    pub fn answered(&mut self, operator: usize, input: &Input, status: u16, at: Timestamp) {
        let expected = self.expected(operator, input);
        assert!(expected.contains(&status), "{status} instead of {expected:?} to {operator}: {input:?}");
        if status >= 300 {
            return;
        }
        for (component, held) in &mut self.leases {
            held.revised |= component.operator.as_str() == operators::name(operator);
        }
        if self.books[operator].take(input, at) {
            self.effects.push(Effect::Input { operator, input: input.clone(), at });
        }
    }

    /// Takes note of a lease.
    pub fn leased(&mut self, lease: &Lease, now: Timestamp) {
        let until = now.plus_hours(Lease::duration(LEASE, lease.attempts).as_secs_f64() / 3600.0);
        let held = Held { fence: lease.fence, until, revised: false };
        if let Some(before) = self.leases.insert(lease.component.clone(), held) {
            let component = &lease.component;
            assert!(before.fence < lease.fence, "{component:?}: fence {} after {}", lease.fence, before.fence);
            assert!(before.until <= now || before.revised, "{component:?} was leased to two workers at the same time");
        }
    }

    /// Takes note of results that were written or refused.
    pub fn completed(&mut self, lease: &Lease, completion: Completion, now: Timestamp) {
        let Some(held) = self.leases.get_mut(&lease.component) else {
            assert_eq!(completion, Completion::Fenced, "{lease:?} did not survive the restart");
            return;
        };
        let held_still = held.fence == lease.fence && now < held.until;
        match completion {
            Completion::Done => assert!(held_still, "a zombie wrote results: {lease:?}"),
            Completion::Fenced => assert!(!held_still || held.revised, "results were refused for no reason: {lease:?}"),
        }
        if held.fence == lease.fence {
            held.until = now;
        }
    }

    /// Takes note that a database of one process has forgotten its leases.
    pub fn restarted(&mut self) {
        self.leases.clear();
    }

    /// Takes note of an activation.
    pub fn activated(&mut self, bundle: usize, all_lives: bool) {
        self.leases.values_mut().for_each(|held| held.revised |= all_lives);
        self.effects.push(Effect::Activation { bundle, all_lives });
    }
}

impl Book {
    /// Keeps what is new; tells whether it is.
    fn take(&mut self, input: &Input, at: Timestamp) -> bool {
        match input {
            Input::Upload(upload) => keep(&mut self.uploads, upload.upload_id.clone(), upload.clone(), at),
            Input::Event { body, .. } => keep(&mut self.events, body.event_id.clone(), reported(input), at),
            Input::Configuration { tail, from, configuration } => {
                let key = (tail.clone(), *from);
                self.configurations.insert(key, SensorConfiguration::clone(configuration)).is_none()
            }
            Input::VoidUpload(id) => void(self.uploads.get_mut(id)),
            Input::VoidEvent { event_id, .. } => void(self.events.get_mut(event_id.as_str())),
            Input::Retry(_) => false,
        }
    }

    /// Uploads that count.
    pub fn counting(&self) -> impl Iterator<Item = &Upload> {
        self.uploads.values().filter(|upload| !upload.voided).map(|upload| &upload.content)
    }

    /// Events that count.
    pub fn standing(&self) -> impl Iterator<Item = &Reported> {
        self.events.values().filter(|event| !event.voided).map(|event| &event.content)
    }

    /// (Part number, serial number) of all components that anything was ever received of.
    pub fn components(&self) -> BTreeSet<(String, String)> {
        let uploads = self.uploads.values().map(|upload| &upload.content);
        let of_uploads = uploads.map(|upload| (upload.part_number.to_string(), upload.serial_number.to_string()));
        let events = self.events.values().map(|event| &event.content.body);
        of_uploads.chain(events.map(|body| (body.part_number.clone(), body.serial_number.clone()))).collect()
    }
}

fn stored<T: PartialEq>(known: Option<&Stored<T>>, content: &T, new: &'static [u16]) -> &'static [u16] {
    match known {
        None => new,
        Some(known) if known.content == *content => &[200],
        Some(_) => &[409],
    }
}

fn reported(input: &Input) -> Reported {
    let Input::Event { tail, position, body } = input else { unreachable!("only events are reported") };
    Reported { tail: tail.to_string(), position: position.to_string(), body: body.clone() }
}

fn keep<K: Ord, T>(known: &mut BTreeMap<K, Stored<T>>, name: K, content: T, received_at: Timestamp) -> bool {
    let new = !known.contains_key(&name);
    if new {
        known.insert(name, Stored { content, received_at, voided: false });
    }
    new
}

fn void<T>(known: Option<&mut Stored<T>>) -> bool {
    known.is_some_and(|known| !std::mem::replace(&mut known.voided, true))
}
