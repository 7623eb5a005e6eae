//! `wheatstone reconstruct`.

use super::{locate::needs_two_cameras, print_json};
use crate::{
    failure::{Failure, Outcome},
    picture_sets::frames,
    progress::Bar,
    table::figure,
    verbosity::{remark, say},
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error, Pixel,
    formats::{npy_float32, read_npy},
    imaging::{ColourImage, GrayImage, Limits, read_colour_image, read_size},
    numeric::statistics::median,
    progress::Progress,
    reconstruction::{
        DepthPng, Reconstruction, ReconstructionSettings, SceneReconstructor, depth_png,
        depth_tiff, write_ply,
    },
    report::{CloudCamera, SceneCloud},
    stereo::{DisparityMap, PairFault},
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
    #[arg(long, value_name = "P", default_value_t = 0.9)]
    confidence: f32,
    /// Leave out points with a larger standard deviation of X, Y or Z, in the model's unit
    #[arg(long, value_name = "LENGTH")]
    max_sigma: Option<f64>,
    /// Part of the left camera's picture: left, top, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    /// Disparities of another matcher instead of our own: a NumPy file of the left rectified picture that
    /// `wheatstone rectify` makes, NaN where there is none
    #[arg(long, value_name = "FILE")]
    matches: Option<PathBuf>,
    /// Their standard deviation in pixels
    #[arg(long, value_name = "PX", default_value_t = 0.5, requires = "matches")]
    matches_sigma: f32,
    /// The folder for the results
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Reconstruct pictures that do not fit together, too: from cameras that have moved, or exchanged
    #[arg(long)]
    force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// `300:1500`.
fn depths(text: &str) -> Result<[f64; 2], String> {
    let parts = text.split_once(':').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match parts {
        Some((Ok(near), Ok(far))) => Ok([near, far]),
        _ => Err("write the nearest and the farthest depth as 300:1500".into()),
    }
}

/// `100,80,320,240`.
fn region(text: &str) -> Result<[u32; 4], String> {
    let parts: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let parts = parts.ok().and_then(|parts| <[u32; 4]>::try_from(parts).ok());
    parts
        .filter(|[_, _, width, height]| *width > 0 && *height > 0)
        .ok_or_else(|| "write left, top, width and height in pixels as 100,80,320,240".into())
}

impl Reconstruct {
    pub(crate) fn run(self) -> Outcome {
        let bar = Bar::new();
        let model = Calibration::load(&self.model)?;
        needs_two_cameras(&model, "reconstruct")?;
        let cameras = self.cameras(model.reconstructor.cameras());
        let frames = frames(&self.images, cameras.len())?;
        if self.matches.is_some() && frames.len() > 1 {
            let problem = "`--matches` names disparities of one pair of pictures";
            return Err(Failure::usage(problem, "give one picture of each camera"));
        }
        let Some(first) = frames.first() else {
            return Err(Failure::usage(
                "the folders hold no pictures",
                "give pictures of every camera",
            ));
        };
        let places: BTreeSet<PathBuf> =
            frames.iter().map(|frame| self.place(frame, frames.len())).collect();
        if places.len() < frames.len() {
            return Err(Failure::usage(
                "two pictures of the first camera have the same name, and their results would have the same folder",
                "give them different names, or reconstruct them one after the other",
            ));
        }
        let made = SceneReconstructor::new(&model, self.settings(cameras, first)?, &bar)?;
        let mut told = Vec::with_capacity(frames.len());
        let mut written = 0;
        for (index, frame) in frames.iter().enumerate() {
            bar.report("reconstructing", index as u64, frames.len() as u64);
            bar.check().map_err(Error::from)?;
            let frame = self.frame((&made, &model), (frame, frames.len()), &bar)?;
            written += usize::from(frame["points"].is_u64());
            told.push(frame);
        }
        drop(bar);
        if written == 0 {
            return Err(Failure::Library(Error::Degenerate {
                problem: "no pictures could be reconstructed".into(),
                hint: "are the pictures in the order of `--cameras`? Were the cameras moved since the calibration?".into(),
            }));
        }
        let whole = self.whole(&made, &model, told);
        if frames.len() > 1 {
            wheatstone::storage::write(&self.output.join("summary.json"), &pretty(&whole))?;
        }
        if self.json { print_json(&whole) } else { Ok(()) }
    }

    /// Reconstructs pictures taken at once, and says what of it. A single frame at fault is an error; of several it is
    /// left out.
    fn frame(
        &self,
        (made, model): (&SceneReconstructor, &Calibration),
        (frame, count): (&[PathBuf], usize),
        bar: &Bar,
    ) -> Outcome<Value> {
        let read = |path: &PathBuf| read_colour_image(path, Limits::default());
        let pictures: Vec<ColourImage> = frame.iter().map(read).collect::<Result<_, Error>>()?;
        let pictures: Vec<&ColourImage> = pictures.iter().collect();
        let found = match &self.matches {
            Some(path) => made.locate(self.given(path)?, &pictures, bar)?,
            None => made.reconstruct(&pictures, bar)?,
        };
        if let Some((cameras, fault)) = found.fault {
            let order = &made.settings().cameras;
            let at_fault = order.iter().zip(frame).filter(|(camera, _)| cameras.contains(camera));
            let at_fault: Vec<String> =
                at_fault.map(|(_, path)| path.display().to_string()).collect();
            let problem = format!("{}: {fault}", at_fault.join(" and "));
            if !self.force && count == 1 {
                let hint = way_out(&fault).into();
                return Err(Failure::Library(Error::Degenerate { problem, hint }));
            }
            remark!("warning", "{problem}");
            if !self.force {
                return Ok(json!({ "images": frame, "fault": fault.to_string() }));
            }
        }
        let place = self.place(frame, count);
        let mut told = summary(&found);
        told["images"] = json!(frame);
        let alone = count == 1;
        let whole = if alone { self.whole(made, model, vec![told.clone()]) } else { told.clone() };
        let title = frame[0].display().to_string();
        write_folder(&place, |folder| write(&found, (made, model), (&title, &whole), folder))?;
        tell(&found, model, &place);
        Ok(told)
    }

    /// Disparities of another matcher.
    fn given(&self, path: &Path) -> Outcome<DisparityMap> {
        let (values, width) = read_npy(path)?;
        let values = values.into_iter().map(|value| value as f32).collect();
        DisparityMap::given(width, values, self.matches_sigma).ok_or_else(|| {
            Failure::usage("the array of disparities is empty", "give one a rectified pixel")
        })
    }

    /// The cameras whose pictures are named, counted from 0.
    fn cameras(&self, of_model: usize) -> Vec<usize> {
        let named = self.images.len();
        let all = if named > 2 && named.is_multiple_of(of_model) { of_model } else { 2 };
        let default = || (0..all).collect();
        let counted = self.cameras.iter().map(|camera| usize::from(*camera) - 1);
        if self.cameras.is_empty() { default() } else { counted.collect() }
    }

    fn settings(&self, cameras: Vec<usize>, first: &[PathBuf]) -> Outcome<ReconstructionSettings> {
        let sizes: Vec<[u32; 2]> =
            first.iter().map(|path| read_size(path)).collect::<Result<_, Error>>()?;
        let mut settings = ReconstructionSettings::new(sizes);
        settings.cameras = cameras;
        settings.depths = self.range;
        settings.least_confidence = self.confidence;
        settings.most_sigma = self.max_sigma;
        settings.region = self.region;
        Ok(settings)
    }

    /// Where the results of pictures taken at once go.
    fn place(&self, frame: &[PathBuf], count: usize) -> PathBuf {
        if count == 1 {
            return self.output.clone();
        }
        let stem = frame[0].file_stem().unwrap_or_default().to_string_lossy();
        self.output.join(wheatstone::storage::file_name(&stem))
    }

    /// What is said of all frames.
    fn whole(&self, made: &SceneReconstructor, model: &Calibration, frames: Vec<Value>) -> Value {
        let range = made.disparities();
        let matrix = made.pair().depth_matrix();
        let rows: Vec<Vec<f64>> =
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        json!({
            "model": self.model,
            "unit": model.unit,
            "rectified": made.pair(),
            "Q": rows,
            "disparities": [range.start, range.end],
            "confidence": self.confidence,
            "frames": frames,
        })
    }
}

fn tell(found: &Reconstruction, model: &Calibration, place: &Path) {
    let cloud = &found.cloud;
    say!(
        "Wrote {}: {} points, {:.0} % of the pixels; median standard deviations of X, Y, Z: {} {}",
        place.display(),
        cloud.len(),
        100.0 * cloud.len() as f64 / found.depth.len() as f64,
        sigmas(found).map(figure).join(", "),
        model.unit
    );
    for camera in &found.left_out {
        remark!(
            "warning",
            "camera {} is left out: it shows hardly anything of the first picture",
            camera + 1
        );
    }
    if cloud.trusted() < 0.5 {
        remark!(
            "warning",
            "{:.0} % of the points lie where the calibration had no data: their standard deviations are extrapolated",
            100.0 * (1.0 - cloud.trusted())
        );
    }
}

/// What to do about a fault.
fn way_out(fault: &PairFault) -> &'static str {
    match fault {
        PairFault::Vertical(_) => {
            "nothing was written; fit again, or reconstruct anyway with `--force`; `wheatstone check POINTS --against MODEL` says which camera has moved"
        }
        PairFault::Exchanged => "nothing was written; exchange the two pictures",
        _ => {
            "nothing was written; a scene at other depths than the calibration needs `--range NEAR:FAR`; `--force` goes on"
        }
    }
}

/// Medians of the points' standard deviations.
fn sigmas(found: &Reconstruction) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let values: Vec<f64> =
            found.cloud.sigmas.iter().map(|sigma| f64::from(sigma[axis])).collect();
        median(&values)
    })
}

fn summary(found: &Reconstruction) -> Value {
    let matched = found.map.disparity.iter().filter(|value| !value.is_nan()).count();
    json!({
        "points": found.cloud.len(),
        "matched": matched as f64 / found.map.disparity.len() as f64,
        "confident": found.map.density(0.9),
        "sigma_median": if found.cloud.is_empty() { Value::Null } else { json!(sigmas(found)) },
        "bounds": found.cloud.bounds(),
        "inside_calibrated_volume": found.cloud.trusted(),
        "depth_png_step": DepthPng::of(&found.depth).step,
        "fault": found.fault.map(|(_, fault)| fault.to_string()),
        "cameras_left_out": found.left_out.iter().map(|camera| camera + 1).collect::<Vec<_>>(),
    })
}

fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}

/// All files of a frame.
fn write(
    found: &Reconstruction,
    (made, model): (&SceneReconstructor, &Calibration),
    (title, summary): (&str, &Value),
    folder: &Path,
) -> Result<(), Error> {
    let map = &found.map;
    let size = (map.width, map.height);
    let put = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> Result<(), String>| {
        let path = folder.join(name);
        let mut bytes = Vec::new();
        write(&mut bytes).map_err(|problem| Error::Io {
            action: "write",
            path: path.clone(),
            source: std::io::Error::other(problem),
        })?;
        wheatstone::storage::write(&path, &bytes)
    };
    write_ply(&found.cloud, &model.unit, &folder.join("cloud.ply"))?;
    put("depth.tiff", &|bytes| {
        depth_tiff(size, &found.depth, &model.unit, std::io::Cursor::new(bytes))
    })?;
    put("depth.png", &|bytes| {
        depth_png(size, &found.depth, (DepthPng::of(&found.depth), &model.unit), bytes)
    })?;
    put("disparity.npy", &|bytes| {
        bytes.extend(npy_float32((map.height, map.width), &map.disparity));
        Ok(())
    })?;
    let level = |x: usize, y: usize| 255.0 * map.confidence[y * map.width + x];
    GrayImage::from_fn(map.width, map.height, level).write_png(&folder.join("confidence.png"))?;
    put("scene.html", &|bytes| {
        bytes.extend(page(found, made, model, title).page().into_bytes());
        Ok(())
    })?;
    put("summary.json", &|bytes| {
        bytes.extend(pretty(summary));
        Ok(())
    })
}

/// The cloud to look at.
fn page(
    found: &Reconstruction,
    made: &SceneReconstructor,
    model: &Calibration,
    title: &str,
) -> SceneCloud {
    let cloud = &found.cloud;
    let cameras = made.settings().cameras.iter().zip(&made.settings().sizes);
    let camera = |(camera, [width, height]): (&usize, &[u32; 2])| {
        let camera = *camera;
        let [right, bottom] = [*width, *height].map(|side| f64::from(side) - 0.5);
        let corners = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]];
        let rays = corners.map(|[x, y]| model.reconstructor.unproject(camera, Pixel::new(x, y)));
        CloudCamera {
            name: format!("camera {}", camera + 1),
            centre: made.centre(camera).map(|centre| [centre.x, centre.y, centre.z]),
            corners: rays
                .into_iter()
                .collect::<Option<Vec<_>>>()
                .unwrap_or_default()
                .iter()
                .map(|ray| ray.direction.normalize().into())
                .collect(),
        }
    };
    SceneCloud {
        title: title.into(),
        unit: model.unit.clone(),
        points: cloud.points.clone(),
        colours: cloud.colours.clone(),
        sigmas: cloud.sigmas.clone(),
        confidence: cloud.confidence.clone(),
        pixels: cloud.pixels.clone(),
        cameras: cameras.map(camera).collect(),
    }
}
