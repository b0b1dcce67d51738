//! The noise of fault estimates is learned without knowing the truth.

use crate::simulated::{Growth, SIGMA, observe};
use domain::FaultModel;
use numerics::Stream;
#[allow(dead_code)] // Lives without their truth.
use prognosis::{FleetPrior, NoNoise, Observation, fit_noise};

use crate::histories;

fn fleet(scale: f64) -> Vec<Vec<Observation>> {
    let prior = FleetPrior::vague();
    let life = |index| {
        let mut random = Stream::new(5, &["noise"]).substream(index);
        let path = Growth::draw(&prior, &mut random).path(2500.0, &mut random);
        observe(&path, scale, &mut random)
    };
    (0..20).map(life).collect()
}

fn assert_near(sigma: &[f64], scale: f64, tolerance: f64) {
    for (entry, sigma) in sigma.iter().enumerate() {
        let expected = scale * SIGMA[usize::from(entry >= 3)];
        assert!((sigma / expected - 1.0).abs() < tolerance, "{entry}: {sigma}, expected {expected}");
    }
}

#[test]
fn heavy_tailed_clipped_noise_is_learned() {
    for scale in [0.5, 1.0, 2.0] {
        assert_near(&fit_noise(&fleet(scale), &FaultModel::electrical()).unwrap(), scale, 0.03);
    }
}

#[test]
fn gross_errors_hardly_matter() {
    let mut fleet = fleet(1.0);
    let mut random = Stream::new(6, &["gross"]);
    for observation in fleet.iter_mut().flatten() {
        if random.uniform() < 0.01 {
            observation.fault_vector.0.fill(random.uniform());
        }
    }
    assert_near(&fit_noise(&fleet, &FaultModel::electrical()).unwrap(), 1.0, 0.12);
}

#[test]
fn a_few_observations_say_nothing() {
    let few: Vec<_> = fleet(1.0).into_iter().take(2).map(|life| life[..12].to_vec()).collect();
    let refused = fit_noise(&few, &FaultModel::electrical());
    assert!(matches!(refused, Err(NoNoise { fault, found }) if fault == "k1" && found < 50));
}

/// The generator's own: 0.0075 for shorts, 0.02 for the eccentricity.
#[test]
fn the_noise_of_the_prior_fleet_is_learned() {
    let Some(folder) = histories::folder() else { return };
    let lives = histories::read(&folder, "prior");
    let observations: Vec<_> = lives.into_iter().map(|life| life.observations).collect();
    let sigma = fit_noise(&observations, &FaultModel::electrical()).unwrap();
    assert_near(&sigma, 1.0, 0.02);
}
