//! Files of other programs, in and out: what `export` and `convert` have in common.

use crate::{
    failure::Outcome,
    progress::Bar,
    table::figure,
    voice::{remark, say},
};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration, Error,
    exchange::{
        self, Approximation, Format, Given, Imported, InputFile, Rig, approximate, approximate_rig,
        calibration, gather, save,
    },
};

/// What files do not say of themselves.
#[derive(Args, Clone)]
pub(crate) struct Told {
    /// Width and height of the pictures; several, separated by commas, where cameras differ
    #[arg(long, value_name = "WxH", value_delimiter = ',', value_parser = size)]
    size: Vec<[u32; 2]>,
}

/// `10x77`, `10x0.5`.
pub(crate) fn board(text: &str) -> Result<(usize, f64), String> {
    match text.split_once('x').map(|(columns, pitch)| (columns.parse(), pitch.parse::<f64>())) {
        Some((Ok(columns), Ok(pitch))) if columns > 0 && pitch > 0.0 && pitch.is_finite() => {
            Ok((columns, pitch))
        }
        _ => Err("a board of ten columns, 77 apart, is written 10x77".into()),
    }
}

/// `1280x1024`.
fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once('x').map(|(w, h)| (w.parse(), h.parse()));
    match parts {
        Some((Ok(width), Ok(height))) if width > 0 && height > 0 => Ok([width, height]),
        _ => Err("a size is written 1280x1024".into()),
    }
}

impl Told {
    pub(crate) fn given(&self, unit: Option<String>, board: Option<(usize, f64)>) -> Given {
        Given { unit, sizes: self.size.clone(), board }
    }
}

/// Where cameras come from.
pub(crate) enum Cameras {
    Model(Box<Calibration>),
    Rig(Rig),
}

impl Cameras {
    /// In a form that the format holds, with the sizes that were given.
    pub(crate) fn fitted(&self, format: &Format, given: &Given) -> Outcome<Approximation> {
        let bar = Bar::new();
        let mut found = match self {
            Self::Model(model) => approximate(model, format.forms(), &bar)?,
            Self::Rig(rig) => approximate_rig(rig, format.forms(), &bar)?,
        };
        for (index, camera) in found.rig.cameras.iter_mut().enumerate() {
            camera.size = given.size(index).or(camera.size);
        }
        Ok(found)
    }
}

/// Writes cameras in another program's format and tells of it.
pub(crate) fn write_cameras(
    cameras: &Cameras,
    format: &Format,
    given: &Given,
    output: &Path,
) -> Outcome<Value> {
    let found = cameras.fitted(format, given)?;
    let files = save(&format.write_rig(&found.rig)?, output)?;
    if let Some(loss) = &found.loss {
        remark!(
            "warning",
            "`{}` cannot hold this model as it is: a {} was fitted to its map instead, which differs by {} px rms, {} px at most",
            format.name,
            loss.form,
            figure(loss.rms),
            figure(loss.largest)
        );
    }
    let unit = found.rig.unit.clone();
    say!("Wrote {} cameras to {}", found.rig.cameras.len(), listed(&files));
    Ok(json!({
        "format": format.name,
        "files": shown(&files),
        "cameras": found.rig.cameras.len(),
        "unit": unit,
        "loss": found.loss,
    }))
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
    say!("Wrote {} cameras to {}", rig.cameras.len(), output.display());
    remark!(
        "note",
        "nothing is known of how well these cameras were calibrated: `locate` takes pixels for good to {pixel_sigma} px (--pixel-sigma), lengths for {}, and calls every place `outside`; `evaluate` judges them on points that you know",
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
        None => exchange::guess(paths)?,
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
