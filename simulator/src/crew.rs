//! Who tells the service of one unit: its uploads and what mechanics did to it, one after the other.

use std::sync::Arc;

use domain::Mask;
use ema::{faults::ElectricalFaults, wear::AMBIENT_TEMPERATURE};
use numerics::Stream;
use proto::json::{MaintenanceBody, MaintenanceKind, UploadBody};
use tokio::{sync::Semaphore, task::spawn_blocking};

use crate::{
    Client, FleetError, Sent,
    client::Heard,
    instrument::SAMPLE_NOISE,
    linkage,
    mission::Surroundings,
    plan::{FLIGHT_FH, FleetPlan, PART_NUMBER},
    roster::{Step, What},
    unit::Condition,
    wing::InstrumentedWing,
};

/// What became of one or more flights.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Flown {
    /// Uploads that were new to the service.
    pub accepted: u64,
    /// Uploads that it had already.
    pub duplicates: u64,
}

/// What it takes to tell of a unit.
#[derive(Debug, Clone)]
pub struct Crew {
    pub plan: FleetPlan,
    pub wing: Arc<InstrumentedWing>,
    pub mask: Arc<Mask>,
    pub client: Client,
    /// One permit per core: physics is computed on so many.
    pub cores: Arc<Semaphore>,
}

impl Crew {
    /// Tells what the service has not heard of a unit yet.
    pub async fn tell(&self, steps: Vec<Step>, heard: &Heard) -> Result<Flown, FleetError> {
        let mut flown = Flown::default();
        for step in steps {
            match step.what {
                What::Flight if step.flight_hours() <= heard.flight_hours => {}
                What::Flight => match self.upload(&step).await? {
                    Sent::Accepted => flown.accepted += 1,
                    Sent::Duplicate => flown.duplicates += 1,
                },
                What::Upkeep(kind, outcome) => self.report(&step, kind, outcome, heard).await?,
            }
        }
        Ok(flown)
    }

    async fn report(
        &self,
        step: &Step,
        kind: MaintenanceKind,
        outcome: Option<domain::Finding>,
        heard: &Heard,
    ) -> Result<(), FleetError> {
        let event = MaintenanceBody {
            event_id: format!("{}.{:05}.{}", step.unit.serial_number, step.flights, word(kind)),
            kind,
            outcome,
            part_number: PART_NUMBER.to_owned(),
            serial_number: step.unit.serial_number.to_string(),
            occurred_at: self.plan.time_at(step.fleet_fh).to_string(),
            flight_hours: step.flight_hours(),
            note: None,
        };
        if !heard.events.contains(&event.event_id) {
            let (tail, position) = (self.plan.tail(step.slot), self.plan.position(step.slot));
            self.client.report(&tail, &position, &event).await?;
        }
        Ok(())
    }

    async fn upload(&self, step: &Step) -> Result<Sent, FleetError> {
        let body = self.measure(step).await?;
        self.client.upload(&self.plan.tail(step.slot), &body).await
    }

    /// What the aircraft sends after a flight.
    async fn measure(&self, step: &Step) -> Result<UploadBody, FleetError> {
        let _core = self.cores.acquire().await.expect("never closed");
        let (mask, physics, seed) = (self.mask.clone(), self.plan.physics, self.plan.seed);
        let (wing, position) = (self.wing.clone(), self.plan.position(step.slot));
        let (unit, flights, hours) = (step.unit.clone(), step.flights, step.flight_hours());
        let (equivalent_h, mission) = (step.equivalent_h, step.surroundings);
        let (reading, flight, ambient_c) = spawn_blocking(move || {
            let Condition { faults, surroundings } = unit.at(equivalent_h);
            let Surroundings { load, temperature } = mission.unwrap_or(surroundings);
            let faults = ElectricalFaults::try_from(faults).expect("wear stays within what the physics can do");
            let key = ["flight", unit.serial_number.as_str(), &flights.to_string()];
            let ambient_c = AMBIENT_TEMPERATURE.zero_c + AMBIENT_TEMPERATURE.scale_k * temperature;
            let sortie = wing.fly(&position, load, ambient_c, &Stream::new(seed, &["wing", key[1], key[2]]));
            let motor = linkage::motor(unit.transmission_efficiency);
            let reading = physics.measure(&motor, &faults, &mask, &sortie.output_torque(), Stream::new(seed, &key));
            (reading, sortie.flight, ambient_c)
        })
        .await?;
        Ok(UploadBody {
            upload_id: format!("{}.{flights:05}", step.unit.serial_number),
            position: self.plan.position(step.slot).to_string(),
            part_number: PART_NUMBER.to_owned(),
            serial_number: step.unit.serial_number.to_string(),
            flight_hours: hours,
            flight_cycles: Some(flights),
            recorded_at: self.plan.time_at(step.fleet_fh).to_string(),
            mask_id: Some(self.mask.id().to_string()),
            samples: Some(reading.samples),
            load_ratio: Some(reading.load_ratio),
            sample_noise: Some(SAMPLE_NOISE),
            faults: None,
            strain: Some(flight.strain),
            air_data: Some(flight.air_data),
            temperature_c: Some(ambient_c),
            winding_temperature_c: None,
            on_ground: Some(false),
        })
    }
}

impl Step {
    /// The unit's hours since new.
    pub fn flight_hours(&self) -> f64 {
        self.flights as f64 * FLIGHT_FH
    }
}

/// The end of an event's name.
fn word(kind: MaintenanceKind) -> &'static str {
    match kind {
        MaintenanceKind::Install => "install",
        MaintenanceKind::Remove => "remove",
        MaintenanceKind::Overhaul => "overhaul",
        MaintenanceKind::Finding => "finding",
    }
}
