//! When a Brownian motion whose ends are known first reached zero in between.
//!
//! **What**: probability and time of the first passage of a Brownian bridge from a > 0 to b within
//! time T, v the variance that the free motion gathers in T.
//! **Update rule**: P(passage) = exp(-2 a b / v) for b > 0, else one. Given a passage at share s of T,
//! s / (1 - s) is inverse Gaussian with mean a / |b| and shape a^2 / v; drawn by the transformation
//! with two roots.
//! **Requirements**: a > 0; v = 0 stands for a straight line.
//! **Source**: reflection principle; Beskos, Roberts 2005, section 2; Michael, Schucany, Haas 1976.

use numerics::Stream;

/// A Brownian bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BrownianBridge {
    /// Value at its beginning, above zero.
    pub from: f64,
    /// Value at its end.
    pub to: f64,
    /// Variance of the free motion over the same time.
    pub variance: f64,
}

impl BrownianBridge {
    /// Probability that it reaches zero.
    pub fn passage_probability(&self) -> f64 {
        if self.to <= 0.0 { 1.0 } else { libm::exp(-2.0 * self.from * self.to / self.variance) }
    }

    /// Draws when it first reaches zero, given that it does, as a share of its time.
    pub fn passage_share(&self, stream: &mut Stream) -> f64 {
        let z = stream.normal();
        // An end at zero is a limit with infinite mean; so close to it nothing changes any more.
        let mean = self.from / self.to.abs().max(1e-9 * self.from);
        // Roots mean r and mean / r of (u - mean)^2 shape / (mean^2 u) = z^2.
        let spread = mean * z * z * self.variance / (self.from * self.from);
        let root = 1.0 / (1.0 + 0.5 * spread + (spread + 0.25 * spread * spread).sqrt());
        let smaller = stream.uniform() * (1.0 + root) < 1.0;
        let odds = if smaller { mean * root } else { mean / root };
        odds / (1.0 + odds)
    }
}

#[cfg(test)]
mod tests {
    use numerics::normal;

    use super::*;

    /// P(zero is reached before the share s), by the reflection principle.
    fn reached_by(bridge: &BrownianBridge, share: f64) -> f64 {
        let BrownianBridge { from, to, variance } = *bridge;
        let sd = (variance * share * (1.0 - share)).sqrt();
        let (here, mirrored) = (from * (1.0 - share) + to * share, to * share - from * (1.0 - share));
        normal::cumulative(-here / sd) + (-2.0 * from * to / variance).exp() * normal::cumulative(mirrored / sd)
    }

    #[test]
    fn passage_times_have_their_distribution() {
        let mut stream = Stream::new(1, &["passage"]);
        for (from, to, variance) in
            [(1.0, -0.5, 0.3), (0.2, -1.0, 2.0), (0.3, 0.4, 0.5), (1.0, -1.0, 0.05), (0.5, 0.0, 0.7)]
        {
            let bridge = BrownianBridge { from, to, variance };
            let n = 20_000;
            let shares: Vec<f64> = (0..n).map(|_| bridge.passage_share(&mut stream)).collect();
            for at in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let drawn = shares.iter().filter(|share| **share <= at).count() as f64 / f64::from(n);
                let expected = reached_by(&bridge, at) / bridge.passage_probability();
                assert!((drawn - expected).abs() < 0.015, "{bridge:?} by {at}: {drawn}, expected {expected}");
            }
        }
    }

    #[test]
    fn a_straight_line_passes_where_it_passes() {
        let mut stream = Stream::new(2, &["line"]);
        let line = BrownianBridge { from: 3.0, to: -1.0, variance: 0.0 };
        assert_eq!((line.passage_probability(), line.passage_share(&mut stream)), (1.0, 0.75));
        assert_eq!(BrownianBridge { to: 1.0, ..line }.passage_probability(), 0.0);
    }
}
