//! A fleet that flies: it follows its roster, and tells the service what that has not heard of yet.
//!
//! Everything follows from the plan's seed, so a fleet that is started again sends the same uploads and events again.
//! Units are told of side by side, each in the order of its own course.

use std::{collections::BTreeMap, sync::Arc};

use ema::commutation::BINS;
use tokio::{
    sync::Semaphore,
    task::{JoinSet, spawn_blocking},
};

use crate::{
    Client, FleetError, Truth,
    avionics::Avionics,
    client::Heard,
    crew::{Crew, Flown},
    plan::{FLIGHT_FH, FleetPlan, PART_NUMBER},
    roster::{Roster, Step, What},
    wing::InstrumentedWing,
};

/// Flights of the fleet that units may be apart from each other.
const SIDE_BY_SIDE: i64 = 10;

/// A fleet at some point of its future.
#[derive(Debug)]
pub struct Fleet {
    crew: Crew,
    roster: Roster,
    /// What the service had heard of units when they first appeared, by index.
    heard: BTreeMap<u64, Heard>,
}

impl Fleet {
    /// Assembles the fleet and fetches the mask, as every aircraft must before it samples. What the
    /// service knows of the fleet already is not flown again.
    pub async fn launch(plan: FleetPlan, client: Client) -> Result<Self, FleetError> {
        plan.check()?;
        let mask = client.mask(BINS).await?;
        let mut units = JoinSet::new();
        for slot in 0..plan.slots() {
            let plan = plan.clone();
            units.spawn_blocking(move || (slot, plan.unit(slot, 0)));
        }
        let mut units = units.join_all().await;
        units.sort_by_key(|(slot, _)| *slot);
        let units = units.into_iter().map(|(_, unit)| Arc::new(unit)).collect();
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let wing = spawn_blocking(InstrumentedWing::reference).await?;
        let roster = Roster::new(plan.clone(), units);
        let cores = Arc::new(Semaphore::new(cores));
        let crew = Crew { avionics: Arc::new(Avionics { plan, wing, mask }), client, cores };
        let mut fleet = Self { crew, roster, heard: BTreeMap::new() };
        fleet.catch_up().await?;
        Ok(fleet)
    }

    /// The plan.
    pub fn plan(&self) -> &FleetPlan {
        self.crew.plan()
    }

    /// Hours of the fleet's future, negative in its past, up to which every position has flown.
    pub fn flown_fh(&self) -> f64 {
        self.roster.flight() as f64 * FLIGHT_FH
    }

    /// Flies every position up to an hour of the fleet's future and uploads after every flight.
    pub async fn fly_until(&mut self, fleet_fh: f64) -> Result<Flown, FleetError> {
        let last = (fleet_fh / FLIGHT_FH).floor() as i64;
        let mut total = Flown::default();
        while self.roster.flight() < last {
            let until = last.min(self.roster.flight() + SIDE_BY_SIDE);
            let (roster, steps) = flown(self.roster.clone(), until).await?;
            self.roster = roster;
            let flown = self.tell(steps).await?;
            total.accepted += flown.accepted;
            total.duplicates += flown.duplicates;
        }
        Ok(total)
    }

    /// The hidden truth of the units now installed.
    pub fn truth(&self) -> impl Iterator<Item = Truth<'_>> {
        self.roster.occupants().map(|occupant| Truth {
            tail: self.plan().tail(occupant.slot),
            position: self.plan().position(occupant.slot),
            part_number: PART_NUMBER,
            serial_number: &occupant.unit.serial_number,
            life: occupant.unit.life,
            flight_hours: occupant.flights as f64 * FLIGHT_FH,
            failure_fh: occupant.failure_fh,
            mission: self.plan().mission(occupant.slot),
            pace: occupant.pace,
            equivalent_h: occupant.equivalent_h,
            transmission_efficiency: occupant.unit.transmission_efficiency,
        })
    }

    /// Goes to the last flight of which the service has heard from everyone, and tells what it has not heard of the
    /// maintenance before.
    async fn catch_up(&mut self) -> Result<(), FleetError> {
        loop {
            let (roster, mut steps) = flown(self.roster.clone(), self.roster.flight() + 1).await?;
            self.ask(&steps).await?;
            let heard = |step: &Step| step.flight_hours() <= self.heard[&step.unit.index].flight_hours;
            if !steps.iter().filter(|step| step.what == What::Flight).all(heard) {
                return Ok(());
            }
            self.roster = roster;
            steps.retain(|step| step.what != What::Flight);
            self.tell(steps).await?;
        }
    }

    /// Tells of some steps, side by side for the units that they are about.
    async fn tell(&mut self, steps: Vec<Step>) -> Result<Flown, FleetError> {
        self.ask(&steps).await?;
        let mut courses: BTreeMap<u64, Vec<Step>> = BTreeMap::new();
        for step in steps {
            courses.entry(step.unit.index).or_default().push(step);
        }
        let mut crews = JoinSet::new();
        for (index, course) in courses {
            let (crew, heard) = (self.crew.clone(), self.heard[&index].clone());
            crews.spawn(async move { crew.tell(course, &heard).await });
        }
        let mut total = Flown::default();
        for flown in crews.join_all().await {
            let flown = flown?;
            total.accepted += flown.accepted;
            total.duplicates += flown.duplicates;
        }
        Ok(total)
    }

    /// Asks what the service has heard of units that appear for the first time.
    async fn ask(&mut self, steps: &[Step]) -> Result<(), FleetError> {
        let mut questions = JoinSet::new();
        let new: BTreeMap<u64, &Step> = steps.iter().map(|step| (step.unit.index, step)).collect();
        for (index, step) in new.into_iter().filter(|(index, _)| !self.heard.contains_key(index)) {
            let (client, serial_number) = (self.crew.client.clone(), step.unit.serial_number.clone());
            questions.spawn(async move { (index, client.heard(PART_NUMBER, &serial_number).await) });
        }
        for (index, heard) in questions.join_all().await {
            self.heard.insert(index, heard?);
        }
        Ok(())
    }
}

/// The roster after some flights, and what is to be told of them.
async fn flown(mut roster: Roster, until: i64) -> Result<(Roster, Vec<Step>), FleetError> {
    let fly = move || {
        let mut steps = Vec::new();
        while roster.flight() < until {
            steps.extend(roster.fly());
        }
        (roster, steps)
    };
    Ok(spawn_blocking(fly).await?)
}
