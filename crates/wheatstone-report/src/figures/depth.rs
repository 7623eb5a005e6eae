//! Error against depth, with the floor.

use super::{
    super::plot::{Plot, scale::Scale},
    Figure, every, thinned,
};
use crate::{Report, text::figure as digits};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let bands = &report.depth;
    if bands.is_empty() {
        return None;
    }
    let unit = &report.unit;
    let points: Vec<(usize, [f64; 2])> = report
        .points
        .iter()
        .enumerate()
        .filter_map(|(index, point)| Some((index, [point.located.as_ref()?.depth, point.error()?])))
        .collect();
    // The least errors of a cloud say nothing and would stretch the axis.
    let cut = report.accuracy.as_ref()?.median / 30.0;
    let across = Scale::around(points.iter().map(|(_, p)| p[0]), false);
    let lines = bands.iter().flat_map(|b| [b.floor_rms, b.predicted_rms]).flatten();
    let values = points.iter().map(|(_, p)| p[1]).chain(lines).filter(|value| *value >= cut);
    let mut plot = Plot::new(
        (across, &format!("depth from the cameras, {unit}")),
        (Scale::logarithmic(values), &format!("error, {unit}")),
    );
    for (index, point) in points.iter().step_by(every(points.len())).filter(|(_, p)| p[1] >= cut) {
        plot.dot(*point, "dot faint", (2.2, Some(*index)));
    }
    let line = |pick: &dyn Fn(&crate::DepthBand) -> Option<f64>| -> Vec<[f64; 2]> {
        bands.iter().filter_map(|band| Some([band.depth, pick(band)?])).collect()
    };
    let rms = line(&|band| Some(band.rms));
    plot.line(&rms, "c0", "rms");
    for point in &rms {
        plot.dot(*point, "f0", (3.2, None));
    }
    let predicted = line(&|band| band.predicted_rms);
    if !predicted.is_empty() {
        plot.line(&predicted, "c1 dashed", "predicted by the error bars");
    }
    let floor = line(&|band| band.floor_rms);
    if !floor.is_empty() {
        plot.line(&floor, "c2 dotted", "floor");
    }
    let (first, last) = (bands.first()?, bands.last()?);
    let alternative = format!(
        "Error against depth: rms {} {unit} at {} {unit}, {} {unit} at {} {unit}.",
        digits(first.rms),
        digits(first.depth),
        digits(last.rms),
        digits(last.depth)
    );
    Some(Figure {
        name: "error-by-depth",
        title: "Error against depth",
        how: how(report, points.len()),
        good: "The solid line follows the line below it, and rises smoothly as the square of the depth.",
        panels: vec![plot.finish("", &alternative)],
    })
}

fn how(report: &Report, count: usize) -> String {
    let floor = if report.depth.iter().any(|band| band.floor_rms.is_some()) {
        "The dotted line is the floor: the error of the same pixels with the true cameras."
    } else {
        "The dashed line is predicted by the covariances of the fit."
    };
    format!(
        "Each dot is one of the {}, the solid line their root mean square in bands of depth. {floor}{}",
        report.judgement.words(),
        thinned(count)
    )
}
