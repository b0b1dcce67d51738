//! The sensor map A_z and the hinge rows C_z from cases: least squares.
//!
//! What: rows m of y = m . z from cases (z, y), simulated or of a ground test.
//! Update rule: columns of the cases' z scaled to unit norm, singular value decomposition, singular
//! values below 1e-9 of the largest left out: what the cases do not excite stays zero.
//! Requires: finite cases. Offline: it uses a library's decomposition.
//! Source: Berri 2021, eq. 4.12, with z in place of the flight condition.

use nalgebra::DMatrix;

use crate::products::Products;

/// Singular values below this part of the largest are taken for zero.
pub const RELATIVE_CONDITION: f64 = 1e-9;

/// Cases from which no map can be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MapFitError {
    /// No cases.
    #[error("a map needs cases")]
    NoCases,
    /// Cases and responses do not pair, or cases respond with different numbers of values.
    #[error("case {case} has {given} responses where {expected} are expected")]
    Shape {
        /// Index of the case, 0-based.
        case: usize,
        /// How many it has.
        given: usize,
        /// How many the first has.
        expected: usize,
    },
    /// A number is NaN or infinite.
    #[error("case {case} is not finite")]
    NotFinite {
        /// Index of the case, 0-based.
        case: usize,
    },
}

/// One case: products and what was measured at them.
#[derive(Debug, Clone, PartialEq)]
pub struct MapCase {
    /// z.
    pub products: Products,
    /// Strain of each grating, or hinge moment of each surface.
    pub responses: Vec<f64>,
}

/// The rows of the linear map from products to responses, one per response.
pub fn fit_map(cases: &[MapCase]) -> Result<Vec<Products>, MapFitError> {
    let expected = cases.first().ok_or(MapFitError::NoCases)?.responses.len();
    for (case, MapCase { products, responses }) in cases.iter().enumerate() {
        if responses.len() != expected {
            return Err(MapFitError::Shape { case, given: responses.len(), expected });
        }
        if !products.iter().chain(responses).all(|x| x.is_finite()) {
            return Err(MapFitError::NotFinite { case });
        }
    }
    let mut design = DMatrix::from_fn(cases.len(), Products::default().len(), |i, k| cases[i].products[k]);
    let responses = DMatrix::from_fn(cases.len(), expected, |i, j| cases[i].responses[j]);
    let mut scales = Products::default();
    for (scale, mut column) in scales.iter_mut().zip(design.column_iter_mut()) {
        let norm = column.norm();
        *scale = if norm > 0.0 { norm } else { 1.0 };
        column /= *scale;
    }
    let decomposition = design.svd(true, true);
    let smallest = RELATIVE_CONDITION * decomposition.singular_values.max();
    let scaled = decomposition.solve(&responses, smallest).expect("both factors were asked for");
    Ok((0..expected).map(|j| std::array::from_fn(|k| scaled[(k, j)] / scales[k])).collect())
}
