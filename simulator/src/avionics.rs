//! What an aircraft measures in a flight of one of its actuators, as it sends it: samples and load ratio of the motor, strain and
//! air data of the wing, and the ambient temperature, all of one flight.

use domain::Mask;
use ema::{faults::ElectricalFaults, wear::AMBIENT_TEMPERATURE};
use numerics::Stream;
use proto::json::UploadBody;

use crate::{
    instrument::SAMPLE_NOISE,
    linkage,
    mission::Surroundings,
    plan::{FleetPlan, PART_NUMBER},
    roster::Step,
    wing::InstrumentedWing,
};

/// The instruments of every aircraft of a fleet.
#[derive(Debug)]
pub struct Avionics {
    pub plan: FleetPlan,
    pub wing: InstrumentedWing,
    pub mask: Mask,
}

impl Avionics {
    /// What is sent after a flight. Draws are keyed by the unit's serial number and the number of its flight.
    pub fn upload(&self, step: &Step) -> UploadBody {
        let Self { plan, wing, mask } = self;
        let (unit, position, flights) = (&step.unit, plan.position(step.slot), step.flights);
        let Surroundings { load, temperature } = step.flown();
        let faults = ElectricalFaults::try_from(unit.at(step.equivalent_h).faults);
        let faults = faults.expect("wear stays within what the physics can do");
        let key = ["flight", unit.serial_number.as_str(), &flights.to_string()];
        let ambient_c = AMBIENT_TEMPERATURE.zero_c + AMBIENT_TEMPERATURE.scale_k * temperature;
        let sortie = wing.fly(&position, load, ambient_c, &Stream::new(plan.seed, &["wing", key[1], key[2]]));
        let motor = linkage::motor(unit.transmission_efficiency);
        let (torque, stream) = (sortie.output_torque(), Stream::new(plan.seed, &key));
        let reading = plan.physics.measure(&motor, &faults, mask, &torque, stream);
        UploadBody {
            upload_id: format!("{}.{flights:05}", unit.serial_number),
            position: position.to_string(),
            part_number: PART_NUMBER.to_owned(),
            serial_number: unit.serial_number.to_string(),
            flight_hours: step.flight_hours(),
            flight_cycles: Some(flights),
            recorded_at: plan.time_at(step.fleet_fh).to_string(),
            mask_id: Some(mask.id().to_string()),
            samples: Some(reading.samples),
            load_ratio: Some(reading.load_ratio),
            sample_noise: Some(SAMPLE_NOISE),
            faults: None,
            strain: Some(sortie.flight.strain),
            air_data: Some(sortie.flight.air_data),
            temperature_c: Some(ambient_c),
            winding_temperature_c: None,
            on_ground: Some(false),
        }
    }
}
