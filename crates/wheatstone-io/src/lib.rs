//! What goes to disk and comes from it: tables of points, and calibrations of other programs.

pub mod tables;
pub mod formats;
