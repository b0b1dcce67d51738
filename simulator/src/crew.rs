//! Who tells the service of one unit: its uploads and what mechanics did to it, one after the other.

use std::sync::Arc;

use proto::json::{MaintenanceBody, MaintenanceKind, UploadBody};
use tokio::{sync::Semaphore, task::spawn_blocking};

use crate::{
    Client, FleetError, Sent,
    avionics::Avionics,
    client::Heard,
    plan::{FleetPlan, PART_NUMBER},
    roster::{Step, What},
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
    pub avionics: Arc<Avionics>,
    pub client: Client,
    /// One permit per core: physics is computed on so many.
    pub cores: Arc<Semaphore>,
}

impl Crew {
    /// The plan of the fleet.
    pub fn plan(&self) -> &FleetPlan {
        &self.avionics.plan
    }

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
            occurred_at: self.plan().time_at(step.fleet_fh).to_string(),
            flight_hours: step.flight_hours(),
            note: None,
        };
        if !heard.events.contains(&event.event_id) {
            let (tail, position) = (self.plan().tail(step.slot), self.plan().position(step.slot));
            self.client.report(&tail, &position, &event).await?;
        }
        Ok(())
    }

    async fn upload(&self, step: &Step) -> Result<Sent, FleetError> {
        let body = self.measure(step).await?;
        let flight = u32::try_from(step.flights).unwrap_or(u32::MAX);
        self.client.upload(&self.plan().tail(step.slot), body, flight).await
    }

    /// What the aircraft sends after a flight.
    async fn measure(&self, step: &Step) -> Result<UploadBody, FleetError> {
        let _core = self.cores.acquire().await.expect("never closed");
        let (avionics, step) = (self.avionics.clone(), step.clone());
        Ok(spawn_blocking(move || avionics.upload(&step)).await?)
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
