//! Truths about Gappy POD.

use domain::{Coordinate, Mask};
use numerics::Stream;
use proptest::prelude::*;
use reduction::{GappyPod, ModeCount, PodBasis, Prior, Sample};

const BINS: usize = 36;

fn basis() -> PodBasis {
    let map = |i: usize| {
        let mut stream = Stream::new(4, &["maps"]).substream(i as u64);
        let [a, b, c] = [0.2, 0.1, 0.05].map(|sd| sd * stream.normal());
        let at = |x: f64| 1.0 + a * x.cos() + b * x.sin() + c * (2.0 * x).cos();
        (0..BINS).map(|bin| at((bin as f64 + 0.5) * std::f64::consts::TAU / BINS as f64)).collect()
    };
    PodBasis::train(&(0..200).map(map).collect::<Vec<_>>(), ModeCount::Fixed(3)).unwrap()
}

fn mask(bins: impl IntoIterator<Item = usize>) -> Mask {
    Mask::new(Coordinate::ElectricalAngleRad, BINS, bins.into_iter().collect()).unwrap()
}

fn samples(map: &[f64], mask: &Mask, sd: f64) -> Vec<Option<Sample>> {
    mask.bins().iter().map(|bin| Some(Sample { value: map[*bin], sd })).collect()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < tolerance)
}

proptest! {
    #[test]
    fn a_full_mask_gives_the_projection(values in prop::collection::vec(0.5..1.5f64, BINS)) {
        let basis = basis();
        let mask = mask(0..BINS);
        let gappy = GappyPod::new(&basis, &mask).unwrap();
        let projection = basis.project(&values);
        for prior in [Prior::Flat, Prior::Pod] {
            let fit = gappy.fit(&samples(&values, &mask, 1e-6), prior);
            prop_assert!(close(&fit.coefficients, &projection, 1e-8));
        }
    }

    #[test]
    fn without_noise_any_mask_gives_the_projection_of_a_map_in_the_subspace(a in -1.0..1.0f64, b in -1.0..1.0f64) {
        let basis = basis();
        let mask = mask([1, 5, 12, 20, 29, 33]);
        let truth = [a, b, 0.1];
        let map = basis.reconstruct(&truth);
        let fit = GappyPod::new(&basis, &mask).unwrap().fit(&samples(&map, &mask, 1e-7), Prior::Pod);
        prop_assert!(close(&fit.coefficients, &truth, 1e-9));
        prop_assert!(fit.chi_square < 1e-6);
    }
}

#[test]
fn a_missing_point_counts_as_little_as_one_of_endless_noise() {
    let (basis, mask) = (basis(), mask([1, 5, 12, 20, 29, 33]));
    let gappy = GappyPod::new(&basis, &mask).unwrap();
    let map: Vec<f64> = (0..BINS).map(|bin| 1.0 + 0.01 * (bin as f64).sin()).collect();
    let mut missing = samples(&map, &mask, 0.01);
    let mut endless = missing.clone();
    missing[2] = None;
    endless[2].as_mut().unwrap().sd = 1e9;
    let (missing, endless) = (gappy.fit(&missing, Prior::Pod), gappy.fit(&endless, Prior::Pod));
    assert!(close(&missing.coefficients, &endless.coefficients, 1e-12));
    assert_eq!((missing.degrees_of_freedom, endless.degrees_of_freedom), (2, 3));
    assert_eq!(missing.studentised[2], None);
    let whole = gappy.fit(&samples(&map, &mask, 0.01), Prior::Pod);
    for j in 0..3 {
        assert!(missing.posterior_covariance.get(j, j) > whole.posterior_covariance.get(j, j));
    }
}

#[test]
fn nothing_measured_leaves_the_prior() {
    let (basis, mask) = (basis(), mask([1, 5, 12]));
    let fit = GappyPod::new(&basis, &mask).unwrap().fit(&[None; 3], Prior::Pod);
    assert_eq!(fit.coefficients, [0.0; 3]);
    for j in 0..3 {
        assert!((fit.posterior_covariance.get(j, j) / basis.prior_variance()[j] - 1.0).abs() < 1e-12);
        assert!(fit.sampling_covariance.get(j, j).abs() < 1e-12);
    }
}

#[test]
fn covariance_and_chi_square_are_those_of_repeated_noise() {
    let (basis, mask) = (basis(), mask((0..BINS).step_by(3)));
    let gappy = GappyPod::new(&basis, &mask).unwrap();
    let (truth, sd, repeats) = ([0.3, -0.2, 0.1], 0.05, 20_000);
    let map = basis.reconstruct(&truth);
    let mut stream = Stream::new(9, &["noise"]);
    let (mut mean, mut square, mut chi_square, mut studentised) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
    let expected = gappy.fit(&samples(&map, &mask, sd), Prior::Pod);
    for _ in 0..repeats {
        let mut noisy = samples(&map, &mask, sd);
        noisy.iter_mut().flatten().for_each(|sample| sample.value += sd * stream.normal());
        let fit = gappy.fit(&noisy, Prior::Pod);
        for (j, alpha) in fit.coefficients.iter().enumerate() {
            mean[j] += alpha / f64::from(repeats);
            square[j] += (alpha - expected.coefficients[j]).powi(2) / f64::from(repeats);
        }
        let flat = gappy.fit(&noisy, Prior::Flat);
        chi_square += flat.chi_square / f64::from(repeats);
        studentised += flat.studentised[4].unwrap().powi(2) / f64::from(repeats);
    }
    assert!(close(&mean, &expected.coefficients, 0.01));
    for (j, square) in square.iter().enumerate() {
        assert!((square / expected.sampling_covariance.get(j, j) - 1.0).abs() < 0.05);
    }
    assert!((chi_square / expected.degrees_of_freedom as f64 - 1.0).abs() < 0.02);
    assert!((studentised - 1.0).abs() < 0.05);
}

#[test]
fn a_repeat_gives_the_same_bits() {
    let (basis, mask) = (basis(), mask((0..BINS).step_by(2)));
    let gappy = GappyPod::new(&basis, &mask).unwrap();
    let map: Vec<f64> = (0..BINS).map(|bin| 1.0 + 0.1 * (bin as f64 * 0.4).sin()).collect();
    let fit = || gappy.fit(&samples(&map, &mask, 0.01), Prior::Pod);
    assert_eq!(fit(), fit());
    let restored: GappyPod = serde_json::from_str(&serde_json::to_string(&gappy).unwrap()).unwrap();
    assert_eq!(restored.fit(&samples(&map, &mask, 0.01), Prior::Pod), fit());
}

#[test]
fn a_mask_of_other_maps_is_refused() {
    let other = Mask::new(Coordinate::ElectricalAngleRad, 360, vec![1]).unwrap();
    let refused = GappyPod::new(&basis(), &other).unwrap_err();
    assert_eq!(refused.to_string(), "the mask samples maps of 360 bins, the basis has 36");
}
