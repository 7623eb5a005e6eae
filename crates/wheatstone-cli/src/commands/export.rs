//! `wheatstone export`.

use super::print_json;
use crate::{
    conversion::{PictureSizes, read_cameras, write_cameras},
    failure::{Failure, Outcome},
    output::refuse_inputs,
};
use clap::{Args, builder::PossibleValuesParser};
use std::path::PathBuf;
use wheatstone::formats::{FORMATS, Format};

/// Export a model's intrinsics and extrinsics for another program
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone export model.json --format opencv -o stereo.yml\n  \
    wheatstone export model.json --format colmap --size 1280x1024 -o rig/\n  \
    wheatstone export model.json --format openptv --size 1280x1024 -o cal/\n  \
    wheatstone export model.json --format myptv-cameras --size 1280x1024 -o cameras/\n\n\
    Formats of several files go into the folder that `-o` names. A model that the format cannot hold,\n\
         such as a network, is approximated by a parametric camera, and the loss is reported in pixels.\n\
    docs/formats.md lists what each format holds, and its conventions."
)]
pub(crate) struct Export {
    /// The model file
    model: PathBuf,
    /// The format; `wheatstone list formats` describes them
    #[arg(long, value_parser = PossibleValuesParser::new(
        FORMATS.iter().filter(|f| f.is_calibration() && f.writes()).map(|f| f.name)
    ))]
    format: String,
    /// The file to write, or the folder for formats of several files
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    told: PictureSizes,
    /// Print what was written, and the loss of accuracy, as JSON
    #[arg(long)]
    json: bool,
}

impl Export {
    pub(crate) fn run(self) -> Outcome {
        if self.output.as_os_str() == "-" {
            return Err(Failure::usage(
                "cameras are not written to standard output",
                "name a file with `-o`",
            ));
        }
        refuse_inputs(&self.output, [&*self.model])?;
        let format = Format::named(&self.format)?;
        let given = self.told.given(None, None);
        let (cameras, _) = read_cameras(None, &[self.model], &given)?;
        let told = write_cameras(&cameras, format, &given, &self.output)?;
        if self.json { print_json(&told) } else { Ok(()) }
    }
}
