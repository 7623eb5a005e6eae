//! Fits a table of points and saves the model.
//!
//! The table has the columns `view,id,x1,y1,x2,y2,X,Y,Z`: pixels of two cameras and world points in
//! centimetres. Here it is made with synthetic cameras.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyMethod, Calibration, LineGrid, Preparation, Silent,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
    tables::{self, Duplicates},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("wheatstone-fit-table-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let (table, file) = (folder.join("points.csv"), folder.join("model.json"));
    write_table(&table)?;

    let data = tables::read(&table, "cm", Duplicates::Refuse)?;
    println!("{} points of {} cameras", data.correspondences.len(), data.cameras);

    // Faults of the data are found, gross outliers set aside.
    let prepared = Preparation::default().run(data, 0, &Silent)?;
    let method = AnyMethod::named("brown")?;
    let model = Calibration::fit(&method, &prepared, 0, false, &Silent)?;
    println!("fitted {}: {:.4} cm rms on its own points", method.name(), model.training.rms);

    model.save(&file)?;
    let same = Calibration::load(&file)?;
    let pixels = &prepared.data.correspondences[0].pixels;
    let located = same.reconstructor.locate(pixels).ok_or("the first point was not located")?;
    println!("the first point lies at {:.3?} cm", located.point.coords.as_slice());
    std::fs::remove_dir_all(folder)?;
    Ok(())
}

/// A chart at seven distances before two cameras, pixels with noise of 0.1 px.
fn write_table(path: &std::path::Path) -> Result<(), Box<dyn Error>> {
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let noise = (Noise::Normal(0.1), 0);
    let data = chart_correspondences(&rig, &chart, &Stage::default().views()?, noise, None);
    tables::save(&data, path)?;
    Ok(())
}
