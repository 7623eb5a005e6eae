//! Files of other programs, in and out: what `export` and `convert` have in common.

use crate::{
    failure::{Failure, Outcome},
    progress::Bar,
    table::figure,
    verbosity::{detail, remark, say},
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error,
    dataset::Dataset,
    formats::{
        self, Approximation, Fold, Format, Given, Imported, InputFile, Loss, Rig, approximate,
        approximate_rig, calibration, gather, save,
    },
    geometry::Pixel,
    rectification::{
        AtDepth, ErrorSummary, PairSettings, Rectification, VerticalErrors, VirtualPair,
    },
};

/// What files do not say of themselves.
#[derive(Args, Clone, Default)]
pub(crate) struct PictureSizes {
    /// Width and height of the pictures; separated by commas if the cameras differ
    #[arg(long, value_name = "WxH", value_delimiter = ',', value_parser = size)]
    size: Vec<[u32; 2]>,
}

/// `10x77`, `10x0.5`.
pub(crate) fn board(text: &str) -> Result<(usize, f64), String> {
    match text.split_once('x').map(|(columns, pitch)| (columns.parse(), pitch.parse::<f64>())) {
        Some((Ok(columns), Ok(pitch))) if columns > 0 && pitch > 0.0 && pitch.is_finite() => {
            Ok((columns, pitch))
        }
        _ => Err("write a board of ten columns, 77 apart, as 10x77".into()),
    }
}

/// `1280x1024`.
pub(crate) fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once('x').map(|(w, h)| (w.parse(), h.parse()));
    match parts {
        Some((Ok(width), Ok(height))) if width > 0 && height > 0 => Ok([width, height]),
        _ => Err("write a size as 1280x1024".into()),
    }
}

impl PictureSizes {
    pub(crate) fn given(&self, unit: Option<String>, board: Option<(usize, f64)>) -> Given {
        Given { unit, sizes: self.size.clone(), board, columns: None }
    }

    /// The sizes that were given, otherwise those that are `known`.
    pub(crate) fn sizes(
        &self,
        known: Vec<Option<[u32; 2]>>,
        cameras: usize,
    ) -> Outcome<Vec<Option<[u32; 2]>>> {
        if self.size.is_empty() {
            return Ok(known);
        }
        refuse_count(self.size.len(), cameras)?;
        let given = self.given(None, None);
        Ok((0..cameras).map(|camera| given.size(camera)).collect())
    }

    /// The same for pictures in which these pixels were measured: they lie within.
    pub(crate) fn of_pixels(
        &self,
        known: Vec<Option<[u32; 2]>>,
        data: &Dataset,
    ) -> Outcome<Vec<Option<[u32; 2]>>> {
        let sizes = self.sizes(known, data.cameras)?;
        if !self.size.is_empty() {
            for (camera, size) in sizes.iter().enumerate() {
                size.map_or(Ok(()), |size| refuse_beyond(data, camera, size))?;
            }
        }
        Ok(sizes)
    }
}

/// Refuses sizes that are neither one for all cameras nor one for each.
fn refuse_count(sizes: usize, cameras: usize) -> Outcome {
    if sizes > 1 && sizes != cameras {
        return Err(Failure::usage(
            format!("`--size` gives {sizes} sizes, and there are {cameras} cameras"),
            "give one size for all cameras, or one for each, separated by commas",
        ));
    }
    Ok(())
}

/// Refuses a size that the pixels of a camera exceed, but for gross errors.
fn refuse_beyond(data: &Dataset, camera: usize, [width, height]: [u32; 2]) -> Outcome {
    const GROSS: f64 = 0.05;
    let pixels: Vec<Pixel> =
        data.correspondences.iter().filter_map(|row| row.pixels[camera]).collect();
    // The first pixel's centre or corner, or 1, may be the origin.
    let is_within = |pixel: &&Pixel| {
        (-1.0..=f64::from(width) + 1.0).contains(&pixel.x)
            && (-1.0..=f64::from(height) + 1.0).contains(&pixel.y)
    };
    let beyond = pixels.len() - pixels.iter().filter(is_within).count();
    if beyond as f64 <= GROSS * pixels.len() as f64 {
        return Ok(());
    }
    let largest = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).fold(0.0, f64::max).ceil();
    Err(Failure::usage(
        format!(
            "camera {}: {beyond} of {} pixels lie outside of {width}x{height} pictures, up to x = {} and y = {}",
            camera + 1,
            pixels.len(),
            largest(0),
            largest(1)
        ),
        "give the `--size` of the pictures in which the pixels were measured, width first",
    ))
}

/// Where cameras come from.
pub(crate) enum Cameras {
    Model(Box<Calibration>),
    Rig(Rig),
}

impl Cameras {
    fn count(&self) -> usize {
        match self {
            Self::Model(model) => model.volume.cameras(),
            Self::Rig(rig) => rig.cameras.len(),
        }
    }

    /// As a model, be it one that was imported on the spot.
    fn as_model(&self) -> Outcome<Cow<'_, Calibration>> {
        Ok(match self {
            Self::Model(model) => Cow::Borrowed(&**model),
            Self::Rig(rig) => {
                let imported = Imported {
                    format: String::new(),
                    files: Vec::new(),
                    cameras: rig.cameras.iter().map(|camera| camera.name.clone()).collect(),
                    sizes: rig.cameras.iter().map(|camera| camera.size).collect(),
                    // Nothing of a rectified pair depends on it.
                    pixel_sigma: 1.0,
                };
                Cow::Owned(calibration(rig, imported)?)
            }
        })
    }

    /// In a form that the format holds, with the sizes that were given.
    pub(crate) fn fitted(&self, format: &Format, given: &Given) -> Outcome<Approximation> {
        let bar = Bar::new();
        // A lens must hold all over the picture, so that its size counts.
        let found = match self {
            Self::Model(model) => {
                let mut model = (**model).clone();
                let size = |camera| given.size(camera).or(model.picture_size(camera));
                model.sizes = (0..model.volume.cameras()).map(size).collect();
                approximate(&model, format.forms(), &bar)
            }
            Self::Rig(rig) => {
                let mut rig = rig.clone();
                for (index, camera) in rig.cameras.iter_mut().enumerate() {
                    camera.size = given.size(index).or(camera.size);
                }
                approximate_rig(&rig, format.forms(), &bar)
            }
        };
        Ok(found.map_err(|refused| refused.of_format(format.name))?)
    }
}

/// Writes cameras in another program's format and tells of it.
pub(crate) fn write_cameras(
    cameras: &Cameras,
    format: &Format,
    given: &Given,
    output: &Path,
) -> Outcome<Value> {
    format.check_name(output)?;
    refuse_count(given.sizes.len(), cameras.count())?;
    if format.is_pair() {
        let model = cameras.as_model()?;
        let sizes = (0..model.volume.cameras()).map(|camera| given.size(camera)).collect();
        let wanted = PairSettings { sizes, ..PairSettings::default() };
        let made = Rectification::of(&model, &wanted, &Bar::new())?;
        return write_pair(&made, format, output);
    }
    let found = cameras.fitted(format, given)?;
    let files = save(&format.write_rig(&found.rig)?, output)?;
    let own = format.loss(&found.rig);
    tell_losses(&found, own.as_ref(), format.name);
    say!("Wrote {} to {}", counted(found.rig.cameras.len()), listed(&files));
    Ok(json!({
        "format": format.name,
        "files": shown(&files),
        "cameras": found.rig.cameras.len(),
        "unit": found.rig.unit,
        "loss": found.loss.or(own),
    }))
}

/// Says in what written cameras are not those of the model.
fn tell_losses(found: &Approximation, own: Option<&Loss>, format: &str) {
    let mut why = format!("`{format}` cannot hold this model");
    if let Some(Fold { camera, is_within }) = found.fold {
        let camera = camera + 1;
        if is_within {
            why = format!(
                "the lens of camera {camera} folds in its picture, where no points were seen (`{format}` could hold it)"
            );
        } else {
            remark!(
                "warning",
                "the lens of camera {camera} folds within a tenth of the picture's size beyond its edge, where no points were seen: it is exported as it is, and is of no use there"
            );
        }
    }
    for loss in found.loss.iter().chain(own) {
        remark!(
            "warning",
            "{why}: a {} was fitted to it instead, which differs by {} px rms, {} px at most",
            loss.form,
            figure(loss.rms),
            figure(loss.largest)
        );
    }
}

fn counted(cameras: usize) -> String {
    if cameras == 1 { "1 camera".into() } else { format!("{cameras} cameras") }
}

/// The virtual cameras; their rotation row by row as all matrices, which would be written column by column.
pub(crate) fn virtual_pair(pair: &VirtualPair) -> Value {
    let rotation = &pair.rectified_from_world.rotation;
    let row = |row: usize| [0, 1, 2].map(|column| rotation[(row, column)]);
    let mut told = json!(pair);
    told["rectified_from_world"]["rotation"] = json!([0, 1, 2].map(row));
    told
}

/// Writes a rectified pair and tells of it.
pub(crate) fn write_pair(made: &Rectification, format: &Format, output: &Path) -> Outcome<Value> {
    let files = save(&format.write_pair(made)?, output)?;
    let pair = &made.pair;
    let [left, right] = pair.cameras.map(|camera| camera + 1);
    say!(
        "Rectified camera {left} (left) and camera {right} (right): {} x {} pixels, focal length {} px, baseline {} {}",
        pair.size[0],
        pair.size[1],
        figure(pair.focal),
        figure(pair.baseline),
        pair.unit
    );
    tell_leftover(made);
    if let Some(followed) = &made.leftover.followed {
        remark!(
            "note",
            "this model has no projection: one was fitted to the points that it locates, to {} px rms",
            figure(followed.rms)
        );
    }
    say!("Wrote {}", listed(&files));
    Ok(json!({
        "format": format.name,
        "files": shown(&files),
        "left": left,
        "right": right,
        "unit": pair.unit,
        "pair": virtual_pair(pair),
        "leftover": made.leftover,
    }))
}

/// Says what is left of vertical differences.
fn tell_leftover(made: &Rectification) {
    let pair = &made.pair;
    let told = |judged: &VerticalErrors| {
        let ErrorSummary { median, rms, p95, max, .. } = judged.vertical;
        if max < 1e-6 {
            return "none".into();
        }
        let figures = [median, rms, p95, max].map(figure);
        format!(
            "{} px median, {} rms, 95 % below {}, {} at most",
            figures[0], figures[1], figures[2], figures[3]
        )
    };
    if let Some(judged) = &made.leftover.model {
        say!("Vertical error over the calibrated volume: {}", told(judged));
        if let Some(place) = judged.place.filter(|place| place.rms > 1e-6 * pair.depth) {
            say!(
                "This model has no single projection centre: points triangulated from the rectified pair differ from the model's by {} {} rms",
                figure(place.rms),
                pair.unit
            );
        }
        let by_depth =
            |slice: &AtDepth| format!("{} at {}", figure(slice.vertical.rms), figure(slice.depth));
        detail!(
            "rms by depth in {}: {}",
            pair.unit,
            judged.by_depth.iter().map(by_depth).collect::<Vec<_>>().join(", ")
        );
    }
    if let Some(judged) = &made.leftover.measured {
        say!(
            "Vertical error of the {} measured points, noise included: {}",
            judged.vertical.n,
            told(judged)
        );
        let [low, high] = judged.disparity.map(figure);
        say!("Disparities from {low} to {high} px");
    }
}

/// Saves a rig as a model on which points can be located.
pub(crate) fn write_model(
    rig: &Rig,
    format: &Format,
    files: &[InputFile],
    pixel_sigma: f64,
    output: &Path,
) -> Outcome<Value> {
    let name = |file: &InputFile| {
        file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let imported = Imported {
        format: format.name.into(),
        files: files.iter().map(name).collect(),
        cameras: rig.cameras.iter().map(|camera| camera.name.clone()).collect(),
        sizes: rig.cameras.iter().map(|camera| camera.size).collect(),
        pixel_sigma,
    };
    let model = calibration(rig, imported)?;
    model.save(output)?;
    say!("Wrote {} to {}", counted(rig.cameras.len()), output.display());
    remark!(
        "note",
        "the accuracy of this calibration is unknown: `locate` assumes a pixel noise of {pixel_sigma} px (--pixel-sigma) and lengths in {}, and reports every point as `outside`; `evaluate` measures the error on known points",
        model.unit
    );
    Ok(json!({
        "format": "model",
        "files": [output.display().to_string()],
        "cameras": rig.cameras.len(),
        "unit": model.unit,
        "loss": null,
    }))
}

/// Files that were written.
pub(crate) fn listed(files: &[PathBuf]) -> String {
    shown(files).join(", ")
}

pub(crate) fn shown(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|file| file.display().to_string()).collect()
}

/// The format of what is to be read; `None` for a model.
pub(crate) fn source(name: Option<&str>, paths: &[PathBuf]) -> Outcome<Option<&'static Format>> {
    Ok(match name {
        Some("model") => None,
        Some(name) => Some(Format::named(name)?),
        None => formats::guess(paths)?,
    })
}

/// Reads cameras.
pub(crate) fn read_cameras(
    format: Option<&'static Format>,
    paths: &[PathBuf],
    given: &Given,
) -> Outcome<(Cameras, Vec<InputFile>)> {
    let Some(format) = format else {
        let [path] = paths else {
            return Err(Error::Unsupported {
                format: "model".into(),
                what: "several files".into(),
                hint: "name one model".into(),
            }
            .into());
        };
        return Ok((Cameras::Model(Box::new(Calibration::load(path)?)), Vec::new()));
    };
    let files = gather(format, paths)?;
    Ok((Cameras::Rig(format.read_rig(&files, given)?), files))
}
