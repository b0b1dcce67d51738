//! Components and tails in short: what lists are made of, without a forecast's draws. They know no clock: data grow stale
//! by themselves.

use domain::{
    AsOf, Checks, Doubt, PartNumber, Plan, Position, Prognosis, QUANTILE_LEVELS, RulDistribution, SerialNumber, Status,
    TailNumber, Timestamp, prognosis::InsufficientHistory,
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
    /// What is known of the remaining life, or what is missing for a forecast.
    pub outlook: Result<Outlook, InsufficientHistory>,
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
    pub doubts: Vec<Doubt>,
}

impl Outlook {
    /// The quantile at one of the levels that are told; `None` when it is censored, or of another level.
    pub fn quantile_fh(&self, level: f64) -> Option<f64> {
        let told = QUANTILE_LEVELS.iter().position(|one| *one == level)?;
        self.quantiles_fh[told]
    }
}

impl Outlook {
    /// Whether P(failure within some hours up to the horizon) is above a risk, as far as the quantiles tell; `None` where only
    /// the draws do. (A quantile may differ from a share of the draws by a few of them.)
    pub fn exceeds(&self, within_fh: f64, risk: f64) -> Option<bool> {
        const SLACK: f64 = 0.02;
        if self.first_end_fh.is_none_or(|first| first > within_fh) {
            return Some(false);
        }
        let mut told =
            QUANTILE_LEVELS.into_iter().zip(self.quantiles_fh).filter_map(|(level, quantile)| {
                match quantile.is_some_and(|quantile| quantile <= within_fh) {
                    true if level - SLACK > risk => Some(true),
                    false if level + SLACK <= risk => Some(false),
                    _ => None,
                }
            });
        told.next()
    }
}

impl Brief {
    /// A prognosis in short.
    pub fn new(prognosis: &Prognosis) -> Self {
        let outlook = prognosis.forecast.as_ref().map_err(Clone::clone).map(|forecast| Outlook {
            quantiles_fh: forecast.rul.quantiles_fh(),
            first_end_fh: forecast.rul.ends_fh().next(),
            horizon_fh: forecast.rul.horizon_fh(),
            dominant_fault: forecast.dominant_fault.clone(),
            pace: forecast.pace.as_ref().map(|pace| pace.now),
            doubts: forecast.doubts.clone(),
        });
        Self { as_of: prognosis.as_of.clone(), standing: prognosis.standing(), outlook }
    }
}

impl Unit {
    /// Forgets what cannot be told any longer, because something of it is damaged.
    pub(crate) fn damage(&mut self) {
        (self.began, self.prognosis, self.found_failed_fh, self.is_damaged) = (None, None, None, true);
        (self.set_aside, self.before_overhaul) = (SetAsideUploads::default(), 0);
    }

    /// The first status that applies while the data are not stale.
    pub fn standing(&self) -> Status {
        match &self.prognosis {
            _ if self.found_failed_fh.is_some() => Status::Failed,
            Some(prognosis) => prognosis.standing,
            None => Status::InsufficientHistory,
        }
    }
}

impl Installed {
    /// It in short.
    pub fn in_short(&self) -> Unit {
        Unit {
            tail: self.tail.clone(),
            position: self.position.clone(),
            place_known: self.place_known,
            part_number: self.part_number.clone(),
            serial_number: self.serial_number.clone(),
            overhaul_index: self.overhaul_index,
            began: self.began.clone(),
            since: self.since,
            prognosis: self.prognosis.as_ref().map(Brief::new),
            found_failed_fh: self.found_failed_fh,
            is_damaged: self.is_damaged,
            set_aside: self.set_aside.clone(),
            before_overhaul: self.before_overhaul,
        }
    }
}

/// A component in short, with how its tail flies.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedUnit {
    /// The component.
    pub unit: Unit,
    /// Flight hours per day of the tail (see [`crate::Installed::utilisation_fh_per_day`]).
    pub utilisation_fh_per_day: Option<f64>,
    /// The plan of the tail; empty where none is in force.
    pub plan: Plan,
    /// The checks of the tail; none where none are in force.
    pub checks: Checks,
    /// Its remaining life, where it was asked for and has a forecast.
    pub rul: Option<RulDistribution>,
}

/// The components that are asked for; what is `None` does not matter.
#[derive(Debug, Clone, Copy, Default)]
pub struct UnitsAsked<'a> {
    /// On this tail.
    pub tail: Option<&'a TailNumber>,
    /// At this position.
    pub position: Option<&'a Position>,
    /// Of this part number.
    pub part_number: Option<&'a PartNumber>,
    /// Behind this place, or without one.
    pub after: Option<(&'a TailNumber, &'a Position)>,
    /// Most components.
    pub limit: Option<u32>,
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
