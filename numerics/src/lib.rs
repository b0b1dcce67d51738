//! Random streams, distributions and small matrices, the same bits on any machine.
//!
//! What: the numerics that several crates of the workspace need, each once. Plain loops in a fixed order, transcendental
//! functions of `libm` only, no instructions chosen at run time. Nothing here knows the nouns of the service.
//!
//! ```
//! use numerics::{Stream, Symmetric, normal, quantile};
//!
//! // The same seed and key give the same numbers anywhere.
//! let mut stream = Stream::new(1, &["front page"]);
//! let draws = quantile::sorted((0..10_001).map(|_| stream.normal()).collect());
//! let p90 = quantile::nearest(&draws, 0.9);
//! assert!((p90 - normal::quantile(0.9)).abs() < 0.05);
//!
//! let mut matrix = Symmetric::diagonal(&[1.0, 2.0]);
//! matrix.add_outer(&[1.0, 1.0], 3.0);
//! let x = matrix.cholesky().expect("positive definite").solve(&[4.0, 5.0]);
//! assert!(matrix.times(&x).iter().zip([4.0, 5.0]).all(|(found, b)| (found - b).abs() < 1e-12));
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod apportionment;
pub mod chi_square;
pub mod energy;
pub mod fixed_cholesky;
pub mod least_squares;
pub mod log_sum_exp;
pub mod normal;
pub mod quantile;
pub mod random;
pub mod resampling;
pub mod robust_line;
pub mod symmetric;

pub use apportionment::apportion;
pub use fixed_cholesky::FixedCholesky;
pub use least_squares::LeastSquares;
pub use random::Stream;
pub use robust_line::RobustLine;
pub use symmetric::{Cholesky, Symmetric};
