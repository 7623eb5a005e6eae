//! `wheatstone new`.

use super::chart::ChartOptions;
use crate::{
    failure::{Failure, Outcome},
    verbosity::say,
};
use clap::{Args, builder::PossibleValuesParser};
use std::{fmt::Write as _, path::PathBuf};
use wheatstone::{
    capture::FILE_NAME,
    chart::{
        AnyChart,
        sheet::{self, Sheet},
    },
    storage,
};

/// Create a capture: a commented capture.toml to fill in, one folder per camera, and a chart to
/// print
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone new capture/\n  \
    wheatstone new waved/ --hand-held      for a hand-held board, whose poses are estimated\n  \
    wheatstone new tank/ --chart chessboard --columns 9 --rows 6 --pitch 25 --cameras top,side,front\n\n\
    Then print chart.pdf, take pictures, enter the chart poses in capture.toml unless the board was held\n\
    by hand, and run `wheatstone fit capture/ -o model.json`.")]
pub(crate) struct New {
    /// The capture's folder
    folder: PathBuf,
    /// Names of the cameras, in order
    #[arg(long, value_delimiter = ',', default_value = "left,right")]
    cameras: Vec<String>,
    /// Unit of every length
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(sheet::UNITS))]
    unit: String,
    /// For a board held by hand: no chart poses to enter, they are estimated with the cameras
    #[arg(long)]
    hand_held: bool,
    #[command(flatten)]
    chart: ChartOptions,
}

/// Pitch of a chart that fits a sheet of A4 paper, in millimetres.
const PITCH_ON_PAPER: f64 = 25.0;

/// Six or more views give held-out ones on both sides and in the middle.
const VIEWS: usize = 6;

/// Distances that suit a chart, in units of the pitch.
const DISTANCES: [f64; 2] = [20.0, 40.0];

impl New {
    pub(crate) fn run(self) -> Outcome {
        let file = self.folder.join(FILE_NAME);
        if file.exists() {
            return Err(Failure::usage(
                format!("`{}` exists already", file.display()),
                "choose another folder, or delete it first",
            ));
        }
        self.refuse_odd_names()?;
        let unit = sheet::millimetres_per(&self.unit).unwrap_or(1.0);
        let pitch = PITCH_ON_PAPER / unit;
        let chart = self.chart.chart("chessboard", Some(pitch))?;
        let (measured, pitch) = match chart.size() {
            Some(("pitch", pitch)) => ("pitch", pitch),
            Some((_, tag)) => ("tags", tag),
            None => ("points", pitch),
        };
        let sheet = Sheet::new(&chart, &self.unit, None)?;
        let text = self.text(&chart, pitch)?;
        storage::write_folder(&self.folder, |folder| {
            for camera in &self.cameras {
                storage::create_folder(&folder.join(camera))?;
            }
            storage::write(&folder.join("chart.pdf"), &sheet.pdf())?;
            storage::write(&folder.join(FILE_NAME), text.as_bytes())
        })?;
        let folder = self.folder.display();
        say!("Created a capture in {folder}");
        let chart = self.folder.join("chart.pdf");
        say!(
            "  1. print {} at 100 %, tape it to a flat board, measure its {measured}",
            chart.display()
        );
        let cameras = self.cameras.join(", ");
        if self.hand_held {
            say!(
                "  2. hold the board in ten or more poses, tilted another way in each, and take a"
            );
            say!("     picture of each with every camera at once, into {cameras}");
            say!("  3. enter the measured {measured} in {}", file.display());
        } else {
            say!("  2. take a picture with every camera at each distance, into {cameras}");
            say!("  3. enter the chart poses in {}", file.display());
        }
        say!("  4. wheatstone fit {folder} -o model.json");
        Ok(())
    }

    fn refuse_odd_names(&self) -> Outcome {
        let mut sorted = self.cameras.clone();
        sorted.sort();
        sorted.dedup();
        let plain = |name: &String| {
            !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c))
        };
        // A board held by hand calibrates one camera alone, too.
        let (least, needed) =
            if self.hand_held { (1, "different") } else { (2, "two or more different") };
        if sorted.len() < self.cameras.len().max(least) || !sorted.iter().all(plain) {
            return Err(Failure::usage(
                format!("the cameras cannot be called {}", self.cameras.join(",")),
                format!("give {needed} names of letters, digits, - and _"),
            ));
        }
        Ok(())
    }

    fn text(&self, chart: &AnyChart, pitch: f64) -> Outcome<String> {
        let as_toml = serde_json::to_value(chart).map_err(std::io::Error::from)?;
        let fields = as_toml.as_object().cloned().unwrap_or_default();
        let mut text = format!(
            "# A capture: the pictures of every camera, and the chart that they show.\n\
             # Every length below is in this unit, and so is every result.\n\
             unit = \"{}\"\n\n\
             # The chart. `columns` and `rows` count inner corners (chessboard), crossings (line-grid) or dots\n\
             # (dot-grid), but squares of a charuco board and tags of an april-grid. `pitch` is the distance of neighbours,\n\
             # `tag` the side of a tag: measure it on the print.\n[chart]\n",
            self.unit
        );
        // The settings that every chart has, then its own; where its origin is goes without saying.
        let first = ["type", "columns", "rows", "pitch", "tag"];
        let others = fields.keys().map(String::as_str);
        let others = others.filter(|name| !first.contains(name) && *name != "origin");
        for name in first.into_iter().chain(others) {
            if let Some(value) = fields.get(name) {
                let _ = writeln!(text, "{name} = {value}");
            }
        }
        text += "\n# The cameras, in their order: camera 1, camera 2, … Name the pictures of one view alike: they are paired\n\
         # by their names, otherwise in sorted order. A view need not have a picture of every camera. PNG, JPEG,\n\
         # TIFF, BMP or PNM.\n[cameras]\n";
        for camera in &self.cameras {
            let _ = writeln!(text, "{camera} = \"{camera}/*.*\"");
        }
        text += &if self.hand_held { HAND_HELD.to_owned() } else { poses(pitch) };
        Ok(text)
    }
}

/// What a capture without chart poses says of them.
const HAND_HELD: &str = "\n# No [[views]]: the board is held by hand, and where it was is estimated with the cameras. Good views:\n\
    # - ten or more, near and far, some in the corners of the pictures;\n\
    # - the board tilted by twenty degrees or more, another way in each;\n\
    # - held still, or all cameras triggered at once; every camera shares views with another.\n\
    # The world frame is that of the chart in the first view (`fit --gauge first-camera`: that of camera 1).\n";

/// The chart poses to fill in, at distances that suit the pitch.
fn poses(pitch: f64) -> String {
    let [near, far] = DISTANCES.map(|distance| distance * pitch);
    // Made-up distances would be fitted silently by whoever forgets to replace them.
    let mut text = format!(
        "\n# The chart poses: where the centre of the chart's points is, one entry per picture pair, in sorted order.\n\
        # Enter the measured distance of each view in place of nan. The world origin is wherever you like, such as\n\
        # the end of the ruler. Use at least two distances, better six or more, spread over the depth that you want\n\
        # to measure; {near} to {far} from the cameras suits this chart.\n\
        # rotation is a rotation vector (axis times angle, radians): zero while the chart is only shifted.\n"
    );
    for number in 1..=VIEWS {
        let _ = write!(
            text,
            "[[views]]\nname = \"{number:02}\"\ntranslation = [0, 0, nan]\nrotation = [0, 0, 0]\n\n"
        );
    }
    text
}
