//! Metric 3-D points from matched pixels of two or more cameras.
//!
//! What goes in: a [`Dataset`] of correspondences, each a world point with its pixel in every camera
//! that saw it, from a table or from pictures of a chart. What is fitted: a [`Calibration`], which maps
//! matched pixels to points and holds its data, its settings and its error on views that were left out
//! of the fit. What comes out: for each set of matched pixels a point in world coordinates, its
//! covariance, its reprojection error, and whether it lies where the fit had data.
//!
//! # Fit and locate
//!
//! ```
//! # #[cfg(feature = "synthetic")] {
//! use wheatstone::synthetic::{Noise, Rig, Stage};
//! use wheatstone::{AnyMethod, Calibration, LineGrid, Prepared, Silent};
//!
//! // Seven chart placements before two synthetic cameras; lengths in centimetres.
//! let rig = Rig::named("paper", 2)?;
//! let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
//! let views = Stage::default().views()?;
//! let data = wheatstone::synthetic::chart_correspondences(
//!     &rig, &chart, &views, (Noise::Normal(0.1), 0), None,
//! );
//!
//! let method = AnyMethod::named("brown")?;
//! let model = Calibration::fit(&method, &Prepared::as_given(data.clone()), 0, false, &Silent)?;
//! let located = model.locate(&data.correspondences[0].pixels).ok_or("not seen")?;
//! let sigma_z = located.covariance[(2, 2)].sqrt();
//! println!("Z = {:.2} +- {sigma_z:.2} {}", located.point.z, model.unit);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Many points, as plain columns
//!
//! ```no_run
//! use wheatstone::{Calibration, Silent};
//!
//! let model = Calibration::load("model.json".as_ref())?;
//! let mut locator = model.locator();
//! // x and y of camera 1, x and y of camera 2; NaN where a camera did not see the point.
//! let (x1, y1, x2, y2) = ([301.5], [220.25], [284.0], [f64::NAN]);
//! let batch = locator.locate_columns(&[&x1, &y1, &x2, &y2], &Silent)?;
//! assert!(batch.get(0).is_none());
//! # Ok::<(), wheatstone::Error>(())
//! ```
//!
//! # Features
//!
//! | feature | on by default | what it adds |
//! |---|---|---|
//! | `charts` | yes | pictures, calibration charts and their detection |
//! | `io` | yes | tables of points; calibrations of OpenCV, ROS, Kalibr, COLMAP and others |
//! | `synthetic` | yes | cameras and charts with known truth, for tests and examples |
//! | `report` | yes | the HTML report and its figures |
//! | `robot` | no | a robot that drives by its cameras |
//! | `stereo` | yes | dense matching of rectified pairs |
//! | `reconstruction` | yes | point clouds with error bars from pairs of pictures |
//! | `mcap` | no | logs of reconstructions for Foxglove and Rerun |
//!
//! Each feature down to `robot` contains those above it, in this order; `stereo` stands alone, and `reconstruction` contains
//! it and `charts`; `mcap` contains `reconstruction`.
//!
//! # Examples
//!
//! They stand in `examples/` of this crate, run without arguments (`cargo run --example fit_table`)
//! and need no files.
//!
//! | example | what it shows |
//! |---|---|
//! | `fit_table` | a table of points in, a model file out |
//! | `locate_batch` | many points as plain columns, with progress |
//! | `detect_chart` | chart points in a picture from memory |
//! | `calibrate_handheld_stereo` | two cameras and a chart held by hand |
//! | `judge_calibration` | faults of the data, leave-one-view-out errors, comparison of methods |
//! | `convert_to_opencv` | a model's cameras as OpenCV's YAML |
//! | `custom_method` | a method of one's own beside the built-in ones |
//! | `write_report` | the HTML report |
//!
//! # Conventions
//!
//! Pixel (0, 0) is the centre of the top-left pixel; x points right, y down. A camera frame has x right,
//! y down, z forward. A pose `a_from_b` maps coordinates of frame b to those of frame a. World lengths
//! are in the unit of the data, which models carry as text. Cameras count from 0 in code and from 1 in
//! messages. The same seed gives the same bits. Nothing is global but [`limits`]: progress and cancelling go
//! through the [`Progress`] that a call is given.
//!
//! # Stability
//!
//! What stands at the root of this crate follows semantic versioning, and so do `tables::read`,
//! `tables::write` and `tables::Duplicates`. The modules below the root hold all the rest: they are public, but their items may
//! change with any minor version.

mod face;

#[doc(inline)]
pub use face::*;

pub use nalgebra;
pub use wheatstone_core::{
    calibration, camera, dataset, error, evaluate, fit, geometry, limits, method, preparation,
    rectification, storage,
};
pub use wheatstone_numeric::{self as numeric, progress};

#[cfg(feature = "charts")]
pub use wheatstone_charts::{capture, chart, detection, imaging, rectified_pictures};
#[cfg(feature = "io")]
pub use wheatstone_io::{formats, tables};
#[cfg(feature = "reconstruction")]
pub use wheatstone_reconstruction as reconstruction;
#[cfg(feature = "report")]
pub use wheatstone_report as report;
#[cfg(feature = "robot")]
pub use wheatstone_robot as robot;
#[cfg(feature = "stereo")]
pub use wheatstone_stereo as stereo;
#[cfg(feature = "synthetic")]
pub use wheatstone_synthetic as synthetic;

/// The programs of the README and of the documentation's pages are compiled and run as tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
#[doc = include_str!("../../../docs/how-to/rust.md")]
#[doc = include_str!("../../../docs/robot.md")]
struct Pages;
