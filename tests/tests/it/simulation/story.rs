//! What happens to an operator's actuators, and what is sent of it: the inputs of one operator in the order in
//! which they come about.
//!
//! Units fly seven hours twice a day, near the end of their lives, so that forecasts are computed quickly. Names
//! are shared between operators on purpose (positions, serial numbers, upload ids, event ids); what must never
//! leave an operator carries its word ([`word`]).

use airframe::{Flight, FlightSettings, Layout, reference::reference_configuration};
use domain::{
    LoadRatio, MapSamples, Mask, Position, Reading, SensorConfiguration, SerialNumber, TailNumber, Timestamp, Upload,
};
use ema::{faults::ElectricalFaults, motor::Motor};
use numerics::Stream;
use proto::json::{MaintenanceBody, MaintenanceKind};
use simulator::{OutputTorque, Physics};

use super::{
    dice::Dice,
    input::Input,
    mix::{Mix, Story},
};

/// Length of a flight, hours.
const FLIGHT_FH: f64 = 7.0;
/// From one flight to the next, hours.
const TURN_H: f64 = 12.0;
/// When the first flight lands.
const START: &str = "2026-03-01T08:00:00Z";
const PART_NUMBER: &str = "EMA-48V";
const POSITIONS: [&str; 2] = ["AIL-L", "FLAP-R"];

/// When an operator's first flight lands.
pub fn start() -> Timestamp {
    START.parse().expect("a time")
}

/// When the last flight of every operator has landed.
pub fn end(mix: &Mix) -> Timestamp {
    start().plus_hours(TURN_H * (mix.flights + 1) as f64)
}

/// What only one operator may ever see.
pub fn word(operator: usize) -> &'static str {
    ["ALFA", "BRAVO", "CHARLY"][operator]
}

/// One actuator.
#[derive(Debug, Clone)]
struct Unit {
    serial_number: SerialNumber,
    flight_hours: f64,
    /// Hours since it was new or overhauled.
    worn_h: f64,
    uploads: usize,
}

/// A unit's place, by its number.
type Place = usize;

/// Tells the story of one operator.
pub struct Teller<'a> {
    mix: &'a Mix,
    operator: usize,
    mask: &'a Mask,
    dice: Dice,
    /// Installed units by place, then the spare ones.
    units: Vec<Unit>,
    places: Vec<(TailNumber, Position)>,
    events: usize,
    told: Vec<Input>,
}

impl<'a> Teller<'a> {
    /// Assembles the operator's fleet.
    pub fn new(seed: u64, mix: &'a Mix, operator: usize, mask: &'a Mask) -> Self {
        let mut dice = Dice::new(seed, &["story", word(operator)]);
        let tails = dice.whole(1..3);
        let positions = dice.whole(1..3);
        let place = |n: usize| {
            let tail = format!("{}-{}", word(operator), n / positions + 1);
            (tail.parse().expect("a tail"), POSITIONS[n % positions].parse().expect("a position"))
        };
        let places: Vec<_> = (0..tails * positions).map(place).collect();
        let spares = dice.whole(1..3);
        let units = (0..places.len() + spares).map(|n| Unit::new(operator, n, &mut dice)).collect();
        Self { mix, operator, mask, dice, units, places, events: 0, told: Vec::new() }
    }

    /// All inputs, in the order in which they come about.
    pub fn tell(mut self) -> Vec<Input> {
        let turns = self.mix.flights / self.places.len() + 1;
        for turn in 0..turns {
            let at = start().plus_hours(TURN_H * turn as f64);
            for place in 0..self.places.len() {
                self.fly(place, at);
                self.maintain(place, at.plus_hours(1.0));
            }
            self.reconsider(at);
        }
        self.told
    }

    fn story(&self) -> &'a Story {
        &self.mix.story
    }

    /// One flight, and its upload.
    fn fly(&mut self, place: Place, at: Timestamp) {
        let unit = &mut self.units[place];
        unit.flight_hours += FLIGHT_FH;
        unit.worn_h += FLIGHT_FH;
        unit.uploads += 1;
        let mut upload = self.measure(place, at);
        let Story { odd_uploads, conflicts, .. } = self.story();
        if self.dice.chance(*odd_uploads) {
            self.make_odd(&mut upload);
        }
        if self.dice.chance(*conflicts) {
            let other = Upload { flight_hours: upload.flight_hours + 0.25, ..upload.clone() };
            self.told.push(Input::Upload(other));
        }
        self.told.push(Input::Upload(upload));
    }

    /// What the aircraft knows of a unit after a flight.
    fn measure(&mut self, place: Place, at: Timestamp) -> Upload {
        let unit = &self.units[place];
        let (tail, position) = self.places[place].clone();
        let upload_id = format!("{}.{:03}", unit.serial_number, unit.uploads);
        let key = Stream::new(self.dice.bits(), &["upload"]);
        let wear = 0.5 + 0.0012 * unit.worn_h;
        let faults = ElectricalFaults::new([wear.min(0.8), 0.2, 0.25], 0.1, 1.0).expect("within what the motor can do");
        let reading = Physics::ClosedForm.measure(
            &Motor::default(),
            &faults,
            self.mask,
            &OutputTorque::steady(50.0),
            key.substream(0),
        );
        let flight = self.dice.chance(0.4).then(|| {
            let configuration = reference_configuration(Layout::D);
            Flight::draw(&configuration, &FlightSettings::hard(), None, &key.substream(1))
        });
        Upload {
            tail,
            upload_id: upload_id.parse().expect("short"),
            position,
            part_number: PART_NUMBER.parse().expect("short"),
            serial_number: unit.serial_number.clone(),
            flight_hours: unit.flight_hours,
            flight_cycles: Some(unit.uploads as u64),
            recorded_at: at,
            reading: Reading::Samples(MapSamples {
                mask_id: self.mask.id(),
                samples: reading.samples,
                load_ratio: Some(reading.load_ratio),
                sample_noise: Some(0.01),
            }),
            strain: flight.as_ref().map(|flight| flight.strain.clone()),
            air_data: flight.as_ref().map(|flight| flight.air_data.clone()),
            temperature_c: Some(12.5),
            winding_temperature_c: None,
            on_ground: Some(false),
        }
    }

    /// An upload that says something that cannot be, or little.
    fn make_odd(&mut self, upload: &mut Upload) {
        match self.dice.whole(0..5) {
            // Hours that nobody can have flown.
            0 => upload.flight_hours += 5000.0,
            // A clock that is far ahead.
            1 => upload.recorded_at = upload.recorded_at.plus_hours(24.0 * 2000.0),
            // Hardly any sample.
            2 => {
                let reading = upload.reading.samples_mut().expect("simulated uploads bring samples");
                for i in 3..reading.samples.len() {
                    reading.samples[i] = None;
                    if let Some(LoadRatio::PerSample(ratios)) = &mut reading.load_ratio {
                        ratios[i] = None;
                    }
                }
            }
            // No load: the other diagnosis serves.
            3 => upload.reading.samples_mut().expect("simulated uploads bring samples").load_ratio = None,
            // Somebody else's place.
            _ => (upload.tail, upload.position) = self.dice.pick(&self.places).clone(),
        }
    }

    /// What is done on the ground after a flight.
    fn maintain(&mut self, place: Place, at: Timestamp) {
        let Story { swaps, overhauls, findings, .. } = *self.story();
        if self.dice.chance(findings) {
            let outcome = if self.dice.chance(0.5) { domain::Finding::Failed } else { domain::Finding::Serviceable };
            self.report(MaintenanceKind::Finding, Some(outcome), place, place, at);
        }
        if self.dice.chance(overhauls) {
            self.report(MaintenanceKind::Overhaul, None, place, place, at);
            self.units[place].worn_h = 0.0;
        }
        if self.dice.chance(swaps) {
            let other = self.dice.whole(0..self.units.len());
            self.swap(place, other, at);
        }
    }

    /// Two units change places; one of them may come from the shelf.
    fn swap(&mut self, place: Place, other: usize, at: Timestamp) {
        let mut moves = vec![(MaintenanceKind::Remove, place, place)];
        if other < self.places.len() {
            moves.push((MaintenanceKind::Remove, other, other));
            moves.push((MaintenanceKind::Install, place, other));
        }
        moves.push((MaintenanceKind::Install, other, place));
        for (i, (kind, unit, at_place)) in moves.into_iter().enumerate() {
            if self.dice.chance(self.story().reported) {
                self.report(kind, None, unit, at_place, at.plus_hours(0.5 * (i + 1) as f64));
            }
        }
        self.units.swap(place, other);
    }

    /// A mechanic reports something of a unit, at a place.
    fn report(
        &mut self,
        kind: MaintenanceKind,
        outcome: Option<domain::Finding>,
        unit: usize,
        place: Place,
        at: Timestamp,
    ) {
        let unit = &self.units[unit];
        let (tail, position) = self.places[place].clone();
        let body = MaintenanceBody {
            event_id: format!("E{:03}", self.events),
            kind,
            outcome,
            part_number: PART_NUMBER.to_owned(),
            serial_number: unit.serial_number.to_string(),
            occurred_at: at.to_string(),
            flight_hours: unit.flight_hours,
            note: self.dice.chance(0.5).then(|| format!("seen by {}", word(self.operator))),
        };
        self.events += 1;
        if self.dice.chance(self.story().conflicts) {
            let body = MaintenanceBody { flight_hours: body.flight_hours + 0.5, ..body.clone() };
            self.told.push(Input::Event { tail: tail.clone(), position: position.clone(), body });
        }
        self.told.push(Input::Event { tail, position, body });
    }

    /// What is taken back, tried again and read anew of all that was told.
    fn reconsider(&mut self, at: Timestamp) {
        let Story { voids, retries, configurations, .. } = *self.story();
        if self.dice.chance(voids * self.places.len() as f64) {
            let taken_back = match self.dice.pick(&self.told).clone() {
                Input::Upload(upload) => Some(Input::VoidUpload(upload.upload_id)),
                Input::Event { tail, position, body } => {
                    let event_id = body.event_id.parse().expect("an event's name");
                    Some(Input::VoidEvent { tail, position, event_id })
                }
                _ => None,
            };
            self.told.extend(taken_back);
        }
        if self.dice.chance(retries * self.places.len() as f64) {
            let tried = match self.dice.pick(&self.told) {
                Input::Upload(upload) => Some(Input::Retry(upload.upload_id.clone())),
                _ => None,
            };
            self.told.extend(tried);
        }
        if self.dice.chance(configurations) {
            let (tail, _) = self.dice.pick(&self.places).clone();
            let hours = at.hours_since(start()) * self.dice.number(-0.2..1.0);
            let from = start().plus_hours((hours / TURN_H).round() * TURN_H);
            let configuration = Box::new(self.configuration());
            self.told.push(Input::Configuration { tail, from, configuration });
        }
    }

    fn configuration(&mut self) -> SensorConfiguration {
        let mut configuration = reference_configuration(Layout::D);
        configuration.effectiveness.aileron = *self.dice.pick(&[0.9, 1.0, 1.1]);
        configuration.strain_gratings[0].place = format!("U20 of {}", word(self.operator));
        configuration
    }
}

impl Unit {
    /// Every second serial number is another operator's as well.
    fn new(operator: usize, number: usize, dice: &mut Dice) -> Self {
        let serial =
            if number.is_multiple_of(2) { format!("SN-{number}") } else { format!("{}{number}", word(operator)) };
        let flight_hours = 10.0 * dice.whole(0..300) as f64;
        let worn_h = dice.number(0.0..200.0);
        Self { serial_number: serial.parse().expect("short"), flight_hours, worn_h, uploads: 0 }
    }
}
