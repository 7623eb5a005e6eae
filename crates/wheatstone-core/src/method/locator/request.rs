//! What a locator makes on demand.

use super::{covariance_table, undistortion_tiles};

/// What may be made on demand: a patch of the base's or the epipolar_check's camera, or a box of covariances; each by
/// its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Request {
    Base(usize, u32),
    EpipolarCheck(usize, u32),
    Covariance(u32),
}

impl Request {
    /// As many points must ask for it as it takes to make it.
    pub(super) fn pays(self, points: u32) -> bool {
        points as usize
            >= if matches!(self, Self::Covariance(_)) {
                covariance_table::NODES
            } else {
                undistortion_tiles::NODES
            }
    }
}

/// What was made on demand.
pub(super) enum Built {
    Tile(undistortion_tiles::BuiltTile),
    Covariance(covariance_table::BuiltCell),
}
