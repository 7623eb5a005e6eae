//! How the robot learns where pairs of pixels point: a chart of lines is stood before it at the paper's
//! distances, and a method is fitted to the crossings that its cameras see.

use super::{
    PlanarPose,
    world::{Board, Eye, World},
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use wheatstone_charts::{
    capture::{CameraPictures, Capture, CapturedView},
    chart::{AnyChart, line_grid::LineGrid},
    detection::{DetectionSettings, Found, detect_in},
    imaging::GrayImage,
};
use wheatstone_core::{
    Calibration, Result,
    geometry::{Pose, Vector3},
    method::AnyMethod,
    preparation::Prepared,
};
use wheatstone_numeric::{progress::Progress, random::Random};
use wheatstone_synthetic::Stage;

/// The chart: as wide and as high as the farthest picture shows.
#[must_use]
pub fn chart() -> AnyChart {
    LineGrid { columns: 21, rows: 5, pitch: 5.0, ..LineGrid::default() }.into()
}

/// How high the chart's middle stands above the floor, in centimetres: its board rests on it.
const MIDDLE: f64 = 13.5;

/// Pictures of the chart at the paper's distances, before a robot at the start of a world whose floor is
/// still empty.
#[derive(Clone, Debug)]
pub struct ChartPictures {
    capture: Capture,
    pictures: BTreeMap<PathBuf, GrayImage>,
}

impl ChartPictures {
    /// Takes them.
    ///
    /// # Errors
    ///
    /// None with the built-in stage.
    pub fn take(eyes: &[Eye; 2], world: &World, random: &mut Random) -> Result<Self> {
        let empty = World { obstacles: Vec::new(), ..world.clone() };
        let chart = chart();
        let names = ["left", "right"];
        let path = |camera: usize, view: &str| Path::new(names[camera]).join(view);
        let (mut views, mut pictures) = (Vec::new(), BTreeMap::new());
        for (name, mut pose) in Stage::default().views()? {
            pose.translation -= Vector3::new(0.0, MIDDLE, 0.0);
            let board = Board { chart: &chart, robot_from_chart: pose };
            for (camera, eye) in eyes.iter().enumerate() {
                let picture = eye.look(&empty, PlanarPose::default(), Some(&board), random);
                pictures.insert(path(camera, &name), picture);
            }
            views.push(CapturedView { name, world_from_chart: Some(pose), sigma: None });
        }
        let cameras = (0..2).map(|camera| CameraPictures {
            name: names[camera].into(),
            pictures: views.iter().map(|view| Some(path(camera, &view.name))).collect(),
        });
        let capture = Capture {
            path: PathBuf::from("robot"),
            unit: "cm".into(),
            cameras: cameras.collect(),
            chart,
            views,
        };
        Ok(Self { capture, pictures })
    }

    /// The chart's crossings in all of them.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Degenerate`] where the chart is not found, [`wheatstone_core::Error::Cancelled`].
    pub fn detect(&self, progress: &dyn Progress) -> Result<Found> {
        let read = |path: &Path| match self.pictures.get(path) {
            Some(picture) => Ok(picture.clone()),
            None => Ok(GrayImage::from_fn(1, 1, |_, _| 0.0)),
        };
        detect_in(&self.capture, DetectionSettings::default(), &read, progress)
    }

    /// Fits a method to the crossings.
    ///
    /// # Errors
    ///
    /// Those of [`ChartPictures::detect`] and of [`AnyMethod::fit_checked`].
    pub fn calibrate(
        &self,
        method: &AnyMethod,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Calibration> {
        let mut data = self.detect(progress)?.dataset;
        data.correspondences.retain(|row| row.seen_by() == 2);
        Calibration::fit(method, &Prepared::as_given(data), seed, false, progress)
    }

    /// The picture of a view (counted from 0) by a camera.
    #[must_use]
    pub fn picture(&self, camera: usize, view: usize) -> Option<&GrayImage> {
        self.pictures.get(self.capture.cameras.get(camera)?.pictures.get(view)?.as_ref()?)
    }

    /// What the chart stood like in each view.
    #[must_use]
    pub fn places(&self) -> Vec<Pose> {
        self.capture.views.iter().filter_map(|view| view.world_from_chart).collect()
    }
}
