//! Components and tails in short: what lists are made of, without a forecast's draws. They know no clock: data grow stale
//! by themselves.

use domain::{
    AsOf, DoubtKind, PartNumber, Plan, Position, Prognosis, QUANTILE_LEVELS, SerialNumber, Status, TailNumber,
    Timestamp,
};
use serde::{Deserialize, Serialize};

use crate::{Installed, LifeBeginning, SetAsideUploads};

/// A component at the position where it is installed now, or was last, in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// The aircraft.
    pub tail: TailNumber,
    /// The position.
    pub position: Position,
    /// Whether it is there (see [`crate::Installed::place_known`]).
    pub place_known: bool,
    /// The component's part number.
    pub part_number: PartNumber,
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// Number of the life that it is in.
    pub overhaul_index: u32,
    /// The overhaul with which that life began; `None` for the life that began when the component was new.
    pub began: Option<LifeBeginning>,
    /// Start of the installation as far as it is known.
    pub since: Timestamp,
    /// The prognosis issued last in the active generation of the life; `None` for a life without history.
    pub prognosis: Option<Brief>,
    /// The component's hours since new at which it was found failed, which ended the life.
    pub found_failed_fh: Option<f64>,
    /// Whether something of it is damaged or missing in the database: then neither the life nor a prognosis is told.
    pub is_damaged: bool,
    /// Uploads recorded in that life that are set aside.
    pub set_aside: SetAsideUploads,
    /// Uploads recorded since the overhaul with fewer hours than it has (see [`crate::Installed::before_overhaul`]).
    pub before_overhaul: u64,
}

/// A prognosis in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Brief {
    /// The newest data.
    pub as_of: AsOf,
    /// Its status while the data are not stale.
    pub standing: Status,
    /// What is known of the remaining life; `None` without a forecast.
    pub outlook: Option<Outlook>,
}

/// A forecast in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outlook {
    /// Quantiles of remaining life at [`QUANTILE_LEVELS`], flight hours; `None` where they are censored.
    pub quantiles_fh: [Option<f64>; QUANTILE_LEVELS.len()],
    /// Shortest remaining life of all draws, flight hours; `None` when all are censored.
    pub first_end_fh: Option<f64>,
    /// The horizon, flight hours.
    pub horizon_fh: f64,
    /// Name of the fault that most often drives the end of life.
    pub dominant_fault: String,
    /// The pace of its present mission, where it is known.
    pub pace: Option<f64>,
    /// What speaks against it.
    pub doubts: Vec<DoubtKind>,
}

impl Brief {
    /// A prognosis in short.
    pub fn new(prognosis: &Prognosis) -> Self {
        let outlook = prognosis.forecast.as_ref().ok().map(|forecast| Outlook {
            quantiles_fh: forecast.rul.quantiles_fh(),
            first_end_fh: forecast.rul.ends_fh().next(),
            horizon_fh: forecast.rul.horizon_fh(),
            dominant_fault: forecast.dominant_fault.clone(),
            pace: forecast.pace.as_ref().map(|pace| pace.now),
            doubts: forecast.doubts.iter().map(|doubt| doubt.kind).collect(),
        });
        Self { as_of: prognosis.as_of.clone(), standing: prognosis.standing(), outlook }
    }
}

impl Unit {
    /// The first status that applies while the data are not stale.
    pub fn standing(&self) -> Status {
        match &self.prognosis {
            _ if self.found_failed_fh.is_some() => Status::Failed,
            Some(prognosis) => prognosis.standing,
            None => Status::InsufficientHistory,
        }
    }
}

/// A component in short, with how its tail flies.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedUnit {
    /// The component.
    pub unit: Unit,
    /// Flight hours per day of the tail (see [`Installed::utilisation_fh_per_day`]).
    pub utilisation_fh_per_day: Option<f64>,
    /// The plan of the tail; empty where none is in force.
    pub plan: Plan,
}

/// The components of an operator that need attention most, the worst first.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstUnits {
    /// The components.
    pub units: Vec<ListedUnit>,
    /// The number of all components that have a place, or lost it.
    pub components: u64,
    /// The number of all tails.
    pub tails: u64,
    /// Uploads that wait to be processed.
    pub pending_uploads: u64,
}

/// The components of an operator that may be due: all that are, and some that are not.
#[derive(Debug, Clone, PartialEq)]
pub struct MayBeDue {
    /// The components, by tail and position.
    pub installed: Vec<Installed>,
    /// The number of all components that have a place, or lost it.
    pub components: u64,
    /// The oldest newest data of all components that are not older than was asked: when these are, more may be due.
    pub oldest_fresh: Option<Timestamp>,
}

/// A tail with what is installed on it, in short.
#[derive(Debug, Clone, PartialEq)]
pub struct TailInShort {
    /// The aircraft.
    pub tail: TailNumber,
    /// Number of positions with a component.
    pub positions: usize,
    /// The lowest 10 % quantile of remaining life, flight hours; `None` when none is known.
    pub p10_fh: Option<f64>,
    /// How its components stand while their data are not stale, each with the time of its newest data.
    pub(crate) standing: Vec<(Status, Option<Timestamp>)>,
}

impl TailInShort {
    /// A tail with nothing on it.
    pub(crate) fn empty(tail: TailNumber) -> Self {
        Self { tail, positions: 0, p10_fh: None, standing: Vec::new() }
    }

    /// Times of the newest data on which the standing of its components rests.
    pub fn newest_data(&self) -> impl Iterator<Item = Timestamp> {
        self.standing.iter().filter_map(|(_, newest_data)| *newest_data)
    }

    /// The worst status of its components at `now`; nothing installed is as unknown as no history.
    pub fn status(&self, now: Timestamp, stale_after_h: f64) -> Status {
        let statuses =
            self.standing.iter().map(|(standing, newest_data)| standing.at(*newest_data, now, stale_after_h));
        statuses.min().unwrap_or(Status::InsufficientHistory)
    }
}
