//! Metric 3-D from matched pixels of any two or more cameras.

pub use wheatstone_core::{
    Calibration, Error, Result, calibration, camera, dataset, error, evaluate, fit, geometry,
    method, preparation, rectification, storage,
};
pub use wheatstone_numeric::{self as numeric, progress};

#[cfg(feature = "charts")]
pub use wheatstone_charts::{capture, chart, detection, imaging};
#[cfg(feature = "io")]
pub use wheatstone_io::{formats, rectification as rectified_pictures, tables};
#[cfg(feature = "report")]
pub use wheatstone_report as report;
#[cfg(feature = "robot")]
pub use wheatstone_robot as robot;
#[cfg(feature = "synthetic")]
pub use wheatstone_synthetic as synthetic;

/// The README's example is compiled as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
