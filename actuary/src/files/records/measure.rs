//! What a value of a column means: how far on the way from nominal to the limit.

use numerics::quantile;
use prognosis::Ending;
use serde::Serialize;

use super::{
    file::{RecordFile, Row, Unit},
    flags::{Flags, LimitAt, NominalIs},
};
use crate::exit::Failure;

/// A fault that went so much of its way back has not only been seen with noise.
const AWAY: f64 = 0.1;

/// A unit and the file that tells of it.
pub type Told<'a> = (&'a RecordFile, &'a Unit);

/// The measure of one fault, in the unit of its column.
#[derive(Debug, Clone, Serialize)]
pub struct Measure {
    /// The column.
    #[serde(skip)]
    pub name: String,
    /// Its value where nothing is damaged; the median over the units that teach, where each has its own.
    pub nominal: f64,
    /// The value at which a unit has failed; that of the nominal value beside it, where it is relative.
    pub limit: f64,
    /// Whether the limit was learned from the last values of units that failed, so that no passage of it ends a life.
    pub learned: bool,
    /// Standard deviation of one value, where it was told.
    pub sigma: Option<f64>,
    /// Rows of a unit whose median is its own nominal value; none where all have the same.
    #[serde(skip)]
    own_rows: Option<usize>,
    /// The limit as a share of the nominal value.
    #[serde(skip)]
    share: Option<f64>,
}

impl Measure {
    /// The measures of all faults that have a limit, by what the units that teach show.
    pub fn all(flags: &Flags, teachers: &[Told]) -> Result<Vec<Self>, Failure> {
        (0..flags.limits.len()).map(|fault| Self::of(fault, flags, teachers)).collect()
    }

    fn of(fault: usize, flags: &Flags, teachers: &[Told]) -> Result<Self, Failure> {
        let name = &flags.limits[fault].name;
        let told = flags.nominals.iter().find(|nominal| nominal.name == *name).map(|nominal| nominal.is);
        let own_rows = match told {
            Some(NominalIs::First(rows)) => Some(rows),
            _ => None,
        };
        let of_first = |rows: usize| median(teachers.iter().map(|(_, unit)| first(unit, fault, rows)));
        let nominal = match told {
            Some(NominalIs::Value(value)) => value,
            _ => of_first(own_rows.unwrap_or(1)),
        };
        let at = flags.limits[fault].at;
        let (limit, share) = match at {
            LimitAt::Value(value) => (value, None),
            LimitAt::Share(share) => (relative(nominal, share), Some(share)),
            LimitAt::Learned => (learned(fault, name, flags, teachers)?, None),
        };
        let sigma = flags.sigmas.iter().find(|sigma| sigma.name == *name).map(|sigma| sigma.value);
        let learned = at == LimitAt::Learned;
        let measure = Self { name: name.clone(), nominal, limit, learned, sigma, own_rows, share };
        measure.check(fault, teachers).map(|()| measure)
    }

    /// Nominal value and limit of a unit.
    fn ends(&self, unit: &Unit, fault: usize) -> (f64, f64) {
        let nominal = self.own_rows.map_or(self.nominal, |rows| first(unit, fault, rows));
        (nominal, self.share.map_or(self.limit, |share| relative(nominal, share)))
    }

    /// A unit's way from nominal to the limit, refused where there is none.
    pub fn way(&self, fault: usize, (file, unit): Told) -> Result<Way, Failure> {
        let (nominal, limit) = self.ends(unit, fault);
        if nominal == limit || (limit > nominal) != (self.limit > self.nominal) {
            let reason =
                format!("unit {} is nominal at {nominal}, which leaves no way to its limit {limit}", unit.name);
            return Err(file.refuse(&unit.rows[0], &self.name, reason));
        }
        Ok(Way { nominal, limit })
    }

    /// Whether each unit has a nominal value of its own.
    pub fn is_nominal_by_unit(&self) -> bool {
        self.own_rows.is_some()
    }

    /// The standard deviation of one value as a severity.
    pub fn severity_sigma(&self) -> Option<f64> {
        self.sigma.map(|sigma| sigma / (self.limit - self.nominal).abs())
    }

    /// Refuses a limit that is none and a column that tells of no damage.
    fn check(&self, fault: usize, teachers: &[Told]) -> Result<(), Failure> {
        let Self { name, nominal, limit, .. } = self;
        let (file, unit) = teachers[0];
        let refuse = |row: &Row, reason: String| Err(file.refuse(row, name, reason));
        if nominal == limit {
            return refuse(&unit.rows[0], format!("the limit {limit} is the nominal value, too"));
        }
        let moves = |(_, unit): &Told| unit.rows.iter().any(|row| row.values[fault] != unit.rows[0].values[fault]);
        if !teachers.iter().any(moves) {
            let reason =
                format!("{name} never moves from {} in any unit: not a fault under observation", value(unit, fault));
            return refuse(&unit.rows[0], reason);
        }
        let ways = teachers.iter().map(|told| self.way(fault, *told)).collect::<Result<Vec<_>, _>>()?;
        let passed = |(way, (_, unit)): &(&Way, &Told)| way.severity(value(unit, fault)) >= 1.0;
        let beyond: Vec<_> = ways.iter().zip(teachers).filter(passed).collect();
        if 2 * beyond.len() > teachers.len() {
            let (file, unit) = beyond[0].1;
            let reason = format!(
                "{} is beyond the limit {limit} in the first row of unit {} and of {} of {} units: the limit lies on the healthy side",
                value(unit, fault),
                unit.name,
                beyond.len(),
                teachers.len()
            );
            return Err(file.refuse(&unit.rows[0], name, reason));
        }
        self.must_move_to_the_limit(fault, teachers, &ways)
    }

    /// Refuses a limit that most units move away from.
    fn must_move_to_the_limit(&self, fault: usize, teachers: &[Told], ways: &[Way]) -> Result<(), Failure> {
        let last = |unit: &Unit| unit.rows.last().expect("a unit has rows").values[fault];
        let moved = |(way, (_, unit)): (&Way, &Told)| way.severity(last(unit)) - way.severity(value(unit, fault));
        let away: Vec<bool> = ways.iter().zip(teachers).map(|pair| moved(pair) < -AWAY).collect();
        let (Some(first), true) =
            (away.iter().position(|away| *away), 2 * away.iter().filter(|away| **away).count() > away.len())
        else {
            return Ok(());
        };
        let (file, unit) = teachers[first];
        let reason = format!(
            "unit {} and most others move away from the limit {}, here from {} to {}: the limit lies on the healthy side",
            unit.name,
            self.limit,
            value(unit, fault),
            last(unit)
        );
        Err(file.refuse(unit.rows.last().expect("a unit has rows"), &self.name, reason))
    }
}

/// From nominal to the limit.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    nominal: f64,
    limit: f64,
}

impl Way {
    /// The share of the way at a value: zero where nominal, one at the limit.
    pub fn severity(&self, value: f64) -> f64 {
        (value - self.nominal) / (self.limit - self.nominal)
    }
}

/// The first value of a unit.
fn value(unit: &Unit, fault: usize) -> f64 {
    unit.rows[0].values[fault]
}

/// The median of the first rows of a unit.
fn first(unit: &Unit, fault: usize, rows: usize) -> f64 {
    median(unit.rows.iter().take(rows).map(|row| row.values[fault]))
}

/// So far from nominal; the sign of the share is the direction, whatever the sign of the nominal value.
fn relative(nominal: f64, share: f64) -> f64 {
    nominal + share * nominal.abs()
}

/// The median of the last values of units that failed: of all, where no file tells of ends.
fn learned(fault: usize, name: &str, flags: &Flags, teachers: &[Told]) -> Result<f64, Failure> {
    let failed = |(_, unit): &&Told| flags.end.is_none() || unit.ending == Some(Ending::Failed);
    let last = |(_, unit): &Told| unit.rows.last().expect("a unit has rows").values[fault];
    let values: Vec<f64> = teachers.iter().filter(failed).map(last).collect();
    match values.is_empty() {
        true => Err(teachers[0]
            .0
            .refuse_whole(format!("no unit that teaches has failed, which the limit of {name} could be learned from"))),
        false => Ok(median(values.into_iter())),
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile::median(&quantile::sorted(values.collect())).expect("at least one value")
}
