//! Maps from cases.

use crate::cases::{self, Table};
use airframe::{MapCase, MapFitError, fit_map};

fn close(found: &[[f64; 5]], expected: &[[f64; 5]]) {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().flatten().fold(0.0_f64, |max, x| max.max(x.abs()));
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() <= 1e-6 * largest, "{found} instead of {expected}");
    }
}

#[test]
fn maps_of_simulated_cases_are_those_of_the_prototype() {
    let folder = cases::folder();
    let conditions = Table::open(&folder.join("train_conditions.csv"));
    let products = cases::true_products(&conditions);
    for layout in ["A", "D"] {
        let parameters = cases::parameters(&folder, layout);
        let strains = Table::open(&folder.join(format!("{layout}_train_strains.csv")));
        let of = |responses: Vec<Vec<f64>>| {
            let cases =
                products.iter().zip(responses).map(|(products, responses)| MapCase { products: *products, responses });
            fit_map(&cases.collect::<Vec<_>>()).expect("100 cases")
        };
        close(&of(strains.rows("eps_true_", 2, 12)), &parameters.a_z);
        let moments = conditions.numbers("M_f_Nm").into_iter().zip(conditions.numbers("M_a_Nm"));
        close(&of(moments.map(|(flap, aileron)| vec![flap, aileron]).collect()), &parameters.c_z);
    }
}

/// Cases that never roll leave the effect of rolling at zero instead of at noise.
#[test]
fn what_no_case_excites_stays_zero() {
    let case = |q: f64, alpha: f64| {
        let products = [q, q * alpha, 0.0, 0.1 * q * alpha, 0.0];
        MapCase { products, responses: vec![2.0 * q + 3.0 * q * alpha] }
    };
    let found = fit_map(&[case(1000.0, 0.1), case(1500.0, -0.1), case(2000.0, 0.02)]).expect("three cases")[0];
    assert_eq!((found[2], found[4]), (0.0, 0.0));
    assert!((found[0] - 2.0).abs() < 1e-9);
    // Two products that go together share their effect; together they have all of it.
    assert!((found[1] + 0.1 * found[3] - 3.0).abs() < 1e-9);
}

#[test]
fn cases_that_do_not_fit_are_named() {
    let case = |responses: Vec<f64>| MapCase { products: [1.0; 5], responses };
    assert_eq!(fit_map(&[]), Err(MapFitError::NoCases));
    let shape = fit_map(&[case(vec![1.0]), case(vec![])]);
    assert_eq!(shape, Err(MapFitError::Shape { case: 1, given: 0, expected: 1 }));
    assert_eq!(fit_map(&[case(vec![f64::NAN])]), Err(MapFitError::NotFinite { case: 0 }));
}
