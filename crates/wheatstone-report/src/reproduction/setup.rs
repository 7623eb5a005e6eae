//! What the paper's figures 1 to 4 show, of the rig that stands for its robot.

use super::{ARCHITECTURES, data::Data};
use crate::SetupFigures;
use wheatstone_core::{
    Result,
    camera::PosedCamera,
    geometry::{Pixel, Point3},
};
use wheatstone_synthetic::Stage;

/// Where the chart stands that figure 4 shows, in centimetres.
const SHOWN: f64 = 50.0;

/// The setup of these data.
pub(super) fn of(data: &Data) -> Result<SetupFigures> {
    let stations = Stage::default().views()?;
    let points = data.chart.points();
    let along = |axis: usize| {
        let mut all: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        all
    };
    let (columns, rows) = (along(0), along(1));
    let camera = &data.rig.cameras[0];
    Ok(SetupFigures {
        cameras: data.rig.cameras.iter().map(plan).collect(),
        stations: stations.iter().map(|(_, pose)| pose.translation.z).collect(),
        chart: [columns[0], columns[columns.len() - 1]],
        layers: [&[2 * data.rig.cameras.len()], ARCHITECTURES[0], &[3]].concat(),
        picture: [camera.width as f64, camera.height as f64],
        lines: data.rig.cameras.iter().map(|camera| lines(camera, &columns, &rows)).collect(),
    })
}

/// A camera from above: its centre, and where the left and the right border of its picture are a metre ahead.
fn plan(camera: &PosedCamera) -> [[f64; 2]; 3] {
    let centre = camera.centre();
    let border = |x: f64| {
        let pixel = Pixel::new(x, 0.5 * camera.height as f64);
        camera.ray(pixel).map_or([centre.x, centre.z], |ray| {
            let at = ray.at((100.0 - ray.origin.z) / ray.direction.z);
            [at.x, at.z]
        })
    };
    [[centre.x, centre.z], border(0.0), border(camera.width as f64)]
}

/// The chart's lines as a camera sees them, each as the crossings along it.
fn lines(camera: &PosedCamera, columns: &[f64], rows: &[f64]) -> Vec<Vec<[f64; 2]>> {
    let seen = |x: f64, y: f64| {
        camera.project_visible(Point3::new(x, y, SHOWN)).map(|pixel| [pixel.x, pixel.y])
    };
    let level = rows.iter().map(|y| columns.iter().filter_map(|x| seen(*x, *y)).collect());
    let upright = columns.iter().map(|x| rows.iter().filter_map(|y| seen(*x, *y)).collect());
    level.chain(upright).filter(|line: &Vec<[f64; 2]>| line.len() > 1).collect()
}
