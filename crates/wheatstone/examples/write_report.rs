//! Writes the HTML report of a model: one file that needs no network.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyMethod, Calibration, LineGrid, Material, Prepared, Report, Silent, Wording,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let noise = (Noise::Normal(0.1), 0);
    let data = chart_correspondences(&rig, &chart, &Stage::default().views()?, noise, None);
    let method = AnyMethod::named("dlt")?;
    let model = Calibration::fit(&method, &Prepared::as_given(data), 0, true, &Silent)?;

    let material = Material {
        title: "two synthetic cameras".into(),
        command: None,
        model: &model,
        comparison: None,
        truth: Some(&rig.cameras),
        seen: None,
        held_out: true,
        wording: Wording::default(),
    };
    let report = Report::of(&material, &Silent)?;

    let file = std::env::temp_dir().join(format!("wheatstone-report-{}.html", std::process::id()));
    report.write_html(&file)?;
    println!("{} bytes of HTML", std::fs::metadata(&file)?.len());
    println!("{}", report.verdict.sentence);
    std::fs::remove_file(file)?;
    Ok(())
}
