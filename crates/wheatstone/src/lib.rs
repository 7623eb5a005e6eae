//! Metric 3-D from matched pixels of any two or more cameras.
//!
//! The modules stand in the order in which data flows through them; a module may use only those
//! above it.

pub mod error;
pub mod progress;
pub mod storage;
pub mod numeric;
pub mod geometry;
pub mod imaging;
mod html;
mod registry;
pub mod chart;
pub mod camera;
pub mod dataset;
pub mod method;
pub mod cleaning;
pub mod evaluate;
pub mod clinic;
pub mod preparation;
pub mod calibration;
pub mod rectification;
pub mod exchange;
pub mod synthetic;
pub mod robot;
pub mod reproduction;
pub mod report;

pub use calibration::Calibration;
pub use error::{Error, Result};

/// The README's example is compiled as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
