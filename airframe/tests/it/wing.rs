//! The reference wing against an independent prototype, and against what holds for any section.

use std::path::Path;

use crate::cases::{self, Table};
use airframe::{
    Basis, Layout, Section, SectionGeometry, SectionLoads, flight_products, products::response, reference_beam,
    reference_configuration, strains,
};
use domain::{AirData, sensor_configuration::FLIGHT_PRODUCTS};
use nalgebra::DMatrix;
use serde_json::Value;

fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/loads").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn reference() -> Value {
    serde_json::from_str(&fixture("wing_reference.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

#[track_caller]
pub fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
}

/// 50 m/s, alpha 5, aileron 5, flap 10 degrees.
pub fn thesis_case() -> AirData {
    AirData {
        dynamic_pressure_pa: 1531.25,
        airspeed_m_s: 50.0,
        angle_of_attack_rad: 5.0_f64.to_radians(),
        roll_rate_rad_s: 0.0,
        flap_rad: 10.0_f64.to_radians(),
        aileron_rad: 5.0_f64.to_radians(),
    }
}

fn section() -> Section {
    Section::new(SectionGeometry::reference())
}

/// Lift over the span by its causes.
#[test]
fn lift_per_length_is_the_prototypes() {
    let reference = reference();
    let table = &reference["lift_per_length_N_m"];
    let (line, case) = (reference_beam().lifting_line().clone(), thesis_case());
    let column = |name: &str| numbers(&table[name]);
    let causes = [
        ("flap", Basis::Flap, case.flap_rad),
        ("aileron", Basis::Aileron, case.aileron_rad),
        ("wing", Basis::Incidence, case.angle_of_attack_rad - line.wing().zero_lift_angle_rad),
    ];
    for (name, basis, amount) in causes {
        let loading = line.unit_loading(basis);
        for (y_m, expected) in column("y").into_iter().zip(column(name)) {
            close(case.dynamic_pressure_pa * amount * loading.lift_per_length_m(y_m), expected, 1.5);
        }
    }
    let loading = line.loading(&case);
    for (y_m, expected) in column("y").into_iter().zip(column("total")) {
        close(case.dynamic_pressure_pa * loading.lift_per_length_m(y_m), expected, 2.0);
    }
}

/// Shear force, bending moment and torsion of the right wing at its root and along the span.
#[test]
fn beam_carries_the_prototypes_loads() {
    let reference = reference();
    let table = &reference["beam"];
    let (beam, products) = (reference_beam(), flight_products(&thesis_case()));
    let rows = numbers(&table["y"]).into_iter().zip(numbers(&table["T_z"]));
    let moments = numbers(&table["M_x"]).into_iter().zip(numbers(&table["M_t"]));
    for ((y_m, shear_n), (bending_nm, torsion_nm)) in rows.zip(moments) {
        let loads = beam.loads(y_m, &products);
        close(loads.shear_n, shear_n, 1e-5 * shear_n.abs());
        close(loads.bending_nm, bending_nm, 1e-5 * bending_nm.abs());
        close(loads.torsion_nm, torsion_nm, 1e-5 * torsion_nm.abs());
    }
    let root = beam.loads(0.0, &products);
    close(root.shear_n, 6968.55, 0.05);
    close(root.bending_nm, 15_822.84, 0.1);
    close(root.torsion_nm, -1828.4, 0.05);
}

/// dM_b/dy = -T between hinges, and no load is left at the tip.
#[test]
fn bending_is_the_integral_of_shear() {
    let (beam, products) = (reference_beam(), [1500.0, 110.0, 6.0, 240.0, -150.0]);
    for y_m in [0.2, 1.7, 2.8, 3.9, 4.6] {
        let bending_nm = |y_m| beam.loads(y_m, &products).bending_nm;
        let slope = (bending_nm(y_m + 1e-5) - bending_nm(y_m - 1e-5)) / 2e-5;
        close(slope, -beam.loads(y_m, &products).shear_n, 1e-3);
    }
    let SectionLoads { shear_n, bending_nm, torsion_nm } = beam.loads(5.0, &products);
    assert!(shear_n.abs() < 1e-9 && bending_nm.abs() < 1e-9 && torsion_nm.abs() < 1e-9);
}

/// Superposed unit loads are the loads of the whole flight condition, roll included.
#[test]
fn loads_are_linear_in_the_products() {
    let case = AirData { roll_rate_rad_s: 0.5, ..thesis_case() };
    let beam = reference_beam();
    let clean = beam.lifting_line().loading(&AirData { flap_rad: 0.0, aileron_rad: 0.0, ..case.clone() });
    for y_m in [0.0, 1.3, 2.7, 4.4] {
        let mut direct = SectionLoads {
            shear_n: 1531.25 * clean.outboard_lift_m2(y_m),
            bending_nm: 1531.25 * clean.outboard_moment_m3(y_m),
            torsion_nm: -0.047 * 1531.25 * (5.0 - y_m),
        };
        // Half of each surface's lift at each hinge, half a chord behind the axis.
        let hinges = [(1.0, 1730.476), (2.2, 1730.476), (3.3, 619.184), (4.3, 619.184)];
        for (hinge_m, lift_n) in hinges.into_iter().filter(|(hinge_m, _)| *hinge_m > y_m) {
            direct.shear_n += 0.5 * lift_n;
            direct.bending_nm += 0.5 * lift_n * (hinge_m - y_m);
            direct.torsion_nm -= 0.5 * lift_n * 0.5;
        }
        let actuators = [(1.0, 1730.476), (3.3, 619.184)];
        for (_, lift_n) in actuators.into_iter().filter(|(actuator_m, _)| *actuator_m > y_m) {
            direct.torsion_nm -= lift_n * 0.125;
        }
        let loads = beam.loads(y_m, &flight_products(&case));
        close(loads.shear_n, direct.shear_n, 0.05);
        close(loads.bending_nm, direct.bending_nm, 0.05);
        close(loads.torsion_nm, direct.torsion_nm, 0.05);
    }
}

#[test]
fn section_is_the_prototypes() {
    let reference = reference();
    let (table, section) = (&reference["section"], section());
    let names: Vec<&str> = table["boom_names"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    for (i, (boom, name)) in section.geometry().booms.iter().zip(names).enumerate() {
        assert_eq!(boom.name, name);
        close(boom.x_m, numbers(&table["x"])[i], 1e-14);
        close(boom.z_m, numbers(&table["z"])[i], 1e-14);
        close(boom.area_m2, numbers(&table["A"])[i], 1e-18);
        let factor = numbers(&table["navier_k"])[i];
        close(section.bending_factors_per_m3()[i], factor, 1e-10 * factor.abs());
    }
    for (panel, row) in section.geometry().panels.iter().zip(matrix(&table["panels"])) {
        assert_eq!(vec![panel.from as f64, panel.to as f64, panel.thickness_m], row);
    }
    let moments = section.second_moments();
    close(moments.x_m, table["xg"].as_f64().unwrap(), 1e-14);
    close(moments.z_m, table["zg"].as_f64().unwrap(), 1e-14);
    close(moments.jx_m4, table["Jx"].as_f64().unwrap(), 1e-18);
    close(moments.jz_m4, table["Jz"].as_f64().unwrap(), 1e-17);
    close(moments.jxz_m4, table["Jxz"].as_f64().unwrap(), 1e-18);
    for (unit, flows) in [
        ("shear_flow_unit_Tz", section.flow_per_shear_per_m()),
        ("shear_flow_unit_Mt", section.flow_per_torsion_per_m2()),
    ] {
        for (flow, expected) in flows.iter().zip(numbers(&table[unit])) {
            close(*flow, expected, 1e-9);
        }
    }
}

#[test]
fn section_has_its_stiffness_and_shear_centre() {
    close(section().torsional_stiffness_nm2(), 2.508_35e5, 1.0);
    close(section().shear_centre_x_m(), 0.3146, 5e-5);
}

/// A thin-walled square tube: GJ = G 4 A^2 t / s, and its shear centre is its middle.
#[test]
fn square_tube_has_its_closed_solution() {
    let corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.4), (0.0, 0.4)];
    let reference = SectionGeometry::reference();
    let booms = corners.map(|(x_m, z_m)| airframe::section::Boom { name: String::new(), x_m, z_m, area_m2: 1e-4 });
    let panel = |i: usize| airframe::section::Panel { from: i, to: (i + 1) % 4, thickness_m: 1e-3 };
    let geometry = SectionGeometry {
        booms: booms.to_vec(),
        panels: (0..4).map(panel).collect(),
        cells: vec![(0..4).map(|panel| (panel, 1.0)).collect()],
        ..reference
    };
    let gj = geometry.shear_modulus_pa * 4.0 * 0.16 * 0.16 * 1e-3 / 1.6;
    let section = Section::new(geometry);
    close(section.torsional_stiffness_nm2(), gj, 1e-9 * gj);
    close(section.shear_centre_x_m(), 0.2, 1e-12);
    for flow in section.flow_per_torsion_per_m2() {
        close(*flow, -1.0 / (2.0 * 0.16), 1e-12);
    }
}

/// sum A k = 0, sum A k z = -1, sum A k x = 0: bending makes no axial force and no moment across.
#[test]
fn bending_strain_resolves_to_the_moment() {
    let section = section();
    let (geometry, centroid) = (section.geometry(), section.second_moments());
    let sum = |arm: &dyn Fn(&airframe::section::Boom) -> f64| -> f64 {
        let booms = geometry.booms.iter().zip(section.bending_factors_per_m3());
        booms.map(|(boom, factor)| boom.area_m2 * factor * arm(boom)).sum()
    };
    close(sum(&|_| 1.0), 0.0, 1e-13);
    close(sum(&|boom| boom.z_m - centroid.z_m), -1.0, 1e-13);
    close(sum(&|boom| boom.x_m - centroid.x_m), 0.0, 1e-13);
}

/// Panel flows make no force aft, the shear force up and the torsion about the axis, and leave every
/// boom by A k T more than they enter it.
#[test]
fn panel_flows_resolve_to_shear_and_torsion() {
    let section = section();
    let geometry = section.geometry();
    for (flows, shear, torsion) in
        [(section.flow_per_shear_per_m(), 1.0, 0.0), (section.flow_per_torsion_per_m2(), 0.0, 1.0)]
    {
        let (mut aft, mut up, mut nose_up) = (0.0, 0.0, 0.0);
        let mut excess = vec![0.0; geometry.booms.len()];
        for (panel, flow) in geometry.panels.iter().zip(flows) {
            let (u, v) = (&geometry.booms[panel.from], &geometry.booms[panel.to]);
            aft += flow * (v.x_m - u.x_m);
            up += flow * (v.z_m - u.z_m);
            nose_up -= flow * ((u.x_m - 0.25) * v.z_m - (v.x_m - 0.25) * u.z_m);
            excess[panel.from] += flow;
            excess[panel.to] -= flow;
        }
        close(aft, 0.0, 1e-12);
        close(up, shear, 1e-12);
        close(nose_up, torsion, 1e-12);
        for ((boom, factor), excess) in geometry.booms.iter().zip(section.bending_factors_per_m3()).zip(excess) {
            close(excess, boom.area_m2 * factor * shear, 1e-12);
        }
    }
}

/// A diagonal grating sees (1 - nu)/2 of the mean axial strain and half of the shear angle f/(t G).
#[test]
fn diagonal_strain_has_its_two_parts() {
    let section = section();
    let bent = SectionLoads { bending_nm: 1e4, ..SectionLoads::default() };
    let mean = 0.5 * (section.axial_strain(6, &bent) + section.axial_strain(7, &bent));
    close(section.diagonal_strain(6, &bent), 0.335 * mean, 1e-18);
    let twisted = SectionLoads { torsion_nm: 1e3, ..SectionLoads::default() };
    let shear_angle = 1e3 * section.flow_per_torsion_per_m2()[2] / (0.8e-3 * 27e9);
    close(section.diagonal_strain(2, &twisted), 0.5 * shear_angle, 1e-18);
}

/// Upper stringers in compression: strains of the case at y = .95 m, and all twelve of both layouts.
#[test]
fn gratings_show_the_prototypes_strains() {
    let reference = reference();
    let products = flight_products(&thesis_case());
    let axial = strains(&reference_configuration(Layout::A).strain_map, &products);
    for (strain, microstrain) in axial.into_iter().zip([-1146.2, -705.7, 1160.7]) {
        close(1e6 * strain, microstrain, 5e-3 * microstrain.abs());
    }
    for (layout, name) in [(Layout::A, "A"), (Layout::D, "D")] {
        let strains = strains(&reference_configuration(layout).strain_map, &products);
        for (strain, microstrain) in strains.into_iter().zip(numbers(&reference["sensors"][name]["strain_ue"])) {
            close(1e6 * strain, microstrain, 0.002 + 1e-6 * microstrain.abs());
        }
    }
}

/// A_z and C_z; an entry of A_z by the largest of its column.
#[test]
fn maps_are_the_prototypes() {
    let reference = reference();
    for (layout, name) in [(Layout::A, "A"), (Layout::D, "D")] {
        let configuration = reference_configuration(layout);
        configuration.check().unwrap();
        let expected = matrix(&reference["sensors"][name]["A_z"]);
        for column in 0..FLIGHT_PRODUCTS {
            let largest = expected.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
            for (row, expected) in configuration.strain_map.iter().zip(&expected) {
                close(row[column], expected[column], 3e-6 * largest);
            }
        }
        let rows = [configuration.hinge_rows.flap, configuration.hinge_rows.aileron];
        for (row, expected) in rows.iter().zip(matrix(&reference["C_z"])) {
            for (value, expected) in row.iter().zip(expected) {
                close(*value, expected, 3e-6);
            }
        }
    }
}

/// Strains and hinge moments of the prototype's cases, to a hundredth of a microstrain and 1e-5.
#[test]
fn cases_have_the_prototypes_strains_and_moments() {
    let folder = cases::folder();
    let conditions = Table::open(&folder.join("train_conditions.csv"));
    let moments = ["M_f_Nm", "M_a_Nm"].map(|name| conditions.numbers(name));
    for (layout, name) in [(Layout::A, "A"), (Layout::D, "D")] {
        let configuration = reference_configuration(layout);
        let rows = [&configuration.hinge_rows.flap, &configuration.hinge_rows.aileron];
        let expected = Table::open(&folder.join(format!("{name}_train_strains.csv"))).rows("eps_true_", 2, 12);
        for (case, products) in cases::true_products(&conditions).iter().enumerate() {
            for (strain, expected) in strains(&configuration.strain_map, products).iter().zip(&expected[case]) {
                close(*strain, *expected, 1e-8);
            }
            for (row, moments) in rows.iter().zip(&moments) {
                close(response(row, products), moments[case], 1e-5 * moments[case].abs());
            }
        }
    }
}

/// Singular values of A std(z) over the training cases, microstrain: axial gratings see four numbers of
/// five, and those badly.
#[test]
fn diagonal_gratings_see_what_axial_ones_do_not() {
    let products = cases::true_products(&Table::open(&cases::folder().join("train_conditions.csv")));
    let deviation = |column: usize| {
        let n = products.len() as f64;
        let mean = products.iter().map(|z| z[column]).sum::<f64>() / n;
        (products.iter().map(|z| (z[column] - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    for (layout, expected) in [(Layout::A, [849.0, 67.0, 6.3, 2.0, 0.0]), (Layout::D, [638.0, 231.0, 111.0, 7.9, 1.06])]
    {
        let map = reference_configuration(layout).strain_map;
        let scaled = DMatrix::from_fn(map.len(), FLIGHT_PRODUCTS, |i, j| 1e6 * map[i][j] * deviation(j));
        let singular_values = scaled.singular_values();
        for ((value, expected), unit) in singular_values.iter().zip(expected).zip([1.0, 1.0, 1.0, 0.1, 0.01]) {
            close(*value, expected, 0.5 * unit);
        }
    }
    assert_eq!(products.len(), 100);
}
