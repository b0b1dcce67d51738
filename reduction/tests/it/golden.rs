//! Agreement with an independent prototype.

use std::path::Path;

use domain::{Coordinate, Mask};
use numerics::Stream;
use reduction::{GappyPod, MaskDesign, ModeCount, PodBasis, Prior, Sample, condition_number};
use serde_json::Value;

const K_NOM: f64 = 0.0752;

fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/ema").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn golden() -> Value {
    serde_json::from_str(&fixture("fdi_golden.json")).unwrap()
}

/// The prototype's basis of nine modes, of its thousand maps of the pair form.
fn basis() -> PodBasis {
    serde_json::from_str(&fixture("pod.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

fn bins(value: &Value) -> Vec<usize> {
    serde_json::from_value(value.clone()).unwrap()
}

/// The maps of a table in units of k_nom.
fn maps(name: &str) -> Vec<Vec<f64>> {
    fixture(name).lines().map(|line| line.split(',').map(|y| y.parse::<f64>().unwrap() / K_NOM).collect()).collect()
}

#[test]
fn the_uniform_mask_is_the_prototypes() {
    let mask = MaskDesign { points: 30, exclusion_bins: 3 }.uniform(360).unwrap();
    assert_eq!(mask.bins(), bins(&golden()["mask"]));
}

/// Squared singular values of a hundred maps by numpy; the fifth mode is the last that tells much.
#[test]
fn energies_of_the_modes_are_those_of_another_decomposition() {
    let maps = maps("val_hf_op/Y.csv");
    let basis = PodBasis::train(&maps, ModeCount::Fixed(9)).unwrap();
    let expected =
        [615.494809, 116.70179, 107.022154, 51.3254956, 36.8806683, 1.56816146, 0.678499259, 0.222633516, 0.105515646];
    for (found, squared_singular_value) in basis.prior_variance().iter().zip(expected) {
        assert!((found * maps.len() as f64 / squared_singular_value - 1.0).abs() < 1e-8, "{found}");
    }
    // The modes are those of the energies: what a map has beyond them is what the other modes hold.
    let kept: f64 = maps.iter().map(|map| basis.project(map).iter().map(|alpha| alpha * alpha).sum::<f64>()).sum();
    assert!((kept / expected.iter().sum::<f64>() - 1.0).abs() < 1e-8, "{kept}");
}

#[test]
fn mask_and_least_squares_coefficients_are_the_prototypes() {
    let (basis, golden) = (basis(), golden());
    for (variance, squared_singular_value) in basis.prior_variance().iter().zip(numbers(&golden["eigenvalues"])) {
        assert!((variance * 1000.0 / squared_singular_value - 1.0).abs() < 1e-6, "{variance}");
    }
    let design = MaskDesign { points: 30, exclusion_bins: 3 };
    assert_eq!(design.d_optimal(&basis).unwrap().bins(), bins(&golden["dopt_mask_flat"]));

    let mask = Mask::new(Coordinate::ElectricalAngleRad, 360, bins(&golden["mask"])).unwrap();
    let gappy = GappyPod::new(&basis, &mask).unwrap();
    let expected: Vec<Vec<f64>> = serde_json::from_value(golden["alpha_hf5"].clone()).unwrap();
    let maps = maps("hf_Y.csv");
    assert_eq!(maps.len(), 4);
    // The fourth of the five is not among the maps.
    for (map, expected) in maps.iter().zip([0, 1, 2, 4].map(|row| &expected[row])) {
        let samples: Vec<_> = mask.bins().iter().map(|bin| Some(Sample { value: map[*bin], sd: 1e-4 })).collect();
        let found = gappy.fit(&samples, Prior::Flat).coefficients;
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }
}

#[test]
fn qr_pivots_and_condition_numbers_are_the_prototypes() {
    let (basis, golden) = (basis(), golden());
    // Nine modes have nine pivots. The prototype's other points are pivots of rounding errors.
    let pivots = MaskDesign { points: 9, exclusion_bins: 3 }.qr(&basis).unwrap();
    let qr_mask = bins(&golden["qr_mask"]);
    assert!(pivots.bins().iter().all(|bin| qr_mask.contains(bin)), "{:?}", pivots.bins());

    let of = |mask: &Mask| condition_number(&basis, mask).unwrap();
    let mask = |bins| Mask::new(Coordinate::ElectricalAngleRad, 360, bins).unwrap();
    let uniform = of(&mask(bins(&golden["mask"])));
    assert!((uniform / golden["cond_G"].as_f64().unwrap() - 1.0).abs() < 1e-5, "{uniform}");
    assert!((of(&mask(bins(&golden["dopt_mask_flat"]))) - 2.45).abs() < 0.01);
    assert!((of(&mask(qr_mask)) - 3.19).abs() < 0.01);
}

#[test]
fn thirty_points_of_any_rule_are_well_conditioned_and_nine_neurons_are_not() {
    let basis = basis();
    let of = |mask: Mask| condition_number(&basis, &mask).unwrap();
    let som = |design: MaskDesign| of(design.som(&basis, &mut Stream::new(1, &["som"])).unwrap().0);
    for exclusion_bins in [3, 12] {
        let design = MaskDesign { points: 30, exclusion_bins };
        assert!(of(design.uniform(360).unwrap()) < 2.0);
        assert!(of(design.qr(&basis).unwrap()) < 2.5);
        assert!(of(design.d_optimal(&basis).unwrap()) < 2.5);
        // Neurons crowd where modes change: expected 5 to 9, by the random start.
        assert!(som(design) < 12.0);
        // A map of nine neurons is folded: several of them share an angle.
        let few = MaskDesign { points: 9, exclusion_bins };
        assert!(of(few.qr(&basis).unwrap()) < 3.0 && of(few.uniform(360).unwrap()) < 3.0);
        assert!(som(few) > 1e4);
    }
}
