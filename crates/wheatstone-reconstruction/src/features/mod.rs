//! Corners and edges of one picture, found again in another one along epipolar curves.
//!
//! Where texture is thin, or speed counts more than density: a few thousand points instead of one a pixel. `gradient` has
//! the derivatives of a picture; `corners` and `edges` are where they say something; `epipolar_curve` is where the other
//! picture shows what is at a pixel, near or far, and `corner_matches` and `edge_matches` follow it.

mod gradient;
mod corners;
mod edges;
mod epipolar_curve;
mod corner_matches;
mod edge_matches;

pub use corner_matches::{CornerMatch, match_corners};
pub use corners::{Aligned, Corner, Look, aligned_along, corners, likeness, look};
pub use edge_matches::{
    Candidate, EdgeNeighbours, LEAST_CROSSING, candidates, is_sampled, match_edges, settled,
    straighten, unlike,
};
pub use edges::{Edge, Edges, about};
pub use epipolar_curve::{CurvePlace, EpipolarCurve};
pub use gradient::Gradient;
