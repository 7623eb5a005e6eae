//! A camera whose pose relative to the others changed while charts were waved before them.

use super::finding::{Change, Finding, Severity};
use crate::{
    dataset::Dataset,
    fit::bundle::{CameraMotion, PoseChange},
};

/// Shifts of a picture by more than so many times what is left, or by more than so many pixels, are fatal.
const GREAT: f64 = 5.0;
const PIXELS: f64 = 1.0;

/// What the checks of single cameras say of it, each as far as it sees it.
const IN_PART: [&str; 5] =
    ["camera-moved", "camera-drifted", "unsynchronised", "view-unexplained", "pixel-offset"];

/// Puts it in the place of what the checks of single cameras, whose charts followed it in part, say of it. Returns whether
/// it does: what else is fatal may be the reason.
pub(in crate::preparation) fn name_motion(
    findings: &mut Vec<Finding>,
    motion: &CameraMotion,
    data: &Dataset,
) -> bool {
    // Pixels counted otherwise in just these views are simpler.
    let is_simpler =
        |finding: &Finding| finding.code == "pixel-offset" && finding.views == motion.views;
    let is_in_part = |finding: &Finding| IN_PART.contains(&finding.code) && !is_simpler(finding);
    let is_other = |finding: &Finding| finding.severity == Severity::Fatal && !is_in_part(finding);
    // Of single views the checks of single cameras know more: whose view it is, or which points were mixed up.
    let is_named = |view: &String| {
        findings.iter().any(|finding| is_in_part(finding) && finding.views.contains(view))
    };
    let are_named = motion.change == PoseChange::FewViews && motion.views.iter().all(is_named);
    if are_named || findings.iter().any(is_other) {
        return false;
    }
    findings.retain(|finding| !is_in_part(finding));
    findings.insert(0, finding(motion, data));
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    true
}

fn finding(motion: &CameraMotion, data: &Dataset) -> Finding {
    let [before, left] = motion.errors;
    let severity =
        if motion.shift > PIXELS.min(GREAT * left) { Severity::Fatal } else { Severity::Warning };
    let cameras: Vec<usize> = if data.cameras == 2 { vec![0, 1] } else { vec![motion.camera] };
    let code = match motion.change {
        PoseChange::Step | PoseChange::FewViews => "camera-moved",
        PoseChange::Drift => "camera-drifted",
        PoseChange::Every => "unsynchronised",
    };
    let (words, hint) = words(motion, data.cameras);
    let mut figures = vec![
        ("error of a pixel coordinate, px".into(), before),
        ("the same with this explanation, px".into(), left),
        ("shift of the picture, px".into(), motion.shift),
    ];
    if motion.change != PoseChange::Every {
        figures.push(("turned, degrees".into(), motion.rotation));
        figures.push((format!("moved, {}", data.unit), motion.translation));
    }
    let is_of_views = motion.change == PoseChange::FewViews;
    Finding {
        views: motion.views.clone(),
        cameras,
        figures,
        changes: if is_of_views { left_out(motion, data) } else { Vec::new() },
        stays_in_fit: !is_of_views,
        ..Finding::of_all(code, severity, words, hint)
    }
}

/// What is wrong, and what to do about it.
fn words(motion: &CameraMotion, cameras: usize) -> (String, String) {
    let camera = match cameras {
        2 => "camera 2, or the other way camera 1 (two cameras cannot tell which),".to_owned(),
        _ => format!("camera {}", motion.camera + 1),
    };
    let shift = motion.shift;
    let first = motion.views.first().map_or("", String::as_str);
    let fixed = "fix the camera's mount and record again";
    match motion.change {
        PoseChange::Step => (
            format!(
                "{camera} moved before view `{first}`: its picture is shifted by {shift:.2} px, as by a rotation of {:.3} degrees",
                motion.rotation
            ),
            format!("{fixed}, or use only the views before `{first}`, or only those from it on"),
        ),
        PoseChange::FewViews => (
            format!(
                "{camera} was elsewhere in views `{}`, or took them at another instant: its picture is shifted by {shift:.2} px",
                motion.views.join("`, `")
            ),
            format!("{fixed}, or let these pictures be left out"),
        ),
        PoseChange::Drift => (
            format!(
                "{camera} drifts: from the first view to the last its picture creeps by {shift:.2} px"
            ),
            "let the cameras warm up, fix their mounts, and record again".into(),
        ),
        PoseChange::Every => (
            format!(
                "{camera} shows the chart at another pose than the others do in every view, by {shift:.2} px: pictures of a view are not of one instant, or a mount is loose"
            ),
            "take the pictures of a view at the same instant (with a hardware trigger, or with the chart at rest), and fix the cameras' mounts".into(),
        ),
    }
}

/// The camera's pictures of these views.
fn left_out(motion: &CameraMotion, data: &Dataset) -> Vec<Change> {
    let camera = motion.camera;
    let is_of_view =
        |view: usize| data.views.get(view).is_some_and(|name| motion.views.contains(name));
    let rows = data.correspondences.iter().enumerate();
    let seen = rows.filter(|(_, row)| is_of_view(row.view) && row.pixels[camera].is_some());
    seen.map(|(row, _)| Change::Pixel { row, camera, to: None }).collect()
}
