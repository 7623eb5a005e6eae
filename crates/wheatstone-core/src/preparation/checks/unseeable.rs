//! What nobody could see in calibration data, and what the user can compare instead: where the
//! cameras stand by these data.

use super::{
    column_units::unseen_columns,
    coverage::common_normal,
    evidence::Evidence,
    finding::{Examination, Finding, Layout, Severity, Statement},
    pairs::Pair,
    views::View,
};
use crate::Error;
use wheatstone_numeric::statistics::{mean, median, percentile};

/// A camera farther away than so many times the points' median distance from their middle observes them within
/// a thousandth of parallel projection.
const AFFINE: f64 = 1e3;

/// The cameras after the first, by what was fitted.
pub(super) fn layout(evidence: &Evidence) -> Vec<Layout> {
    let Some(Some(first)) = evidence.seen.first() else { return Vec::new() };
    let mut all = Vec::new();
    for (camera, seen) in evidence.seen.iter().enumerate().skip(1) {
        let Some(seen) = seen else { continue };
        let between = (seen.camera.centre() - first.camera.centre()) * evidence.frame.size;
        let own = first.camera.rotation() * between;
        let baseline = between.norm();
        let at_infinity: Vec<String> = [(0, &first.camera), (camera, &seen.camera)]
            .iter()
            .filter(|(_, camera)| camera.centre().coords.norm() > AFFINE)
            .map(|(camera, _)| format!("camera {}", camera + 1))
            .collect();
        if !at_infinity.is_empty() {
            let words = format!(
                "{} is practically at infinity: there is too little perspective to determine its distance",
                at_infinity.join(", and so is ")
            );
            all.push(Layout { camera, baseline: f64::INFINITY, words });
            continue;
        }
        let directions = [
            ("left of", "right of", own.x),
            ("above", "below", own.y),
            ("behind", "in front of", own.z),
        ];
        let largest = directions.iter().max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
        let side = largest
            .map_or("beside", |(minus, plus, value)| if *value < 0.0 { minus } else { plus });
        let side = match side {
            "left of" | "right of" => format!("to the {side}"),
            other => other.to_owned(),
        };
        let words = format!(
            "seen from camera 1, camera {} is {} {} {side} it (the baseline)",
            camera + 1,
            short(baseline),
            evidence.data.unit
        );
        all.push(Layout { camera, baseline, words });
    }
    all
}

/// Four significant digits.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { libm::log10(value.abs()).floor() as i32 };
    format!("{value:.*}", usize::try_from(3 - digits).unwrap_or(0))
}

/// What is to be said of every set of data.
pub(super) fn statements(evidence: &Evidence) -> Vec<Statement> {
    let layout = layout(evidence);
    let first = layout.first().filter(|layout| layout.baseline.is_finite());
    let baseline = first.map_or_else(
        || "measure the baseline of two cameras".to_owned(),
        |l| format!("measure the baseline: is it {} {}?", short(l.baseline), evidence.data.unit),
    );
    let mut all = vec![
        Statement {
            what: "a wrong unit, or one scale error of all coordinates (a chart printed too large or too small)".into(),
            check: baseline,
        },
        Statement {
            what: "the cameras exchanged in all views".into(),
            check: first.map_or_else(
                || "compare the camera positions".into(),
                |l| format!("is this right: {}?", l.words),
            ),
        },
        Statement {
            what: "another pixel origin, or resized pictures, in all views of a camera".into(),
            check: "harmless as long as `locate` gets the same pixels".into(),
        },
    ];
    all.extend(another_focal_length(evidence));
    all.extend(oblique_stage(evidence));
    all.extend(another_pitch_along_one_side(evidence));
    all
}

/// Charts that are longer along one side than was declared look as to cameras whose pixels are not square: all of them
/// alike. So do sensors that are tilted alike.
fn another_pitch_along_one_side(evidence: &Evidence) -> Option<Statement> {
    /// Simulated lenses behind glass and water deviate by 0.03 from square pixels.
    const OBLONG: f64 = 0.03;
    let ratios: Vec<f64> = evidence
        .seen
        .iter()
        .map(|seen| {
            let [fx, fy] = seen.as_ref()?.camera.focal();
            Some(libm::log(fx / fy))
        })
        .collect::<Option<_>>()?;
    let are_alike = ratios.iter().all(|ratio| ratio * ratios[0] > 0.0 && ratio.abs() > OBLONG);
    are_alike.then(|| Statement {
        what: "another pitch along X or Y alone, or pixels that are not square".into(),
        check: format!(
            "focal lengths along x are {:.1} % {} than along y in every camera: measure the chart along both sides",
            100.0 * (libm::exp(mean(&ratios).abs()) - 1.0),
            if ratios[0] > 0.0 { "longer" } else { "shorter" }
        ),
    })
}

/// A lens of another focal length sees parallel planes farther apart alike, and so points at random places where cameras
/// look along a column.
fn another_focal_length(evidence: &Evidence) -> Option<Statement> {
    let stacked = common_normal(evidence).map(|(normal, _)| ["X", "Y", "Z"][normal.iamax()]);
    let columns = stacked.map_or_else(|| unseen_columns(evidence), |axis| vec![axis]);
    let distance =
        stacked.map(|_| "measure how far apart two of the charts are, and compare".into());
    let angle = field_of_view(evidence).map(|angle| {
        format!("is it right that the points fill {angle:.0} degrees of camera 1's view, from left to right?")
    });
    let checks: Vec<String> = distance.into_iter().chain(angle).collect();
    (!columns.is_empty() && !checks.is_empty()).then(|| Statement {
        what: format!("another unit of {} alone, or another focal length", columns.join(" or ")),
        check: checks.join("; "),
    })
}

/// Parallel planes of a stage that moves obliquely look as right ones do to other cameras, and so do those that are shown in
/// order while a camera drifts.
fn oblique_stage(evidence: &Evidence) -> Option<Statement> {
    let (normal, _) = common_normal(evidence).filter(|_| evidence.views.len() > 2)?;
    let depth = |view: &View| {
        let places = view.rows.iter().filter_map(|row| evidence.data.correspondences[*row].world);
        median(&places.map(|place| normal.dot(&place.coords)).collect::<Vec<_>>())
    };
    let depths: Vec<f64> = evidence.views.iter().map(depth).collect();
    let is_in_order = depths.is_sorted() || depths.iter().rev().is_sorted();
    let oblique = "a stage that moves obliquely to the chart";
    let measure = "measure the stage's angle to the chart";
    Some(if is_in_order {
        Statement {
            what: format!(
                "{oblique}, or a camera that drifts while the stage advances, or is triggered late while it moves"
            ),
            check: format!(
                "{measure}; show the first chart once more at the end, as a view of its own"
            ),
        }
    } else {
        Statement { what: oblique.into(), check: measure.into() }
    })
}

/// The angle that the points fill in the first camera's view from left to right, in degrees, by what was fitted.
fn field_of_view(evidence: &Evidence) -> Option<f64> {
    let camera = &evidence.seen.first()?.as_ref()?.camera;
    let sideways = |(place, _): &Pair| {
        let own = camera.rotation() * (place - camera.centre());
        libm::atan2(own.x, own.z)
    };
    let pairs = evidence.cells.iter().flat_map(|view| &view[0].pairs);
    let angles: Vec<f64> = pairs.map(sideways).collect();
    Some((percentile(&angles, 0.99) - percentile(&angles, 0.01)).to_degrees())
}

/// Compares the distance of the first two cameras with what was measured on the rig; a tolerance of
/// 0.01 is one percent. A finding where they differ by more, or where the data do not tell.
#[must_use]
pub fn compare_baseline(found: &Examination, expected: f64, tolerance: f64) -> Option<Finding> {
    let own =
        found.layout.first().map(|layout| layout.baseline).filter(|length| length.is_finite());
    let ratio = own.map(|own| own / expected);
    if ratio.is_some_and(|ratio| (ratio - 1.0).abs() <= tolerance) {
        return None;
    }
    let explanation = match (own, ratio) {
        (Some(own), Some(ratio)) => format!(
            "the baseline is {} by these data and {} by your measurement (ratio {ratio:.4}): all coordinates have a wrong unit or scale, or the measurement is wrong",
            short(own),
            short(expected)
        ),
        _ => "the data do not determine the baseline".into(),
    };
    Some(Finding {
        cameras: vec![0, 1],
        figures: own.map(|own| ("baseline by the data".to_owned(), own)).into_iter().collect(),
        ..Finding::of_all(
            "baseline-differs",
            Severity::Fatal,
            explanation,
            "measure the chart's pitch and the stage's steps again, and give them in one unit",
        )
    })
}

/// Charts held by hand that cannot be placed, for this reason.
pub(crate) fn undetermined_poses(error: &Error) -> Finding {
    Finding::of_all(
        "poses-undetermined",
        Severity::Fatal,
        error.to_string(),
        error.hint().map_or_else(String::new, |hint| hint.to_string()),
    )
}

/// Charts held by hand that may be tilted to either of two sides.
pub(crate) fn undecided_poses(views: &[String]) -> Option<Finding> {
    (!views.is_empty()).then(|| Finding {
        views: views.to_vec(),
        stays_in_fit: true,
        ..Finding::of_all(
            "pose-two-fold",
            Severity::Warning,
            "two poses of the chart, tilted to either side, explain the pixels alike: the better one was taken".into(),
            "tilt the chart more, show it nearer, or to two cameras at once; or leave the view out",
        )
    })
}

/// Too few views of charts held by hand, or points in them, to estimate poses without a lens model: behind water or glass
/// points then err by two to four times their error bars.
pub(crate) fn few_views(views: usize, points: usize) -> Option<Finding> {
    /// By simulated captures of 6 to 15 views of 24 or 99 points.
    const VIEWS: usize = 8;
    const POINTS: usize = 300;
    (views < VIEWS || points < POINTS).then(|| Finding {
        figures: vec![("views".into(), views as f64), ("points".into(), points as f64)],
        stays_in_fit: true,
        ..Finding::of_all(
            "few-views",
            Severity::Warning,
            format!("the chart poses were estimated without a lens model, for which {points} points in {views} views are few: the error bars may be too small"),
            "take fifteen views, with the chart large in the picture and tilted another way in each",
        )
    })
}

/// A chart held by hand whose shape is not the one that was declared.
pub(crate) fn other_shape(explanation: String, (name, value): (&str, f64), hint: &str) -> Finding {
    Finding {
        figures: vec![(name.into(), value)],
        stays_in_fit: true,
        ..Finding::of_all("chart-shape", Severity::Warning, explanation, hint)
    }
}

/// A method whose error bars say nothing of chart poses that were estimated.
pub(crate) fn omitted_pose_uncertainty() -> Finding {
    Finding {
        stays_in_fit: true,
        ..Finding::of_all(
            "omitted-pose-uncertainty",
            Severity::Warning,
            "the chart poses were estimated from the same pixels, and the error bars of this method leave out what they are uncertain by: they are too small".into(),
            "fit a camera model (`brown`, `kannala-brandt`, `neural-camera`), or give the chart poses",
        )
    }
}
