//! What is odd about a file of histories, and may yet be meant so.

use std::{collections::BTreeSet, path::Path};

use prognosis::Observation;

/// No aircraft flies longer, flight hours.
const LONG_FH: f64 = 150_000.0;

/// Runs that are odd.
#[derive(Debug, Default)]
pub struct Oddities {
    /// Whose time goes back from one row to the next, and the first such row.
    backwards: Runs,
    /// That were seen twice at a time, as two different states.
    twice: Runs,
    /// That last too long.
    long: Runs,
}

/// Runs of one kind, and where it is seen first.
#[derive(Debug, Default)]
struct Runs {
    ids: BTreeSet<String>,
    first: String,
}

impl Runs {
    fn add(&mut self, id: &str, place: impl FnOnce() -> String) {
        if self.ids.is_empty() {
            self.first = place();
        }
        if !self.ids.contains(id) {
            self.ids.insert(id.to_owned());
        }
    }

    fn note(&self, file: &Path, words: &str) -> Option<String> {
        let (file, count, first) = (file.display(), self.ids.len(), &self.first);
        (count > 0).then(|| format!("{file}: {words} in {count} of its runs, first in {first}"))
    }
}

impl Oddities {
    /// Looks at a row of a run, and the time of its row before.
    pub fn row(&mut self, id: &str, before_fh: Option<f64>, t_fh: f64, line: usize) {
        if let Some(before_fh) = before_fh.filter(|before_fh| t_fh < *before_fh) {
            self.backwards.add(id, || format!("row {line}, run {id}: {t_fh} h after {before_fh} h"));
        }
    }

    /// Looks at a run in its order, without rows that are there twice.
    pub fn history(&mut self, id: &str, observations: &[Observation]) {
        if let Some(pair) = observations.windows(2).find(|pair| pair[0].t_fh == pair[1].t_fh) {
            self.twice.add(id, || format!("run {id} at {} h", pair[0].t_fh));
        }
        if let Some(last) = observations.last().filter(|last| last.t_fh > LONG_FH) {
            self.long.add(id, || format!("run {id}: {} h", last.t_fh));
        }
    }

    /// A line for each oddity of a file.
    pub fn notes(&self, file: &Path) -> Vec<String> {
        let backwards = "times go back (rows are put in order; are these several lives?)";
        let twice = "different rows have one time (all count; are these several lives?)";
        let long = "hours are more than an aircraft flies (are these seconds?)";
        let notes = [(&self.backwards, backwards), (&self.twice, twice), (&self.long, long)];
        notes.into_iter().filter_map(|(runs, words)| runs.note(file, words)).collect()
    }
}
