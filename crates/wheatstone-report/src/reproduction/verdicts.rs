//! What the paper says, and whether it is so: each claim tested as the paper words it, by a criterion that is set
//! beforehand.

use super::{
    Change, Claim, FIGURE_6_EPOCHS, Reproduction, Verdict,
    results::{BeyondCurve, Condition, Growth, LearningPoint, Rival},
};

/// Epochs of the paper's training.
const PAPER_EPOCHS: u64 = 100_000;

/// The mean error that the paper reports, in percent.
pub(super) const PAPER_PERCENT: f64 = 4.33;

/// "Little" is less than this share.
const LITTLE: f64 = 0.25;

/// "Comparable" is less than so many times as large.
const COMPARABLE: f64 = 1.5;

/// An exponent is that of a claim if its interval lies nearer to it than to the whole numbers beside it.
const NEARER: f64 = 0.5;

/// What figure 6 calls the paper's network.
pub(super) const NETWORK: &str = "network of 2001";

/// What a test of a claim came to.
struct Test {
    measured: String,
    holds: bool,
    why: String,
}

/// A claim and its test; `missing` says what was not run, where something was not.
fn claim(claim: &str, missing: Option<String>, test: impl FnOnce() -> Option<Test>) -> Claim {
    let untested = |why: String| Claim {
        claim: claim.into(),
        measured: String::new(),
        verdict: Verdict::NotTested,
        why,
    };
    if let Some(missing) = missing {
        return untested(missing);
    }
    let Some(Test { measured, holds, why }) = test() else {
        return untested("What it compares was not measured.".into());
    };
    let verdict = if holds { Verdict::Confirmed } else { Verdict::NotConfirmed };
    Claim { claim: claim.into(), measured, verdict, why }
}

/// Each claim beside its figure.
pub(super) fn judge(all: &Reproduction) -> Vec<Claim> {
    let mut claims = figure_5(all);
    claims.extend(figure_6(all));
    claims.extend(architectures(all));
    claims.push(comparable(all));
    claims.extend(conditions(all));
    claims.push(accurate_enough(all));
    claims
}

impl Reproduction {
    /// That training was shorter than a claim speaks of, where it was.
    fn too_short(&self, epochs: u64) -> Option<String> {
        (self.epochs < epochs)
            .then(|| format!("Trained for {} epochs; the claim is of {epochs}.", self.epochs))
    }

    fn rival(&self, name: &str) -> Option<&Rival> {
        self.comparison.iter().find(|row| row.method == name)
    }

    fn beyond(&self, name: &str) -> Option<&BeyondCurve> {
        self.figure_6.iter().find(|curve| curve.method == name)
    }

    fn condition(&self, change: &Change) -> Option<&Condition> {
        self.conditions.iter().find(|condition| condition.change == *change)
    }

    fn learned(&self, epoch: u64) -> Option<&LearningPoint> {
        self.figure_5.iter().find(|point| point.epoch >= epoch)
    }
}

fn figure_5(all: &Reproduction) -> Vec<Claim> {
    let falls = || {
        let medians = all
            .figure_5
            .windows(2)
            .map(|pair| pair[1].training_percent.median / pair[0].training_percent.median);
        let most = medians.fold(0.0, f64::max);
        Some(Test {
            measured: format!("between two points of the curve it grows {most:.3} times at most"),
            holds: most <= 1.05,
            why: "Criterion: the median over the seeds never grows by more than a twentieth."
                .into(),
        })
    };
    let at = |epoch: u64, most: f64| {
        move || {
            let p = all.learned(epoch)?.exam_percent;
            Some(Test {
                measured: format!(
                    "{:.2} %, {:.2} to {:.2} over {} seeds",
                    p.median, p.least, p.greatest, all.seeds
                ),
                holds: p.median <= most,
                why: format!("Criterion: the median over the seeds is {most} % or less."),
            })
        }
    };
    vec![
        claim(
            "Figure 5: the mean error is 4.33 % after 100 000 epochs",
            all.too_short(PAPER_EPOCHS),
            at(PAPER_EPOCHS, PAPER_PERCENT),
        ),
        claim(
            "Figure 5: the mean error is below 5 % after 40 000 epochs",
            all.too_short(40_000),
            at(40_000, 5.0),
        ),
        claim("Figure 5: the error falls steadily", all.too_short(PAPER_EPOCHS), falls),
    ]
}

/// Whether an exponent is that of a claim.
fn is_of(growth: &Growth, claimed: f64) -> bool {
    growth.interval.iter().all(|end| (end - claimed).abs() < NEARER)
}

fn exponent(growth: &Growth) -> String {
    let [low, high] = growth.interval;
    format!("exponent {:.2} (95 %: {low:.2} to {high:.2})", growth.exponent)
}

fn better_beyond(all: &Reproduction) -> Option<Test> {
    let mean = |curve: &BeyondCurve| {
        curve.points.iter().map(|point| point.percent).sum::<f64>() / curve.points.len() as f64
    };
    let (own, other) = (mean(all.beyond(NETWORK)?), mean(all.beyond("interpolation")?));
    Some(Test {
        measured: format!("error of Z {own:.2} % against {other:.2} %"),
        holds: own < other,
        why: "Criterion: a smaller mean error of Z at 150 to 200 cm.".into(),
    })
}

fn figure_6(all: &Reproduction) -> Vec<Claim> {
    let linear = || {
        let growth = all.beyond(NETWORK)?.percent_growth;
        Some(Test {
            measured: format!("percent error over that at 140 cm: {}", exponent(&growth)),
            holds: is_of(&growth, 1.0),
            why: "Criterion: the exponent of a + b (Z - 140 cm)^p is 1, its interval within 0.5 to 1.5.".into(),
        })
    };
    let square = |names: &'static [&'static str], reason: &'static str| {
        move || {
            let curves = names.iter().map(|name| Some((name, all.beyond(name)?.error_growth)));
            let curves = curves.collect::<Option<Vec<_>>>()?;
            let each = curves.iter().map(|(name, growth)| format!("{name} {}", exponent(growth)));
            Some(Test {
                measured: format!("error in cm: {}", each.collect::<Vec<_>>().join("; ")),
                holds: curves.iter().all(|(_, growth)| is_of(growth, 2.0)),
                why: format!(
                    "Criterion: the exponent of b Z^p is 2, its interval within 1.5 to 2.5. {reason}"
                ),
            })
        }
    };
    vec![
        claim(
            "Figure 6: beyond the trained range the network's error in percent grows linearly with the distance",
            all.too_short(FIGURE_6_EPOCHS),
            linear,
        ),
        claim(
            "Figure 6: the error of triangulation grows as the square of the distance",
            None,
            square(
                &["dlt", "tsai", "brown"],
                "So rays through noisy pixels miss each other, whatever calibrated the cameras.",
            ),
        ),
        claim(
            "Figure 6: the error of interpolation grows as the square of the distance",
            None,
            square(
                &["interpolation"],
                "Interpolation errs by what lies beyond its points, not by the noise of pixels.",
            ),
        ),
        claim(
            "The network is better than interpolation beyond the trained range",
            all.too_short(FIGURE_6_EPOCHS),
            || better_beyond(all),
        ),
    ]
}

fn architectures(all: &Reproduction) -> Vec<Claim> {
    let ends = |values: &[f64]| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        (least, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    let nets = all.architectures.len();
    let error = || {
        let medians: Vec<f64> =
            all.architectures.iter().map(|net| net.exam_percent.median).collect();
        let (least, greatest) = ends(&medians);
        Some(Test {
            measured: format!("medians of {nets} networks: {least:.2} to {greatest:.2} %"),
            holds: greatest <= (1.0 + LITTLE) * least,
            why: "Criterion: \"little\" is a quarter at most from the best to the worst.".into(),
        })
    };
    let time = || {
        // A network that never gets there takes longer than all.
        let epochs = all.architectures.iter().map(|net| net.epochs_to_5_percent);
        let times: Vec<f64> = epochs.map(|it| it.map_or(f64::INFINITY, |it| it as f64)).collect();
        let (least, greatest) = ends(&times);
        let last = if greatest.is_finite() { greatest.to_string() } else { "never".into() };
        Some(Test {
            measured: format!("epochs to 5 %: {least} to {last}"),
            holds: greatest > (1.0 + LITTLE) * least,
            why: "Criterion: from the fastest to the slowest more than a quarter.".into(),
        })
    };
    vec![
        claim("Other architectures change the error little", all.too_short(PAPER_EPOCHS), error),
        claim("Other architectures change the time to converge", all.too_short(PAPER_EPOCHS), time),
    ]
}

fn comparable(all: &Reproduction) -> Claim {
    claim(
        "The accuracy is comparable with that of standard calibration",
        all.too_short(PAPER_EPOCHS),
        || {
            let network = all.learned(PAPER_EPOCHS)?.exam_percent.median;
            let (tsai, brown) = (all.rival("tsai")?, all.rival("brown")?);
            let best = tsai.inside_percent.min(brown.inside_percent);
            Some(Test {
                measured: format!(
                    "{network:.2} % against {:.2} (Tsai) and {:.2} (Brown)",
                    tsai.inside_percent, brown.inside_percent
                ),
                holds: network <= COMPARABLE * best,
                why: format!(
                    "Criterion: one and a half times the better of the two at most. The same layers, trained as they are today, reach {:.2} %.",
                    all.rival("network")?.inside_percent
                ),
            })
        },
    )
}

fn any_cameras(all: &Reproduction) -> Option<Test> {
    let named = all.conditions.iter().filter_map(|condition| match &condition.change {
        Change::Cameras(name) => Some((name, condition.exam_percent.median)),
        _ => None,
    });
    let named: Vec<(&String, f64)> = named.collect();
    let each: Vec<String> = named.iter().map(|(name, p)| format!("{name} {p:.2} %")).collect();
    let why =
        "Criterion: below 5 % with each of them, as in figure 5, without a change of any setting.";
    Some(Test {
        measured: each.join(", "),
        holds: !named.is_empty() && named.iter().all(|(_, percent)| *percent < 5.0),
        why: why.into(),
    })
}

fn conditions(all: &Reproduction) -> Vec<Claim> {
    let own = || all.condition(&Change::Nothing);
    let quantisation = || {
        let (whole, exact) =
            (own()?.exam_rms.median, all.condition(&Change::ExactPixels)?.exam_rms.median);
        let share = 1.0 - (exact / whole).powi(2);
        Some(Test {
            measured: format!(
                "{:.0} % of the mean square error: {whole:.2} cm rms, {exact:.2} with exact pixels",
                100.0 * share.max(0.0)
            ),
            holds: share >= 0.5,
            why: "Criterion: half of the mean square error or more goes where pixels are exact. What is left the training leaves.".into(),
        })
    };
    let origin = || {
        let (here, there) =
            (own()?.exam_rms.median, all.condition(&Change::Origin)?.exam_rms.median);
        Some(Test {
            measured: format!("{there:.2} cm rms, {here:.2} with the paper's origin"),
            holds: there <= (1.0 + LITTLE) * here,
            why: "Criterion: a quarter more at most with the world's frame metres away and turned."
                .into(),
        })
    };
    let scaling = || {
        let (with, without) =
            (own()?.exam_percent.median, all.condition(&Change::Unscaled)?.exam_percent.median);
        let found = if without.is_finite() { format!("{without:.1} %") } else { "diverged".into() };
        Some(Test {
            measured: format!("{found} without it, {with:.2} % with it"),
            holds: without >= 2.0 * with,
            why: "Criterion: twice the error or more without it. Sigmoids saturate on pixels as they are.".into(),
        })
    };
    let missing = || all.too_short(PAPER_EPOCHS);
    vec![
        claim(
            "Much of the error is due to pixels being read to whole ones",
            missing(),
            quantisation,
        ),
        claim("It works with any type of camera", missing(), || any_cameras(all)),
        claim("The world's origin is arbitrary", missing(), origin),
        claim(
            "Inputs and targets must be scaled to 0 … 1 for the training to succeed",
            missing(),
            scaling,
        ),
    ]
}

fn accurate_enough(all: &Reproduction) -> Claim {
    let missing = all.drives.is_none().then(|| "The robot did not drive.".to_owned());
    claim("The accuracy is enough for the robot to find its way", missing, || {
        let drives = all.drives?;
        Some(Test {
            measured: format!(
                "{} of {} simple worlds reached, {} collisions",
                drives.reached, drives.worlds, drives.collisions
            ),
            holds: 10 * drives.reached >= 9 * drives.worlds && drives.collisions == 0,
            why: "Criterion: nine of ten goals or more, and no collision, among few obstacles with three robot widths between them.".into(),
        })
    })
}
