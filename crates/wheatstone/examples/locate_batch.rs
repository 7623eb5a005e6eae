//! Locates many points at once: plain columns of pixels in, plain columns of coordinates out.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::{error::Error, ops::ControlFlow};
use wheatstone::{
    AnyMethod, Calibration, FnProgress, LineGrid, Prepared, Silent,
    geometry::columns_of,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // A calibration of two synthetic cameras, through bytes as over a network.
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let noise = (Noise::Normal(0.1), 0);
    let train = chart_correspondences(&rig, &chart, &Stage::default().views()?, noise, None);
    let method = AnyMethod::named("brown")?;
    let fitted = Calibration::fit(&method, &Prepared::as_given(train), 0, false, &Silent)?;
    let model = Calibration::from_bytes(&fitted.to_bytes()?)?;

    // 20 000 points: a column of x and one of y for each camera, in pixels.
    let points = random_correspondences(&rig, &chart, (60.0, 120.0), (noise.0, 1), 20_000);
    let rows: Vec<_> = points.correspondences.iter().map(|row| row.pixels.clone()).collect();
    let mut columns = columns_of(&rows, 2).into_iter().flatten().collect::<Vec<Vec<f64>>>();
    // Camera 2 did not see the first point.
    columns[2][0] = f64::NAN;

    // A closure is told how far it is, and stops the work by `ControlFlow::Break(())`.
    let progress = FnProgress::new(|task, done, total| {
        println!("{task}: {done} of {total}");
        ControlFlow::Continue(())
    });
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let mut locator = model.locator();
    let batch = locator.locate_columns(&columns, &progress)?;

    println!("{} of {} located", batch.located(), batch.len());
    let [_, _, sigma_z] = batch.sigma();
    for row in 0..3 {
        let [x, y, z] = batch.point.each_ref().map(|column| column[row]);
        println!("{x:8.3} {y:8.3} {z:8.3} +- {:.3} {}", sigma_z[row], batch.trust[row]);
    }
    Ok(())
}
