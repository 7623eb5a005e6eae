//! Metric point clouds with error bars, from calibrated cameras and what they see.
//!
//! A [`SceneReconstructor`] is made ready once for two or more cameras of a model, of any optics; pictures of theirs give
//! a [`Reconstruction`]: disparities, depths, and a [`Cloud`] of points in the world with their standard deviations.
//!
//! # The way of the data
//!
//! 1. `pair` has two pictures rectified by the model's virtual pair, and matched: along rows where those are epipolar
//!    lines, and along the curves that the model says where they are not. `wheatstone_stereo::judge_pair` names what
//!    makes a pair worthless: exchanged or moved cameras, pictures with nothing in common; `pair_check` holds it.
//! 2. `scene` does so with the reference camera and each other one. `matches` leads from disparities back to pixels of
//!    the cameras' own pictures; `seen` gathers, for each pixel of the reference, what the others match with it: `dense`
//!    from disparity maps, `sparse` from corners and edges ([`features`]), or from pixels that somebody else matched.
//! 3. `consensus` keeps what the pairs agree on, `contradiction` tells of a camera that agrees with no other, and `turned` which
//!    one a small rotation of explains what rows and depths say.
//! 4. `points` has the model triangulate it. A disparity is a search only: what is told is where the model's own map
//!    places the matched pixels, with the covariance of the match and of the calibration. Of a pair's disparities
//!    `point_lattice` interpolates what the map says; `scene_points` chooses between the two.
//!    With three and more cameras `rims` drops what lies at edges of depth. `checks` tells what left no point.
//! 5. `cloud` holds the results, `mesh` joins them to a surface; `cloud_files` and `depth_files` write them. `fusion` puts frames of
//!    cameras and scenes that stand still together before.

pub mod features;
mod settings;
mod matches;
mod sharpness;
mod cloud;
mod seen;
mod points;
mod pair;
mod pair_check;
mod turned;
mod point_lattice;
mod dense;
mod sparse;
mod consensus;
mod rims;
mod scene_points;
mod contradiction;
mod reconstruction;
mod scene;
mod scene_cameras;
mod checks;
mod fusion;
mod mesh;
mod cloud_files;
mod depth_files;
#[cfg(feature = "mcap")]
mod mcap_log;

pub use checks::Emptied;
pub use cloud::Cloud;
pub use cloud_files::{CLOUD_FORMATS, CloudFormat, write_ply};
pub use contradiction::Contradiction;
pub use depth_files::{DepthPng, depth_png, depth_tiff};
pub use fusion::FrameFusion;
#[cfg(feature = "mcap")]
pub use mcap_log::{EncodedPicture, McapLog};
pub use mesh::Mesh;
pub use pair_check::PairCheck;
pub use reconstruction::Reconstruction;
pub use scene::SceneReconstructor;
pub use settings::ReconstructionSettings;
pub use turned::{TurnedCamera, TurnedSideways};
