//! What is known of a life before it begins.
//!
//! - What: how faults grow, and, where past lives told it, how long lives go on beside that.
//! - Update rule: none; [`Lesson::learn`](crate::Lesson::learn) and [`learn_from_ended`](crate::learn_from_ended)
//!   make it.
//! - Requirements: one law in the faults' own measure, with nothing beside it, is written as its [`FleetPrior`] alone.

use std::fmt;

use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeSeed, IntoDeserializer, MapAccess, Visitor, value::MapAccessDeserializer},
};

use crate::{
    clock::Clock,
    companions::Companions,
    coordinate::Coordinate,
    growth_laws::{GrowthLaw, GrowthLaws},
    lesson::Lesson,
    motor_load::MotorCalibration,
    pace::PaceLaw,
    prior::FleetPrior,
};

/// What is known of a life before it begins.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(into = "Written")]
pub struct LifePrior {
    /// How faults grow.
    pub growth: GrowthLaws,
    /// What past lives tell beside that.
    pub companions: Option<Companions>,
    /// What load and temperature do to the pace of wear; all else is in damage-equivalent hours then. `None` where nobody
    /// knows.
    pub pace: Option<PaceLaw>,
    /// How the motor tells a load where no strain does; `None` where no past flights taught it.
    pub motor: Option<MotorCalibration>,
}

impl LifePrior {
    /// The grain of time, which all laws share.
    pub fn clock(&self) -> &Clock {
        &self.first().clock
    }

    /// What is known of growth by the most frequent law.
    pub fn first(&self) -> &FleetPrior {
        &self.growth.laws[0].prior
    }

    fn is_of_growth_alone(&self) -> bool {
        self.companions.is_none() && self.pace.is_none() && self.motor.is_none()
    }

    /// The prior of its only law, where that is in the faults' own measure and nothing stands beside it.
    fn alone(&self) -> Option<&FleetPrior> {
        match &self.growth.laws[..] {
            [GrowthLaw { coordinate: Coordinate::IDENTITY, prior, .. }] if self.is_of_growth_alone() => Some(prior),
            _ => None,
        }
    }
}

impl From<FleetPrior> for LifePrior {
    fn from(prior: FleetPrior) -> Self {
        let law = GrowthLaw { coordinate: Coordinate::IDENTITY, prior, share: 1.0 };
        Self { growth: GrowthLaws { laws: vec![law] }, companions: None, pace: None, motor: None }
    }
}

impl From<Lesson> for LifePrior {
    fn from(Lesson { growth, companions, pace }: Lesson) -> Self {
        Self { growth, companions: Some(companions), pace, motor: None }
    }
}

/// Its JSON.
#[derive(Serialize)]
#[serde(untagged)]
enum Written {
    Several {
        growth: GrowthLaws,
        companions: Option<Companions>,
        #[serde(skip_serializing_if = "Option::is_none")]
        pace: Option<PaceLaw>,
        #[serde(skip_serializing_if = "Option::is_none")]
        motor: Option<MotorCalibration>,
    },
    Alone(FleetPrior),
}

impl From<LifePrior> for Written {
    fn from(prior: LifePrior) -> Self {
        match prior.alone() {
            Some(alone) => Self::Alone(alone.clone()),
            None => {
                let LifePrior { growth, companions, pace, motor } = prior;
                Self::Several { growth, companions, pace, motor }
            }
        }
    }
}

impl<'de> Deserialize<'de> for LifePrior {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Reader)
    }
}

/// Tells by the first key which of the two is written. (Trying one after the other would forget where an error is.)
struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = LifePrior;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a prior")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<LifePrior, A::Error> {
        #[derive(Deserialize)]
        struct Several {
            growth: GrowthLaws,
            companions: Option<Companions>,
            pace: Option<PaceLaw>,
            motor: Option<MotorCalibration>,
        }
        let first: Option<String> = map.next_key()?;
        let several = matches!(first.as_deref(), Some("growth" | "companions" | "pace" | "motor"));
        let rest = MapAccessDeserializer::new(Ahead { first, map });
        if several {
            let Several { growth, companions, pace, motor } = Several::deserialize(rest)?;
            return Ok(LifePrior { growth, companions, pace, motor });
        }
        FleetPrior::deserialize(rest).map(LifePrior::from)
    }
}

/// A map whose first key was read ahead.
struct Ahead<A> {
    first: Option<String>,
    map: A,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Ahead<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        match self.first.take() {
            Some(first) => seed.deserialize(first.into_deserializer()).map(Some),
            None => self.map.next_key_seed(seed),
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pace::Coefficient;

    #[test]
    fn one_law_alone_is_written_as_its_prior() {
        let fleet = FleetPrior::vague();
        let prior = LifePrior::from(fleet.clone());
        let json = serde_json::to_string(&prior).expect("a prior serialises");
        assert_eq!(json, serde_json::to_string(&fleet).expect("a prior serialises"));
        assert_eq!(serde_json::from_str::<LifePrior>(&json).expect("a prior"), prior);
    }

    #[test]
    fn another_measure_or_law_is_written_whole() {
        let mut prior = LifePrior::from(FleetPrior::vague());
        prior.growth.laws[0].coordinate = Coordinate { exponent: 1.5, offset: 0.2 };
        written_whole(&prior);
        let told = Coefficient { mean: 2.0, sd: 0.1 };
        written_whole(&LifePrior { pace: Some(PaceLaw::told(told, told)), ..FleetPrior::vague().into() });
    }

    fn written_whole(prior: &LifePrior) {
        let json = serde_json::to_string(prior).expect("a prior serialises");
        assert_eq!(serde_json::from_str::<LifePrior>(&json).expect("a prior"), *prior);
    }
}
