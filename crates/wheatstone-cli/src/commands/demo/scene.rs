//! The last step: a scene reconstructed, and held against the truth.

use crate::{
    commands::reconstruct::results::{self, whole},
    failure::Outcome,
    progress::Bar,
};
use serde::Serialize;
use std::path::Path;
use wheatstone::{
    Calibration, Pixel,
    dataset::{Correspondence, Dataset, volume::Trust},
    evaluate::{evaluate, floor},
    geometry::Point3,
    imaging::{ColourImage, Limits, read_colour_image},
    reconstruction::{CLOUD_FORMATS, Reconstruction, ReconstructionSettings, SceneReconstructor},
    report::SceneFigures,
    storage::write_folder,
    synthetic::{Rig, Scene, Sensor, write_scene},
};

/// How a cloud compares with the scene.
#[derive(Serialize)]
pub(super) struct SceneSummary {
    /// Points, and the share of the rectified picture's pixels that have one.
    pub(super) points: usize,
    pub(super) density: f64,
    /// In the calibrated volume, and beyond it.
    pub(super) inside: Option<Accuracy>,
    pub(super) outside: Option<Accuracy>,
}

/// Errors of points, that lie where the calibration had data, or not.
#[derive(Serialize)]
pub(super) struct Accuracy {
    pub(super) share: f64,
    pub(super) median: f64,
    /// Times the median error of the same matches, triangulated with the true cameras.
    pub(super) ratio_to_floor: f64,
    /// The shares of errors along X, Y and Z within one and two standard deviations.
    pub(super) within: [f64; 2],
}

/// Where the pictures are, and the cloud, in the folder.
const PICTURES: &str = "scene";
pub(super) const RESULTS: &str = "reconstruction";

/// A scene before the rig, seen with its noise, and reconstructed by a model that was fitted to charts.
pub(super) fn reconstruct(
    model: &Calibration,
    (rig, seed): (&Rig, u64),
    (folder, file): (&Path, &str),
    bar: &Bar,
) -> Outcome<(SceneSummary, SceneFigures)> {
    let scene = Scene::before(rig, seed);
    write_scene(folder, (rig, &scene), (Sensor::default(), seed), bar)?;
    let sides = ["left", "right"].map(|side| folder.join(PICTURES).join(format!("{side}.png")));
    let read = |path: &std::path::PathBuf| read_colour_image(path, Limits::default());
    let pictures: Vec<ColourImage> = sides.iter().map(read).collect::<Result<_, _>>()?;
    let sizes = [0, 1].map(|camera| {
        let camera = &rig.cameras[camera];
        [camera.width as u32, camera.height as u32]
    });
    let made = SceneReconstructor::new(model, ReconstructionSettings::new(sizes), bar)?;
    let found = made.reconstruct(&[&pictures[0], &pictures[1]], bar)?;
    let mut told = results::summary(&found);
    told["images"] = ["left", "right"].map(|side| format!("{PICTURES}/{side}.png")).into();
    let told = whole(Path::new(file), (&made, model), vec![told]);
    write_folder(&folder.join(RESULTS), |place| {
        let formats = [&CLOUD_FORMATS[0]];
        results::write(&found, (&made, model), ("demo: a rendered scene", &told), (place, &formats))
    })?;
    let truth = |index: usize| {
        let [x, y] = found.cloud.pixels[0][index].map(f64::from);
        scene.place(&rig.cameras[0], Pixel::new(x, y))
    };
    let truth: Vec<Option<Point3>> = (0..found.cloud.len()).map(truth).collect();
    let judged = |outside: bool| {
        let is_one = |index: &usize| (found.cloud.trust[*index] == Trust::Outside) == outside;
        let points: Vec<usize> = (0..found.cloud.len()).filter(is_one).collect();
        accuracy(&found, &truth, (model, rig), &points)
    };
    let drawn = results::figures(&found, (&made, model), &sides);
    let summary = SceneSummary {
        points: drawn.points,
        density: drawn.density,
        inside: judged(false),
        outside: judged(true),
    };
    Ok((summary, drawn))
}

/// Of some of the points; `None` where there are none.
fn accuracy(
    found: &Reconstruction,
    truth: &[Option<Point3>],
    (model, rig): (&Calibration, &Rig),
    points: &[usize],
) -> Option<Accuracy> {
    let pixel = |camera: usize, index: usize| {
        let [x, y] = found.cloud.pixels[camera][index].map(f64::from);
        Some(Pixel::new(x, y))
    };
    let row = |index: &usize| Correspondence {
        view: 0,
        id: None,
        pixels: (0..2).map(|camera| pixel(camera, *index)).collect(),
        world: truth[*index],
        board: None,
    };
    let data = Dataset {
        unit: model.unit.clone(),
        cameras: 2,
        views: Vec::new(),
        correspondences: points.iter().map(row).collect(),
    };
    let own = evaluate(&*model.reconstructor, &data, model.viewpoint).ok()?;
    let floor = floor(&rig.cameras, &data).ok()?;
    let (mut within, mut count) = ([0; 2], 0);
    for index in points {
        let Some(truth) = truth[*index] else { continue };
        for axis in 0..3 {
            let off = found.cloud.points[*index][axis] - truth[axis];
            let ratio = off.abs() / f64::from(found.cloud.sigmas[*index][axis]);
            within[0] += usize::from(ratio < 1.0);
            within[1] += usize::from(ratio < 2.0);
            count += 1;
        }
    }
    Some(Accuracy {
        share: points.len() as f64 / found.cloud.len() as f64,
        median: own.median,
        ratio_to_floor: own.median / floor.median,
        within: within.map(|within| within as f64 / f64::from(count.max(1))),
    })
}
