//! From the rows of a unit to a life: what was seen until it ended, and when that was.

use evaluation::{RecordedEnd, RecordedLife};
use prognosis::Ending;

use super::{
    file::Unit,
    measure::{Measure, Told},
};
use crate::exit::Failure;

/// What is known of lives that a file does not tell the end of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Untold {
    /// They ended where their record ends, in failure.
    Failed,
    /// They were taken out there.
    Removed,
    /// They go on.
    GoesOn,
}

/// How a life was read.
#[derive(Debug, Default)]
pub struct Life {
    /// The life; none for a unit that is beyond a limit from its first row on.
    pub life: Option<RecordedLife>,
    /// Whether a limit ended it.
    pub passed: bool,
    /// Rows after its end, which are not read.
    pub after: usize,
}

/// A unit as a life.
pub fn read(told: Told, measures: &[Measure], untold: Untold) -> Result<Life, Failure> {
    let (_, unit) = told;
    let ways = measures.iter().enumerate().map(|(fault, measure)| measure.way(fault, told));
    let ways = ways.collect::<Result<Vec<_>, _>>()?;
    let severity = |values: &[f64]| ways.iter().zip(values).map(|(way, value)| way.severity(*value)).collect();
    let mut severities: Vec<Vec<f64>> = unit.rows.iter().map(|row| severity(&row.values)).collect();
    let mut times: Vec<f64> = unit.rows.iter().map(|row| row.time).collect();
    let ends: Vec<bool> = measures.iter().map(|measure| !measure.learned).collect();
    let passage = passage(&times, &severities, &ends);
    let end = passage.map_or_else(
        || ending(unit, untold).map(|ending| RecordedEnd { time: times[times.len() - 1], ending }),
        |time| Some(RecordedEnd { time, ending: Ending::Failed }),
    );
    let kept = end.map_or(times.len(), |end| times.partition_point(|time| *time <= end.time));
    let after = times.len() - kept;
    times.truncate(kept);
    severities.truncate(kept);
    let lives = passage.is_none_or(|end| end > times[0]);
    let life = RecordedLife { unit: unit.name.clone(), times, severities, stress: Vec::new(), end };
    Ok(Life { life: lives.then_some(life), passed: passage.is_some(), after })
}

fn ending(unit: &Unit, untold: Untold) -> Option<Ending> {
    unit.ending.or(match untold {
        Untold::Failed => Some(Ending::Failed),
        Untold::Removed => Some(Ending::Removed),
        Untold::GoesOn => None,
    })
}

/// The first passage of a limit that ends lives, linear between two rows.
fn passage(times: &[f64], severities: &[Vec<f64>], ends: &[bool]) -> Option<f64> {
    let passed = |severities: &Vec<f64>| severities.iter().zip(ends).any(|(severity, ends)| *ends && *severity >= 1.0);
    let row = severities.iter().position(passed)?;
    if row == 0 {
        return Some(times[0]);
    }
    let (before, after) = (&severities[row - 1], &severities[row]);
    let share = |fault: usize| (1.0 - before[fault]) / (after[fault] - before[fault]);
    let shares = (0..ends.len()).filter(|&fault| ends[fault] && after[fault] >= 1.0).map(share);
    let first = shares.fold(f64::INFINITY, f64::min);
    Some(if first < 1.0 { times[row - 1] + first * (times[row] - times[row - 1]) } else { times[row] })
}
