//! A simulated fleet's prognoses against its hidden truth.

use std::fmt::Write as _;

use proto::answer::RulAnswer;
use simulator::Truth;

/// One unit's forecast and what will become of it.
struct Judged {
    truth_fh: f64,
    /// P10, median and P90; `None` beyond the horizon.
    quantiles_fh: [Option<f64>; 3],
}

impl Judged {
    /// Units whose remaining life was told; their truth counts from the newest data, and is zero for one that
    /// has failed since: it fails in the middle of its last flight.
    fn all<'a>(prognoses: &[RulAnswer], units: impl Iterator<Item = Truth<'a>>) -> Vec<Self> {
        let judge = |unit: Truth| {
            let mut of_unit = prognoses.iter().filter(|body| body.serial_number == unit.serial_number.as_str());
            let body = of_unit.find(|body| body.part_number == unit.part_number && body.life == unit.life)?;
            let (rul, as_of) = (body.rul_fh.as_ref()?, body.as_of.as_ref()?);
            let quantiles_fh = [rul.p10, rul.p50, rul.p90];
            Some(Self { truth_fh: (unit.failure_fh - as_of.flight_hours).max(0.0), quantiles_fh })
        };
        units.filter_map(judge).collect()
    }

    fn is_covered(&self) -> bool {
        let [low, _, high] = self.quantiles_fh;
        low.is_some_and(|low| low <= self.truth_fh) && high.is_none_or(|high| self.truth_fh <= high)
    }

    /// Relative error of the median.
    fn error(&self) -> Option<f64> {
        Some((self.quantiles_fh[1]? - self.truth_fh) / self.truth_fh.max(1.0))
    }
}

/// How the forecasts that are served now look to one who knows the truth.
pub fn verdict<'a>(prognoses: &[RulAnswer], units: impl Iterator<Item = Truth<'a>>) -> String {
    let judged = Judged::all(prognoses, units);
    if judged.is_empty() {
        return "No remaining life was told that could be judged by the hidden truth.".to_owned();
    }
    let covered = judged.iter().filter(|unit| unit.is_covered()).count();
    let mut text = format!(
        "By the hidden truth, {covered} of {} remaining lives lie between their P10 and P90 (8 in 10 should)",
        judged.len()
    );
    let mut errors: Vec<f64> = judged.iter().filter_map(Judged::error).collect();
    errors.sort_by(f64::total_cmp);
    if !errors.is_empty() {
        let median = errors[errors.len() / 2];
        write!(text, "; the medians are {:+.0} % off, in the middle", 100.0 * median).expect("writing to a string");
    }
    text + "."
}
