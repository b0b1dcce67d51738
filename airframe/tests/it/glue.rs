//! How glue settles, is distrusted, and is watched.

use crate::cases::{self, Table};
use airframe::{
    fbg,
    glue::{self, Drift, DriftWatch, Settling, SettlingSample},
};
use numerics::Stream;

#[test]
fn the_fit_inverts_the_model() {
    let truth = Settling { pretension: 2000e-6, loss: 0.023, time_constant_days: 2.4 };
    let sample = |i: usize| SettlingSample { age_days: 0.25 * i as f64, strain: truth.strain(0.25 * i as f64) };
    let samples: Vec<_> = (0..60).map(sample).collect();
    let found = Settling::fit(2000e-6, &samples).expect("enough samples");
    assert!((found.loss - truth.loss).abs() < 1e-9, "{found:?}");
    assert!((found.time_constant_days - truth.time_constant_days).abs() < 1e-6, "{found:?}");
}

#[test]
fn what_tells_nothing_is_not_fitted() {
    let sample = |age_days, strain| SettlingSample { age_days, strain };
    assert_eq!(Settling::fit(2000e-6, &[sample(1.0, -1e-6)]), None);
    assert_eq!(Settling::fit(2000e-6, &[sample(0.0, 0.0), sample(0.0, 0.0)]), None);
    assert_eq!(Settling::fit(2000e-6, &[sample(1.0, f64::NAN), sample(2.0, 0.0)]), None);
    assert_eq!(Settling::fit(0.0, &[sample(1.0, -1e-6), sample(2.0, -2e-6)]), None);
}

/// Two joints over a month of weather: 1.8 % and 2.8 % of 2000 microstrain lost at 1.9 days. Humidity
/// stays in the readings as noise.
#[test]
fn losses_of_epoxy_and_cyanoacrylate_are_found() {
    let table = Table::open(&cases::folder().join("glue_settling.csv"));
    let (ages, rises_k) = (table.numbers("t_day"), table.numbers("T_meas_K_rel"));
    for (column, reference_nm, loss) in
        [("lambda_epoxy_nm", 1540.0, glue::EPOXY_LOSS), ("lambda_cyano_nm", 1550.0, glue::CYANOACRYLATE_LOSS)]
    {
        let peaks = table.numbers(column).into_iter().zip(ages.iter().zip(&rises_k));
        let samples: Vec<_> = peaks
            .map(|(peak_nm, (age_days, rise_k))| SettlingSample {
                age_days: *age_days,
                strain: fbg::strain(reference_nm, peak_nm, *rise_k),
            })
            .collect();
        let found = Settling::fit(glue::PRETENSION, &samples).expect("a month of samples");
        assert!((found.loss - loss).abs() < 0.0015, "{column}: {found:?}");
        assert!((found.time_constant_days - glue::SETTLING_DAYS).abs() < 0.3, "{column}: {found:?}");
    }
}

#[test]
fn after_quarantine_the_joint_is_still() {
    let joint = Settling {
        pretension: glue::PRETENSION,
        loss: glue::CYANOACRYLATE_LOSS,
        time_constant_days: glue::SETTLING_DAYS,
    };
    let left = joint.strain(f64::INFINITY) - joint.strain(glue::QUARANTINE_DAYS as f64);
    assert!(left.abs() < 0.3e-6, "{left}");
    let sigma =
        glue::quarantine_sigma(Some(domain::Timestamp::from_micros(0)), Some(domain::Timestamp::from_micros(1)));
    assert!((sigma - joint.strain(f64::INFINITY).abs()).abs() < 1e-12);
}

#[test]
fn a_drift_is_seen_and_noise_is_not() {
    let sigma = 1e-6;
    let mut stream = Stream::new(1, &["glue", "watch"]);
    let mut watch = DriftWatch::new(sigma);
    assert!((0..2000).all(|_| watch.update(sigma * stream.normal()).is_none()));
    assert_eq!(watch.update(f64::NAN), None);
    for (shift, expected) in [(6e-6, Drift::Up), (-6e-6, Drift::Down)] {
        let mut watch = DriftWatch::new(sigma);
        let seen = (1..10).find_map(|n| watch.update(shift + sigma * stream.normal()).map(|drift| (n, drift)));
        let (readings, drift) = seen.expect("seen within ten readings");
        assert!(readings <= 4 && drift == expected, "{drift:?} after {readings}");
    }
}
