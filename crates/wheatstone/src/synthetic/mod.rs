//! Cameras, charts and scenes whose truth is known: for tests, examples and the demonstration, and
//! for users who want to know what their rig could do.

mod correspondences;
pub mod fault_survey;
pub mod faults;
mod noise;
pub mod random_capture;
mod render;
mod rig;
mod truth;
mod write;

pub use correspondences::{chart_correspondences, random_correspondences};
pub use noise::Noise;
pub use render::{Sensor, render};
pub use rig::Rig;
pub use truth::Truth;
pub use write::{Stage, write_capture, write_points};
