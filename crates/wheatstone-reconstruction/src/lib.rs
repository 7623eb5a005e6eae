//! Metric point clouds with error bars, from a calibrated pair of cameras and what they see.
//!
//! A [`PairReconstructor`] is made ready once for two cameras of a model, of any optics; each pair of pictures gives a
//! [`Reconstruction`]: disparities, depths, and a [`Cloud`] of points in the world with their standard deviations.
//!
//! # The way of the data
//!
//! 1. `pair` has both pictures rectified by the model's virtual pair (`remap`), and matched: along rows where those are
//!    epipolar lines, and along the curves that the model says where they are not.
//! 2. `wheatstone_stereo::pair_fault` names what makes a pair worthless: exchanged or moved cameras, pictures with nothing
//!    in common.
//! 3. `matches` goes from disparities back to matched pixels of the cameras' own pictures.
//! 4. `points` has the model triangulate them. A disparity is a search only: what is told is where the model's own map
//!    places the matched pixels, with the covariance of the match and of the calibration.
//! 5. `cloud` and `depth` hold the results; `ply` and `depth_files` write them.

mod settings;
mod remap;
mod matches;
mod points;
mod cloud;
mod pair;
mod ply;
mod depth_files;

pub use cloud::Cloud;
pub use depth_files::{DepthPng, depth_png, depth_tiff};
pub use pair::{PairReconstructor, Reconstruction};
pub use ply::binary_ply;
pub use settings::ReconstructionSettings;
