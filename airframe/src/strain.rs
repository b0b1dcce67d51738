//! Strain gratings on the right wing: where they are bonded, and what they show.
//!
//! Strain is linear in the flight-condition products z = [q, q alpha, q p/V, q delta_f, q delta_a] (not
//! in the flight condition itself, as Berri 2021, eq. 4.12 has it): eps = A_z z.

use domain::upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS};

use crate::{
    beam::Beam,
    products::{Products, response},
    section::Section,
};

/// Places of the four stations, m from the plane of symmetry.
pub const STATIONS_M: [f64; TEMPERATURE_SENSORS] = [0.95, 2.15, 3.25, 4.25];

/// What a grating measures, and on which member of the section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grating {
    /// Along the stringer of this name.
    Axial(&'static str),
    /// A grating at 45 degrees in this panel, where torsion shows.
    Diagonal(usize),
}

/// Arrangement of twelve gratings, three at each of the four stations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Axial gratings on three stringers, as in the thesis: every station measures its bending moment
    /// thrice, and torsion, where the control surfaces show, not at all.
    A,
    /// One axial grating and two at 45 degrees in the upper and the lower skin.
    D,
}

impl Layout {
    /// The three gratings of a station.
    pub fn station(self) -> [Grating; 3] {
        match self {
            Layout::A => [Grating::Axial("U20"), Grating::Axial("U70"), Grating::Axial("L20")],
            Layout::D => [Grating::Axial("U20"), Grating::Diagonal(6), Grating::Diagonal(2)],
        }
    }

    /// All gratings with the index of their station, in the order of an upload.
    pub fn gratings(self) -> impl Iterator<Item = (usize, Grating)> {
        (0..STATIONS_M.len()).flat_map(move |station| self.station().map(|grating| (station, grating)))
    }
}

impl Grating {
    /// Its place in words.
    pub fn place(self) -> String {
        match self {
            Grating::Axial(stringer) => stringer.to_owned(),
            Grating::Diagonal(panel) => format!("panel {panel} at 45 deg"),
        }
    }
}

/// A_z: strain of every grating per unit of each flight-condition product.
///
/// # Panics
/// If the section has no stringer or panel that the layout names.
pub fn strain_map(beam: &Beam, section: &Section, layout: Layout) -> Vec<Products> {
    let loads = STATIONS_M.map(|y_m| beam.unit_loads(y_m));
    let row = |(station, grating): (usize, Grating)| {
        loads[station].map(|loads| match grating {
            Grating::Axial(name) => {
                section.axial_strain(section.boom(name).expect("a stringer of the section"), &loads)
            }
            Grating::Diagonal(panel) => section.diagonal_strain(panel, &loads),
        })
    };
    layout.gratings().map(row).collect()
}

/// Strains A_z z of all gratings, bit-reproducible.
pub fn strains(map: &[Products], products: &Products) -> [f64; STRAIN_SENSORS] {
    assert_eq!(map.len(), STRAIN_SENSORS, "one row per grating");
    std::array::from_fn(|i| response(&map[i], products))
}
