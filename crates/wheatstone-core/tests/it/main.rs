//! What the core does in worlds whose truth is known.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod dataset;
mod error;
mod geometry;
mod brown;
mod budget;
mod coverage;
mod fitted_cameras;
mod interpolation;
mod lenses;
mod locator;
mod hand_held_motion;
mod mismatch;
mod network;
mod neural_camera;
mod outliers;
mod soloff;
mod volume;
mod settled_locator;
mod staged;
mod worlds;
