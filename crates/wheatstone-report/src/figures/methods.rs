//! Methods side by side.

use super::{
    super::plot::bars::{Bar, bars},
    Figure,
};
use crate::{Report, text::figure as digits};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    if report.methods.len() < 2 {
        return None;
    }
    let mut methods: Vec<_> = report.methods.iter().collect();
    let rms = |rms: Option<f64>| rms.unwrap_or(f64::INFINITY);
    methods.sort_by(|a, b| rms(a.rms).total_cmp(&rms(b.rms)));
    let least = methods.first()?.rms.unwrap_or(f64::INFINITY);
    // A method that fails altogether must not make all others alike: its bar is cut off.
    let cut = if least > 0.0 { 8.0 * least } else { f64::INFINITY };
    let row = |method: &&crate::MethodFigures| {
        let mut note =
            method.ratio_to_floor.map_or_else(String::new, |r| format!("({} ×)", digits(r)));
        if method.problem.is_some() {
            note += " not all fits";
        }
        Bar {
            label: method.method.clone(),
            value: method.rms,
            mark: None,
            class: match method.rms {
                Some(rms) if rms > cut => "f1 hatched",
                _ if method.chosen => "f2",
                _ => "f0",
            },
            note,
        }
    };
    let rows: Vec<Bar> = methods.iter().map(row).collect();
    let chosen = methods.iter().find(|method| method.chosen);
    let alternative = chosen.map_or_else(
        || format!("{} methods compared.", rows.len()),
        |method| format!("{} methods compared; {} is recommended.", rows.len(), method.method),
    );
    let legend: &[(&str, &str)] = &[("f2", "to be trusted"), ("f0", "others")];
    let floor = if report.methods.iter().any(|method| method.ratio_to_floor.is_some()) {
        " In brackets: times the floor."
    } else {
        ""
    };
    let axis = format!("held-out rms error, {}", report.unit);
    Some(Figure {
        name: "methods",
        title: "Methods compared",
        how: format!(
            "Each bar is the held-out error of one method (whole views left out).{floor} Bars longer than eight times the shortest are cut off and hatched."
        ),
        good: "Several short bars of nearly equal length: the result does not depend on the method. The simplest of the best is recommended.",
        panels: vec![bars(&rows, legend, (&axis, cut), &alternative)],
    })
}
