//! Faults of calibration data: what is wrong with correspondences, where, how it shows, and what to do
//! about it.
//!
//! Every camera is fitted to the views on which most agree; what the other views say of each view's
//! points in each camera is the measure. Where points miss it, each fault says how well it would
//! explain that; the simplest that brings them down to the level of sound views is named. A miss that
//! no fault explains is left alone: gross errors, a stage's errors, lenses.
//!
//! To add a fault: write `clinic/<name>.rs` with a type that implements `Fault`, then add its `mod`
//! line and its row in `FAULTS`.

mod board;
mod board_order;
mod camera_moved;
mod cameras_swapped;
mod chart_size;
mod duplicates;
mod evidence;
mod finding;
mod handedness;
mod pixel_offset;
mod pixel_units;
mod points_permuted;
mod robust_camera;
mod spread;
mod unseeable;
mod unsynchronised;
mod whole_board;

pub use finding::{Change, Examination, Finding, Severity, repair_all};
pub use unseeable::{Layout, Statement, compare_baseline};

use crate::dataset::Dataset;
use evidence::Evidence;
use finding::{Proposal, settle};

/// One kind of fault, or a family of close ones.
trait Fault: Sync {
    /// What this fault would explain.
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal>;
}

/// Every fault that the clinic knows, by the name of its file.
const FAULTS: &[(&str, &dyn Fault)] = &[
    ("cameras_swapped", &cameras_swapped::CamerasSwapped),
    ("unsynchronised", &unsynchronised::Unsynchronised),
    ("board_order", &board_order::BoardOrder),
    ("pixel_units", &pixel_units::PixelUnits),
    ("pixel_offset", &pixel_offset::PixelOffset),
    ("chart_size", &chart_size::ChartSize),
    ("points_permuted", &points_permuted::PointsPermuted),
    ("camera_moved", &camera_moved::CameraMoved),
    ("handedness", &handedness::Handedness),
    ("duplicates", &duplicates::Duplicates),
    ("spread", &spread::Spread),
];

/// The names of all families of faults.
#[must_use]
pub fn families() -> Vec<&'static str> {
    FAULTS.iter().map(|(name, _)| *name).collect()
}

/// Looks for faults. Never fails: data of which nothing can be said give no findings but the
/// statements of what cannot be seen.
#[must_use]
pub fn examine(data: &Dataset) -> Examination {
    let evidence = Evidence::new(data);
    let mut proposals = Vec::new();
    for (_, fault) in FAULTS {
        proposals.extend(fault.propose(&evidence));
    }
    Examination {
        findings: settle(&evidence, proposals),
        cannot_be_seen: unseeable::statements(&evidence),
        layout: unseeable::layout(&evidence),
    }
}

#[doc(hidden)]
#[must_use]
pub fn debug_table(data: &Dataset) -> String {
    let e = Evidence::new(data);
    let mut t = String::new();
    for (c, s) in e.seen.iter().enumerate() {
        if let Some(s) = s {
            t += &format!(
                "camera {} typical {:.3} good {:.3} mirrored {} principal {:?} f {:?} stray {:.3}\n",
                c + 1,
                s.typical,
                s.good(),
                s.camera.is_mirrored(),
                s.camera.principal(),
                s.camera.focal(),
                e.stray(c)
            );
        }
    }
    for (v, cells) in e.cells.iter().enumerate() {
        t += &e.views[v].name;
        for c in cells {
            t += &format!(
                "  {:8.3}{} ({:.2},{:.2}) n{}",
                c.error,
                if c.suspicious { "*" } else { " " },
                c.offset.x,
                c.offset.y,
                c.pairs.len()
            );
        }
        t += &format!(" {:?}\n", e.views[v].board.as_ref().map(|b| b.counts));
    }
    t
}
