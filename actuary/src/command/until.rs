//! What units have to last for, and at which risk, as the command line asks it.

use clap::Args;
use domain::Day;

use crate::client::Question;

/// Until when units have to last; until the next check of their tails where nothing is given.
#[derive(Debug, Args)]
pub struct Until {
    /// Have to last until this day, such as 2027-03-01.
    #[arg(long, value_name = "DATE", conflicts_with_all = ["check", "within_fh"])]
    by: Option<Day>,
    /// Have to last until the check of this name, or the next one.
    #[arg(long, value_name = "NAME", conflicts_with = "within_fh")]
    check: Option<String>,
    /// Have to last so many flight hours from the newest data of each, 0 to 10000.
    #[arg(long, value_name = "H", allow_negative_numbers = true)]
    within_fh: Option<f64>,
    /// Probability of failure until then above which one does not last, such as 0.05 or 5%; as the operator has set it unless
    /// given.
    #[arg(long, value_name = "P", value_parser = risk, allow_negative_numbers = true)]
    risk: Option<f64>,
}

impl Until {
    /// A question with it.
    pub fn of(&self, question: Question) -> Question {
        let Self { by, check, within_fh, risk } = self;
        question.with("by", *by).with("check", check.as_ref()).with("within_fh", *within_fh).with("risk", *risk)
    }
}

/// A probability, as such or in per cent.
fn risk(text: &str) -> Result<f64, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let read = match text.strip_suffix('%') {
        // Divided, so that 5% is 0.05 to the last bit.
        Some(percent) => number(percent).map(|percent| percent / 100.0),
        None => number(text),
    };
    read.ok_or_else(|| format!("{text:?} is no probability, such as 0.05 or 5%"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn risks_are_probabilities_or_per_cent() {
        assert_eq!(risk("0.05"), Ok(0.05));
        assert_eq!(risk("5%"), Ok(0.05));
        assert_eq!(risk("10 %"), Ok(0.1));
        assert!(risk("little").is_err() && risk("%").is_err());
    }
}
