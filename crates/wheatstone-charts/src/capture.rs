//! A capture on disk: `capture.toml` and the pictures that it names.

mod faults;
mod pairing;
mod passed_over;
mod stars;

use crate::{
    chart::{AnyChart, kalibr_target},
    imaging::{is_picture, read_size},
};
use pairing::{Picture, pair_up, refuse};
use serde::{Deserialize, Serialize};
use stars::starred;
use std::path::{Component, Path, PathBuf};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    geometry::{Pose, Vector3},
    limits, storage, unit,
};

/// The name of the file that describes a capture.
pub const FILE_NAME: &str = "capture.toml";

/// What the user recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// The file that describes it.
    pub path: PathBuf,
    /// The unit of every length in it.
    pub unit: String,
    /// What was shown to the cameras.
    pub chart: AnyChart,
    /// The cameras, in the order in which pixels are given.
    pub cameras: Vec<CameraPictures>,
    /// The chart's placements, one picture a camera each.
    pub views: Vec<CapturedView>,
}

/// One camera's pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPictures {
    /// Its name.
    pub name: String,
    /// One picture a view, in the views' order; none where the camera has none of the view.
    pub pictures: Vec<Option<PathBuf>>,
}

/// One placement of the chart.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturedView {
    /// Its name.
    pub name: String,
    /// Where the chart stood, where that is known.
    pub world_from_chart: Option<Pose>,
    /// Standard deviation of that place along each axis, in the capture's unit, where it is given.
    pub sigma: Option<f64>,
}

/// `capture.toml` as it stands in the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureFile {
    /// The unit of every length in it.
    pub unit: String,
    /// What was shown to the cameras.
    pub chart: AnyChart,
    /// A pattern of picture files a camera.
    pub cameras: toml::Table,
    /// Where the chart stood.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<ViewEntry>,
}

/// One `[[views]]` entry.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewEntry {
    /// Its name.
    pub name: String,
    /// `world_from_chart`, in the capture's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<[f64; 3]>,
    /// `world_from_chart`: axis times angle, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f64; 3]>,
    /// Standard deviation of the translation along each axis, in the capture's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// Where a capture's pictures may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Reach {
    /// In the folder of its file, and in those within it.
    #[default]
    Folder,
    /// Anywhere: patterns may be absolute or go up, and links may lead out.
    Anywhere,
}

impl Capture {
    /// Reads `capture.toml`, or the folder that holds one, and finds the pictures in that folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] naming the line.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, Reach::Folder)
    }

    /// Reads a capture whose pictures may be elsewhere.
    ///
    /// # Errors
    ///
    /// As [`Capture::open`].
    pub fn open_within(path: &Path, reach: Reach) -> Result<Self> {
        let path = if path.is_dir() { path.join(FILE_NAME) } else { path.to_path_buf() };
        let text = storage::read_text(&path, limits::SETTINGS_BYTES)?;
        let malformed = |e: toml::de::Error| faults::malformed(&path, &text, &e);
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut table: toml::Table = toml::from_str(&text).map_err(malformed)?;
        let mut file: CaptureFile = if kalibr_target::declare(&mut table, folder)? {
            table.try_into().map_err(malformed)?
        } else {
            toml::from_str(&text).map_err(malformed)?
        };
        file.chart.load(folder)?;
        file.chart.validate().map_err(|e| {
            refuse(&path, e.to_string(), e.hint().as_deref().unwrap_or("correct it"))
        })?;
        Self::resolve(path, file, reach)
    }

    /// The cameras without a picture of a view, with the view: both by name.
    pub fn missing(&self) -> impl Iterator<Item = (&str, &str)> {
        self.cameras.iter().flat_map(|camera| {
            let of_views = camera.pictures.iter().zip(&self.views);
            let missing = of_views.filter(|(picture, _)| picture.is_none());
            missing.map(|(_, view)| (camera.name.as_str(), view.name.as_str()))
        })
    }

    /// Says which pictures were paired, or which were taken for those of which view, by the order of their names alone; none
    /// where their names, or those of views, tell.
    #[must_use]
    pub fn order_of_pairs(&self) -> Option<String> {
        let names: Vec<&str> = self.views.iter().map(|view| &*view.name).collect();
        let pictures = |view: usize| {
            self.cameras.iter().filter_map(move |camera| camera.pictures[view].as_deref())
        };
        let is_named = |view: usize| {
            pictures(view).any(|file| {
                let name = names[view].rsplit('/').next().unwrap_or_default();
                pairing::stem(file).contains(name)
                    || file.components().any(|part| part.as_os_str() == name)
            })
        };
        let paired = pairing::is_by_order(&self.files(), &names);
        let given = !paired && !(0..names.len()).all(is_named);
        let together = |view: usize| {
            let stems = pictures(view).map(pairing::stem).collect::<Vec<_>>().join(" with ");
            if given { format!("`{}` is of {stems}", names[view]) } else { stems }
        };
        let last = names.len().checked_sub(1)?;
        let others = if last > 1 { ", …, " } else { ", " };
        let last = if last > 0 { format!("{others}{}", together(last)) } else { String::new() };
        let what = match (paired, given) {
            (true, _) => "pictures were paired",
            (_, true) => "pictures were taken for those of the views",
            _ => return None,
        };
        Some(format!("{what} in the order of their names: {}{last}", together(0)))
    }

    /// Says which files beside the pictures were passed over, as pictures of a kind that cannot be read.
    #[must_use]
    pub fn passed_over(&self) -> Option<String> {
        passed_over::told(&passed_over::beside(&self.files()))
    }

    /// The pictures of each camera.
    fn files(&self) -> Vec<Vec<PathBuf>> {
        let own = |camera: &CameraPictures| camera.pictures.iter().flatten().cloned().collect();
        self.cameras.iter().map(own).collect()
    }

    /// Width and height of each camera's pictures in pixels; all pictures of a camera have that of its
    /// first.
    #[must_use]
    pub fn sizes(&self) -> Vec<Option<[u32; 2]>> {
        let first =
            |camera: &CameraPictures| read_size(camera.pictures.iter().flatten().next()?).ok();
        self.cameras.iter().map(first).collect()
    }

    /// Pictures of a scene without a chart, one a camera: files in the folder `scene` beside the capture's file, named after the
    /// cameras (`scene/left.png`). None where a camera has none. Links are not followed.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] where a camera has two.
    pub fn scene(&self) -> Result<Option<Vec<PathBuf>>> {
        let folder = self.path.with_file_name("scene");
        let is_folder = std::fs::symlink_metadata(&folder).is_ok_and(|found| found.is_dir());
        let Some(entries) = is_folder.then(|| std::fs::read_dir(&folder).ok()).flatten() else {
            return Ok(None);
        };
        let plain =
            entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
        let mut files: Vec<PathBuf> = plain.map(|entry| entry.path()).collect();
        files.sort();
        let mut pictures = Vec::new();
        for camera in &self.cameras {
            let named =
                |file: &&PathBuf| file.file_stem().is_some_and(|stem| *stem == *camera.name);
            let mut own = files.iter().filter(|file| named(file) && read_size(file).is_ok());
            let (first, second) = (own.next(), own.next());
            if let (Some(first), Some(second)) = (first, second) {
                let problem =
                    format!("two pictures of camera `{}`: {} too", camera.name, second.display());
                return Err(refuse(first, problem, "leave one of them in the folder"));
            }
            pictures.push(first.cloned());
        }
        Ok(pictures.into_iter().collect())
    }

    fn resolve(path: PathBuf, file: CaptureFile, reach: Reach) -> Result<Self> {
        if unit::is_of_other_kind(&file.unit) {
            let problem = format!("`{}` is given for the unit of lengths", file.unit);
            return Err(refuse(&path, problem, "give a unit such as mm"));
        }
        let (mut names, mut files) = (Vec::new(), Vec::new());
        for (name, pattern) in &file.cameras {
            let Some(pattern) = pattern.as_str() else {
                return Err(refuse(
                    &path,
                    format!("camera `{name}` is not a file pattern in quotes"),
                    "such as `left = \"left/*.png\"`",
                ));
            };
            names.push(name.clone());
            let folder = path.parent().unwrap_or(Path::new(""));
            let picture =
                |file: PathBuf| Picture::new(file.clone(), starred(folder, pattern, &file));
            let own = matching_files(&path, name, pattern, reach)?;
            files.push(own.into_iter().map(picture).collect());
        }
        if files.is_empty() {
            return Err(refuse(
                &path,
                "no cameras under [cameras]: triangulation needs two or more".into(),
                "give one line per camera, such as `left = \"left/*.png\"`",
            ));
        }
        let given = file.views.iter().map(|entry| entry.name.clone()).collect();
        let (pictures, views) = pair_up(&path, (&names, files), given)?;
        let pictures = names.into_iter().zip(pictures);
        let cameras = pictures.map(|(name, pictures)| CameraPictures { name, pictures }).collect();
        let mut views = if file.views.is_empty() {
            let view = |name| CapturedView { name, world_from_chart: None, sigma: None };
            views.into_iter().map(view).collect()
        } else {
            file.views.iter().map(|entry| view_of(&path, entry)).collect::<Result<Vec<_>>>()?
        };
        place_bodies(&path, &file.chart, &mut views)?;
        Ok(Self { path, unit: file.unit, chart: file.chart, cameras, views })
    }
}

/// A chart that is not flat and was shown once is the world itself; shown more often, its places must be
/// known.
fn place_bodies(path: &Path, chart: &AnyChart, views: &mut [CapturedView]) -> Result<()> {
    let flat = chart.points().iter().all(|point| point.z == 0.0);
    if flat || views.iter().all(|view| view.world_from_chart.is_some()) {
        return Ok(());
    }
    if let [only] = views {
        only.world_from_chart = Some(Pose::default());
        return Ok(());
    }
    Err(refuse(
        path,
        format!("{} views of a non-planar chart without known poses", views.len()),
        "give every view its `translation` (and `rotation`) under [[views]], or record a single view: its chart frame is then the world frame",
    ))
}

/// The files that a pattern names, sorted; relative patterns begin at the capture's folder.
fn matching_files(path: &Path, camera: &str, pattern: &str, reach: Reach) -> Result<Vec<PathBuf>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let elsewhere = |what: &str| Error::Malformed {
        path: path.into(),
        line: None,
        problem: format!("camera `{camera}`: `{what}` is not in the folder of this file"),
        hint: Hint::new("move the pictures into that folder", Remedy::Follow),
    };
    let inward = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
    if reach == Reach::Folder && !Path::new(pattern).components().all(inward) {
        return Err(elsewhere(pattern));
    }
    // Characters of the folder's own name are meant literally.
    let full = if Path::new(pattern).is_absolute() || folder.as_os_str().is_empty() {
        pattern.to_owned()
    } else {
        format!("{}/{pattern}", glob::Pattern::escape(&folder.to_string_lossy()))
    };
    let found = glob::glob(&full).map_err(|e| {
        refuse(
            path,
            format!("camera `{camera}`: `{pattern}` is not a valid file pattern: {}", e.msg),
            "`*` stands for any part of a name, as in `left/*.png`",
        )
    })?;
    let mut files: Vec<PathBuf> =
        found.filter_map(|entry| entry.ok()).filter(|p| p.is_file()).collect();
    files.sort();
    // `left/*` names what is no picture, too.
    if files.iter().any(|file| is_picture(file)) {
        files.retain(|file| is_picture(file));
    }
    if reach == Reach::Folder {
        let whole = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let whole = whole.canonicalize().map_err(|e| Error::reading(folder, e))?;
        // A link may lead out.
        let is_within = |file: &&PathBuf| file.canonicalize().is_ok_and(|f| f.starts_with(&whole));
        if let Some(file) = files.iter().find(|file| !is_within(file)) {
            return Err(elsewhere(&file.display().to_string()));
        }
    }
    if files.is_empty() {
        return Err(refuse(
            path,
            format!("camera `{camera}`: no file matches `{pattern}`"),
            "patterns are relative to the folder of this file; check spelling and extension",
        ));
    }
    Ok(files)
}

fn view_of(path: &Path, entry: &ViewEntry) -> Result<CapturedView> {
    if entry.rotation.is_some() && entry.translation.is_none() {
        return Err(refuse(
            path,
            format!("view `{}` has a rotation but no translation", entry.name),
            "give `translation = [x, y, z]` too, or neither for a hand-held chart",
        ));
    }
    if entry.translation.iter().flatten().any(|number| number.is_nan()) {
        return Err(refuse(
            path,
            format!("view `{}` has no pose yet: its `translation` has a nan", entry.name),
            "enter where the chart stood, of every view; or remove all of [[views]] if it was held by hand",
        ));
    }
    let numbers = entry.translation.iter().chain(&entry.rotation).flatten();
    if numbers.clone().any(|number| !number.is_finite()) {
        return Err(refuse(
            path,
            format!("the pose of view `{}` has a value that is not finite", entry.name),
            "give lengths in `unit` and angles in radians, as finite numbers",
        ));
    }
    let world_from_chart = entry.translation.map(|translation| {
        let rotation = entry.rotation.unwrap_or_default();
        Pose::from_rotation_vector(Vector3::from(translation), Vector3::from(rotation))
    });
    if entry.sigma.is_some_and(|sigma| !(sigma.is_finite() && sigma >= 0.0)) {
        return Err(refuse(
            path,
            format!("the `sigma` of view `{}` is not a standard deviation", entry.name),
            "give a length in `unit` that is not negative",
        ));
    }
    Ok(CapturedView { name: entry.name.clone(), world_from_chart, sigma: entry.sigma })
}
