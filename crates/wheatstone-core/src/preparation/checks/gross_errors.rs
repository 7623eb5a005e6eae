//! Points here and there that are far from where their view's others are: a fit sets them aside, but many of them are a
//! fault of whatever matched or detected them.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Proposal, Severity},
};
use wheatstone_numeric::statistics::median;

pub(super) struct GrossErrors;

/// Of a camera's points, the share that is too large to be passed over: slips of detectors and matchers come to a tenth.
const MANY: f64 = 0.25;

impl Fault for GrossErrors {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        (0..evidence.data.cameras).filter_map(|camera| of_camera(evidence, camera)).collect()
    }
}

fn of_camera(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    // Detectors err by no more than this, whatever the lens.
    let most = 8.0 * seen.typical + 1.0;
    let (mut count, mut far) = (0, Vec::new());
    for view in 0..evidence.views.len() {
        let Some((cell, _, other)) = evidence.at(view, camera) else { continue };
        // A view that is off as a whole has a fault of its own.
        if cell.suspicious {
            continue;
        }
        count += cell.pairs.len();
        far.extend(cell.pairs.iter().map(|pair| other.error(pair).norm()).filter(|e| *e > most));
    }
    let share = far.len() as f64 / count.max(1) as f64;
    (share >= MANY && far.len() > 5).then(|| Proposal {
        figures: vec![
            ("share of the points".into(), share),
            ("how far off, median, px".into(), median(&far)),
        ],
        ..Proposal::itself(
            "gross-errors",
            Severity::Warning,
            format!(
                "camera {}: {} of {count} points are more than {most:.1} px from where the others of their view put them",
                camera + 1,
                far.len()
            ),
            "a fit sets them aside; look at what matched or detected them, which may err by less as often",
        )
    })
}
