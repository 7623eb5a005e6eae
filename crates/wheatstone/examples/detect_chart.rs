//! Finds a chart's points in a picture that is in memory.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyChart, ChartSearch, Chessboard, GrayImage, Pose,
    geometry::Vector3,
    numeric::random::Random,
    synthetic::{Rig, Sensor, render},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // A board of 9 x 6 inner corners, squares of 5 cm, 80 cm before the camera.
    let chart: AnyChart = Chessboard { pitch: 5.0, ..Chessboard::default() }.into();
    let (width, height, bytes, truth) = frame(&chart)?;

    // 8-bit grey values, row by row; `from_raw_stride` takes padded rows, `from_raw16` deeper ones.
    let image = GrayImage::from_raw(width, height, &bytes)?;
    let readings = match chart.detect(&image) {
        ChartSearch::Found(readings) => readings,
        ChartSearch::NotFound(reason) => return Err(reason.into()),
    };

    // A board that looks the same upside down has two readings, with the same pixels.
    let reading = readings.first().ok_or("no reading")?;
    println!("{} points, {} readings", reading.points.len(), readings.len());
    for (id, pixel) in reading.points.iter().take(3) {
        println!("point {id} at ({:.3}, {:.3})", pixel.x, pixel.y);
    }
    let errors = reading.points.iter().map(|(id, pixel)| (pixel - truth[*id]).norm());
    println!("largest error {:.3} px", errors.fold(0.0, f64::max));
    Ok(())
}

type Frame = (usize, usize, Vec<u8>, Vec<wheatstone::Pixel>);

/// A synthetic picture as a camera's driver gives it, and where the points truly are in it.
fn frame(chart: &AnyChart) -> Result<Frame, Box<dyn Error>> {
    let camera = Rig::named("paper", 2)?.cameras.remove(0);
    let pose = Pose { translation: Vector3::new(0.0, 0.0, 80.0), ..Pose::default() };
    let picture = render(&camera, chart, &pose, Sensor::default(), &mut Random::new(0));
    let bytes = picture.values().iter().map(|value| value.round() as u8).collect();
    let world = chart.points().into_iter().map(|point| pose.transform(point));
    let truth = world.map(|point| camera.project(point)).collect::<Option<Vec<_>>>();
    Ok((picture.width(), picture.height(), bytes, truth.ok_or("a point is not seen")?))
}
