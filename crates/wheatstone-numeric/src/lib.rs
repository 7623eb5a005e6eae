//! Numbers without cameras: random streams, statistics, linear least squares, and the multilayer
//! perceptron with its training.
//!
//! Everything here gives the same bits on every machine: sums run in a fixed order, and
//! transcendental functions come from `libm` or from [`sigmoid`].

mod error;
pub mod progress;
pub mod backpropagation;
pub mod cholesky;
pub mod covariance;
pub mod evidence;
pub mod least_squares;
pub mod levenberg_marquardt;
pub mod aligned;
pub mod loss;
pub mod matrix_product;
pub mod number;
pub mod blocked_matrix;
pub mod perceptron;
pub mod random;
pub mod reweighted;
pub mod sigmoid;
pub mod simd;
pub mod statistics;

pub use error::{Error, Result};
