//! The report on the 2001 paper done again.

use super::{
    Reproduction, Verdict,
    results::{BeyondCurve, LearningPoint},
    verdicts::PAPER_PERCENT,
};
use crate::{
    Report,
    sections::{self, ClaimFigures, Curve, CurveFigure, Level},
    text::figure,
};

impl Report {
    /// The 2001 paper's figures and claims.
    #[must_use]
    pub fn of_reproduction(all: &Reproduction, title: &str, command: Option<String>) -> Self {
        let claim = |claim: &super::Claim| ClaimFigures {
            claim: claim.claim.clone(),
            measured: claim.measured.clone(),
            verdict: claim.verdict.words().into(),
            why: claim.why.clone(),
        };
        Self {
            command,
            setup: Some(all.setup.clone()),
            learning: Some(figure_5(&all.figure_5)),
            beyond: Some(figure_6(&all.figure_6)),
            claims: all.claims.iter().map(claim).collect(),
            verdict: verdict(all),
            ..Self::empty(title, "cm")
        }
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
            curve("median", |p| p.exam_percent.median),
            curve("worst seed", |p| p.exam_percent.greatest),
            curve("best seed", |p| p.exam_percent.least),
            curve("fitted pairs", |p| p.training_percent.median),
        ],
        levels: vec![Level { at: PAPER_PERCENT, name: format!("{PAPER_PERCENT} % (paper)") }],
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
        levels: Vec::new(),
    }
}

/// What the claims of the paper come to.
fn verdict(all: &Reproduction) -> sections::Verdict {
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
    let count = |verdict: Verdict| all.claims.iter().filter(|it| it.verdict == verdict).count();
    let (holding, untested) = (count(Verdict::Confirmed), count(Verdict::NotTested));
    let tested = all.claims.len() - untested;
    let rest = match untested {
        0 => String::new(),
        _ => format!(" Not tested: {untested}."),
    };
    sections::Verdict {
        grade: if holding == all.claims.len() { "confirmed" } else { "mixed" }.into(),
        sentence: format!("{holding} of {tested} tested claims of the 2001 paper hold here.{rest}"),
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
