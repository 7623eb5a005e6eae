//! `wheatstone check --against`: whether cameras still stand as they did.

use super::{
    locate::{FALSE_ALARM, refuse_other_order},
    print_json,
};
use crate::{
    failure::Outcome,
    input::{Reading, load_any},
    progress::Bar,
    table::{figure, table, with_sigma},
    verbosity::{remark, say},
};
use serde_json::{Value, json};
use std::path::Path;
use wheatstone::{
    Calibration, Error,
    evaluate::camera_motion::{CameraChange, CameraMotion, Change, Known},
};

/// Compares what cameras see now with what the model expects.
pub(super) fn check(input: &Path, model: &Path, mut reading: Reading, as_json: bool) -> Outcome {
    let bar = Bar::new();
    let calibration = Calibration::load(model)?;
    // A points file's numbers are in the model's unit unless it says otherwise.
    reading.unit.get_or_insert_with(|| calibration.unit.clone());
    let data = load_any(input, &reading, &bar)?.data;
    let pixels: Vec<_> = data.correspondences.iter().map(|row| row.pixels.clone()).collect();
    refuse_other_order(&*calibration.reconstructor, &pixels, FALSE_ALARM)?;
    let found = calibration.camera_motion(&data, &bar)?;
    drop(bar);
    if calibration.imported.is_some() {
        remark!(
            "note",
            "another program's calibration does not say how uncertain it is: its cameras are taken for exact"
        );
    }
    if as_json {
        print_json(&json_of(&found))?;
    } else {
        tell(&found, model);
    }
    let Some(first) = found.changes.first() else { return Ok(()) };
    Err(Error::Degenerate {
        problem: format!("{} since {} was fitted", subject(first), model.display()),
        hint: format!(
            "calibrate again; `wheatstone fit … --intrinsics {}` needs one view of a board for the new poses, if the lenses are as they were",
            model.display()
        )
        .into(),
    }
    .into())
}

fn json_of(found: &CameraMotion) -> Value {
    let change = |change: &CameraChange| {
        let cameras: Vec<usize> = change.cameras.iter().map(|camera| camera + 1).collect();
        let mut value = json!(change);
        value["cameras"] = json!(cameras);
        value
    };
    let mut value = json!(found);
    value["changes"] = found.changes.iter().map(change).collect();
    value["verdict"] = match (found.changes.is_empty(), found.is_explained()) {
        (false, _) => "changed",
        (true, true) => "unchanged",
        (true, false) => "unexplained",
    }
    .into();
    value
}

fn tell(found: &CameraMotion, model: &Path) {
    let points = match found.known {
        Known::Places => "points at given places",
        Known::Boards => "points of boards at unknown poses",
        Known::Matches => "matched points",
    };
    if found.changes.is_empty() && !found.is_explained() {
        say!(
            "No camera moved, as far as {} {points} tell, but they do not agree with {}: noise alone differs so much \
             with a probability of {}, and no motion explains it",
            found.n,
            model.display(),
            figure(found.chance)
        );
    } else if found.changes.is_empty() {
        say!(
            "Unchanged: what the cameras see of {} {points} agrees with {} (noise alone differs more with a \
             probability of {})",
            found.n,
            model.display(),
            figure(found.chance)
        );
    }
    for change in &found.changes {
        say!("{}: {}", subject(change), manner(change, &found.unit));
        for line in components(change, &found.unit) {
            say!("  {line}");
        }
        if let [_, _, ..] = change.cameras[..]
            && !change.together
        {
            let each = change.cameras.iter().zip(&change.confidence);
            let each =
                each.map(|(camera, share)| format!("{} with {:.0} %", camera + 1, 100.0 * share));
            say!(
                "  these pixels do not tell which camera it was: {}",
                each.collect::<Vec<_>>().join(", ")
            );
        }
    }
    if !found.changes.is_empty() {
        say!(
            "{} {points} were used; noise alone differs so much with a probability of {}",
            found.n,
            figure(found.chance)
        );
    }
    tell_noise(found);
    say!("The smallest motions of one camera that would be noticed 19 times in 20:");
    say!("{}", limits(found).trim_end());
    for sentence in cannot_show(found) {
        say!("{sentence}");
    }
}

fn tell_noise(found: &CameraMotion) {
    /// The noise of another detector, or of natural texture.
    const MUCH: f64 = 2.0;
    if found.left_out > 0 {
        remark!("note", "{} pixels or matches were left out as gross errors", found.left_out);
    }
    let [now, before] = [found.pixel_sigma, found.expected_pixel_sigma].map(figure);
    if found.pixel_sigma > MUCH * found.expected_pixel_sigma {
        remark!(
            "warning",
            "reprojection errors are {now} px where the model expects {before}, however the cameras moved: a weaker \
             detector or matcher, a chart of another size, or a change that is no motion"
        );
    } else {
        say!("Reprojection errors are {now} px; the model expects {before}");
    }
    if !found.changes.is_empty() && !found.is_explained() {
        remark!("warning", "these changes do not explain all that the pixels show");
    }
}

fn subject(change: &CameraChange) -> String {
    let cameras: Vec<String> =
        change.cameras.iter().map(|camera| (camera + 1).to_string()).collect();
    if change.together {
        "All cameras moved alike against the given places".into()
    } else if change.change == Change::FocalLength {
        format!("The focal length of camera {} changed", cameras.join(" or "))
    } else {
        format!("Camera {} moved", cameras.join(" or "))
    }
}

/// A length and its standard deviation by those of its components.
fn length(of: [f64; 3], sigma: [f64; 3]) -> String {
    let norm = of.iter().map(|value| value * value).sum::<f64>().sqrt();
    let square: f64 = of.iter().zip(sigma).map(|(value, sigma)| (value * sigma).powi(2)).sum();
    with_sigma(norm, square.sqrt() / norm.max(f64::MIN_POSITIVE))
}

fn manner(change: &CameraChange, unit: &str) -> String {
    let turn = length(change.turn, change.turn_sigma);
    let shift = length(change.shift, change.shift_sigma);
    match change.change {
        Change::Turn => format!("turned about its own centre by {turn} degrees"),
        Change::Shift => format!("shifted by {shift} {unit}"),
        Change::TurnAndShift if change.together => format!(
            "the rig as a whole, or the chart's frame: turned by {turn} degrees and shifted by {shift} {unit}"
        ),
        Change::TurnAndShift => format!("turned by {turn} degrees and shifted by {shift} {unit}"),
        Change::FocalLength => format!(
            "by {} percent",
            with_sigma(100.0 * change.focal_length, 100.0 * change.focal_length_sigma)
        ),
    }
}

fn components(change: &CameraChange, unit: &str) -> Vec<String> {
    let names = |names: [&str; 3], of: [f64; 3], sigma: [f64; 3], unit: &str| {
        let each = names.iter().zip(of.iter().zip(sigma));
        let each =
            each.map(|(name, (value, sigma))| format!("{name} {}", with_sigma(*value, sigma)));
        format!("{} {unit}", each.collect::<Vec<_>>().join(", "))
    };
    let axes =
        if change.together { ["about X", "about Y", "about Z"] } else { ["pitch", "yaw", "roll"] };
    let turn = || names(axes, change.turn, change.turn_sigma, "degrees");
    let shift = || names(["x", "y", "z"], change.shift, change.shift_sigma, unit);
    match change.change {
        Change::Turn => vec![turn()],
        Change::Shift => vec![shift()],
        Change::TurnAndShift => vec![turn(), shift()],
        Change::FocalLength => Vec::new(),
    }
}

fn limits(found: &CameraMotion) -> String {
    let shift = |axis: &str| format!("{axis} ({})", found.unit);
    let heading = ["x", "y", "z"].map(shift);
    let heading =
        ["camera", "pitch (degrees)", "yaw", "roll", &*heading[0], "y", "z", "focal length (%)"];
    let cell = |value: f64| if value.is_finite() { figure(value) } else { "none".into() };
    let rows = found.noticeable.iter().enumerate().map(|(camera, least)| {
        let figures = least.turn.into_iter().chain(least.shift).chain([100.0 * least.focal_length]);
        std::iter::once((camera + 1).to_string()).chain(figures.map(cell)).collect()
    });
    table(&heading, &rows.collect::<Vec<Vec<String>>>())
}

/// A yaw is called hidden that has to be as many times larger than a pitch to be noticed.
const HIDDEN: f64 = 5.0;

/// What data of this kind hide.
fn cannot_show(found: &CameraMotion) -> Vec<String> {
    if found.known == Known::Places {
        return Vec::new();
    }
    let mut sentences = vec![
        "What these data cannot show: a motion of all cameras together. Without known places only motions of the cameras \
         against each other show."
            .to_owned(),
    ];
    if found.noticeable.len() == 2 {
        sentences.push(
            "Of two cameras, either may have moved: they are told apart only where a turn about one camera's own centre \
             explains what no such turn of the other does."
                .into(),
        );
    }
    // Of cameras that do not stand in a row, others see what a yaw changes.
    let hidden = found.noticeable.iter().filter(|least| least.turn[1] > HIDDEN * least.turn[0]);
    let yaw = hidden.map(|least| least.turn[1]).fold(0.0, f64::max);
    if found.known == Known::Matches && yaw > 0.0 {
        let degrees = if yaw.is_finite() { figure(yaw) } else { "90".into() };
        sentences.push(format!(
            "Without a chart, yaw cannot be seen: it changes distances, and hardly how pixels match; less than {degrees} \
             degrees would go unnoticed. A shift along the baseline changes the scale alone, and cannot be seen at all."
        ));
    }
    sentences
}
