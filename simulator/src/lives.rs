//! Whole lives: units that nobody takes out, each on a tail of its own, from new to the flight in which they fail.

use domain::{Mask, Upload};

use crate::{
    FleetError,
    avionics::Avionics,
    mission::{Mission, Surroundings},
    plan::FleetPlan,
    roster,
    wing::InstrumentedWing,
};

/// The lives of the first units of a fleet.
#[derive(Debug)]
pub struct Lives {
    avionics: Avionics,
}

/// A flight, and what is hidden of it.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeFlight {
    /// What the aircraft sends.
    pub upload: Upload,
    /// True load and temperature.
    pub surroundings: Surroundings,
    /// Damage-equivalent hours of the life so far.
    pub equivalent_h: f64,
}

impl Lives {
    /// The lives of a plan, sampled at a mask.
    pub fn new(plan: FleetPlan, mask: Mask) -> Result<Self, FleetError> {
        plan.check()?;
        Ok(Self { avionics: Avionics { plan, wing: InstrumentedWing::reference(), mask } })
    }

    /// The mission of a slot's tail.
    pub fn mission(&self, slot: usize) -> Option<Mission> {
        self.avionics.plan.mission(slot)
    }

    /// One of every so many flights of a slot's life; the last one is that in which it fails.
    pub fn flights(&self, slot: usize, every: usize) -> impl Iterator<Item = LifeFlight> {
        let steps = roster::life(&self.avionics.plan, slot);
        let skipped = (steps.len() - 1) % every;
        steps.into_iter().skip(skipped).step_by(every).map(|step| {
            let upload = self.avionics.upload(&step).into_upload(self.avionics.plan.tail(step.slot));
            LifeFlight {
                upload: upload.expect("aircraft know their names"),
                surroundings: step.flown(),
                equivalent_h: step.equivalent_h,
            }
        })
    }
}
