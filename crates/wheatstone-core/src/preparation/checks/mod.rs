//! Faults of calibration data: what is wrong with correspondences, where, how it shows, and what to do
//! about it.
//!
//! Every camera is fitted to the views on which most agree; what the other views say of each view's
//! points in each camera is the measure. Where points miss it, each fault says how well it would
//! explain that; the simplest that brings them down to the level of sound views is named. A miss that
//! no fault explains is left alone: gross errors, a stage's errors, lenses.
//!
//! To add a fault: write `checks/<name>.rs` with a type that implements `Fault`, then add its `mod`
//! line and its row in `FAULTS`.

mod board;
mod board_order;
mod camera_drifted;
mod camera_evidence;
mod camera_moved;
mod cameras_swapped;
mod chart_size;
mod column_units;
mod consensus;
mod coverage;
mod decentred_camera;
mod duplicates;
mod estimated_poses;
mod evidence;
mod expected;
mod extrapolation;
mod field;
mod finding;
mod frame;
mod gross_errors;
mod handedness;
mod of_fit;
mod other_pose;
mod pairs;
mod parting;
mod pixel_offset;
mod pixel_units;
mod points_permuted;
mod projection_sigma;
mod relative_motion;
mod repair;
mod resection;
mod robust_camera;
mod stretch;
mod sums;
mod unexplained;
mod unit_ratios;
mod units_mixed;
mod unseeable;
mod unsynchronised;
mod unusable;
mod views;
mod whole_board;

pub use expected::{ExpectedDistance, compare_distance};
pub use finding::{Change, Examination, Finding, Layout, Severity, Statement};
pub(crate) use of_fit::of_fit;
pub(super) use relative_motion::name_motion;
pub(super) use repair::{blames_most, fits_worse, not_corrected};
pub use repair::{doubt, left_out, repair, repair_all};
pub use unseeable::compare_baseline;
pub(super) use unseeable::{
    few_views, omitted_pose_uncertainty, other_shape, undecided_poses, undetermined_poses,
};

use crate::dataset::Dataset;
use evidence::Evidence;
use finding::{Proposal, resolve};

/// One kind of fault, or a family of close ones.
trait Fault: Sync {
    /// What this fault would explain.
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal>;

    /// What it would explain of one picture (by view and camera) whose view's other pictures are right. Nothing for faults
    /// that are not of single pictures.
    fn of_picture(&self, _evidence: &Evidence, _picture: (usize, usize)) -> Vec<Proposal> {
        Vec::new()
    }
}

/// Every fault that the clinic knows.
const FAULTS: &[&dyn Fault] = &[
    &cameras_swapped::CamerasSwapped,
    &unsynchronised::Unsynchronised,
    &board_order::BoardOrder,
    &pixel_units::PixelUnits,
    &pixel_offset::PixelOffset,
    &units_mixed::UnitsMixed,
    &chart_size::ChartSize,
    &points_permuted::PointsPermuted,
    &camera_drifted::CameraDrifted,
    &camera_moved::CameraMoved,
    &handedness::Handedness,
    &duplicates::Duplicates,
    &coverage::Coverage,
    &gross_errors::GrossErrors,
    &unexplained::Unexplained,
    &unusable::Unusable,
];

/// Looks for faults. Never fails: data of which nothing can be said give no findings but the
/// statements of what cannot be seen.
#[must_use]
pub fn examine(data: &Dataset) -> Examination {
    let evidence = Evidence::new(data);
    let mut proposals = Vec::new();
    // In a world that is stretched nothing else can be told.
    match column_units::units_throughout(&evidence) {
        Some(stretched) => proposals.push(stretched),
        None => {
            proposals.extend(FAULTS.iter().flat_map(|fault| fault.propose(&evidence)));
            estimated_poses::judge_by_other_pictures(&evidence, &mut proposals);
        }
    }
    Examination {
        findings: resolve(&evidence, proposals),
        cannot_be_seen: unseeable::statements(&evidence),
        layout: unseeable::layout(&evidence),
    }
}

/// The views of which some picture errs beyond what sound ones do, the worst first.
pub(super) fn worst_views(data: &Dataset) -> Vec<usize> {
    let evidence = Evidence::new(data);
    let excess = |view: usize| {
        let suspects = evidence.suspects(view).into_iter();
        suspects.map(|camera| evidence.excess((view, camera))).fold(0.0, f64::max)
    };
    let mut worst: Vec<(usize, f64)> = (0..evidence.views.len())
        .map(|view| (view, excess(view)))
        .filter(|(_, excess)| *excess > 0.0)
        .collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst.into_iter().map(|(view, _)| view).collect()
}
