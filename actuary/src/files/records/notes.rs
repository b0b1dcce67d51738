//! What follows from the rules of reading and may surprise.

use prognosis::Ending;

use super::{
    file::{RecordFile, Unit},
    life::{Life, Untold},
    measure::Measure,
};

/// Units of one kind: how many, and the first.
#[derive(Debug, Default)]
struct Units {
    count: usize,
    first: String,
}

impl Units {
    fn add(&mut self, unit: &Unit) {
        if self.count == 0 {
            self.first.clone_from(&unit.name);
        }
        self.count += 1;
    }

    /// A line about them; `{}` units, or one.
    fn line(&self, words: &str) -> Option<String> {
        match self.count {
            0 => None,
            1 => Some(format!("unit {} {words}", self.first)),
            count => Some(format!("{count} units (such as {}) {words}", self.first)),
        }
    }
}

/// What was noticed in reading.
#[derive(Debug, Default)]
pub struct Notes {
    general: Vec<String>,
    failed: Units,
    record_end: Units,
    removed: Units,
    overruled: Units,
    going_on: Units,
    taught: Units,
    beyond: Units,
    /// Rows after the end of their unit.
    after: usize,
}

impl Notes {
    /// Of files and of the measures of faults.
    pub fn new<'a>(files: impl Iterator<Item = &'a RecordFile>, measures: &[Measure]) -> Self {
        let mut general: Vec<String> = Vec::new();
        let (mut ignored, mut repeated): (Vec<&str>, usize) = (Vec::new(), 0);
        for file in files {
            for name in &file.ignored {
                if !ignored.contains(&name.as_str()) {
                    ignored.push(name);
                }
            }
            repeated += file.repeated;
        }
        let learned = measures.iter().filter(|measure| measure.learned);
        general.extend(learned.map(|Measure { name, limit, .. }| {
            format!("the limit of {name} is {limit}, the median of the last values of units that failed; its passage ends no life")
        }));
        if !ignored.is_empty() {
            general.push(format!("columns without a limit are ignored: {}", ignored.join(", ")));
        }
        if repeated > 0 {
            general.push(format!("{repeated} rows are there twice and count once"));
        }
        Self { general, ..Self::default() }
    }

    /// Takes note of units of one table that teach, and others that are judged.
    pub fn split(&mut self, teach: usize, judge: usize, alternating: bool) {
        let which = if alternating { "the 1st, 3rd, 5th...; tell --prior for others" } else { "the first ones" };
        self.general.insert(0, format!("{teach} of the {} units teach ({which}), {judge} are judged", teach + judge));
    }

    /// Takes note of a unit that is judged and has taught, too.
    pub fn taught(&mut self, unit: &Unit) {
        self.taught.add(unit);
    }

    /// Takes note of how a unit was read.
    pub fn life(&mut self, unit: &Unit, Life { life, passed, after }: &Life, untold: Untold) {
        self.after += after;
        let kind = match (life, unit.ending, untold) {
            (None, ..) => &mut self.beyond,
            (_, Some(Ending::Removed), _) if *passed => &mut self.overruled,
            _ if *passed => return,
            (_, Some(Ending::Failed), _) => &mut self.failed,
            (_, Some(Ending::Removed), _) => return,
            (_, None, Untold::Failed) => &mut self.record_end,
            (_, None, Untold::Removed) => &mut self.removed,
            (_, None, Untold::GoesOn) => &mut self.going_on,
        };
        kind.add(unit);
    }

    /// A line for each.
    pub fn lines(self) -> Vec<String> {
        let kinds = [
            (&self.beyond, "beyond a limit from the first row on: left out"),
            (&self.failed, "told to have failed without passing a limit: ended, as failed, at the last time"),
            (&self.record_end, "taken to have failed where the record ends: no column of --end tells otherwise"),
            (&self.overruled, "told to be removed after passing a limit: failed at the passage"),
            (&self.removed, "passing no limit until the last time: taken to be removed there, not failed"),
            (&self.taught, "taught, too: figures flatter"),
            (&self.going_on, "going on at the last time: predicted, not judged"),
        ];
        let units = kinds.iter().filter_map(|(units, words)| units.line(words));
        let after = (self.after > 0).then(|| format!("{} rows after the end of their unit are not read", self.after));
        let lines = units.chain(after).collect::<Vec<_>>();
        self.general.into_iter().chain(lines).collect()
    }
}
