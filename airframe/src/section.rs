//! A cross-section of the wing as booms that carry axial load and panels that carry shear.
//!
//! - What: strain of stringers and skin under shear force, bending and torsion.
//! - Update rule: bending is Navier's with the product of inertia, eps = k M_b/E with
//!   k = -(Jz z - Jxz x)/(Jx Jz - Jxz^2) about the booms' centroid (Berri 2021, eq. 4.9, corrected in sign
//!   and cross terms). Shear flows f (N/m) leave each boom by A k T more than they enter it, resolve to
//!   the torsion about the axis, and twist all cells alike (eq. 4.11, corrected: the moment takes twice
//!   the swept area, n booms give n - 1 independent equations, every further cell one of equal twist).
//! - Requirements: booms, panels and cells of a closed section, panels = booms - 1 + cells; straight
//!   panels; the skin carries no normal stress.
//! - Signs: x aft and z up from the nose; tip-up bending and nose-up torsion are positive; f is positive
//!   from a panel's first to its second boom.
//! - Source: Megson 2013, "Aircraft structures for engineering students", chapters 20 and 23.

#![allow(clippy::disallowed_methods, reason = "offline: a wing is described once")]

use nalgebra::{DMatrix, DVector};

use crate::{
    beam::SectionLoads,
    wing::{Camber, Wing},
};

/// A stringer or spar cap.
#[derive(Debug, Clone, PartialEq)]
pub struct Boom {
    /// Its name: `U` for the upper and `L` for the lower skin, and its place in percent of the chord.
    pub name: String,
    /// Place aft of the nose, m.
    pub x_m: f64,
    /// Height above the chord line, m.
    pub z_m: f64,
    /// Area A, m^2.
    pub area_m2: f64,
}

/// A piece of skin or a spar web between two booms.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// First boom.
    pub from: usize,
    /// Second boom.
    pub to: usize,
    /// Thickness t, m.
    pub thickness_m: f64,
}

/// A closed cell: its panels in order round it, each with +1 if it is passed from its first to its
/// second boom and -1 if not. Seen with the nose to the left, the way round is anticlockwise.
pub type Cell = Vec<(usize, f64)>;

/// Geometry and material of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionGeometry {
    /// The booms.
    pub booms: Vec<Boom>,
    /// The panels.
    pub panels: Vec<Panel>,
    /// The cells.
    pub cells: Vec<Cell>,
    /// Place of the axis on the chord line about which torsion is counted, m aft of the nose.
    pub axis_x_m: f64,
    /// Young's modulus E, Pa.
    pub young_modulus_pa: f64,
    /// Shear modulus G, Pa.
    pub shear_modulus_pa: f64,
    /// Poisson's ratio nu.
    pub poisson_ratio: f64,
}

/// A section with its properties.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    geometry: SectionGeometry,
    second_moments: SecondMoments,
    /// k of every boom, 1/m^3.
    bending_factors_per_m3: Vec<f64>,
    /// Shear flow of every panel per shear force, 1/m.
    flow_per_shear_per_m: Vec<f64>,
    /// Shear flow of every panel per torsion, 1/m^2.
    flow_per_torsion_per_m2: Vec<f64>,
}

/// First and second moments of the booms' areas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondMoments {
    /// Centroid aft of the nose, m.
    pub x_m: f64,
    /// Centroid above the chord line, m.
    pub z_m: f64,
    /// Jx = sum A z^2 about the centroid, m^4.
    pub jx_m4: f64,
    /// Jz = sum A x^2, m^4.
    pub jz_m4: f64,
    /// Jxz = sum A x z, m^4.
    pub jxz_m4: f64,
}

impl SectionGeometry {
    /// The section of the reference wing: NACA 2412, chord 1 m, nine booms, two cells divided by the
    /// front spar's web, aluminium.
    pub fn reference() -> Self {
        let camber = Wing::reference().camber;
        let stringers = [(0.20, 600e-6), (0.35, 150e-6), (0.50, 150e-6), (0.70, 300e-6)];
        let boom = |(fraction, area_m2): (f64, f64), upper: bool| {
            let (x_m, z_m) = naca_point(&camber, 0.12, fraction, upper);
            let name = format!("{}{:.0}", if upper { 'U' } else { 'L' }, 100.0 * fraction);
            Boom { name, x_m, z_m, area_m2 }
        };
        let nose = Boom { name: "nose".into(), x_m: 0.01, z_m: camber.line(0.01), area_m2: 60e-6 };
        let mut booms = vec![nose];
        booms.extend(stringers.map(|stringer| boom(stringer, false)));
        booms.extend(stringers.into_iter().rev().map(|stringer| boom(stringer, true)));
        let (skin_m, web_m) = (0.8e-3, 1.5e-3);
        let around =
            (0..9).map(|i| Panel { from: i, to: (i + 1) % 9, thickness_m: if i == 4 { web_m } else { skin_m } });
        let front_web = Panel { from: 1, to: 8, thickness_m: web_m };
        let nose_cell = vec![(0, 1.0), (9, 1.0), (8, 1.0)];
        let box_cell = (1..8).map(|panel| (panel, 1.0)).chain([(9, -1.0)]).collect();
        Self {
            booms,
            panels: around.chain([front_web]).collect(),
            cells: vec![nose_cell, box_cell],
            axis_x_m: 0.25,
            young_modulus_pa: 72e9,
            shear_modulus_pa: 27e9,
            poisson_ratio: 0.33,
        }
    }

    /// x_u z_v - x_v z_u of a panel about the axis: twice the area swept from there, m^2.
    fn swept_m2(&self, panel: &Panel) -> f64 {
        let (u, v) = (&self.booms[panel.from], &self.booms[panel.to]);
        (u.x_m - self.axis_x_m) * v.z_m - (v.x_m - self.axis_x_m) * u.z_m
    }

    fn length_m(&self, panel: &Panel) -> f64 {
        let (u, v) = (&self.booms[panel.from], &self.booms[panel.to]);
        (v.x_m - u.x_m).hypot(v.z_m - u.z_m)
    }

    fn area_m2(&self, cell: &Cell) -> f64 {
        0.5 * cell.iter().map(|&(panel, sign)| sign * self.swept_m2(&self.panels[panel])).sum::<f64>()
    }

    /// Twist rate of a cell under each panel's unit flow, nose-up, times G:
    /// -sum sign l/t /(2 A), since the way round the cell is nose-down.
    fn twist_row(&self, cell: &Cell) -> Vec<f64> {
        let mut row = vec![0.0; self.panels.len()];
        for &(panel, sign) in cell {
            let panel_ref = &self.panels[panel];
            row[panel] = -sign * self.length_m(panel_ref) / panel_ref.thickness_m / (2.0 * self.area_m2(cell));
        }
        row
    }

    fn second_moments(&self) -> SecondMoments {
        let sum = |f: &dyn Fn(&Boom) -> f64| self.booms.iter().map(|boom| boom.area_m2 * f(boom)).sum::<f64>();
        let area_m2 = sum(&|_| 1.0);
        let (x_m, z_m) = (sum(&|boom| boom.x_m) / area_m2, sum(&|boom| boom.z_m) / area_m2);
        SecondMoments {
            x_m,
            z_m,
            jx_m4: sum(&|boom| (boom.z_m - z_m).powi(2)),
            jz_m4: sum(&|boom| (boom.x_m - x_m).powi(2)),
            jxz_m4: sum(&|boom| (boom.x_m - x_m) * (boom.z_m - z_m)),
        }
    }
}

impl Section {
    /// Solves the shear flows of unit loads.
    ///
    /// # Panics
    /// If the panels do not make exactly the given cells of the booms.
    pub fn new(geometry: SectionGeometry) -> Self {
        let (booms, panels, cells) = (geometry.booms.len(), geometry.panels.len(), geometry.cells.len());
        assert_eq!(panels + 1, booms + cells, "panels = booms - 1 + cells");
        let second_moments = geometry.second_moments();
        let factors = bending_factors(&geometry.booms, &second_moments);
        let mut matrix = DMatrix::zeros(panels, panels);
        let (mut shear, mut torsion) = (DVector::zeros(panels), DVector::zeros(panels));
        for (p, panel) in geometry.panels.iter().enumerate() {
            // The equation of the last boom follows from the others.
            if panel.from < booms - 1 {
                matrix[(panel.from, p)] += 1.0;
            }
            if panel.to < booms - 1 {
                matrix[(panel.to, p)] -= 1.0;
            }
            matrix[(booms - 1, p)] = -geometry.swept_m2(panel);
        }
        for (i, boom) in geometry.booms[..booms - 1].iter().enumerate() {
            shear[i] = boom.area_m2 * factors[i];
        }
        torsion[booms - 1] = 1.0;
        let first = geometry.twist_row(&geometry.cells[0]);
        for (i, cell) in geometry.cells[1..].iter().enumerate() {
            for (p, (twist, first)) in geometry.twist_row(cell).iter().zip(&first).enumerate() {
                matrix[(booms + i, p)] = twist - first;
            }
        }
        let factorised = matrix.lu();
        let flows = |load: &DVector<f64>| {
            let flows = factorised.solve(load).expect("a closed section carries shear and torsion in one way");
            flows.iter().copied().collect()
        };
        let (flow_per_shear_per_m, flow_per_torsion_per_m2) = (flows(&shear), flows(&torsion));
        Self {
            geometry,
            second_moments,
            bending_factors_per_m3: factors,
            flow_per_shear_per_m,
            flow_per_torsion_per_m2,
        }
    }

    /// Geometry and material.
    pub fn geometry(&self) -> &SectionGeometry {
        &self.geometry
    }

    /// Centroid and second moments of area.
    pub fn second_moments(&self) -> &SecondMoments {
        &self.second_moments
    }

    /// k of every boom, 1/m^3: eps = k M_b/E.
    pub fn bending_factors_per_m3(&self) -> &[f64] {
        &self.bending_factors_per_m3
    }

    /// Shear flow of every panel per shear force on the axis, 1/m.
    pub fn flow_per_shear_per_m(&self) -> &[f64] {
        &self.flow_per_shear_per_m
    }

    /// Shear flow of every panel per torsion, 1/m^2.
    pub fn flow_per_torsion_per_m2(&self) -> &[f64] {
        &self.flow_per_torsion_per_m2
    }

    /// The boom of this name.
    pub fn boom(&self, name: &str) -> Option<usize> {
        self.geometry.booms.iter().position(|boom| boom.name == name)
    }

    /// Torsional stiffness GJ, N m^2: torsion over twist rate.
    pub fn torsional_stiffness_nm2(&self) -> f64 {
        self.geometry.shear_modulus_pa / self.twist(&self.flow_per_torsion_per_m2)
    }

    /// Shear centre aft of the nose, m: a shear force there does not twist the section.
    pub fn shear_centre_x_m(&self) -> f64 {
        let lever_m = self.twist(&self.flow_per_shear_per_m) / self.twist(&self.flow_per_torsion_per_m2);
        self.geometry.axis_x_m + lever_m
    }

    /// Axial strain of a boom.
    pub fn axial_strain(&self, boom: usize, loads: &SectionLoads) -> f64 {
        self.bending_factors_per_m3[boom] * loads.bending_nm / self.geometry.young_modulus_pa
    }

    /// Strain at 45 degrees in a panel: (1 - nu)/2 eps_ax + f/(2 t G), with the mean axial strain of its
    /// booms.
    pub fn diagonal_strain(&self, panel: usize, loads: &SectionLoads) -> f64 {
        let Panel { from, to, thickness_m } = &self.geometry.panels[panel];
        let axial = 0.5 * (self.axial_strain(*from, loads) + self.axial_strain(*to, loads));
        let flow_n_m =
            self.flow_per_shear_per_m[panel] * loads.shear_n + self.flow_per_torsion_per_m2[panel] * loads.torsion_nm;
        0.5 * (1.0 - self.geometry.poisson_ratio) * axial
            + flow_n_m / (2.0 * thickness_m * self.geometry.shear_modulus_pa)
    }

    /// Twist rate times G under panel flows; all cells share it.
    fn twist(&self, flows: &[f64]) -> f64 {
        self.geometry.twist_row(&self.geometry.cells[0]).iter().zip(flows).map(|(twist, flow)| twist * flow).sum()
    }
}

fn bending_factors(booms: &[Boom], moments: &SecondMoments) -> Vec<f64> {
    let SecondMoments { x_m, z_m, jx_m4, jz_m4, jxz_m4 } = *moments;
    let determinant = jx_m4 * jz_m4 - jxz_m4 * jxz_m4;
    let factor = |boom: &Boom| -(jz_m4 * (boom.z_m - z_m) - jxz_m4 * (boom.x_m - x_m)) / determinant;
    booms.iter().map(factor).collect()
}

/// A point of a NACA four-digit section of chord 1 m, x and z in m; the thickness stands across the
/// mean line.
fn naca_point(camber: &Camber, thickness: f64, x: f64, upper: bool) -> (f64, f64) {
    let polynomial = -0.1260 + x * (-0.3516 + x * (0.2843 - 0.1015 * x));
    let half = 5.0 * thickness * (0.2969 * x.sqrt() + x * polynomial);
    let half = if upper { half } else { -half };
    let (sin, cos) = camber.slope(x).atan().sin_cos();
    (x - half * sin, camber.line(x) + half * cos)
}
