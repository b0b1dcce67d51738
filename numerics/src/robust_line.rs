//! A straight line through points of which some lie far off.
//!
//! - What: y = offset + slope x with the covariance of both, and the spread of the points about it.
//! - Update rule: a resistant line through the medians of the outer thirds of x, then least squares with Tukey's biweights of
//!   the residuals in units of their spread, which is their median size; half of the points may lie anywhere.
//! - Requirements: x that differ; errors in y alone. The same points in any order give the same bits.
//! - Source: Tukey 1977 for the resistant line; Beaton, Tukey 1974 for the weights.

use crate::quantile;

/// Fewest points of a line.
const MIN_POINTS: usize = 6;
/// Tukey's tuning constant, in standard deviations: 95 % efficient where errors are normal.
const BIWEIGHT: f64 = 4.685;
/// Rounds of reweighting; a line is at rest after some ten.
const ROUNDS: usize = 20;
/// Median of the absolute value of a standard normal number.
const MEDIAN: f64 = 0.674_489_75;

/// A line and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustLine {
    /// y at x = 0.
    pub offset: f64,
    /// y per x.
    pub slope: f64,
    /// Standard deviation of one point about the line.
    pub sigma: f64,
    /// Variance of the offset.
    pub offset_variance: f64,
    /// Variance of the slope.
    pub slope_variance: f64,
    /// Their covariance.
    pub covariance: f64,
    /// Correlation of x and y, by the final weights.
    pub correlation: f64,
}

impl RobustLine {
    /// The line through points (x, y); `None` of fewer than six, or where x hardly differs.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < MIN_POINTS {
            return None;
        }
        let mut points = points.to_vec();
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let (mut offset, mut slope) = resistant(&points)?;
        for _ in 0..ROUNDS {
            let sums = Sums::of(&points, offset, slope, spread(&points, offset, slope));
            (offset, slope) = sums.line()?;
        }
        let sigma = spread(&points, offset, slope);
        Sums::of(&points, offset, slope, sigma).described(sigma)
    }

    /// y at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.offset + self.slope * x
    }
}

/// Offset and slope of the line through the medians of the outer thirds.
fn resistant(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let third = points.len() / 3;
    let (low, high) = (&points[..third], &points[points.len() - third..]);
    let centre = |points: &[(f64, f64)]| (median(points.iter().map(|p| p.0)), median(points.iter().map(|p| p.1)));
    let ((left, below), (right, above)) = (centre(low), centre(high));
    let slope = (right > left).then(|| (above - below) / (right - left))?;
    Some((median(points.iter().map(|(x, y)| y - slope * x)), slope))
}

/// Median size of the residuals, as a standard deviation.
fn spread(points: &[(f64, f64)], offset: f64, slope: f64) -> f64 {
    median(points.iter().map(|(x, y)| (y - offset - slope * x).abs())) / MEDIAN
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile::median(&quantile::sorted(values.collect())).unwrap_or(0.0)
}

/// Weighted moments of the points about a first guess of their centre.
struct Sums {
    weight: f64,
    mean_x: f64,
    mean_y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Sums {
    fn of(points: &[(f64, f64)], offset: f64, slope: f64, sigma: f64) -> Self {
        let weight = |&(x, y): &(f64, f64)| {
            let far = (y - offset - slope * x) / (BIWEIGHT * sigma);
            if sigma <= 0.0 || !far.is_finite() {
                return 1.0;
            }
            let near = (1.0 - far * far).max(0.0);
            near * near
        };
        let weighted: Vec<(f64, f64, f64)> = points.iter().map(|point| (weight(point), point.0, point.1)).collect();
        let total: f64 = weighted.iter().map(|(w, ..)| w).sum();
        let mean_x = weighted.iter().map(|(w, x, _)| w * x).sum::<f64>() / total;
        let mean_y = weighted.iter().map(|(w, _, y)| w * y).sum::<f64>() / total;
        let moment =
            |of: fn(f64, f64) -> f64| -> f64 { weighted.iter().map(|(w, x, y)| w * of(x - mean_x, y - mean_y)).sum() };
        let [xx, xy, yy] = [moment(|x, _| x * x), moment(|x, y| x * y), moment(|_, y| y * y)];
        Self { weight: total, mean_x, mean_y, xx, xy, yy }
    }

    fn line(&self) -> Option<(f64, f64)> {
        let slope = self.xy / self.xx;
        (self.xx > 0.0 && slope.is_finite()).then_some((self.mean_y - slope * self.mean_x, slope))
    }

    fn described(&self, sigma: f64) -> Option<RobustLine> {
        let (offset, slope) = self.line()?;
        let slope_variance = sigma * sigma / self.xx;
        Some(RobustLine {
            offset,
            slope,
            sigma,
            offset_variance: sigma * sigma / self.weight + self.mean_x * self.mean_x * slope_variance,
            slope_variance,
            covariance: -self.mean_x * slope_variance,
            correlation: if self.yy > 0.0 { self.xy / (self.xx * self.yy).sqrt() } else { 0.0 },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Stream;

    /// y = 0.1 + 0.4 x with an error of 0.02, and a share of points anywhere.
    fn points(count: usize, astray: f64, stream: &mut Stream) -> Vec<(f64, f64)> {
        let mut point = |_| {
            let x = 0.2 + 1.6 * stream.uniform();
            let y = 0.1 + 0.4 * x + 0.02 * stream.normal();
            if stream.uniform() < astray { (x, 3.0 * stream.uniform()) } else { (x, y) }
        };
        (0..count).map(&mut point).collect()
    }

    #[test]
    fn the_line_is_found_and_its_sigmas_hold() {
        let mut stream = Stream::new(3, &["robust line"]);
        let (mut slopes, mut offsets, mut sigmas) = (0.0, 0.0, 0.0);
        let runs = 200;
        for _ in 0..runs {
            let line = RobustLine::through(&points(60, 0.0, &mut stream)).unwrap();
            slopes += (line.slope - 0.4) * (line.slope - 0.4) / line.slope_variance;
            offsets += (line.offset - 0.1) * (line.offset - 0.1) / line.offset_variance;
            sigmas += line.sigma;
        }
        for (name, value) in [("slope", slopes), ("offset", offsets), ("sigma", 50.0 * sigmas)] {
            let mean = value / f64::from(runs);
            assert!((0.8..1.4).contains(&mean), "{name}: {mean}");
        }
    }

    #[test]
    fn a_third_of_the_points_anywhere_moves_it_little() {
        let mut stream = Stream::new(4, &["robust line"]);
        let line = RobustLine::through(&points(300, 0.33, &mut stream)).unwrap();
        assert!((line.slope - 0.4).abs() < 0.02 && (line.offset - 0.1).abs() < 0.02, "{line:?}");
    }

    #[test]
    fn the_order_of_points_changes_no_bit_and_no_spread_gives_no_line() {
        let mut points = points(50, 0.1, &mut Stream::new(5, &["robust line"]));
        let line = RobustLine::through(&points);
        points.reverse();
        assert_eq!(RobustLine::through(&points), line);
        assert_eq!(RobustLine::through(&[(1.0, 2.0); 40]), None);
        assert_eq!(RobustLine::through(&points[..5]), None);
        let exact: Vec<(f64, f64)> = (0..20).map(f64::from).map(|x| (x, 1.0 + 2.0 * x)).collect();
        let line = RobustLine::through(&exact).unwrap();
        assert!((line.slope - 2.0).abs() < 1e-12 && line.sigma < 1e-12, "{line:?}");
    }
}
