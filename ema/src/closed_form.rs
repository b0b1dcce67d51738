//! The back-EMF map in closed form, and the load ratio of steady motion.
//!
//! What: the map value that a perfect estimator would find, from the faults and the load ratio
//! r = R i/(k_nom w) of the bin; and that ratio from the torque at the output. Requirements: no voltage saturation, no commutation transient.
//! Source: Berri 2021, eq. 6.2 with the phase coefficients 3.33-3.35 and the voltage balance of the
//! active pair, whose resistance is R/2 sum N_j: y = 1/2 sum N_j (1 + r + zeta cos(...)) - r.

use crate::{
    commutation::{ACTIVE_PAIRS, BINS, bin_centre_rad, sector},
    faults::ElectricalFaults,
    motor::Motor,
    shaft::damping_nm_s_rad,
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

/// Mean load ratio of a motor that turns steadily in positive direction at `speed_rad_s` under a torque at the output, which
/// opposes where it is positive.
///
/// The torque balance T_m = T_u/(i eta_D) + T_f + C w of opposing loads (C with the braking of shorted windings), with
/// T_m = k_nom y_0 I and y_0 the mean of the map without load, makes the ratio r = R I/(k_nom w) a straight line over the load:
/// **r = R/(k_nom^2 y_0 w) (T_u/(i eta_D) + T_f + C w)**. At a speed that is always the same, intercept and slope tell friction
/// and efficiency; T_u is the hinge moment times what the linkage makes of it. Windings that are shorted raise both:
/// [`healthy_load_ratio`] takes that away.
pub fn steady_load_ratio(motor: &Motor, faults: &ElectricalFaults, output_nm: f64, speed_rad_s: f64) -> f64 {
    let unloaded = map(faults, &[0.0; BINS]).iter().sum::<f64>() / BINS as f64;
    let torque_nm = motor.transmission().steady_torque_nm(output_nm) + damping_nm_s_rad(motor, faults) * speed_rad_s;
    let k_nom = motor.back_emf_v_s_rad;
    motor.resistance_ohm * torque_nm / (k_nom * k_nom * unloaded * speed_rad_s)
}

/// The load ratio that a motor without shorted windings would have under the same load and friction, at any speed.
///
/// With N the mean healthy share of the windings, y_0 = N (eccentricity averages out over a turn), and the braking of the shorted
/// ones, sum (1 - N_j) k_phase^2/R_phase w, is R/(k_nom^2 w) times itself = sum (1 - N_j)/2 in ratio, because a phase has half of
/// the resistance and of the back-EMF of a pair. So **r_healthy = N r - 3/2 (1 - N)**.
pub fn healthy_load_ratio(faults: &ElectricalFaults, load_ratio: f64) -> f64 {
    let healthy = faults.healthy().iter().sum::<f64>() / 3.0;
    healthy * load_ratio - 1.5 * (1.0 - healthy)
}

/// Torque at the shaft of a healthy motor that a load ratio at a speed stands for, N m.
pub fn torque_nm(motor: &Motor, load_ratio: f64, speed_rad_s: f64) -> f64 {
    motor.back_emf_v_s_rad * motor.back_emf_v_s_rad * speed_rad_s * load_ratio / motor.resistance_ohm
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
    fn the_load_ratio_is_a_straight_line_over_an_opposing_load_and_gives_the_torque_back() {
        let motor = Motor { opposing_efficiency: 0.8, ..Motor::default() };
        let ratio = |output_nm| steady_load_ratio(&motor, &ElectricalFaults::default(), output_nm, 280.0);
        for output_nm in [0.0, 50.0, 200.0] {
            let expected_nm = output_nm / 500.0 / 0.8 + 0.06 + 5e-5 * 280.0;
            assert!((torque_nm(&motor, ratio(output_nm), 280.0) - expected_nm).abs() < 1e-12, "{output_nm}");
        }
        let shorted = ElectricalFaults::new([0.2, 0.0, 0.0], 0.0, 0.0).unwrap();
        let raised = steady_load_ratio(&motor, &shorted, 50.0, 280.0);
        assert!(raised > 1.1 * ratio(50.0));
        assert!((healthy_load_ratio(&shorted, raised) - ratio(50.0)).abs() < 1e-12);
        let eccentric = ElectricalFaults::new([0.2, 0.1, 0.0], 0.3, 1.0).unwrap();
        let raised = steady_load_ratio(&motor, &eccentric, 50.0, 280.0);
        assert!((healthy_load_ratio(&eccentric, raised) - ratio(50.0)).abs() < 0.01 * ratio(50.0));
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
