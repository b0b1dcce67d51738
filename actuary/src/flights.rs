//! What a simulated fleet flies, and with which hidden gears, as the command line says it.

use clap::Args;
use simulator::{FleetPlan, Mission};

use crate::exit::Failure;

/// Missions and weak transmissions.
#[derive(Debug, Clone, Args)]
pub struct FlightArguments {
    /// Missions that the tails take in turn (short-haul, cruise, training), separated by commas: they differ in load and
    /// temperature, actuators wear at their pace, and half of the tails change their route once.
    #[arg(long, value_name = "MISSION", value_delimiter = ',')]
    missions: Vec<Mission>,
    /// Places whose first actuator has gears 15 % less efficient, as EC-A001/FLAP-L, separated by commas.
    #[arg(long, value_name = "TAIL/POSITION", value_delimiter = ',')]
    weak_transmission: Vec<String>,
}

impl FlightArguments {
    /// The plan with these missions and gears.
    pub fn of(&self, plan: FleetPlan) -> Result<FleetPlan, Failure> {
        let slot = |place: &String| {
            let named = place
                .split_once('/')
                .and_then(|(tail, position)| plan.slot(&tail.parse().ok()?, &position.parse().ok()?));
            let (first, last) = (0, plan.slots().saturating_sub(1));
            let range = [first, last].map(|slot| format!("{}/{}", plan.tail(slot), plan.position(slot))).join(" to ");
            named.ok_or_else(|| Failure::BadInput(format!("--weak-transmission {place}: the fleet has {range}")))
        };
        let weak_transmission = self.weak_transmission.iter().map(slot).collect::<Result<_, _>>()?;
        Ok(FleetPlan { missions: self.missions.clone(), weak_transmission, ..plan })
    }
}
