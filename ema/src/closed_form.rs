//! The back-EMF map in closed form.
//!
//! What: the map value that a perfect estimator would find, from the faults and the load ratio
//! r = R i/(k_nom w) of the bin. Requirements: no voltage saturation, no commutation transient.
//! Source: Berri 2021, eq. 6.2 with the phase coefficients 3.33-3.35 and the voltage balance of the
//! active pair, whose resistance is R/2 sum N_j: y = 1/2 sum N_j (1 + r + zeta cos(...)) - r.

use crate::{
    commutation::{ACTIVE_PAIRS, BINS, bin_centre_rad, sector},
    faults::ElectricalFaults,
};

/// Map value in units of k_nom at the centre of a bin, under a load ratio.
pub fn back_emf(faults: &ElectricalFaults, bin: usize, load_ratio: f64) -> f64 {
    let flux = faults.flux_factors(bin_centre_rad(bin));
    let healthy = faults.healthy();
    let (positive, negative) = ACTIVE_PAIRS[sector(bin)];
    let of_phase = |phase: usize| 0.5 * healthy[phase] * (flux[phase] + load_ratio);
    of_phase(positive) + of_phase(negative) - load_ratio
}

/// The whole map in units of k_nom, under one load ratio per bin.
pub fn map(faults: &ElectricalFaults, load_ratios: &[f64; BINS]) -> Vec<f64> {
    load_ratios.iter().enumerate().map(|(bin, &load_ratio)| back_emf(faults, bin, load_ratio)).collect()
}

#[cfg(test)]
mod tests {
    use domain::FaultVector;

    use super::*;

    #[test]
    fn golden_values_are_met() {
        let faults = ElectricalFaults::try_from(&FaultVector(vec![0.2, 0.05, 0.0, 0.6, 0.55])).unwrap();
        // Computed by an independent prototype at r = 0.2.
        let golden = [
            (0, 0.9539233212118471),
            (45, 0.9410382842397507),
            (100, 0.7547011772217509),
            (170, 0.8195218405009848),
            (250, 0.9517879256446786),
            (330, 0.9085394001832133),
        ];
        let map = map(&faults, &[0.2; BINS]);
        for (bin, y) in golden {
            assert!((map[bin] - y).abs() < 1e-14, "bin {bin}: {}", map[bin]);
        }
    }

    #[test]
    fn the_healthy_map_is_flat_under_any_load() {
        for load_ratio in [-0.3, 0.0, 0.4] {
            let map = map(&ElectricalFaults::default(), &[load_ratio; BINS]);
            assert!(map.iter().all(|y| (y - 1.0).abs() < 1e-15));
        }
    }

    #[test]
    fn shorts_act_on_the_load_invariant_map_alike_under_any_load() {
        let faults = ElectricalFaults::new([0.3, 0.1, 0.0], 0.0, 0.0).unwrap();
        for bin in 0..BINS {
            let of = |r| (back_emf(&faults, bin, r) + r) / (1.0 + r);
            assert!((of(0.3) - of(-0.2)).abs() < 1e-14);
        }
    }
}
