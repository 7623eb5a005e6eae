//! `wheatstone convert`.

use super::print_json;
use crate::{
    conversion::{
        Cameras, PictureSizes, board, listed, read_cameras, shown, source, write_cameras,
        write_model,
    },
    failure::{Failure, Outcome},
    input::{columns, positive},
    output::refuse_inputs,
    verbosity::{remark, say},
};
use clap::{Args, builder::PossibleValuesParser};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wheatstone::{
    formats::{FORMATS, Format, Given, gather, save},
    tables::ColumnNames,
};

/// Convert calibrations and points between programs
#[derive(Args)]
#[command(
    override_usage = "wheatstone convert [OPTIONS] <IN>... <OUT>",
    after_help = "Examples:\n  wheatstone convert stereo.yml model.json\n  \
    wheatstone convert --from kalibr camchain.yaml --to colmap rig/\n  \
    wheatstone convert left.cameramodel right.cameramodel model.json\n  \
    wheatstone convert --from dltdv --size 1280x1024 dltCoefs.csv model.json\n  \
    wheatstone convert located.csv cloud.ply\n\n\
    Cameras become a model (model.json) on which `locate` works, or cameras of another format; points\n\
    become points. docs/formats.md lists what each format holds, and its conventions."
)]
pub(crate) struct Convert {
    /// The input (files, or a folder of them), then the output
    #[arg(required = true, num_args = 1.., value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Input format [default: recognised by name and content]
    #[arg(long, value_name = "FORMAT", value_parser = names(Format::reads))]
    from: Option<String>,
    /// Output format [default: by extension; of cameras, a model]
    #[arg(long, value_name = "FORMAT", value_parser = names(Format::writes))]
    to: Option<String>,
    /// Unit of lengths; files in another unit are converted [default: theirs, else mm]
    #[arg(long)]
    unit: Option<String>,
    #[command(flatten)]
    told: PictureSizes,
    /// Number of corner columns of a chart and their distance, for lists of corners without it
    #[arg(long, value_name = "COLUMNSxPITCH", value_parser = board)]
    board: Option<(usize, f64)>,
    /// Names of the columns in a table: NAME=COLUMN,… or all names in order (`_`: none)
    #[arg(long, value_name = "NAMES", value_parser = columns)]
    columns: Option<ColumnNames>,
    /// Standard deviation of a pixel coordinate, which calibration files do not contain
    // The better half of the real sets that the project is tested on reprojects to 0.5 px or less.
    #[arg(long, value_name = "PIXELS", default_value = "0.5", value_parser = positive)]
    pixel_sigma: f64,
    /// Print what was written, and the loss of accuracy, as JSON
    #[arg(long)]
    json: bool,
}

/// The names of formats, and `model`.
fn names(which: fn(&Format) -> bool) -> PossibleValuesParser {
    let formats = FORMATS.iter().filter(move |format| which(format)).map(|format| format.name);
    PossibleValuesParser::new(std::iter::once("model").chain(formats))
}

impl Convert {
    pub(crate) fn run(self) -> Outcome {
        let Some((output, paths)) = self.paths.split_last().filter(|(_, paths)| !paths.is_empty())
        else {
            return Err(Failure::usage(
                "only one path is given",
                "give the input, then the output",
            ));
        };
        refuse_inputs(output, paths.iter().map(PathBuf::as_path))?;
        let from = source(self.from.as_deref(), paths)?;
        let given = Given {
            columns: self.columns.clone(),
            ..self.told.given(self.unit.clone(), self.board)
        };
        let told = if from.is_some_and(|format| !format.is_calibration()) {
            self.points(from, paths, &given, output)?
        } else {
            self.cameras(from, paths, &given, output)?
        };
        if self.json { print_json(&told) } else { Ok(()) }
    }

    /// The format to write, of cameras or of points; `None` for a model.
    fn target(&self, output: &Path, cameras: bool) -> Outcome<Option<&'static Format>> {
        match self.to.as_deref() {
            Some("model") => Ok(None),
            Some(name) => Ok(Some(Format::named(name)?)),
            None => by_extension(output, cameras),
        }
    }

    fn cameras(
        &self,
        from: Option<&'static Format>,
        paths: &[PathBuf],
        given: &Given,
        output: &Path,
    ) -> Outcome<Value> {
        let (cameras, files) = read_cameras(from, paths, given)?;
        match (self.target(output, true)?, &cameras, from) {
            (Some(to), _, _) => write_cameras(&cameras, to, given, output),
            (None, Cameras::Rig(rig), Some(from)) => {
                write_model(rig, from, &files, self.pixel_sigma, output)
            }
            _ => Err(Failure::usage("the input is already a model", "choose another `--to`")),
        }
    }

    fn points(
        &self,
        from: Option<&'static Format>,
        paths: &[PathBuf],
        given: &Given,
        output: &Path,
    ) -> Outcome<Value> {
        let (Some(from), Some(to)) = (from, self.target(output, false)?) else {
            return Err(Failure::usage(
                "points cannot be converted to a model",
                "`wheatstone fit` fits a model to them",
            ));
        };
        to.check_name(output)?;
        let files = gather(from, paths)?;
        let data = from.read_points(&files, given)?;
        let unit = from.unit_of_points(&files, given)?;
        let files = save(&to.write_points(&data, &Given { unit, ..given.clone() })?, output)?;
        let (all, left_out) = (data.correspondences.len(), to.left_out(&data));
        if left_out > 0 {
            remark!(
                "note",
                "left out {left_out} of {all} points, which have no X, Y, Z: `{}` cannot hold them",
                to.name
            );
        }
        say!("Wrote {} points to {}", all - left_out, listed(&files));
        Ok(json!({
            "format": to.name,
            "files": shown(&files),
            "cameras": data.cameras,
            "unit": data.unit,
            "points": all - left_out,
            "left_out": left_out,
        }))
    }
}

/// The format that an output's extension names; `None` for a model.
fn by_extension(path: &Path, cameras: bool) -> Outcome<Option<&'static Format>> {
    let end = path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default();
    let name = match (end.as_str(), cameras) {
        ("json", true) => return Ok(None),
        ("yml", true) => "opencv",
        ("toml", true) => "anipose",
        ("csv", false) => "csv",
        ("arrow" | "feather", false) => "arrow",
        ("npy", false) => "npy",
        ("parquet", false) => "parquet",
        ("ply", false) => "ply",
        ("pcd", false) => "pcd",
        _ => {
            return Err(Failure::usage(
                format!("the name `{}` does not tell the output format", path.display()),
                "give `--to NAME`; `wheatstone list formats` has the names",
            ));
        }
    };
    Ok(Some(Format::named(name)?))
}
