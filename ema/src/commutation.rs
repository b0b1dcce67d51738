//! Six-step commutation and the angles of the back-EMF map.
//!
//! The map has one bin per electrical degree. Sector s = floor((theta_e + 30 deg)/60 deg) mod 6 has a
//! fixed pair of active phases, so every commutation and every corner of the trapezoidal back-EMF lies
//! on the edge of a bin: inside a bin the models are smooth.

/// Bins of a map over one electrical revolution.
pub const BINS: usize = 360;
/// Bins of one commutation sector.
pub const SECTOR_BINS: usize = 60;
/// First bin of sector 1: commutations lie at this bin and every [`SECTOR_BINS`] after it.
pub const FIRST_COMMUTATION_BIN: usize = 30;

/// Active phases (positive, negative) of sectors 0 to 5, for positive torque: CA, CB, AB, AC, BC, BA.
pub const ACTIVE_PAIRS: [(usize, usize); 6] = [(2, 0), (2, 1), (0, 1), (0, 2), (1, 2), (1, 0)];

/// Sector of a bin.
pub fn sector(bin: usize) -> usize {
    (bin + FIRST_COMMUTATION_BIN) / SECTOR_BINS % ACTIVE_PAIRS.len()
}

/// Sign of the current of phases A, B, C in a sector, for positive torque.
pub fn phase_signs(sector: usize) -> [f64; 3] {
    let (positive, negative) = ACTIVE_PAIRS[sector];
    let mut signs = [0.0; 3];
    signs[positive] = 1.0;
    signs[negative] = -1.0;
    signs
}

/// Electrical angle of the lower edge of a bin, rad.
pub fn bin_edge_rad(bin: usize) -> f64 {
    bin as f64 * (std::f64::consts::TAU / BINS as f64)
}

/// Electrical angle of the centre of a bin, rad.
pub fn bin_centre_rad(bin: usize) -> f64 {
    (bin as f64 + 0.5) * (std::f64::consts::TAU / BINS as f64)
}

/// Trapezoidal back-EMF of phases A, B, C at the lower edge of a bin, amplitude 1: flat within 60
/// degrees of 150, 270 and 30 degrees, linear to the opposite flat.
pub fn trapezoid(bin: usize) -> [f64; 3] {
    [150, 270, 30].map(|centre: usize| {
        let ahead = (bin + BINS - centre) % BINS;
        let distance = ahead.min(BINS - ahead) as f64;
        ((90.0 - distance) / 30.0).clamp(-1.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_are_those_of_the_hall_sensors() {
        for bin in 0..BINS {
            // Berri 2021, eq. 3.2, with H_j = [cos(theta_e - 120 deg (j - 1)) > 0].
            let hall = |j: f64| (bin_centre_rad(bin) - 120_f64.to_radians() * j).cos() > 0.0;
            let [h1, h2, h3] = [hall(0.0), hall(1.0), hall(2.0)].map(f64::from);
            assert_eq!(phase_signs(sector(bin)), [h2 - h1, h3 - h2, h1 - h3], "bin {bin}");
        }
    }

    #[test]
    fn the_active_pair_is_on_its_flats() {
        for bin in 0..BINS {
            let (positive, negative) = ACTIVE_PAIRS[sector(bin)];
            for edge in [bin, (bin + 1) % BINS] {
                assert_eq!(trapezoid(edge)[positive], 1.0, "bin {bin}");
                assert_eq!(trapezoid(edge)[negative], -1.0, "bin {bin}");
            }
        }
    }
}
