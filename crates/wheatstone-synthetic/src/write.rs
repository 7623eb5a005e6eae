//! Synthetic data on disk, in the form in which users have theirs, with the truth beside them.

use super::{
    Noise, Placement, Rig, Scene, Sensor, Truth, chart_correspondences, render, scene::SCENE_STREAM,
};
use std::path::Path;
use wheatstone_charts::{
    capture::{CaptureFile, FILE_NAME, ViewEntry},
    chart::AnyChart,
};
use wheatstone_core::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pose, Vector3},
    storage,
};
use wheatstone_io::{formats::npy_float64, tables};
use wheatstone_numeric::{progress::Progress, random::Random};

/// The chart's distances, as on a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// The first, in the rig's unit.
    pub near: f64,
    /// None is beyond this.
    pub far: f64,
    /// From one to the next.
    pub step: f64,
}

impl Default for Stage {
    /// The paper's: 50, 65, 80, 95, 110, 125 and 140 cm.
    fn default() -> Self {
        Self { near: 50.0, far: 140.0, step: 15.0 }
    }
}

impl Stage {
    /// The placements: square to the world's axes, named by their distance.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for distances that do not rise or are not in front of the cameras.
    pub fn views(&self) -> Result<Vec<(String, Pose)>> {
        let valid = self.near > 0.0 && self.far >= self.near && self.step > 0.0;
        let count = ((self.far - self.near) / self.step + 1e-9).floor() + 1.0;
        if !valid || count > 1000.0 {
            return Err(Error::Setting {
                setting: "distances".into(),
                value: format!("{} to {} every {}", self.near, self.far, self.step),
                need: "0 < near <= far, and a step above 0 that makes at most 1000 distances"
                    .into(),
            });
        }
        let place = |index: usize| {
            let distance = self.near + index as f64 * self.step;
            let translation = Vector3::new(0.0, 0.0, distance);
            (view_name(distance), Pose { translation, ..Pose::default() })
        };
        Ok((0..count as usize).map(place).collect())
    }
}

/// Three digits before the point sort as the distances do.
fn view_name(distance: f64) -> String {
    if distance.fract() == 0.0 { format!("{distance:03}") } else { format!("{distance:07.3}") }
}

/// Names of the cameras in a capture.
fn camera_names(count: usize) -> Vec<String> {
    if count == 2 {
        vec!["left".into(), "right".into()]
    } else {
        (1..=count).map(|camera| format!("camera{camera}")).collect()
    }
}

/// Renders a capture into `folder`, of a chart at these placements, which the capture tells or leaves
/// open: pictures, `capture.toml`, `truth.json` with the cameras, and
/// `truth.csv` with where every visible point truly falls.
///
/// # Errors
///
/// [`Error::Io`], [`Error::Setting`], [`Error::Cancelled`].
pub fn write_capture(
    folder: &Path,
    (rig, chart): (&Rig, &AnyChart),
    (views, known): (&[Placement], bool),
    (sensor, seed): (Sensor, u64),
    progress: &dyn Progress,
) -> Result<()> {
    storage::write_folder(folder, |folder| {
        write_into(folder, (rig, chart), (views, known), (sensor, seed), progress)
    })
}

fn write_into(
    folder: &Path,
    (rig, chart): (&Rig, &AnyChart),
    (views, known): (&[Placement], bool),
    (sensor, seed): (Sensor, u64),
    progress: &dyn Progress,
) -> Result<()> {
    let names = camera_names(rig.cameras.len());
    let total = (views.len() * names.len()) as u64;
    for (index, (camera, name)) in rig.cameras.iter().zip(&names).enumerate() {
        storage::create_folder(&folder.join(name))?;
        for (view, (view_name, pose)) in views.iter().enumerate() {
            progress.check()?;
            let picture = index * views.len() + view;
            let mut random = Random::stream(seed, picture as u64 + 1);
            let image = render(camera, chart, pose, sensor, &mut random);
            image.write_png(&folder.join(name).join(format!("{view_name}.png")))?;
            progress.report("rendering", picture as u64 + 1, total);
        }
    }
    write_description(folder, chart, &names, if known { views } else { &[] })?;
    let exact = chart_correspondences(rig, chart, views, (Noise::None, seed), None);
    tables::save(&exact, &folder.join("truth.csv"))?;
    let truth = Truth { unit: "cm".into(), rig: rig.clone(), noise: Noise::None, seed };
    truth.save(&folder.join("truth.json"))
}

fn write_description(
    folder: &Path,
    chart: &AnyChart,
    names: &[String],
    views: &[(String, Pose)],
) -> Result<()> {
    let path = folder.join(FILE_NAME);
    let cameras = names
        .iter()
        .map(|name| (name.clone(), toml::Value::String(format!("{name}/*.png"))))
        .collect();
    let views = views
        .iter()
        .map(|(name, pose)| ViewEntry {
            name: name.clone(),
            translation: Some(pose.translation.into()),
            rotation: Some(pose.rotation_vector().into()),
            sigma: None,
        })
        .collect();
    let file = CaptureFile { unit: "cm".into(), chart: chart.clone(), cameras, views };
    let text = toml::to_string(&file)
        .map_err(|e| Error::writing(&path, std::io::Error::other(e.to_string())))?;
    storage::write(&path, text.as_bytes())
}

/// Writes a points file, and its truth beside it.
///
/// # Errors
///
/// [`Error::Io`].
pub fn write_points(
    path: &Path,
    data: &Dataset,
    rig: &Rig,
    (noise, seed): (Noise, u64),
) -> Result<()> {
    tables::save(data, path)?;
    let truth = Truth { unit: data.unit.clone(), rig: rig.clone(), noise, seed };
    truth.save(&Truth::path_beside(path))
}

/// Adds a scene to the folder of a capture, as a folder `scene/` that the capture does not list: of each
/// camera, by the name of its folder of charts, a picture (`left.png`), and the place in the world that each
/// pixel shows, as an array of rows x columns x 3 in the rig's unit (`left_points.npy`, float64; NaN
/// where the camera sees nothing).
///
/// # Errors
///
/// [`Error::Io`], [`Error::Cancelled`].
pub fn write_scene(
    folder: &Path,
    (rig, scene): (&Rig, &Scene),
    (sensor, seed): (Sensor, u64),
    progress: &dyn Progress,
) -> Result<()> {
    storage::write_folder(&folder.join("scene"), |folder| {
        let names = camera_names(rig.cameras.len());
        for (index, (camera, name)) in rig.cameras.iter().zip(&names).enumerate() {
            progress.check()?;
            // The scene itself is drawn from the first stream.
            let mut random = Random::stream(seed, SCENE_STREAM + 1 + index as u64);
            let image = scene.render(camera, sensor, &mut random);
            image.write_png(&folder.join(format!("{name}.png")))?;
            let places = scene.places(camera);
            let shape = [camera.height, camera.width, 3];
            let bytes = npy_float64(&shape, places.as_flattened());
            storage::write(&folder.join(format!("{name}_points.npy")), &bytes)?;
            progress.report("rendering the scene", index as u64 + 1, names.len() as u64);
        }
        Ok(())
    })
}
