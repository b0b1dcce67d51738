//! `predictions.csv`.

use std::io::{self, Write};

use evaluation::{Judged, backtest::LEVELS};

/// One row per prediction, estimator by estimator, run by run; censored values are empty. Flight hours are told to hundredths, which
/// is finer than any draw means; of a unit whose size nobody knows, all digits are.
pub fn write(file: &mut dyn Write, judged: &Judged) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(file);
    let time = &judged.terms.time;
    let [id, at] = if judged.terms.actuators { ["run_id", "t_fh"] } else { ["unit", "t"] };
    let mut header = ["estimator", id, at, "mean", "censored_fraction"].map(str::to_owned).to_vec();
    header.extend(LEVELS.iter().map(|level| quantile_name(*level)));
    table.write_record(&header)?;
    for replays in judged.replays {
        for (recorded, replay) in judged.recorded.iter().zip(&replays.runs) {
            for prediction in &replay.predictions {
                let told = |fh: f64| if judged.terms.actuators { format!("{fh:.2}") } else { time.of(fh).to_string() };
                let mut row =
                    vec![replays.estimator.to_owned(), recorded.run.id.clone(), time.at(prediction.t_fh).to_string()];
                row.push(told(prediction.mean_fh));
                row.push(prediction.censored_fraction.to_string());
                row.extend(prediction.quantiles_fh.iter().map(|quantile| quantile.map_or_else(String::new, told)));
                table.write_record(&row)?;
            }
        }
    }
    table.flush()
}

/// `q05` for 0.05, `q025` for 0.025.
fn quantile_name(level: f64) -> String {
    let per_mille = (1000.0 * level).round() as u32;
    if per_mille.is_multiple_of(10) { format!("q{:02}", per_mille / 10) } else { format!("q{per_mille:03}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_named_by_their_digits() {
        let names: Vec<_> = LEVELS.iter().map(|level| quantile_name(*level)).collect();
        assert_eq!(names[..4], ["q025", "q05", "q10", "q15"]);
        assert_eq!(names[18..], ["q90", "q95", "q975"]);
        assert!(names.contains(&"q50".to_owned()) && names.len() == 21);
    }
}
