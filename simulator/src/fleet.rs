//! A fleet: tails, positions, units, and the flights that they fly.
//!
//! A flight takes [`FLIGHT_FH`] hours; after it, each position uploads once. A unit that fails is
//! found failed after its last upload, and replaced by a new one. Everything follows from the plan's
//! seed, so a fleet that is started again sends the same uploads again.

use std::sync::Arc;

use domain::{Mask, Position, Stream, TailNumber, Timestamp};
use ema::{commutation::BINS, faults::ElectricalFaults, motor::Motor, wear::AMBIENT_TEMPERATURE};
use proto::json::{FindingOutcome, MaintenanceBody, MaintenanceKind, UploadBody};
use tokio::{
    sync::Semaphore,
    task::{JoinSet, spawn_blocking},
};

use crate::{
    Client, FleetError, Physics, Sent,
    instrument::SAMPLE_NOISE,
    unit::{Condition, Unit},
    wing::InstrumentedWing,
};

/// Length of a flight, hours.
pub const FLIGHT_FH: f64 = 4.0;
/// Flight hours per calendar day.
pub const FH_PER_DAY: f64 = 8.0;
/// Oldest units at the start, as a share of their lives.
const OLDEST: f64 = 0.7;
/// The positions that carry an actuator, outermost first.
const POSITIONS: [&str; 4] = ["AIL-L", "AIL-R", "FLAP-L", "FLAP-R"];
const PART_NUMBER: &str = "EMA-48V";

/// A fleet to be.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetPlan {
    /// Number of aircraft.
    pub tails: usize,
    /// Actuators on each, at most four.
    pub positions: usize,
    /// Seed of everything hidden.
    pub seed: u64,
    /// When the fleet's future begins; all history lies before.
    pub start: Timestamp,
    /// What makes the samples.
    pub physics: Physics,
}

/// A fleet at some point of its future.
#[derive(Debug)]
pub struct Fleet {
    plan: FleetPlan,
    motor: Motor,
    wing: Arc<InstrumentedWing>,
    mask: Arc<Mask>,
    client: Client,
    slots: Vec<Slot>,
    cores: Arc<Semaphore>,
}

/// A position of a tail, and who sits there.
#[derive(Debug)]
struct Slot {
    tail: TailNumber,
    position: Position,
    /// Number of the position in the fleet.
    number: usize,
    /// How many units came before.
    replacements: u64,
    unit: Arc<Unit>,
    /// The unit's hours when the future begins: negative for one that is installed later.
    age_fh: f64,
    /// Flights of the unit so far.
    flights: u64,
}

/// What became of one or more flights.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Flown {
    /// Uploads that were new to the service.
    pub accepted: u64,
    /// Uploads that it had already.
    pub duplicates: u64,
}

impl FleetPlan {
    /// Refuses a plan that makes no fleet.
    fn check(&self) -> Result<(), FleetError> {
        let refuse = |field, rule, given: usize| Err(FleetError::BadPlan { field, rule, given: given.to_string() });
        match (self.tails, self.positions) {
            (tails, _) if !(1..=999).contains(&tails) => refuse("tails", "1 to 999", tails),
            (_, positions) if !(1..=POSITIONS.len()).contains(&positions) => refuse("positions", "1 to 4", positions),
            _ => Ok(()),
        }
    }

    /// The calendar time of an hour of the fleet's future.
    pub fn time_at(&self, fleet_fh: f64) -> Timestamp {
        self.start.plus_hours(fleet_fh * 24.0 / FH_PER_DAY)
    }

    fn unit_index(&self, slot: usize, replacements: u64) -> u64 {
        slot as u64 + replacements * (self.tails * self.positions) as u64
    }
}

impl Fleet {
    /// Assembles the fleet and fetches the mask, as every aircraft must before it samples. What the
    /// service knows of the fleet already is not flown again.
    pub async fn launch(plan: FleetPlan, client: Client) -> Result<Self, FleetError> {
        plan.check()?;
        let mask = Arc::new(client.mask(BINS).await?);
        let mut slots = JoinSet::new();
        for number in 0..plan.tails * plan.positions {
            let (plan, client) = (plan.clone(), client.clone());
            slots.spawn(async move { Slot::launch(&plan, number, &client).await });
        }
        let mut slots: Vec<Slot> = slots.join_all().await.into_iter().collect::<Result<_, _>>()?;
        slots.sort_by_key(|slot| slot.number);
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let wing = Arc::new(spawn_blocking(InstrumentedWing::reference).await?);
        Ok(Self { plan, motor: Motor::default(), wing, mask, client, slots, cores: Arc::new(Semaphore::new(cores)) })
    }

    /// The plan.
    pub fn plan(&self) -> &FleetPlan {
        &self.plan
    }

    /// Hours of the fleet's future, negative in its past, up to which every position has flown.
    pub fn flown_fh(&self) -> f64 {
        self.slots.iter().map(Slot::flown_fh).fold(f64::INFINITY, f64::min)
    }

    /// Flies every position up to an hour of the fleet's future and uploads after every flight.
    pub async fn fly_until(&mut self, fleet_fh: f64) -> Result<Flown, FleetError> {
        let mut flights = JoinSet::new();
        for slot in self.slots.drain(..) {
            let crew = Crew {
                plan: self.plan.clone(),
                motor: self.motor.clone(),
                wing: self.wing.clone(),
                mask: self.mask.clone(),
                client: self.client.clone(),
                cores: self.cores.clone(),
            };
            flights.spawn(async move { crew.fly(slot, fleet_fh).await });
        }
        let mut total = Flown::default();
        for landed in flights.join_all().await {
            let (slot, flown) = landed?;
            self.slots.push(slot);
            total.accepted += flown.accepted;
            total.duplicates += flown.duplicates;
        }
        self.slots.sort_by_key(|slot| slot.number);
        Ok(total)
    }

    /// The hidden truth of the units now installed.
    pub fn truth(&self) -> impl Iterator<Item = crate::truth::Truth<'_>> {
        self.slots.iter().map(|slot| crate::truth::Truth {
            tail: &slot.tail,
            position: &slot.position,
            part_number: PART_NUMBER,
            serial_number: &slot.unit.serial_number,
            flight_hours: slot.flights as f64 * FLIGHT_FH,
            failure_fh: slot.unit.failure_fh(),
        })
    }
}

impl Slot {
    async fn launch(plan: &FleetPlan, number: usize, client: &Client) -> Result<Self, FleetError> {
        let tail: TailNumber = format!("EC-A{:03}", number / plan.positions + 1).parse().expect("a valid tail");
        let position: Position = POSITIONS[number % plan.positions].parse().expect("a valid position");
        let unit = assemble(plan.seed, plan.unit_index(number, 0)).await?;
        let share = OLDEST * Stream::new(plan.seed, &["age", unit.serial_number.as_str()]).uniform();
        let age_fh = (share * unit.failure_fh() / FLIGHT_FH).floor() * FLIGHT_FH;
        let mut slot = Self { tail, position, number, replacements: 0, unit, age_fh, flights: 0 };
        slot.catch_up(plan, client).await?;
        Ok(slot)
    }

    /// Goes to where the service last heard of this position.
    async fn catch_up(&mut self, plan: &FleetPlan, client: &Client) -> Result<(), FleetError> {
        let Some(tail) = client.tail(&self.tail).await? else { return Ok(()) };
        let Some(item) = tail.positions.into_iter().find(|item| item.position == self.position.as_str()) else {
            return Ok(());
        };
        let Some(index) = Unit::index_of(plan.seed, &item.serial_number) else { return Ok(()) };
        let fleet = plan.unit_index(0, 1);
        if index % fleet != self.number as u64 {
            return Ok(());
        }
        while self.replacements < index / fleet {
            self.flights = self.last_flight();
            self.replace(plan).await?;
        }
        let heard_fh = item.prognosis.as_of.map_or(0.0, |as_of| as_of.flight_hours);
        self.flights = (heard_fh / FLIGHT_FH) as u64;
        Ok(())
    }

    fn flown_fh(&self) -> f64 {
        self.flights as f64 * FLIGHT_FH - self.age_fh
    }

    /// The flight during which the unit fails.
    fn last_flight(&self) -> u64 {
        (self.unit.failure_fh() / FLIGHT_FH).ceil() as u64
    }

    /// What the mechanic reports after it.
    fn finding(&self, plan: &FleetPlan) -> MaintenanceBody {
        MaintenanceBody {
            event_id: format!("{}.failed", self.unit.serial_number),
            kind: MaintenanceKind::Finding,
            outcome: Some(FindingOutcome::Failed),
            part_number: PART_NUMBER.to_owned(),
            serial_number: self.unit.serial_number.to_string(),
            occurred_at: plan.time_at(self.flown_fh()).to_string(),
            flight_hours: self.flights as f64 * FLIGHT_FH,
            note: None,
        }
    }

    /// A new unit takes the place of the failed one.
    async fn replace(&mut self, plan: &FleetPlan) -> Result<(), FleetError> {
        self.age_fh = -self.flown_fh();
        self.flights = 0;
        self.replacements += 1;
        self.unit = assemble(plan.seed, plan.unit_index(self.number, self.replacements)).await?;
        Ok(())
    }
}

async fn assemble(seed: u64, index: u64) -> Result<Arc<Unit>, FleetError> {
    Ok(Arc::new(spawn_blocking(move || Unit::new(seed, index)).await?))
}

/// What one position needs to fly on its own.
struct Crew {
    plan: FleetPlan,
    motor: Motor,
    wing: Arc<InstrumentedWing>,
    mask: Arc<Mask>,
    client: Client,
    cores: Arc<Semaphore>,
}

impl Crew {
    async fn fly(self, mut slot: Slot, fleet_fh: f64) -> Result<(Slot, Flown), FleetError> {
        let mut flown = Flown::default();
        while slot.flown_fh() + FLIGHT_FH <= fleet_fh {
            if slot.flights == slot.last_flight() {
                self.client.report(&slot.tail, &slot.position, &slot.finding(&self.plan)).await?;
                slot.replace(&self.plan).await?;
            }
            slot.flights += 1;
            let body = self.upload(&slot).await?;
            match self.client.upload(&slot.tail, &body).await? {
                Sent::Accepted => flown.accepted += 1,
                Sent::Duplicate => flown.duplicates += 1,
            }
        }
        Ok((slot, flown))
    }

    /// What the position sends after its latest flight.
    async fn upload(&self, slot: &Slot) -> Result<UploadBody, FleetError> {
        let _core = self.cores.acquire().await.expect("never closed");
        let (motor, mask, physics) = (self.motor.clone(), self.mask.clone(), self.plan.physics);
        let (unit, flights, seed) = (slot.unit.clone(), slot.flights, self.plan.seed);
        let hours = flights as f64 * FLIGHT_FH;
        let (wing, position) = (self.wing.clone(), slot.position.clone());
        let (reading, flight, ambient_c) = spawn_blocking(move || {
            let Condition { faults, load, temperature } = unit.at(hours);
            let faults = ElectricalFaults::try_from(faults).expect("wear stays within what the physics can do");
            let key = ["flight", unit.serial_number.as_str(), &flights.to_string()];
            let ambient_c = AMBIENT_TEMPERATURE.zero_c + AMBIENT_TEMPERATURE.scale_k * temperature;
            let flight = wing.fly(&position, load, ambient_c, &Stream::new(seed, &["wing", key[1], key[2]]));
            (physics.measure(&motor, &faults, &mask, Stream::new(seed, &key)), flight, ambient_c)
        })
        .await?;
        Ok(UploadBody {
            upload_id: format!("{}.{flights:05}", slot.unit.serial_number),
            position: slot.position.to_string(),
            part_number: PART_NUMBER.to_owned(),
            serial_number: slot.unit.serial_number.to_string(),
            flight_hours: hours,
            flight_cycles: Some(flights),
            recorded_at: self.plan.time_at(slot.flown_fh()).to_string(),
            mask_id: self.mask.id().to_string(),
            samples: reading.samples,
            load_ratio: Some(reading.load_ratio.into()),
            sample_noise: Some(SAMPLE_NOISE),
            strain: Some(flight.strain.into()),
            air_data: Some(flight.air_data.into()),
            temperature_c: Some(ambient_c),
            winding_temperature_c: None,
            on_ground: Some(false),
        })
    }
}
