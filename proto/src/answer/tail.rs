//! Tails and what is installed on them.

use domain::{Disagreement, DisagreementKind, LoadAgreement, Status, Timestamp, Urgency};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::RulAnswer;

/// One tail in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TailItem {
    /// The tail.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The worst status of its positions.
    pub status: Status,
    /// The lowest 10 % quantile of remaining useful life, flight hours; null when none is known.
    #[schema(required, example = 1085.0)]
    pub rul_p10_fh: Option<f64>,
    /// Number of positions with a component.
    #[schema(example = 4)]
    pub positions: usize,
}

/// One tail with its positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = TailBody)]
pub struct TailAnswer {
    /// The tail.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The worst status of its positions.
    pub status: Status,
    /// The lowest 10 % quantile of remaining useful life, flight hours; null when none is known.
    #[schema(required, example = 1085.0)]
    pub rul_p10_fh: Option<f64>,
    /// The positions, by name.
    pub positions: Vec<PositionItem>,
    /// Components that were last on this tail, lost their place to others and were never removed: their places are
    /// unknown.
    pub displaced: Vec<DisplacedItem>,
    /// Where motors and wing tell of different loads; empty where they agree or cannot be compared.
    #[serde(default)]
    pub load_disagreements: Vec<TailDisagreement>,
}

/// A lasting difference between what the wing of a tail and some of its motors tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TailDisagreement {
    /// The positions.
    #[schema(example = json!(["AIL-L"]))]
    pub positions: Vec<String>,
    /// What is likely to be behind it.
    pub kind: DisagreementKind,
    /// When the first flight of it was recorded.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z", value_type = String)]
    pub since: Timestamp,
    /// The finding in words, with the figures.
    #[schema(example = "since 1220 fh the motor works 17.4 +- 1.6 % more for every moment")]
    pub detail: String,
}

/// Disagreements that begin within so many hours of one another on all units of a wing are the wing's.
const SAME_TIME_H: f64 = 240.0;

/// A component without a known place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DisplacedItem {
    /// Where it is: null, nobody knows.
    #[schema(required, example = json!(null))]
    pub tail: Option<String>,
    /// Where it is: null, nobody knows.
    #[schema(required, example = json!(null))]
    pub position: Option<String>,
    /// The position of this tail where it was last.
    #[schema(example = "AIL-L")]
    pub last_position: String,
    /// The component's part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// Its serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// How its data stand now.
    pub status: Status,
    /// What to do about it.
    pub urgency: Urgency,
}

/// One position and the component in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PositionItem {
    /// The position.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// The component's part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// The component's serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// Overhaul index of the life.
    #[schema(example = 0)]
    pub life: u32,
    /// Its latest prognosis.
    pub prognosis: RulAnswer,
}

impl From<RulAnswer> for DisplacedItem {
    fn from(last: RulAnswer) -> Self {
        Self {
            tail: None,
            position: None,
            last_position: last.position,
            part_number: last.part_number,
            serial_number: last.serial_number,
            status: last.status,
            urgency: last.urgency,
        }
    }
}

impl From<RulAnswer> for PositionItem {
    fn from(prognosis: RulAnswer) -> Self {
        Self {
            position: prognosis.position.clone(),
            part_number: prognosis.part_number.clone(),
            serial_number: prognosis.serial_number.clone(),
            life: prognosis.life,
            prognosis,
        }
    }
}

impl TailAnswer {
    /// A tail with the remaining lives of its positions, and of what was last on it.
    pub fn new(tail: String, prognoses: Vec<RulAnswer>, displaced: Vec<RulAnswer>) -> Self {
        let TailItem { tail, status, rul_p10_fh, .. } = TailItem::new(tail, &prognoses);
        let compared =
            prognoses.iter().filter_map(|body| Some((body.position.as_str(), body.load_agreement.as_ref()?)));
        let load_disagreements = disagreements(&compared.collect::<Vec<_>>());
        Self {
            tail,
            status,
            rul_p10_fh,
            positions: prognoses.into_iter().map(PositionItem::from).collect(),
            displaced: displaced.into_iter().map(DisplacedItem::from).collect(),
            load_disagreements,
        }
    }
}

/// What the motors of a tail and its wing disagree in, by position. What all of them have from the same time on is the wing's
/// own: its sensor configuration is not what it was.
fn disagreements(compared: &[(&str, &LoadAgreement)]) -> Vec<TailDisagreement> {
    let of_motor = |one: &&Disagreement| one.kind != DisagreementKind::Grating;
    let begun = |agreement: &LoadAgreement| agreement.disagreements.iter().filter(of_motor).map(|one| one.since).min();
    let begun: Vec<Timestamp> = compared.iter().filter_map(|(_, agreement)| begun(agreement)).collect();
    let span_h = begun.iter().max().zip(begun.iter().min()).map(|(last, first)| last.hours_since(*first));
    let of_wing =
        compared.len() > 1 && begun.len() == compared.len() && span_h.is_some_and(|hours| hours <= SAME_TIME_H);
    let mut told = Vec::new();
    if of_wing {
        let wing = TailDisagreement {
            positions: compared.iter().map(|(position, _)| (*position).to_owned()).collect(),
            kind: DisagreementKind::SensorConfiguration,
            since: begun.into_iter().min().expect("more than one"),
            detail: "all motors that can be compared disagree with the wing from the same time on: the wing is read by a wrong \
                     sensor configuration"
                .to_owned(),
        };
        told.push((None, wing));
    }
    for (position, one) in
        compared.iter().flat_map(|(position, told)| told.disagreements.iter().map(move |one| (position, one)))
    {
        let is_grating = one.kind == DisagreementKind::Grating;
        let same = |known: &&mut (Option<u8>, TailDisagreement)| is_grating && known.0 == one.grating;
        match told.iter_mut().find(same) {
            Some((_, known)) => known.positions.push((*position).to_owned()),
            None if of_wing && !is_grating => {}
            None => {
                let (positions, kind, since, detail) =
                    (vec![(*position).to_owned()], one.kind, one.since, one.detail.clone());
                told.push((one.grating, TailDisagreement { positions, kind, since, detail }));
            }
        }
    }
    told.into_iter().map(|(_, disagreement)| disagreement).collect()
}

impl TailItem {
    /// A tail in short; nothing installed is as unknown as no history.
    pub fn new(tail: String, prognoses: &[RulAnswer]) -> Self {
        let p10 = prognoses.iter().filter_map(|body| body.rul_fh.as_ref()?.p10);
        Self {
            tail,
            status: prognoses.iter().map(|body| body.status).min().unwrap_or(Status::InsufficientHistory),
            rul_p10_fh: p10.min_by(f64::total_cmp),
            positions: prognoses.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit of a tail, with what it disagrees in: kind, day since when, grating.
    fn unit(position: &str, found: &[(DisagreementKind, i64, Option<u8>)]) -> (String, LoadAgreement) {
        let begin: Timestamp = "2026-03-01T00:00:00Z".parse().unwrap();
        let one = |&(kind, day, grating): &(DisagreementKind, i64, Option<u8>)| Disagreement {
            kind,
            since_fh: 8.0 * day as f64,
            since: begin.plus_hours(24.0 * day as f64),
            size: 0.2,
            sigma: 0.01,
            grating,
            detail: format!("{} since day {day}", kind.as_str()),
        };
        let agreement = LoadAgreement {
            flights: 100,
            efficiency: 1.0,
            efficiency_sigma: 0.01,
            friction: 0.0,
            friction_sigma: 0.01,
            disagreements: found.iter().map(one).collect(),
            course: Vec::new(),
        };
        (position.to_owned(), agreement)
    }

    fn told(units: &[(String, LoadAgreement)]) -> Vec<(Vec<String>, DisagreementKind)> {
        let compared = units.iter().map(|(position, agreement)| (position.as_str(), agreement)).collect::<Vec<_>>();
        disagreements(&compared).into_iter().map(|one| (one.positions, one.kind)).collect()
    }

    #[test]
    fn what_all_motors_have_from_the_same_date_on_is_the_wings() {
        use DisagreementKind::{Efficiency, Friction, Grating, SensorConfiguration};
        let both = |day| [unit("AIL-L", &[(Efficiency, 10, None)]), unit("AIL-R", &[(Friction, day, None)])];
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        assert_eq!(told(&both(14)), [(names(&["AIL-L", "AIL-R"]), SensorConfiguration)]);
        assert_eq!(told(&both(60)), [(names(&["AIL-L"]), Efficiency), (names(&["AIL-R"]), Friction)]);
        let one_healthy = [unit("AIL-L", &[(Efficiency, 10, None)]), unit("AIL-R", &[])];
        assert_eq!(told(&one_healthy), [(names(&["AIL-L"]), Efficiency)]);
        assert_eq!(told(&one_healthy[..1]), [(names(&["AIL-L"]), Efficiency)]);
        let grating =
            [unit("AIL-L", &[(Grating, 3, Some(7))]), unit("AIL-R", &[(Grating, 4, Some(7)), (Grating, 4, Some(1))])];
        assert_eq!(told(&grating), [(names(&["AIL-L", "AIL-R"]), Grating), (names(&["AIL-R"]), Grating)]);
        assert_eq!(told(&[]), []);
    }
}
