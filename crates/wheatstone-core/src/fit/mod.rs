//! Fits that find chart poses together with the cameras: bundle adjustment of boards in the hand, and
//! charts on a stage that stood elsewhere than said.

pub mod bundle;
pub mod stage;
