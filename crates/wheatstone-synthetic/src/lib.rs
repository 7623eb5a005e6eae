//! Cameras, charts and scenes whose truth is known: for tests, examples and the demonstration, and
//! for users who want to know what their rig could do.

mod correspondences;
mod exposure;
pub mod fault_survey;
pub mod faults;
mod hand_held;
mod noise;
mod outliers;
pub mod random_capture;
mod render;
mod rig;
mod scene;
mod stage_error;
mod truth;
mod write;

pub use correspondences::{
    Placement, chart_correspondences, misplaced_correspondences, random_correspondences,
};
pub use exposure::{Light, Sensor, exposed};
pub use hand_held::{HandHeld, hand_held_correspondences};
pub use noise::Noise;
pub use outliers::{GrossError, Region, with_gross_errors};
pub use render::render;
pub use rig::Rig;
pub use scene::Scene;
pub use stage_error::StageError;
pub use truth::Truth;
pub use write::{Stage, write_capture, write_points, write_scene};
