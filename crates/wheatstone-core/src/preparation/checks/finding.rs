//! What the clinic says, and how it chooses among explanations.

use super::evidence::Evidence;
use crate::geometry::{Pixel, Point3};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::cmp::Ordering;

/// How bad a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Severity {
    /// Good to know.
    Information,
    /// The result may be worse than it could be, or mean something else than meant.
    Warning,
    /// A fit to these data is wrong.
    Fatal,
}

impl Severity {
    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Information => "information",
            Self::Warning => "warning",
            Self::Fatal => "fatal",
        }
    }
}

/// One change of a dataset. Indices are those of its correspondences before any change.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// A camera's pixel of a row.
    Pixel {
        /// The row.
        row: usize,
        /// The camera.
        camera: usize,
        /// Its pixel; `None` for not seen.
        to: Option<Pixel>,
    },
    /// A row's place in the world.
    World {
        /// The row.
        row: usize,
        /// Its place.
        to: Point3,
    },
    /// A row's place on its chart.
    Board {
        /// The row.
        row: usize,
        /// Its place.
        to: [f64; 2],
    },
    /// Removes a row.
    Drop {
        /// The row.
        row: usize,
    },
}

impl Change {
    /// The row that is changed.
    #[must_use]
    pub fn row(&self) -> usize {
        match self {
            Self::Pixel { row, .. }
            | Self::World { row, .. }
            | Self::Board { row, .. }
            | Self::Drop { row } => *row,
        }
    }

    /// The same change of data of which row `rows[i]` is row `i` here; `None` for a row beyond them.
    pub(in crate::preparation) fn in_rows(&self, rows: &[usize]) -> Option<Self> {
        let mut moved = self.clone();
        match &mut moved {
            Self::Pixel { row, .. }
            | Self::World { row, .. }
            | Self::Board { row, .. }
            | Self::Drop { row } => *row = *rows.get(*row)?,
        }
        Some(moved)
    }
}

/// A fault found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Its name, in kebab case.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The views that have it; none for all of them.
    pub views: Vec<String>,
    /// The cameras that have it, counted from 0; none for all of them.
    pub cameras: Vec<usize>,
    /// One sentence: what is wrong and where.
    pub explanation: String,
    /// Figures that say so: a name with its unit, and the value.
    pub figures: Vec<(String, f64)>,
    /// What to do about it.
    pub hint: String,
    /// What puts it right, where that is certain; nothing otherwise.
    pub changes: Vec<Change>,
    /// Whether what the changes take away was measured in these pixels, with their errors, and is none of the few values
    /// that people mix up.
    pub is_estimate: bool,
    /// Whether it is in the fitted model, whose errors or error bars it makes larger than they are told: nothing sets it
    /// aside or puts it right.
    pub stays_in_fit: bool,
}

impl Finding {
    /// One of all views and cameras, with no figures and no changes.
    pub(super) fn of_all(
        code: &'static str,
        severity: Severity,
        explanation: String,
        hint: impl Into<String>,
    ) -> Self {
        Self {
            code,
            severity,
            views: Vec::new(),
            cameras: Vec::new(),
            explanation,
            figures: Vec::new(),
            hint: hint.into(),
            changes: Vec::new(),
            is_estimate: false,
            stays_in_fit: false,
        }
    }

    /// Whether [`repair_all`](super::repair_all) puts it right.
    #[must_use]
    pub fn is_fixable(&self) -> bool {
        !self.changes.is_empty()
    }
}

/// Something that cannot be seen in the data, and what would tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statement {
    /// What cannot be seen.
    pub what: String,
    /// What would tell.
    pub check: String,
}

/// Where a camera stands by these data, seen from the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Layout {
    /// The camera, counted from 0.
    pub camera: usize,
    /// Distance of its centre from the first camera's, in the data's unit; infinite where one of the two
    /// is as good as at infinity.
    pub baseline: f64,
    /// In words, as the first camera's picture has it.
    pub words: String,
}

/// All that an examination says.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Examination {
    /// The faults, the worst first.
    pub findings: Vec<Finding>,
    /// What nobody could see in these data, with what would tell.
    pub cannot_be_seen: Vec<Statement>,
    /// Where the cameras stand by these data, to be compared with the rig; none where unknown.
    pub layout: Vec<Layout>,
}

impl Examination {
    /// The worst severity; `None` for no findings.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.findings.iter().map(|finding| finding.severity).max()
    }

    /// All that it says, with cameras counted from `first`: 0 for programs, 1 for people.
    #[must_use]
    pub fn to_json(&self, first: usize) -> Value {
        let finding = |finding: &Finding| {
            let figures = finding.figures.iter().map(|(name, value)| (name.clone(), json!(value)));
            json!({
                "code": finding.code,
                "severity": finding.severity,
                "views": finding.views,
                "cameras": finding.cameras.iter().map(|camera| first + camera).collect::<Vec<_>>(),
                "explanation": finding.explanation,
                "hint": finding.hint,
                "fixable": finding.is_fixable(),
                "estimate": finding.is_estimate,
                "figures": figures.collect::<Map<_, _>>(),
            })
        };
        let place = |Layout { camera, baseline, words }: &Layout| json!({ "camera": first + camera, "baseline": baseline, "words": words });
        json!({
            "findings": self.findings.iter().map(finding).collect::<Vec<_>>(),
            "cannot_be_seen": self.cannot_be_seen,
            "layout": self.layout.iter().map(place).collect::<Vec<_>>(),
        })
    }
}

/// How many numbers an explanation may choose: the fewer the more certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Freedom {
    /// Does not explain cells, but stands for itself.
    Itself,
    /// None but which of a few.
    Choice,
    /// A scale, an offset.
    Scale,
    /// Any permutation of the points.
    Order,
    /// A place and attitude.
    Pose,
    /// Something of its own for each camera, where all cameras of the view err.
    Each,
}

/// What a fault would explain.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    pub(super) freedom: Freedom,
    /// Error left, over the good level: at most 1.
    pub(super) left: f64,
    /// The cells that it explains, by view and camera.
    pub(super) cells: Vec<(usize, usize)>,
    /// Cells that need no other explanation beside it.
    pub(super) also: Vec<(usize, usize)>,
    /// Findings of one code are one where this is equal too.
    pub(super) key: String,
    pub(super) code: &'static str,
    pub(super) severity: Severity,
    /// What is wrong, without where.
    pub(super) what: String,
    pub(super) hint: String,
    pub(super) figures: Vec<(String, f64)>,
    pub(super) changes: Vec<Change>,
    pub(super) is_estimate: bool,
    pub(super) stays_in_fit: bool,
}

impl Proposal {
    /// The one with less freedom, then the one that leaves less.
    pub(super) fn simpler_first(&self, other: &Self) -> Ordering {
        self.freedom.cmp(&other.freedom).then(self.left.total_cmp(&other.left))
    }

    /// One that stands for itself, of these cameras (none for all).
    pub(super) fn itself(code: &'static str, severity: Severity, what: String, hint: &str) -> Self {
        Self {
            freedom: Freedom::Itself,
            left: 0.0,
            cells: Vec::new(),
            also: Vec::new(),
            key: String::new(),
            code,
            severity,
            what,
            hint: hint.into(),
            figures: Vec::new(),
            changes: Vec::new(),
            is_estimate: false,
            stays_in_fit: false,
        }
    }
}

/// Accepts proposals, the simplest first, each cell once; merges those that say the same of several
/// views; the worst first.
pub(super) fn resolve(evidence: &Evidence, mut proposals: Vec<Proposal>) -> Vec<Finding> {
    proposals.sort_by(Proposal::simpler_first);
    let mut claimed: Vec<(usize, usize)> = Vec::new();
    let mut accepted: Vec<Proposal> = Vec::new();
    for proposal in proposals {
        let mut own = proposal.cells.iter().chain(&proposal.also);
        let taken = own.any(|cell| claimed.contains(cell));
        if taken && proposal.freedom != Freedom::Itself {
            continue;
        }
        if proposal.freedom != Freedom::Itself {
            claimed.extend(&proposal.cells);
        }
        claimed.extend(&proposal.also);
        let cameras = cameras_of(&proposal);
        let same = accepted.iter_mut().find(|other| {
            other.code == proposal.code && other.key == proposal.key && cameras_of(other) == cameras
        });
        match same {
            Some(other) if !proposal.cells.is_empty() => {
                other.cells.extend(proposal.cells);
                other.changes.extend(proposal.changes);
                other.is_estimate |= proposal.is_estimate;
            }
            _ => accepted.push(proposal),
        }
    }
    let mut findings: Vec<Finding> =
        accepted.into_iter().map(|proposal| as_finding(evidence, proposal)).collect();
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}

fn cameras_of(proposal: &Proposal) -> Vec<usize> {
    let mut cameras: Vec<usize> = proposal.cells.iter().map(|(_, camera)| *camera).collect();
    cameras.sort_unstable();
    cameras.dedup();
    cameras
}

fn as_finding(evidence: &Evidence, proposal: Proposal) -> Finding {
    let cameras = cameras_of(&proposal);
    let mut views: Vec<usize> = proposal.cells.iter().map(|(view, _)| *view).collect();
    views.sort_unstable();
    views.dedup();
    let all = views.len() == evidence.views.len();
    let names: Vec<String> = views.iter().map(|view| evidence.views[*view].name.clone()).collect();
    let place = place_in_words(&names, &cameras, all);
    let explanation =
        if place.is_empty() { proposal.what } else { format!("{place}: {}", proposal.what) };
    let mut figures = proposal.figures;
    if proposal.freedom != Freedom::Itself && proposal.also.is_empty() {
        figures.extend(before_and_after(evidence, &proposal.cells, proposal.left));
    }
    Finding {
        code: proposal.code,
        severity: proposal.severity,
        views: names,
        cameras,
        explanation,
        figures,
        hint: proposal.hint,
        changes: proposal.changes,
        is_estimate: proposal.is_estimate,
        stays_in_fit: proposal.stays_in_fit,
    }
}

/// The worst cell's error, and what is left of it.
pub(super) fn before_and_after(
    evidence: &Evidence,
    cells: &[(usize, usize)],
    left: f64,
) -> Vec<(String, f64)> {
    let error = |cell: &(usize, usize)| evidence.cells[cell.0][cell.1].error;
    let worst = cells.iter().max_by(|a, b| error(a).total_cmp(&error(b)));
    let Some(worst) = worst else { return Vec::new() };
    let good = evidence.seen[worst.1]
        .as_ref()
        .map_or(f64::NAN, super::camera_evidence::CameraEvidence::good);
    vec![
        ("median error before, px".into(), error(worst)),
        ("median error with this explanation, px".into(), left * good),
    ]
}

fn place_in_words(views: &[String], cameras: &[usize], all: bool) -> String {
    let cameras: Vec<String> = cameras.iter().map(|camera| (camera + 1).to_string()).collect();
    let camera = match cameras.as_slice() {
        [] => String::new(),
        [one] => format!("camera {one}"),
        many => format!("cameras {}", many.join(", ")),
    };
    let view = match views {
        [] => String::new(),
        _ if all => "all views".into(),
        [one] => format!("view `{one}`"),
        many => format!("views `{}`", many.join("`, `")),
    };
    [camera, view].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}
