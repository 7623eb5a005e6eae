//! What goes to disk and comes from it: tables of points, calibrations of other programs, and rectified
//! pictures.

pub mod tables;
pub mod formats;
pub mod rectification;
