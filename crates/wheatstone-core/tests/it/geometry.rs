//! Geometry whose answers are known.

mod homography;
mod pose;
mod projection;
mod triangulation;
