//! What a fibre Bragg grating shows, and what can be read from it.

use airframe::fbg::{self, Sensitivity};

const MICROSTRAIN: f64 = 1e-6;
const PICOMETRE_NM: f64 = 1e-3;

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

#[test]
fn sensitivities_of_free_and_bonded_gratings() {
    close(Sensitivity::FREE.strain, 0.78, 1e-12);
    close(Sensitivity::FREE.temperature_per_k, 6.65e-6, 1e-18);
    close(Sensitivity::BONDED_ON_ALUMINIUM.temperature_per_k, 24.161e-6, 1e-18);
}

#[test]
fn a_picometre_at_1550_nm() {
    let shifted = 1550.0 + PICOMETRE_NM;
    close(fbg::strain(1550.0, shifted, 0.0) / MICROSTRAIN, 0.827, 5e-4);
    close(fbg::temperature_rise_k(1550.0, shifted), 0.097, 5e-4);
    let per_k_nm = fbg::wavelength_nm(1550.0, 0.0, 1.0) - 1550.0;
    close(PICOMETRE_NM / per_k_nm, 0.027, 5e-4);
}

/// Ten kelvin look like 310 microstrain to a bonded grating without compensation; with the
/// coefficient as printed, alpha_m + zeta_f, 63 microstrain too much would be taken away.
#[test]
fn ten_kelvin_on_aluminium() {
    let warm = fbg::wavelength_nm(1550.0, 0.0, 10.0);
    close(fbg::strain(1550.0, warm, 0.0) / MICROSTRAIN, 310.0, 0.5);
    close(fbg::strain(1550.0, warm, 10.0) / MICROSTRAIN, 0.0, 1e-6);
    let printed_per_k = fbg::ALUMINIUM_EXPANSION_PER_K + fbg::THERMO_OPTIC_PER_K;
    let as_printed = (warm / 1550.0 - 1.0 - 10.0 * printed_per_k) / Sensitivity::FREE.strain;
    close(as_printed / MICROSTRAIN, -63.0, 0.5);
}

#[test]
fn reading_inverts_writing() {
    for (strain, rise_k) in [(0.0, 0.0), (-1.2e-3, -60.0), (8e-4, 25.0), (2e-6, 3.0)] {
        let seen_k = fbg::temperature_rise_k(1562.0, fbg::free_wavelength_nm(1562.0, rise_k));
        close(seen_k, rise_k, 1e-8);
        close(fbg::strain(1542.0, fbg::wavelength_nm(1542.0, strain, rise_k), seen_k), strain, 1e-12);
    }
}

#[test]
fn unlike_gratings_separate_strain_from_temperature() {
    let unstrained = Sensitivity { strain: 0.0, ..Sensitivity::FREE };
    for partner in [unstrained, Sensitivity::FREE] {
        let gratings = [Sensitivity::BONDED_ON_ALUMINIUM, partner];
        let shifts = gratings.map(|g| g.strain * 4e-4 + g.temperature_per_k * -30.0);
        let found = fbg::separate(shifts, gratings).expect("unlike enough");
        close(found.strain, 4e-4, 1e-15);
        close(found.temperature_rise_k, -30.0, 1e-9);
    }
}

/// Gratings are told apart up to a condition number of 9: by the geometry of two unit columns, where
/// one responds 1.58 times as strongly to temperature as the other at equal strain sensitivity.
#[test]
fn gratings_that_respond_alike_are_refused() {
    let like = Sensitivity::BONDED_ON_ALUMINIUM;
    let partner = |factor: f64| Sensitivity { temperature_per_k: factor * like.temperature_per_k, ..like };
    let condition = |factor: f64| fbg::separate([1e-3, 1e-3], [like, partner(factor)]).map_err(|e| e.condition_number);
    assert!(condition(1.6).is_ok());
    let refused = condition(1.56).unwrap_err();
    assert!(refused > 9.0 && refused < 9.3, "{refused}");
    assert_eq!(condition(1.0), Err(f64::INFINITY));
    let dead = Sensitivity { strain: 0.0, temperature_per_k: 0.0 };
    assert!(fbg::separate([0.0, 0.0], [dead, dead]).unwrap_err().condition_number.is_infinite());
}
