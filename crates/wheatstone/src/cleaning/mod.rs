//! What is put right in correspondences before a method is fitted to them: gross outliers are set
//! aside, and charts are moved to where they really stood.

pub mod outliers;
pub mod poses;
pub mod stage;
