//! `wheatstone reconstruct`.

use super::{locate::needs_two_cameras, print_json};
use crate::{
    failure::{Failure, Outcome},
    picture_pairs::pairs,
    progress::Bar,
    table::figure,
    verbosity::{remark, say},
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error, Pixel,
    formats::npy_float32,
    imaging::{GrayImage, Limits, read_colour_image, read_size},
    numeric::statistics::median,
    progress::Progress,
    reconstruction::{
        DepthPng, PairReconstructor, Reconstruction, ReconstructionSettings, binary_ply, depth_png,
        depth_tiff,
    },
    report::{CloudCamera, SceneCloud},
    stereo::PairFault,
    storage::{Output, write_folder},
};

/// Reconstruct what two calibrated cameras see: a point cloud with error bars, depth maps
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone reconstruct model.json --images left.png right.png -o out/\n  \
    wheatstone reconstruct model.json --images left/*.png right/*.png -o out/\n  \
    wheatstone reconstruct model.json --images left.png right.png --range 300:1500 -o out/\n\n\
    The folder gets cloud.ply (points in the world with colours, standard deviations and\n\
    confidence), depth.tiff and depth.png (depths along the axis of the left rectified camera),\n\
    scene.html to look at, disparity.npy, confidence.png and summary.json; of several pairs each has a folder of its own.\n\
         docs/reconstruction.md has the rest."
)]
pub(crate) struct Reconstruct {
    /// The model file, of any method
    model: PathBuf,
    /// Pictures of the first and of the second camera: two files, two folders with as many files each,
    /// or all files of the first camera and then as many of the second
    #[arg(long, num_args = 2.., required = true, value_names = ["FIRST", "SECOND"])]
    images: Vec<PathBuf>,
    /// Two of the model's cameras, counted from 1, in the order of the pictures
    #[arg(long, value_name = "A,B", default_value = "1,2", value_parser = super::rectify::two)]
    cameras: [usize; 2],
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
    /// Part of the first camera's picture: left, top, width and height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    /// The folder for the results
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Reconstruct pairs that do not fit together, too: from cameras that have moved, or exchanged
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
        let pairs = pairs(&self.images)?;
        let Some(first) = pairs.first() else {
            return Err(Failure::usage(
                "the folders hold no pictures",
                "give pictures of both cameras",
            ));
        };
        let places: BTreeSet<PathBuf> =
            pairs.iter().map(|pair| self.place(pair, pairs.len())).collect();
        if places.len() < pairs.len() {
            return Err(Failure::usage(
                "two pictures of the first camera have the same name, and their results would have the same folder",
                "give them different names, or reconstruct them one after the other",
            ));
        }
        let made = PairReconstructor::new(&model, self.settings(first)?, &bar)?;
        let mut frames = Vec::with_capacity(pairs.len());
        let mut written = 0;
        for (index, pair) in pairs.iter().enumerate() {
            bar.report("reconstructing", index as u64, pairs.len() as u64);
            bar.check().map_err(Error::from)?;
            let frame = self.frame((&made, &model), pair, pairs.len())?;
            written += usize::from(frame["points"].is_u64());
            frames.push(frame);
        }
        drop(bar);
        if written == 0 {
            return Err(Failure::Library(Error::Degenerate {
                problem: "no pair could be reconstructed".into(),
                hint: "are the pictures in the order of `--cameras`? Were the cameras moved since the calibration?".into(),
            }));
        }
        let whole = self.whole(&made, &model, frames);
        if pairs.len() > 1 {
            wheatstone::storage::write(&self.output.join("summary.json"), &pretty(&whole))?;
        }
        if self.json { print_json(&whole) } else { Ok(()) }
    }

    /// Reconstructs one of so many pairs, and says what of it. A single one at fault is an error; of several it is left
    /// out.
    fn frame(
        &self,
        (made, model): (&PairReconstructor, &Calibration),
        pair: &[PathBuf; 2],
        count: usize,
    ) -> Outcome<Value> {
        let read = |path: &Path| read_colour_image(path, Limits::default());
        let found = made.reconstruct([&read(&pair[0])?, &read(&pair[1])?])?;
        if let Some(fault) = found.fault {
            let problem = format!("{} and {}: {fault}", pair[0].display(), pair[1].display());
            if !self.force && count == 1 {
                let hint = way_out(&fault).into();
                return Err(Failure::Library(Error::Degenerate { problem, hint }));
            }
            remark!("warning", "{problem}");
            if !self.force {
                return Ok(json!({ "images": pair, "fault": fault.to_string() }));
            }
        }
        let place = self.place(pair, count);
        let mut frame = summary(&found);
        frame["images"] = json!(pair);
        let alone = count == 1;
        let whole =
            if alone { self.whole(made, model, vec![frame.clone()]) } else { frame.clone() };
        let title = pair[0].display().to_string();
        write_folder(&place, |folder| write(&found, (made, model), (&title, &whole), folder))?;
        tell(&found, model, &place);
        Ok(frame)
    }

    fn settings(&self, first: &[PathBuf; 2]) -> Outcome<ReconstructionSettings> {
        let mut settings =
            ReconstructionSettings::new([read_size(&first[0])?, read_size(&first[1])?]);
        settings.cameras = self.cameras.map(|camera| camera - 1);
        settings.depths = self.range;
        settings.least_confidence = self.confidence;
        settings.most_sigma = self.max_sigma;
        settings.region = self.region;
        Ok(settings)
    }

    /// Where the results of a pair go.
    fn place(&self, pair: &[PathBuf; 2], count: usize) -> PathBuf {
        if count == 1 {
            return self.output.clone();
        }
        let stem = pair[0].file_stem().unwrap_or_default().to_string_lossy();
        self.output.join(wheatstone::storage::file_name(&stem))
    }

    /// What is said of all pairs.
    fn whole(&self, made: &PairReconstructor, model: &Calibration, frames: Vec<Value>) -> Value {
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
            "nothing was written; fit again, or reconstruct anyway with `--force`; `wheatstone evaluate` says which camera has moved"
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
        "fault": found.fault.map(|fault| fault.to_string()),
    })
}

fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}

/// All files of a pair.
fn write(
    found: &Reconstruction,
    (made, model): (&PairReconstructor, &Calibration),
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
    cloud(found, &model.unit, &folder.join("cloud.ply"))?;
    put("depth.tiff", &|bytes| {
        depth_tiff(size, &found.depth, &model.unit, std::io::Cursor::new(bytes))
    })?;
    put("depth.png", &|bytes| depth_png(size, &found.depth, DepthPng::of(&found.depth), bytes))?;
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
    made: &PairReconstructor,
    model: &Calibration,
    title: &str,
) -> SceneCloud {
    let cloud = &found.cloud;
    let cameras = made.settings().cameras.into_iter().zip(made.settings().sizes);
    let camera = |(camera, [width, height]): (usize, [u32; 2])| {
        let [right, bottom] = [width, height].map(|side| f64::from(side) - 0.5);
        let corners = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]];
        let rays = corners.map(|[x, y]| model.reconstructor.unproject(camera, Pixel::new(x, y)));
        let side = usize::from(made.pair().cameras[0] != camera);
        let centre = made.pair().centres()[side];
        CloudCamera {
            name: format!("camera {}", camera + 1),
            centre: Some([centre.x, centre.y, centre.z]),
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
        pixels: cloud.pixels.to_vec(),
        cameras: cameras.map(camera).collect(),
    }
}

fn cloud(found: &Reconstruction, unit: &str, path: &Path) -> Result<(), Error> {
    let failed = |source| Error::Io { action: "write", path: path.into(), source };
    let mut output = Output::create(path)?;
    let mut buffered = BufWriter::new(&mut output);
    binary_ply(&found.cloud, unit, &mut buffered)
        .and_then(|()| buffered.flush())
        .map_err(failed)?;
    drop(buffered);
    output.commit()
}
