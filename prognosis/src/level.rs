//! How far a life has come on its way from nominal to the boundary.
//!
//! - What: the level of an observation is 1 - margin / margin of nominal, zero where nominal and one where life ends. With
//!   [`Limits`](crate::Limits) that is the worst of the shares of the way; it works as well with the surrogate of an assessment.
//! - Update rule: observations within 20 h are averaged; where three such means lie within 45 h, their median counts, so that
//!   a single gross error does no harm; the level of a life is the greatest so far.
//! - Requirements: observations in the order of the life. Earlier lives and the present one go through the same steps, so
//!   the lag of the average and the excess of the greatest value are the same for both.

use crate::{block::Observation, boundary::Boundary};

/// Observations are averaged over such a time, reference hours.
const MEAN_FH: f64 = 20.0;
/// Three means within this time are dense enough for their median, reference hours.
const MEDIAN_FH: f64 = 45.0;
/// Levels beyond count as this one: lives that end at limits of their own may end beyond one.
const GREATEST: f64 = 1.5;

/// What levels are measured by.
#[derive(Clone, Copy)]
pub(crate) struct Gauge<'a> {
    boundary: &'a dyn Boundary,
    nominal_margin: f64,
}

impl<'a> Gauge<'a> {
    /// The gauge between a nominal fault vector and a boundary.
    pub fn new(boundary: &'a dyn Boundary, nominal: &[f64]) -> Self {
        Self { boundary, nominal_margin: boundary.margin(nominal) }
    }

    /// The level of a fault vector; zero of one that is no number, and where nominal itself is not healthy.
    fn level(&self, k: &[f64]) -> f64 {
        let level = 1.0 - self.boundary.margin(k) / self.nominal_margin;
        if self.nominal_margin > 0.0 && level.is_finite() { level.clamp(0.0, GREATEST) } else { 0.0 }
    }
}

/// The level of one life as it goes on.
#[derive(Clone)]
pub(crate) struct Ascent<'a> {
    gauge: Gauge<'a>,
    open: Option<Mean>,
    /// Time and level of the last means, at most two.
    recent: Vec<(f64, f64)>,
    greatest: f64,
}

/// Observations of a stretch of [`MEAN_FH`].
#[derive(Debug, Clone)]
struct Mean {
    stretch: f64,
    count: f64,
    time_sum_fh: f64,
    sums: Vec<f64>,
}

impl<'a> Ascent<'a> {
    /// A life that has not been seen.
    pub fn new(gauge: Gauge<'a>) -> Self {
        Self { gauge, open: None, recent: Vec::new(), greatest: 0.0 }
    }

    /// Takes the next observation; time and level of the stretch that it ends, if it does.
    pub fn observe(&mut self, observation: &Observation) -> Option<(f64, f64)> {
        let stretch = libm::floor(observation.t_fh / MEAN_FH);
        let closed = match &self.open {
            Some(open) if open.stretch != stretch => self.close(),
            _ => None,
        };
        let open = self.open.get_or_insert_with(|| Mean {
            stretch,
            count: 0.0,
            time_sum_fh: 0.0,
            sums: vec![0.0; observation.fault_vector.0.len()],
        });
        open.count += 1.0;
        open.time_sum_fh += observation.t_fh;
        open.sums.iter_mut().zip(&observation.fault_vector.0).for_each(|(sum, k)| *sum += k);
        closed
    }

    /// Ends the open stretch; its time and the level that was reached.
    pub fn close(&mut self) -> Option<(f64, f64)> {
        let (t_fh, level) = self.last()?;
        self.greatest = self.level();
        self.open = None;
        if self.recent.len() == 2 {
            self.recent.remove(0);
        }
        self.recent.push((t_fh, level));
        Some((t_fh, self.greatest))
    }

    /// The level that was reached, the open stretch included.
    pub fn level(&self) -> f64 {
        let Some((t_fh, level)) = self.last() else { return self.greatest };
        let robust = match self.recent[..] {
            [first, second] if t_fh - first.0 <= MEDIAN_FH => {
                let (low, high) = (first.1.min(second.1), first.1.max(second.1));
                level.clamp(low, high)
            }
            _ => level,
        };
        self.greatest.max(robust)
    }

    /// Mean time and level of the open stretch.
    fn last(&self) -> Option<(f64, f64)> {
        let Mean { count, time_sum_fh, sums, .. } = self.open.as_ref()?;
        let mean: Vec<f64> = sums.iter().map(|sum| sum / count).collect();
        Some((time_sum_fh / count, self.gauge.level(&mean)))
    }
}

#[cfg(test)]
mod tests {
    use domain::FaultVector;

    use super::*;
    use crate::boundary::Limits;

    fn seen(t_fh: f64, k: [f64; 2]) -> Observation {
        Observation { t_fh, fault_vector: FaultVector(k.to_vec()), sigma: vec![0.01; 2], load: None, temperature: None }
    }

    fn limits() -> Limits {
        Limits { faults: vec![(0.0, 0.25), (1.0, 0.5)] }
    }

    fn close(level: f64, expected: f64) {
        assert!((level - expected).abs() < 1e-12, "{level} instead of {expected}");
    }

    #[test]
    fn the_level_is_the_worst_share_of_the_way_and_never_falls() {
        let limits = limits();
        let mut ascent = Ascent::new(Gauge::new(&limits, &[0.0, 1.0]));
        let mut level_after = |t_fh, k| {
            ascent.observe(&seen(t_fh, k));
            ascent.level()
        };
        close(level_after(0.0, [-0.1, 1.0]), 0.0);
        close(level_after(100.0, [0.05, 0.8]), 0.4);
        close(level_after(200.0, [0.125, 0.9]), 0.5);
        close(level_after(300.0, [0.0, 1.0]), 0.5);
        close(level_after(400.0, [f64::NAN, 1.0]), 0.5);
    }

    #[test]
    fn a_gross_error_in_dense_data_does_no_harm() {
        let limits = limits();
        let mut ascent = Ascent::new(Gauge::new(&limits, &[0.0, 1.0]));
        for i in 0..10 {
            let gross = if i == 6 { 0.2 } else { 0.025 };
            ascent.observe(&seen(20.0 * f64::from(i), [gross, 1.0]));
        }
        close(ascent.level(), 0.1);
    }
}
