//! The terms in which results are told: units and words.
//!
//! Estimators, scores and reports count in reference hours and reference deviations; readers count in what they recorded.

use prognosis::{REFERENCE_LIMIT, Scale};

/// A unit of what is counted in reference hours or reference deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Behind numbers, such as `h`.
    pub name: String,
    /// In a sentence, such as `hours`.
    pub words: String,
    /// On an axis, such as `flight hours`.
    pub axis: String,
    /// How many of them make one of the reference.
    pub per_reference: f64,
    /// A figure of the reference and the same in this unit, whose multiples are told without the dust of conversion.
    step: Option<[f64; 2]>,
}

impl Unit {
    fn new([name, words, axis]: [&str; 3], per_reference: f64) -> Self {
        Self { name: name.to_owned(), words: words.to_owned(), axis: axis.to_owned(), per_reference, step: None }
    }

    /// A figure in this unit.
    pub fn of(&self, reference: f64) -> f64 {
        reference * self.per_reference
    }

    /// Digits behind the point of a figure that is a share of a whole life: none for lives of thousands.
    pub fn decimals(&self) -> usize {
        let digits = (self.of(prognosis::REFERENCE_LIFE_FH)).log10().floor();
        (3.0 - digits).clamp(0.0, 12.0) as usize
    }

    /// A time of a prediction, or between two, in this unit.
    pub fn at(&self, reference: f64) -> f64 {
        match self.step {
            Some([step, told]) if (reference / step).round() * step == reference => (reference / step).round() * told,
            Some(_) => self.rounded(reference),
            None => self.of(reference),
        }
    }

    /// A setting in this unit, without the dust of conversion.
    pub fn told(&self, reference: f64) -> String {
        if self.per_reference == 1.0 { reference.to_string() } else { self.rounded(reference).to_string() }
    }

    /// A figure in this unit, without the dust of conversion.
    pub fn rounded(&self, reference: f64) -> f64 {
        let written = format!("{:.*}", self.decimals() + 4, self.of(reference));
        written.parse().expect("a written number")
    }

    /// Its words without markup, for a page.
    pub(crate) fn escaped(&self) -> Self {
        let [name, words, axis] = [&self.name, &self.words, &self.axis].map(|text| escaped(text));
        Self { name, words, axis, ..*self }
    }
}

/// How results are told.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms {
    /// What time is counted in.
    pub time: Unit,
    /// What deviations from nominal are counted in.
    pub deviation: Unit,
    /// What ends a life, in a sentence about the line that marks it in a chart.
    pub end: String,
    /// Whether lives are those of actuators: diagnoses end at bounds, and a surrogate judges all faults together.
    pub actuators: bool,
    /// What was noticed in reading the lives, a line each.
    pub notes: Vec<String>,
}

impl Terms {
    /// Of actuators in flight hours.
    pub fn actuators() -> Self {
        Self {
            time: Unit::new(["h", "hours", "flight hours"], 1.0),
            deviation: Unit::new(["", "deviation", "deviation from nominal"], 1.0),
            end: "The vertical line is the first faulty verdict of the assessment, which judges all faults together, so that no fault has a threshold of its own.".to_owned(),
            actuators: true,
            notes: Vec::new(),
        }
    }

    /// Of recorded lives in the user's unit of time, predicted `every` so often.
    pub fn recorded(unit: &str, scale: &Scale, every: f64, notes: Vec<String>) -> Self {
        let time = Unit::new([unit; 3], scale.characteristic_life / prognosis::REFERENCE_LIFE_FH);
        Self {
            time: Unit { step: Some([scale.reference_fh(every), every]), ..time },
            deviation: Unit::new(["", "share", "share of the way from nominal to limit"], 1.0 / REFERENCE_LIMIT),
            end: "The vertical line is the failure: the first passage of a limit, or the end that was told.".to_owned(),
            actuators: false,
            notes,
        }
    }

    /// Its words without markup, for a page.
    pub(crate) fn escaped(&self) -> Self {
        let [time, deviation] = [&self.time, &self.deviation].map(Unit::escaped);
        let notes = self.notes.iter().map(|line| escaped(line)).collect();
        Self { time, deviation, end: self.end.clone(), actuators: self.actuators, notes }
    }
}

/// Text from a file, without markup.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_the_digits_that_a_life_of_their_unit_needs() {
        let unit =
            |characteristic_life| Terms::recorded("cycles", &Scale { characteristic_life }, 0.3, Vec::new()).time;
        let digits = [257_000.0, 5_000.0, 999.0, 3.0].map(|life| unit(life).decimals());
        assert_eq!(digits, [0, 0, 1, 3]);
        assert_eq!(Terms::actuators().time.decimals(), 0);
        assert_eq!(unit(257_000.0).told(10_000.0 / 257_000.0 * 5_000.0), "10000");
        assert_eq!(Terms::actuators().time.told(1.0 / 3.0), (1.0_f64 / 3.0).to_string());
    }

    #[test]
    fn times_of_predictions_are_multiples_of_what_was_told() {
        let scale = Scale { characteristic_life: 257_318.0 };
        let time = Terms::recorded("cycles", &scale, 10_000.0, Vec::new()).time;
        let step = scale.reference_fh(10_000.0);
        assert_eq!([1.0, 7.0, 23.0].map(|n| time.at(n * step)), [10_000.0, 70_000.0, 230_000.0]);
        assert!((time.at(2.5 * step) - 25_000.0).abs() < 1e-6);
        assert_eq!(Terms::actuators().time.at(1.0 / 3.0), 1.0 / 3.0);
    }
}
