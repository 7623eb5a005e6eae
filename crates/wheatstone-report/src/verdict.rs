//! What the figures come to, in words.

use super::{
    Report, Validation,
    material::Wording,
    sections::{Accuracy, BudgetShare, FindingFigures, Verdict, ViewFigures},
    text::{figure, percent, round},
};
use wheatstone_core::{
    dataset::split::{FoldKind, grouped},
    error::{Hint, Remedy},
    evaluate::Comparison,
    method::Choice,
};
use wheatstone_numeric::statistics::root_mean_square;

/// Up to so many times the floor, a fit is sound: `auto` asks for a second opinion above
/// the same figure.
pub(super) const SOUND: f64 = 1.25;

/// Above so many times, most of the error is not the pixels': three quarters of its square.
pub(super) const FAIR: f64 = 2.0;

/// The verdict on a model.
pub(super) fn of(report: &Report, choice: Option<&Choice>, wording: Wording) -> Verdict {
    let Some(accuracy) = &report.accuracy else {
        return Verdict {
            grade: "unproven".into(),
            sentence: "No point with known coordinates was located, so the error is unknown."
                .into(),
            reasons: choice.map(reason).into_iter().collect(),
            advice: vec!["Give points with known world coordinates.".into()],
        };
    };
    let ratio = match (report.judgement, held_out(report)) {
        (Validation::HeldOut, _) => accuracy.ratio(),
        (_, Some(rms)) if accuracy.rms > 0.0 => {
            accuracy.ratio().map(|ratio| ratio * rms / accuracy.rms)
        }
        _ => None,
    };
    Verdict {
        grade: with_error_bars(grade(ratio), report).into(),
        sentence: sentence(report, accuracy),
        reasons: reasons(report, accuracy, choice),
        advice: advice(report, accuracy, wording),
    }
}

/// The word for an error that is so many times the floor.
fn grade(ratio: Option<f64>) -> &'static str {
    match ratio {
        Some(ratio) if ratio <= SOUND => "sound",
        Some(ratio) if ratio <= FAIR => "fair",
        Some(_) => "doubtful",
        None => "unproven",
    }
}

/// Error ellipsoids of 70 % that hold less than this share of the points are too small: nobody should rely on
/// them. By chance alone a hundred points fall below it one time in ten, so that the grade falls by one only.
pub(super) const HONEST: f64 = 0.64;

/// What share of the points the 70 % ellipsoids hold, where there are enough points to tell.
fn share_at_70(report: &Report) -> Option<f64> {
    let bar = report.error_bars.iter().find(|bar| (bar.nominal - 0.7).abs() < 0.01)?;
    Some(bar.actual)
}

/// The grade of a model with its error bars: it is not sound where they do not hold, or may not.
fn with_error_bars(grade: &'static str, report: &Report) -> &'static str {
    let fails = share_at_70(report).is_some_and(|held| held < HONEST);
    let may_fail = left_faults(report).any(|found| found.severity == "warning");
    if grade == "sound" && (fails || may_fail) { "fair" } else { grade }
}

/// Faults that are left in the fit, and that no method mends.
fn left_faults(report: &Report) -> impl Iterator<Item = &FindingFigures> {
    report.findings.iter().filter(|found| found.stays_in_fit)
}

fn sentence(report: &Report, accuracy: &Accuracy) -> String {
    let unit = &report.unit;
    let mut text = format!(
        "Points are located to {} {unit} rms at {} {unit}",
        figure(accuracy.rms),
        round(accuracy.working_distance)
    );
    if let Some(floor) = accuracy.floor_rms.filter(|floor| *floor > 0.0) {
        text += &format!("; {} × the floor set by pixel noise", figure(accuracy.rms / floor));
    } else if let Some(predicted) = accuracy.predicted_rms.filter(|rms| *rms > 0.0) {
        text += &format!("; {} × what their error bars predict", figure(accuracy.rms / predicted));
    }
    if report.judgement == Validation::Fitted {
        text += ", on the fitted points themselves";
        if let Some(held_out) = held_out(report) {
            text += &format!("; the held-out error is {} {unit} rms", figure(held_out));
        }
    }
    text + "."
}

fn reason(choice: &Choice) -> String {
    format!("auto chose {}: {}.", choice.chosen, choice.reason)
}

/// Root mean square over the points of some views.
fn pooled<'a>(views: impl Iterator<Item = &'a ViewFigures>) -> Option<f64> {
    let all: Vec<f64> = views.filter_map(|v| Some(vec![v.rms?; v.located])).flatten().collect();
    (!all.is_empty()).then(|| root_mean_square(&all))
}

/// What views that were held out come to, where the errors of the points are those of the fit.
fn held_out(report: &Report) -> Option<f64> {
    let views = report.views.iter().filter(|view| view.kind.is_some());
    pooled(views).filter(|_| report.judgement == Validation::Fitted)
}

fn of_kind(report: &Report, kind: FoldKind) -> Option<f64> {
    pooled(report.views.iter().filter(|view| view.kind == Some(kind)))
}

fn reasons(report: &Report, accuracy: &Accuracy, choice: Option<&Choice>) -> Vec<String> {
    let unit = &report.unit;
    let mut reasons = vec![match report.judgement {
        Validation::HeldOut => format!(
            "All errors are held-out errors (leave-one-out cross-validation): {} points in {}, each left out once.",
            accuracy.located,
            match grouped(report.views.iter().map(|view| view.name.as_str())) {
                Some([views, groups]) => format!("{groups} groups of {views} views"),
                None => format!("{} views or slabs", report.views.len()),
            }
        ),
        _ => format!(
            "The {} points are those that were fitted, and errors on new points are larger: by how much, {}.",
            accuracy.located,
            if held_out(report).is_some() {
                "the views held out when the model was fitted tell"
            } else {
                "is not known"
            }
        ),
    }];
    let [x, y, z] = accuracy.rms_xyz.map(figure);
    reasons.push(format!(
        "Half of the points have an error below {} {unit}, 95 % below {} {unit}; along X, Y, Z the rms is {x}, {y}, {z} {unit}. On average that is {} % of the distance.",
        figure(accuracy.median), figure(accuracy.p95), figure(accuracy.mean_percent)
    ));
    if let (Some(inside), Some(outside)) =
        (of_kind(report, FoldKind::Interpolation), of_kind(report, FoldKind::Extrapolation))
    {
        reasons.push(format!(
            "Between the fitted views the rms is {} {unit}, on the outermost views {} {unit}.",
            figure(inside),
            figure(outside)
        ));
    }
    if let Some(held) = share_at_70(report) {
        let too_small = if held < HONEST { ": they are too small" } else { "" };
        // Cut, not rounded: what is below the limit looks so.
        let held = (1000.0 * held).floor() / 10.0;
        reasons.push(format!(
            "The 70 % error ellipsoids contain {held:.1} % of the true points{too_small}."
        ));
    }
    if accuracy.located < accuracy.n {
        reasons.push(format!(
            "{} of {} points could not be located.",
            accuracy.n - accuracy.located,
            accuracy.n
        ));
    }
    reasons.extend(causes(&report.budget));
    reasons.extend(choice.map(reason));
    reasons
}

/// What the error is made of, the largest part first.
fn causes(budget: &[BudgetShare]) -> Option<String> {
    let mut shares: Vec<&BudgetShare> = budget.iter().filter(|part| part.share >= 0.005).collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    let parts: Vec<String> =
        shares.iter().map(|part| format!("{} {}", part.source, percent(part.share))).collect();
    (!parts.is_empty())
        .then(|| format!("Contributions to the squared error: {}.", parts.join(", ")))
}

/// What helps against the largest part, where it is not the pixels'.
fn remedy(report: &Report) -> Option<Hint> {
    let largest = report.budget.iter().max_by(|a, b| a.share.total_cmp(&b.share))?;
    match largest.source.as_str() {
        "lens model" => Some(Hint::new(
            "Most of the error is the lens model's: `neural-camera` and `network` fit any lens; compare methods",
            Remedy::Compare,
        )),
        "chart poses" if report.placed.is_some() => Some(
            "Most of the error is common to whole views, whose chart poses were estimated: show the chart in more views, held still, and check that it is flat"
                .into(),
        ),
        "chart poses" => Some(Hint::new(
            "Most of the error comes from the chart poses: measure them better, or let the fit estimate them",
            Remedy::ChartPlaces,
        )),
        _ => None,
    }
}

fn advice(report: &Report, accuracy: &Accuracy, wording: Wording) -> Vec<String> {
    let sentence = |found: &FindingFigures| {
        let mut letters = found.hint.chars();
        let first =
            letters.next().map_or_else(String::new, |first| first.to_uppercase().to_string());
        format!("{first}{} ({}).", letters.as_str(), found.code)
    };
    let mut advice: Vec<String> = left_faults(report).map(sentence).collect();
    let has_fault = !advice.is_empty();
    if report.judgement == Validation::Fitted && held_out(report).is_none() {
        advice.push(
            wording.sentence(Hint::new(
                "Evaluate it on points that were not fitted",
                Remedy::Evaluate,
            )),
        );
    }
    let worst = report.views.iter().filter(|view| view.kind == Some(FoldKind::Interpolation));
    let worst = worst.filter_map(|v| Some((v.rms?, v))).max_by(|a, b| a.0.total_cmp(&b.0));
    if let (Some((rms, view)), Some(all)) = (worst, pooled(report.views.iter()))
        && rms > FAIR * all
    {
        advice.push(format!(
            "View {} has {} times the error of all views together: check its pictures and its chart pose.",
            view.name, figure(rms / all)
        ));
    }
    if let (Some(inside), Some(outside)) =
        (of_kind(report, FoldKind::Interpolation), of_kind(report, FoldKind::Extrapolation))
        && outside > FAIR * inside
    {
        advice.push(
            "Beyond the fitted views the error grows quickly: let the nearest and farthest views enclose the volume in which you measure."
                .into(),
        );
    }
    for camera in report.cameras.iter().filter(|camera| camera.area_is_picture) {
        // Half of the picture unseen leaves a lens model free to bend there.
        if camera.coverage.covered() < 0.5 {
            advice.push(format!(
                "The chart covers only {} of the picture of {}: show it in the corners too.",
                percent(camera.coverage.covered()),
                camera.name
            ));
        }
    }
    if has_fault {
        // What is most of the error follows from it.
    } else if let Some(remedy) = remedy(report) {
        advice.push(wording.sentence(remedy));
    } else if accuracy.ratio().is_some_and(|ratio| ratio > FAIR) {
        advice.push(wording.sentence(Hint::new("Most of the error is not pixel noise: look for a pattern in the reprojection errors, and compare methods", Remedy::Compare)));
    }
    advice
}

/// What a comparison alone comes to.
pub(super) fn of_comparison(report: &Report, found: &Comparison, wording: Wording) -> Verdict {
    let chosen = found.methods.iter().find(|row| found.chosen.as_ref() == Some(&row.method));
    let Some((chosen, rms)) = chosen.and_then(|row| Some((row, row.rms?))) else {
        return Verdict {
            grade: grade(None).into(),
            sentence: "No method could be fitted to every part of the data.".into(),
            reasons: found.methods.iter().filter_map(|row| row.problem.clone()).take(1).collect(),
            advice: vec!["Give more views or points, spread over more distances.".into()],
        };
    };
    let ratio = chosen.ratio_to_floor.or(found.budget.as_ref().map(|all| all.ratio_to_floor));
    let times = ratio.map_or_else(String::new, |ratio| {
        format!("; {} × the floor set by pixel noise", figure(ratio))
    });
    let sentence = format!(
        "{} is recommended here: its held-out error is {} {} rms{times}.",
        chosen.method,
        figure(rms),
        found.unit
    );
    let mut reasons = vec![format!(
        "It is the simplest of the methods with nearly the smallest held-out error, among {}.",
        found.methods.len()
    )];
    reasons.extend(causes(&report.budget));
    Verdict {
        grade: grade(ratio).into(),
        sentence,
        reasons,
        advice: remedy(report).map(|hint| wording.sentence(hint)).into_iter().collect(),
    }
}
