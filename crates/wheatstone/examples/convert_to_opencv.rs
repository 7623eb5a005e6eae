//! Writes a model's cameras as OpenCV's YAML, reads them back, and uses one as a plain camera model.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyMethod, BrownConrady, Calibration, CameraModel, Format, Given, InputFile, LineGrid, Pinhole,
    Point3, Prepared, Silent,
    formats::approximate,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let noise = (Noise::Normal(0.1), 0);
    let data = chart_correspondences(&rig, &chart, &Stage::default().views()?, noise, None);
    let method = AnyMethod::named("brown")?;
    let mut model = Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent)?;
    model.sizes = vec![Some([640, 480]); 2];

    // Cameras that the format cannot hold are replaced by the nearest that it can, with the loss told.
    let opencv = Format::named("opencv")?;
    let nearest = approximate(&model, opencv.forms(), &Silent)?;
    match &nearest.loss {
        Some(loss) => println!("nearest {}: {:.4} px rms", loss.form, loss.rms),
        None => println!("without loss"),
    }
    let files = opencv.write_rig(&nearest.rig)?;
    for line in String::from_utf8_lossy(&files[0].bytes).lines().take(8) {
        println!("  {line}");
    }

    let input = |file: &wheatstone::OutputFile| InputFile {
        path: "cameras.yml".into(),
        bytes: file.bytes.clone(),
    };
    let inputs: Vec<InputFile> = files.iter().map(input).collect();
    let read = opencv.read_rig(&inputs, &Given::default())?;
    println!("{} cameras read back", read.cameras.len());

    // A camera model by itself: point in the camera frame to pixel.
    let pinhole = Pinhole { focal: [700.0, 700.0], principal: [319.5, 239.5] };
    let camera = BrownConrady { pinhole, radial: [-0.2, 0.1, 0.0], ..BrownConrady::default() };
    let pixel = camera.project(Point3::new(10.0, 5.0, 80.0)).ok_or("behind the camera")?;
    println!("({:.2}, {:.2})", pixel.x, pixel.y);
    Ok(())
}
