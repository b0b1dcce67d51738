//! What is told of changes of growth, on lives whose truth is known.

mod simulated;

use domain::{FaultModel, Stream};
use prognosis::{Filter, FleetPrior, GrowthChanges, Posterior, blocks};
use simulated::{Growth, observe};

fn sharp() -> FleetPrior {
    let growth_changes = Some(GrowthChanges { particles: 100, ..GrowthChanges::default() });
    FleetPrior { process_noise: 2.5e-5, growth_changes, ..FleetPrior::vague() }
}

/// After 2,400 h with a tenth of the usual noise, the first winding dominant.
fn known(changes: &[(f64, f64)], prior: &FleetPrior) -> Posterior {
    let rates = FleetPrior::vague().rates_per_h;
    let growth = Growth {
        rate_per_h: [rates[8], rates[5], rates[5], rates[6], rates[6]],
        bias_per_h: [2.5e-5, 4e-6, 4e-6, 3e-6, -3e-6],
        process_noise: 2.5e-5,
        changes: changes.to_vec(),
    };
    let mut random = Stream::new(2, &["changing"]);
    let mut filter = Filter::new(&FaultModel::electrical(), prior);
    let observations = observe(&growth.path(2400.0, &mut random), 0.1, &mut random);
    blocks(&observations).iter().for_each(|block| filter.update(block));
    filter.posterior()
}

#[test]
fn a_change_is_dated_and_measured() {
    let posterior = known(&[(0.0, 0.75), (1400.0, 1.5)], &sharp());
    let growth = posterior.growth_summary().expect("a filter that follows changes");
    assert_eq!((growth.multiplier, growth.sigma), (posterior.growth().mean, posterior.growth().sigma));
    assert!(growth.changed_probability > 0.95, "{growth:?}");
    let change = growth.latest_change.expect("a change");
    assert!(change.from_fh < 1400.0 && 1400.0 < change.to_fh, "{change:?}");
    assert!(change.to_fh - change.from_fh < 500.0, "{change:?}");
    assert!((1.2..=3.0).contains(&change.factor), "{change:?}");
    assert!((1.0..=change.factor).contains(&change.factor_p10) && change.factor < change.factor_p90, "{change:?}");
}

#[test]
fn growth_that_stays_shows_no_change() {
    let growth = known(&[], &sharp()).growth_summary().expect("a filter that follows changes");
    assert!(growth.changed_probability < 0.5, "{growth:?}");
    assert_eq!(growth.latest_change, None);
    assert_eq!(known(&[], &FleetPrior::vague()).growth_summary(), None);
}
