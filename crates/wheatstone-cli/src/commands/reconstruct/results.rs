//! What `wheatstone reconstruct` writes.

use super::depths::searched;
use crate::{
    commands::match_pictures::vertical,
    conversion::virtual_pair,
    table::figure,
    verbosity::{remark, say},
};
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error, Pixel,
    formats::npy_float32,
    imaging::GrayImage,
    numeric::statistics::median,
    reconstruction::{
        CloudFormat, DepthPng, Mesh, PairCheck, Reconstruction, SceneReconstructor, depth_png,
        depth_tiff, write_ply,
    },
    report::{CloudCamera, SceneCloud, SceneFigures},
    stereo::PairFault,
};

/// Medians of the points' standard deviations.
pub(super) fn sigmas(found: &Reconstruction) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let values: Vec<f64> =
            found.cloud.sigmas.iter().map(|sigma| f64::from(sigma[axis])).collect();
        median(&values)
    })
}

pub(in crate::commands) fn summary(found: &Reconstruction) -> Value {
    let matched = found.map.disparity.iter().filter(|value| !value.is_nan()).count();
    let offset = |check: &PairCheck| {
        let mut told = vertical(check.vertical?);
        told["cameras"] = json!(check.cameras.map(|camera| camera + 1));
        Some(told)
    };
    json!({
        "points": found.cloud.len(),
        "matched": matched as f64 / found.map.disparity.len() as f64,
        "confident": found.map.density(0.9),
        "sigma_median": if found.cloud.is_empty() { Value::Null } else { json!(sigmas(found)) },
        "bounds": found.cloud.bounds(),
        "inside_calibrated_volume": found.cloud.trusted(),
        "depth_png_step": DepthPng::of(&found.depth).step,
        "fault": found.fault.map(|(_, fault)| fault.to_string()),
        "vertical_offsets": found.checks.iter().filter_map(offset).collect::<Vec<_>>(),
        "warnings": found.doubts(1),
        "cameras_left_out": found.left_out.iter().map(|camera| camera + 1).collect::<Vec<_>>(),
    })
}

/// What is said of all frames: the model's file, and what each frame has.
pub(in crate::commands) fn whole(
    file: &Path,
    (made, model): (&SceneReconstructor, &Calibration),
    frames: Vec<Value>,
) -> Value {
    let range = made.disparities();
    let matrix = made.pair().depth_matrix();
    let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    json!({
        "model": file,
        "unit": model.unit,
        "rectified": virtual_pair(made.pair()),
        "Q": rows,
        "disparities": [range.start, range.end],
        "confidence": shortest(made.settings().least_confidence),
        "frames": frames,
    })
}

/// A number of single precision as short as it was written: 0.95, and not 0.949999988079071.
fn shortest(number: f32) -> Value {
    number.to_string().parse::<f64>().map_or(Value::Null, |number| json!(number))
}

pub(super) fn pretty(value: &Value) -> Vec<u8> {
    format!("{value:#}\n").into_bytes()
}

/// The names of a frame's files, with clouds in some formats.
pub(super) fn file_names<'n>(
    formats: impl IntoIterator<Item = &'n str>,
    mesh: bool,
) -> BTreeSet<String> {
    const ALWAYS: [&str; 6] = [
        "depth.tiff",
        "depth.png",
        "disparity.npy",
        "confidence.png",
        "scene.html",
        "summary.json",
    ];
    let clouds = formats.into_iter().map(|name| format!("cloud.{name}"));
    let others = ALWAYS.into_iter().chain(mesh.then_some("mesh.ply"));
    clouds.chain(others.map(String::from)).collect()
}

/// All files of a frame, the cloud in each of some formats.
pub(in crate::commands) fn write(
    found: &Reconstruction,
    (made, model): (&SceneReconstructor, &Calibration),
    (title, summary): (&str, &Value),
    (folder, formats): (&Path, &[&CloudFormat]),
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
    for format in formats {
        format.save(&found.cloud, &model.unit, &folder.join(format!("cloud.{}", format.name)))?;
    }
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

/// The surface through the points.
pub(super) fn write_mesh(
    found: &Reconstruction,
    (made, model): (&SceneReconstructor, &Calibration),
    folder: &Path,
) -> Result<(), Error> {
    let mesh = Mesh::of(&found.cloud, found.map.width, made.pair().centres()[0]);
    write_ply(&found.cloud, Some(&mesh), &model.unit, &folder.join("mesh.ply"))
}

pub(super) fn tell(
    found: &Reconstruction,
    model: &Calibration,
    (place, formats): (&Path, &[&CloudFormat]),
) {
    let cloud = &found.cloud;
    say!(
        "Wrote {}: {} points, {:.0} % of the pixels; median standard deviations of X, Y, Z: {} {}",
        place.display(),
        cloud.len(),
        100.0 * cloud.len() as f64 / found.depth.len() as f64,
        sigmas(found).map(figure).join(", "),
        model.unit
    );
    let rounded = cloud.float_rounding().filter(|_| formats.iter().any(|format| format.is_single));
    if let Some(rounding) = rounded {
        let single = formats.iter().filter(|format| format.is_single);
        let names: Vec<_> = single.map(|format| format!("cloud.{}", format.name)).collect();
        remark!(
            "note",
            "{} has single precision: so far from the origin it rounds X, Y or Z by up to {} {}; other formats \
             (`--cloud`) hold all digits",
            names.join(", "),
            figure(rounding),
            model.unit
        );
    }
    // A model of another program has no volume.
    if model.imported.is_none() && cloud.trusted() < 0.5 {
        remark!(
            "warning",
            "{:.0} % of the points lie where the calibration had no data: their standard deviations are extrapolated",
            100.0 * (1.0 - cloud.trusted())
        );
    }
}

/// What pictures are called in a report.
pub(in crate::commands) fn names(pictures: &[PathBuf]) -> Vec<String> {
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    pictures.iter().map(name).collect()
}

/// What a report tells of a scene.
pub(in crate::commands) fn figures(
    found: &Reconstruction,
    (made, model): (&SceneReconstructor, &Calibration),
    pictures: &[PathBuf],
) -> SceneFigures {
    let pictures = names(pictures);
    if let Some((_, fault)) = found.fault {
        let problem = match fault {
            PairFault::Vertical(_) | PairFault::Exchanged | PairFault::SamePicture => {
                fault.to_string()
            }
            _ => format!("{fault}; depths of {} were searched (--range)", searched(made, model)),
        };
        return SceneFigures { pictures, problem: Some(problem), ..Default::default() };
    }
    SceneFigures {
        sample: page(found, made, model, &pictures.join(", ")).drawn(),
        pictures,
        problem: None,
        points: found.cloud.len(),
        density: found.cloud.len() as f64 / found.depth.len() as f64,
        inside: found.cloud.trusted(),
        sigmas: (!found.cloud.is_empty()).then(|| sigmas(found)),
    }
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
        let (name, area) = (format!("camera {}", camera + 1), [-0.5, -0.5, right, bottom]);
        let look = |pixel: Pixel| made.direction(camera, pixel);
        CloudCamera::looking(name, made.centre(camera), area, look)
    };
    SceneCloud {
        title: title.into(),
        unit: model.unit.clone(),
        points: cloud.points.iter().map(|point| point.map(|length| length as f32)).collect(),
        colours: cloud.colours.clone(),
        sigmas: cloud.sigmas.clone(),
        confidence: cloud.confidence.clone(),
        pixels: cloud.pixels.clone(),
        cameras: cameras.map(camera).collect(),
        warnings: found.doubts(1),
    }
}
