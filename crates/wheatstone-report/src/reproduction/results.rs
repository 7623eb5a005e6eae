//! The 2001 paper done again, as plain data, and the report on it.

use crate::{
    Report,
    sections::{self, ClaimFigures, Curve, CurveFigure},
    text::figure,
};
use serde::Serialize;

/// Least, middle and greatest value over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeedRange {
    /// Least.
    pub least: f64,
    /// Middle.
    pub median: f64,
    /// Greatest.
    pub greatest: f64,
}

/// Figure 5: mean error in percent of the distance, against epochs.
#[derive(Clone, Debug, Serialize)]
pub struct LearningPoint {
    /// Epochs done.
    pub epoch: u64,
    /// On the pairs that are learned.
    pub training_percent: SeedRange,
    /// On points elsewhere in the same range.
    pub exam_percent: SeedRange,
}

/// Figure 6: mean error of Z in percent of Z, beyond the trained range, for one way of locating.
#[derive(Clone, Debug, Serialize)]
pub struct BeyondCurve {
    /// The method.
    pub method: String,
    /// Distances and errors.
    pub points: Vec<BeyondPoint>,
    /// Residual of the best straight line, in percent.
    pub linear_residual: f64,
    /// Residual of the best parabola without linear term, in percent.
    pub quadratic_residual: f64,
}

/// One distance of figure 6.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BeyondPoint {
    /// Z, in centimetres.
    pub distance: f64,
    /// Mean of |error of Z| / Z, in percent.
    pub percent: f64,
}

/// One network of the study of architectures.
#[derive(Clone, Debug, Serialize)]
pub struct Architecture {
    /// Units in each hidden layer.
    pub hidden: Vec<usize>,
    /// Mean error in percent on points elsewhere in range, at the end.
    pub exam_percent: SeedRange,
    /// Epochs until it is below 5 %; none where it never is, for half of the seeds or more.
    pub epochs_to_5_percent: Option<u64>,
}

/// One row of the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Rival {
    /// The method.
    pub method: String,
    /// Mean error in percent, in the trained range.
    pub inside_percent: f64,
    /// The same at 150 to 200 cm.
    pub beyond_percent: f64,
    /// Root mean square error over the floor, in the trained range.
    pub inside_ratio_to_floor: f64,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduction {
    /// Pairs that are learned.
    pub pairs: usize,
    /// Figure 5.
    pub figure_5: Vec<LearningPoint>,
    /// Figure 6.
    pub figure_6: Vec<BeyondCurve>,
    /// The study of architectures.
    pub architectures: Vec<Architecture>,
    /// The comparison.
    pub comparison: Vec<Rival>,
    /// What the paper says, and what is measured.
    pub claims: Vec<Claim>,
}

/// Whether a claim holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It does.
    Confirmed,
    /// It does not.
    NotConfirmed,
}

/// One claim of the paper.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub claim: String,
    /// What was measured.
    pub measured: String,
    /// Whether the two agree.
    pub verdict: Verdict,
}

impl Report {
    /// The 2001 paper's figures and claims.
    #[must_use]
    pub fn of_reproduction(all: &Reproduction, title: &str, command: Option<String>) -> Self {
        let claims: Vec<ClaimFigures> = all
            .claims
            .iter()
            .map(|claim| ClaimFigures {
                claim: claim.claim.clone(),
                measured: claim.measured.clone(),
                holds: claim.verdict == Verdict::Confirmed,
            })
            .collect();
        let mut report = Self {
            command,
            learning: Some(figure_5(&all.figure_5)),
            beyond: Some(figure_6(&all.figure_6)),
            claims,
            ..Self::empty(title, "cm")
        };
        report.verdict = of_claims(&report.claims, all);
        report
    }
}

fn figure_5(points: &[LearningPoint]) -> CurveFigure {
    let curve = |name: &str, pick: fn(&LearningPoint) -> f64| Curve {
        name: name.into(),
        points: points.iter().map(|point| [point.epoch as f64, pick(point)]).collect(),
    };
    CurveFigure {
        across: "epochs".into(),
        up: "mean error, % of the distance".into(),
        curves: vec![
            curve("new points, median", |p| p.exam_percent.median),
            curve("new points, worst seed", |p| p.exam_percent.greatest),
            curve("new points, best seed", |p| p.exam_percent.least),
            curve("fitted points, median", |p| p.training_percent.median),
        ],
    }
}

fn figure_6(curves: &[BeyondCurve]) -> CurveFigure {
    let curve = |curve: &BeyondCurve| Curve {
        name: curve.method.clone(),
        points: curve.points.iter().map(|point| [point.distance, point.percent]).collect(),
    };
    CurveFigure {
        across: "Z, cm".into(),
        up: "mean error of Z, %".into(),
        curves: curves.iter().map(curve).collect(),
    }
}

/// What the claims of the paper come to.
fn of_claims(claims: &[ClaimFigures], all: &Reproduction) -> sections::Verdict {
    let rivals: Vec<String> = all
        .comparison
        .iter()
        .map(|row| format!("{}: {} %", row.method, figure(row.inside_percent)))
        .collect();
    let nets: Vec<String> = all
        .architectures
        .iter()
        .map(|net| {
            let hidden: Vec<String> = net.hidden.iter().map(usize::to_string).collect();
            format!("{}: {} %", hidden.join("-"), figure(net.exam_percent.median))
        })
        .collect();
    let holding = claims.iter().filter(|claim| claim.holds).count();
    sections::Verdict {
        grade: if holding == claims.len() { "confirmed" } else { "mixed" }.into(),
        sentence: format!("{holding} of {} claims of the 2001 paper hold here.", claims.len()),
        reasons: vec![
            format!(
                "Fitted to {} pairs at whole pixels, as in the paper; errors are those at held-out points in the same range, in percent of the distance.",
                all.pairs
            ),
            format!("Methods, mean error: {}.", rivals.join(", ")),
            format!("Networks by their hidden units, median over the seeds: {}.", nets.join(", ")),
        ],
        advice: Vec::new(),
    }
}
