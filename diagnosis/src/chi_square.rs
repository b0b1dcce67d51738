//! Limit of the chi-square test of plausibility.

/// Standard normal quantile of 99.9 %.
const Z_999: f64 = 3.090_232_306_167_813;

/// The 99.9 % quantile of chi-square with `degrees_of_freedom` > 0, within 3 % (Wilson and Hilferty
/// 1931).
pub fn limit_999(degrees_of_freedom: usize) -> f64 {
    let n = degrees_of_freedom as f64;
    let spread = 2.0 / (9.0 * n);
    let root = 1.0 - spread + Z_999 * spread.sqrt();
    n * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_matches_tables() {
        for (degrees_of_freedom, exact) in [(2, 13.816), (5, 20.515), (10, 29.588), (21, 46.797), (50, 86.661)] {
            let found = limit_999(degrees_of_freedom);
            assert!((found / exact - 1.0).abs() < 0.03, "{degrees_of_freedom}: {found}");
        }
        assert!((limit_999(21) / 46.797 - 1.0).abs() < 3e-3);
    }
}
