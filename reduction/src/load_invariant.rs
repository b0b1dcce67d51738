//! The load-invariant back-EMF map.
//!
//! A raw map y (in units of k_nom) holds a part that grows with the load ratio r = R i/(k w), since
//! the nominal resistance is subtracted where the damaged one acts: y = y'(1 + r) - r. The map
//! y' = (y + r)/(1 + r) keeps shorts independent of load, and shows eccentricity as zeta/(1 + r).
//! Source: Berri 2021, eq. 6.2, with the closed form of the active pair at load ratio r.

/// y' from a raw value `y` (units of k_nom) and the load ratio `r` at the same angle.
pub fn from_raw(y: f64, r: f64) -> f64 {
    (y + r) / (1.0 + r)
}

/// The raw value, in units of k_nom, of a load-invariant one at load ratio `r`.
pub fn to_raw(y_invariant: f64, r: f64) -> f64 {
    y_invariant * (1.0 + r) - r
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_identity() {
        for (y, r) in [(0.9, 0.11), (0.5, -0.2), (1.0, 1.1)] {
            assert!((to_raw(from_raw(y, r), r) - y).abs() < 1e-15);
        }
    }

    #[test]
    fn a_healthy_map_is_one_at_any_load() {
        assert_eq!(from_raw(1.0, 0.7), 1.0);
        assert_eq!(to_raw(1.0, 0.7), 1.0);
    }
}
