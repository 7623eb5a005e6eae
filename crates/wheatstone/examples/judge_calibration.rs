//! Judges data and models: faults of the data, errors on views left out of the fit, and methods side
//! by side.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyMethod, LineGrid, Silent, compare, cross_validate, examine,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let noise = (Noise::Normal(0.1), 0);
    let data = chart_correspondences(&rig, &chart, &Stage::default().views()?, noise, None);

    // One view's pixels are exchanged between the cameras: a fault that the check names.
    let mut faulty = data.clone();
    for row in faulty.correspondences.iter_mut().filter(|row| row.view == 2) {
        row.pixels.reverse();
    }
    for finding in examine(&faulty).findings {
        println!("{} ({}): {}", finding.code, finding.severity.name(), finding.explanation);
    }

    // Each view is left out once; its points are located by a fit to the others.
    let brown = AnyMethod::named("brown")?;
    let validation = cross_validate(&brown, &data, 0, &Silent)?.ok_or("one view only")?;
    for fold in &validation.folds {
        println!("without view {}: {:.4} cm rms", fold.view, fold.rms.unwrap_or(f64::NAN));
    }

    // Methods side by side. With the true cameras the least possible error is known as well.
    let methods = [AnyMethod::named("dlt")?, brown, AnyMethod::named("soloff")?];
    let table = compare(&methods, &data, Some(&rig.cameras), 0, &Silent)?;
    for row in &table.methods {
        println!("{:8} {:.4} cm rms", row.method, row.rms.unwrap_or(f64::NAN));
    }
    println!("chosen: {}", table.chosen.as_deref().unwrap_or("none"));
    Ok(())
}
