//! Calibration charts: where their points are, how to print them and how to find them in pictures; and
//! captures, the folders of pictures that users record.
//!
//! The modules stand in the order in which data flows through them; a module may use only those
//! above it.

pub mod imaging;
pub mod rectified_pictures;
pub mod chart;
pub mod capture;
pub mod detection;
