//! Numbers beside what is known of them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod aligned;
mod backpropagation;
mod blocked_matrix;
mod cholesky;
mod covariance;
mod evidence;
mod least_squares;
mod levenberg_marquardt;
mod perceptron;
mod random;
mod reweighted;
mod sigmoid;
mod simd;
mod statistics;
