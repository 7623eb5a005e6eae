//! Metric 3-D from matched pixels of any two or more cameras: camera models, methods, what they are
//! fitted to, and how they are judged.
//!
//! The modules stand in the order in which data flows through them; a module may use only those
//! above it. Pictures, charts, tables and pages are in crates that build on this one.

pub mod unit;
pub mod limits;
pub mod error;
pub mod storage;
pub mod registry;
pub mod geometry;
pub mod camera;
pub mod dataset;
pub mod method;
pub mod fit;
pub mod preparation;
pub mod evaluate;
pub mod calibration;
pub mod rectification;

pub use calibration::Calibration;
pub use error::{Error, Result};
