//! What the library does as a whole: its shape, the contracts of its extension points, synthetic
//! worlds with known answers, and real data.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod architecture;
mod bodies;
mod camera_motion;
mod chart_shapes;
mod charuco;
mod clinic;
mod contract;
mod data;
mod dot_grids;
mod drifting_cameras;
mod error_bars;
mod given_noise;
mod hand_held;
mod hand_held_faults;
mod hand_held_error_bars;
mod known_lenses;
mod methods;
mod mirrored_charts;
mod moving;
mod one_figure;
mod one_camera;
mod paper;
mod partly_seen;
mod pipeline;
mod real_charts;
mod real_points;
mod rectification;
mod relative_poses;
#[cfg(feature = "robot")]
mod robot;
mod settled_locator;
mod sound_captures;
mod stage;
mod formats;
mod waved_again;
mod what_a_fit_shows;
mod wrong_places;
