//! `wheatstone reconstruct`.

pub(super) mod depths;
mod empty;
mod fault;
mod given;
mod log;
mod pictures;
pub(super) mod results;

use super::{locate::needs_two_cameras, print_json};
use crate::{
    failure::{Failure, Outcome},
    output::{Earlier, refuse_folders, refuse_inputs},
    picture_sets::frames,
    progress::Bar,
    verbosity::remark,
};
use clap::{Args, builder::PossibleValuesParser};
use depths::depths;
use empty::Empty;
use fault::{listed, named, warn_left_out};
use log::Log;
use pictures::{read, region, sizes};
use results::{file_names, pretty, summary, tell, whole, write, write_mesh};
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error,
    imaging::ColourImage,
    progress::Progress,
    reconstruction::{
        CLOUD_FORMATS, CloudFormat, FrameFusion, Reconstruction, ReconstructionSettings,
        SceneReconstructor,
    },
    storage::write_folder,
};

/// Reconstruct what two or more calibrated cameras see: a point cloud with error bars, depth maps
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone reconstruct model.json --images left.png right.png -o out/\n  \
    wheatstone reconstruct model.json --images left/*.png right/*.png -o out/\n  \
    wheatstone reconstruct model.json --images left.png right.png --range 300:1500 -o out/\n\n\
    The folder gets cloud.ply (points in the world with colours, standard deviations and\n\
    confidence), depth.tiff and depth.png (depths along the axis of the left rectified camera),\n\
    scene.html to look at, disparity.npy, confidence.png and summary.json; pictures taken at several times have a folder each.\n\
         docs/reconstruction.md has the rest."
)]
pub(crate) struct Reconstruct {
    /// The model file, of any method
    model: PathBuf,
    /// Pictures of each camera: a file each, a folder each with as many files, or all files of the first
    /// camera and then as many of the next
    #[arg(long, num_args = 2.., required = true, value_names = ["FIRST", "SECOND"])]
    images: Vec<PathBuf>,
    /// Two or more of the model's cameras, counted from 1, in the order of the pictures; the first two
    /// make the pair whose left picture is reconstructed [default: all; of two pictures the first two]
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..))]
    cameras: Vec<u16>,
    /// Nearest and farthest depth to search, in the model's unit [default: those that the model was
    /// fitted to, with a margin]
    #[arg(long, value_name = "NEAR:FAR", value_parser = depths)]
    range: Option<[f64; 2]>,
    /// Leave out points whose disparity is less than a pixel off with a smaller probability
    #[arg(long, value_name = "P", default_value_t = ReconstructionSettings::LEAST_CONFIDENCE)]
    confidence: f32,
    /// Leave out points with a larger standard deviation of X, Y or Z, in the model's unit
    #[arg(long, value_name = "LENGTH")]
    max_sigma: Option<f64>,
    /// Part of the left camera's picture: left, top, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    /// Match corners and edges only, along epipolar curves: where texture is thin, or time short
    #[arg(long, conflicts_with = "matches")]
    sparse: bool,
    /// Fuse frames of a static scene from static cameras: averages noise, outvotes a single deviating
    /// frame
    #[arg(long, conflicts_with_all = ["sparse", "matches"])]
    fuse: bool,
    /// Write the surface as well, mesh.ply: triangles between neighbouring points, and normals
    #[arg(long, conflicts_with_all = ["sparse", "matches"])]
    mesh: bool,
    /// Matches of another program instead of our own: a table with columns x1,y1,x2,y2,…, or a NumPy file
    /// of disparities of the left rectified picture that `wheatstone rectify` makes, NaN where there is none
    #[arg(long, value_name = "FILE")]
    matches: Option<PathBuf>,
    /// Their standard deviation in pixels
    #[arg(long, value_name = "PX", default_value_t = 0.5, requires = "matches", value_parser = positive)]
    matches_sigma: f64,
    /// The folder for the results
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[arg(
        long,
        help = about_cloud_formats(),
        value_name = "FORMAT",
        value_delimiter = ',',
        default_value = CLOUD_FORMATS[0].name,
        value_parser = cloud_formats(),
    )]
    cloud: Vec<String>,
    /// Log pictures, poses, depths and clouds as well, in an MCAP file that Foxglove and Rerun open; one
    /// second a frame
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Reconstruct pictures that do not fit together, too: from cameras that have moved, or exchanged
    #[arg(long)]
    force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// What formats of clouds there are.
fn about_cloud_formats() -> String {
    let about = |format: &CloudFormat| format!("{} ({})", format.name, format.about);
    let all: Vec<_> = CLOUD_FORMATS.iter().map(about).collect();
    format!("Formats of the cloud: {}", all.join(", "))
}

/// The names of formats of clouds.
fn cloud_formats() -> PossibleValuesParser {
    PossibleValuesParser::new(CLOUD_FORMATS.iter().map(|format| format.name))
}

/// A number above 0.
fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number of pixels above 0".into())
}

impl Reconstruct {
    pub(crate) fn run(self) -> Outcome {
        let bar = Bar::new();
        let model = Calibration::load(&self.model)?;
        needs_two_cameras(&model, "reconstruct")?;
        let cameras = self.cameras(model.reconstructor.cameras())?;
        let frames = frames(&self.images, cameras.len())?;
        if self.matches.is_some() && frames.len() > 1 {
            let problem = "`--matches` names matches of pictures that were taken at once";
            return Err(Failure::usage(problem, "give one picture of each camera"));
        }
        let places = self.places(&frames)?;
        let sizes = sizes(&frames, &model, &cameras)?;
        let made = SceneReconstructor::new(&model, self.settings(cameras, sizes), &bar)?;
        if let Some(path) = &self.mcap {
            let inputs = frames.iter().flatten().chain(&self.matches).chain([&self.model]);
            refuse_inputs(path, inputs.map(PathBuf::as_path))?;
        }
        let ours = file_names(CLOUD_FORMATS.iter().map(|format| format.name), true);
        let mut earlier = Earlier::default();
        for place in places.iter().chain([&self.output]) {
            earlier.look(place, "summary.json", &ours);
        }
        let mut log = Log::create(self.mcap.as_deref(), &made, &model)?;
        let told = if self.fuse {
            vec![self.fused((&made, &model), &frames, (&bar, &mut log))?]
        } else {
            self.series((&made, &model), &frames, (&bar, &mut log))?
        };
        drop(bar);
        log.commit()?;
        earlier.tell(&self.written(&frames, &told));
        let whole = whole(&self.model, (&made, &model), told);
        if frames.len() > 1 && !self.fuse {
            wheatstone::storage::write(&self.output.join("summary.json"), &pretty(&whole))?;
        }
        if self.json { print_json(&whole) } else { Ok(()) }
    }

    /// Where the results of each frame go.
    fn places(&self, frames: &[Vec<PathBuf>]) -> Outcome<BTreeSet<PathBuf>> {
        let places: BTreeSet<PathBuf> =
            frames.iter().map(|frame| self.place(frame, frames.len())).collect();
        if places.len() == frames.len() {
            return Ok(places);
        }
        Err(Failure::usage(
            "two pictures of the first camera have the same name, and their results would have the same folder",
            "give them different names, or reconstruct them one after the other",
        ))
    }

    /// The files that this run writes, by what is told of frames.
    fn written(&self, frames: &[Vec<PathBuf>], told: &[Value]) -> BTreeSet<PathBuf> {
        let names = file_names(self.cloud.iter().map(String::as_str), self.mesh);
        // What is fused is told as one frame.
        let count = told.len();
        let with_points = frames.iter().zip(told).filter(|(_, told)| told["points"].is_u64());
        let places = with_points.map(|(frame, _)| self.place(frame, count));
        let of_frames = places.flat_map(|place| names.iter().map(move |name| place.join(name)));
        of_frames.chain([self.output.join("summary.json")]).collect()
    }

    /// Reconstructs one frame after the other, and says what of each. Of several those at fault are left out.
    fn series(
        &self,
        both: (&SceneReconstructor, &Calibration),
        frames: &[Vec<PathBuf>],
        (bar, log): (&Bar, &mut Log),
    ) -> Outcome<Vec<Value>> {
        let mut told = Vec::with_capacity(frames.len());
        let mut unread = None;
        for (index, frame) in frames.iter().enumerate() {
            bar.report("reconstructing", index as u64, frames.len() as u64);
            bar.check().map_err(Error::from)?;
            match read(frame, both.0) {
                Ok(pictures) => {
                    let frame = (&frame[..], frames.len());
                    told.push(self.frame(both, (frame, &pictures), (bar, log))?);
                }
                Err(error) if frames.len() == 1 => return Err(error.into()),
                Err(error) => {
                    remark!("warning", "left out: {error}");
                    told.push(json!({ "images": frame, "fault": error.to_string() }));
                    unread.get_or_insert(error);
                }
            }
        }
        if told.iter().any(|frame| frame["points"].is_u64()) {
            return Ok(told);
        }
        Err(Failure::Library(unread.unwrap_or_else(|| Error::Degenerate {
            problem: "no pictures could be reconstructed".into(),
            hint: "are the pictures in the order of `--cameras`? Were the cameras moved since the calibration?".into(),
        })))
    }

    /// Reconstructs pictures taken at once, and says what of it. A single frame at fault is an error; of several it is
    /// left out.
    fn frame(
        &self,
        (made, model): (&SceneReconstructor, &Calibration),
        ((frame, count), pictures): ((&[PathBuf], usize), &[ColourImage]),
        (bar, log): (&Bar, &mut Log),
    ) -> Outcome<Value> {
        let pictures: Vec<&ColourImage> = pictures.iter().collect();
        let found = match &self.matches {
            Some(path) => {
                given::located((path, self.matches_sigma), (made, model), &pictures, bar)?
            }
            None => made.reconstruct(&pictures, bar)?,
        };
        let both = (frame, &pictures[..]);
        if let Some(told) = fault::of(&found, (made, model), both, bar)? {
            if !self.force && count == 1 {
                return Err(fault::refusal(told));
            }
            let [problem, _] = told;
            remark!("warning", "{problem}");
            if !self.force {
                let fault = found.fault.map_or(problem, |(_, fault)| fault.to_string());
                return Ok(json!({ "images": frame, "fault": fault }));
            }
        }
        if let Some(reason) = self.empty(&found, (made, model)) {
            if count == 1 {
                return Err(reason.into());
            }
            remark!("warning", "{}: {}", listed(frame), reason.problem);
            return Ok(json!({ "images": frame, "fault": reason.problem }));
        }
        warn_left_out(&found, made, (Some(&pictures), bar))?;
        log.frame(frame, &found)?;
        let mut told = summary(&found);
        told["images"] = json!(frame);
        self.write(
            (made, model),
            &found,
            (&frame[0].display().to_string(), told),
            &self.place(frame, count),
        )
    }

    /// Reconstructs what all pictures show together.
    fn fused(
        &self,
        (made, model): (&SceneReconstructor, &Calibration),
        frames: &[Vec<PathBuf>],
        (bar, log): (&Bar, &mut Log),
    ) -> Outcome<Value> {
        let mut fusion = FrameFusion::new(made);
        let (mut used, mut unread) = (Vec::new(), None);
        for (index, frame) in frames.iter().enumerate() {
            bar.report("matching", index as u64, frames.len() as u64);
            let pictures = match read(frame, made) {
                Ok(pictures) => pictures,
                Err(error) if frames.len() == 1 => return Err(error.into()),
                Err(error) => {
                    remark!("warning", "left out: {error}");
                    unread.get_or_insert(error);
                    continue;
                }
            };
            let pictures: Vec<&ColourImage> = pictures.iter().collect();
            match fusion.add(&pictures, bar)? {
                None => used.push(frame),
                Some(fault) => {
                    remark!("warning", "left out: {}", named(made, fault, frame));
                }
            }
        }
        if let Some(error) = unread.filter(|_| used.is_empty()) {
            return Err(error.into());
        }
        let found = fusion.finish(bar)?;
        if let Some(reason) = self.empty(&found, (made, model)) {
            return Err(reason.into());
        }
        fault::refuse_contradicting(&found, used[0], self.force)?;
        warn_left_out(&found, made, (None, bar))?;
        log.frame(used[0], &found)?;
        let title = format!("{}, {} frames", used[0][0].display(), used.len());
        let mut told = summary(&found);
        told["images"] = json!(used);
        self.write((made, model), &found, (&title, told), &self.output)
    }

    /// Why there is no point, where there is none.
    fn empty(
        &self,
        found: &Reconstruction,
        (made, model): (&SceneReconstructor, &Calibration),
    ) -> Option<Empty> {
        Some(Empty::of(made.emptied_by(found)?, (made, model), self.matches.is_some()))
    }

    /// Writes the results of pictures taken at once, and says what they are; gives back what is told of them.
    fn write(
        &self,
        (made, model): (&SceneReconstructor, &Calibration),
        found: &Reconstruction,
        (title, told): (&str, Value),
        place: &Path,
    ) -> Outcome<Value> {
        let whole = whole(&self.model, (made, model), vec![told.clone()]);
        let formats: Vec<_> =
            self.cloud.iter().filter_map(|name| CloudFormat::named(name)).collect();
        write_folder(place, |folder| -> Outcome {
            write(found, (made, model), (title, &whole), (folder, &formats))?;
            if self.mesh {
                write_mesh(found, (made, model), folder)?;
            }
            refuse_folders(folder, place)
        })?;
        tell(found, model, (place, &formats));
        Ok(told)
    }

    /// The cameras whose pictures are named, counted from 0.
    fn cameras(&self, of_model: usize) -> Outcome<Vec<usize>> {
        let named = self.images.len();
        if !self.cameras.is_empty() {
            return Ok(self.cameras.iter().map(|camera| usize::from(*camera) - 1).collect());
        }
        if named > 2 && named.is_multiple_of(of_model) {
            return Ok((0..of_model).collect());
        }
        if named.is_multiple_of(2) {
            return Ok(vec![0, 1]);
        }
        let shared = (3..=of_model).rev().find(|count| named.is_multiple_of(*count));
        let some: Vec<_> = (1..=shared.unwrap_or(2)).map(|camera| camera.to_string()).collect();
        Err(Failure::usage(
            format!("{named} pictures or folders for a model of {of_model} cameras"),
            format!(
                "give as many for each camera, or name the cameras that they are of: `--cameras {}`",
                some.join(",")
            ),
        ))
    }

    fn settings(&self, cameras: Vec<usize>, sizes: Vec<[u32; 2]>) -> ReconstructionSettings {
        let mut settings = ReconstructionSettings::new(sizes);
        settings.cameras = cameras;
        settings.depths = self.range;
        settings.least_confidence = self.confidence;
        settings.most_sigma = self.max_sigma;
        settings.region = self.region;
        settings.sparse = self.sparse;
        settings
    }

    /// Where the results of pictures taken at once go.
    fn place(&self, frame: &[PathBuf], count: usize) -> PathBuf {
        if count == 1 {
            return self.output.clone();
        }
        let stem = frame[0].file_stem().unwrap_or_default().to_string_lossy();
        self.output.join(wheatstone::storage::file_name(&stem))
    }
}
