//! Tails and what is installed on them.

use domain::Status;
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
}

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
    /// How to read its prognosis now.
    pub status: Status,
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
        Self {
            tail,
            status,
            rul_p10_fh,
            positions: prognoses.into_iter().map(PositionItem::from).collect(),
            displaced: displaced.into_iter().map(DisplacedItem::from).collect(),
        }
    }
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
