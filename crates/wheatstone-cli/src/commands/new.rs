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
    chart::{AnyChart, svg},
    storage,
};

/// Begin a capture: a commented capture.toml to fill in, a folder a camera, and a chart to print
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone new capture/\n  \
    wheatstone new tank/ --chart chessboard --columns 9 --rows 6 --pitch 25 --cameras top,side,front\n\n\
    Then print chart.svg, take pictures, say in capture.toml where the chart stood, and run\n\
    `wheatstone fit capture/ -o model.json`.")]
pub(crate) struct New {
    /// The capture's folder
    folder: PathBuf,
    /// The cameras' names, in their order
    #[arg(long, value_delimiter = ',', default_value = "left,right")]
    cameras: Vec<String>,
    /// Unit of every length
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(svg::UNITS))]
    unit: String,
    #[command(flatten)]
    chart: ChartOptions,
}

/// Pitch of a chart that fits a sheet of A4 paper, in millimetres.
const PITCH_ON_PAPER: f64 = 25.0;

/// The distances of the example, in units of the pitch: six or more give held-out views on both
/// sides and in the middle.
const DISTANCES: [f64; 6] = [20.0, 24.0, 28.0, 32.0, 36.0, 40.0];

impl New {
    pub(crate) fn run(mut self) -> Outcome {
        let file = self.folder.join(FILE_NAME);
        if file.exists() {
            return Err(Failure::usage(
                format!("`{}` is there already", file.display()),
                "choose another folder, or delete it first",
            ));
        }
        self.refuse_odd_names()?;
        let unit = svg::millimetres_per(&self.unit).unwrap_or(1.0);
        let pitch = *self.chart.pitch.get_or_insert(PITCH_ON_PAPER / unit);
        let chart = self.chart.chart("chessboard")?;
        let drawing = svg::draw(&*chart, &self.unit, "chart")?;
        let text = self.text(&chart, pitch)?;
        for camera in &self.cameras {
            storage::create_folder(&self.folder.join(camera))?;
        }
        storage::write(&self.folder.join("chart.svg"), drawing.as_bytes())?;
        storage::write(&file, text.as_bytes())?;
        let folder = self.folder.display();
        say!("Began a capture in {folder}");
        say!("  1. print {folder}/chart.svg at 100 %, tape it to a flat board, measure its pitch");
        say!(
            "  2. take a picture with every camera at each distance, into {}",
            self.cameras.join(", ")
        );
        say!("  3. say where the chart stood in {}", file.display());
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
        if sorted.len() < self.cameras.len().max(2) || !sorted.iter().all(plain) {
            return Err(Failure::usage(
                format!("the cameras cannot be called {}", self.cameras.join(",")),
                "give two or more different names of letters, digits, - and _",
            ));
        }
        Ok(())
    }

    fn text(&self, chart: &AnyChart, pitch: f64) -> Outcome<String> {
        let as_toml = serde_json::to_value(chart).map_err(std::io::Error::from)?;
        let fields = as_toml.as_object().cloned().unwrap_or_default();
        let mut text = format!(
            "# A capture: what the cameras saw, and where the chart stood.\n\
             # Every length below is in this unit, and so will be every result.\n\
             unit = \"{}\"\n\n\
             # The chart. `columns` and `rows` count inner corners (chessboard), crossings (line-grid) or dots\n\
             # (dot-grid), not squares, but for a charuco board they do. `pitch` is from one to the next: measure it on the print.\n[chart]\n",
            self.unit
        );
        // The settings that every chart has, then its own; where its origin is goes without saying.
        let first = ["type", "columns", "rows", "pitch"];
        let others = fields.keys().map(String::as_str);
        let others = others.filter(|name| !first.contains(name) && *name != "origin");
        for name in first.into_iter().chain(others) {
            if let Some(value) = fields.get(name) {
                let _ = writeln!(text, "{name} = {value}");
            }
        }
        text += "\n# The cameras, in their order: camera 1, camera 2, … Pictures pair up in sorted order, so name\n\
            # them alike. PNG, JPEG, TIFF, BMP or PNM.\n[cameras]\n";
        for camera in &self.cameras {
            let _ = writeln!(text, "{camera} = \"{camera}/*.*\"");
        }
        text += "\n# Where the middle of the chart's points stood, one entry for each picture pair, in sorted order.\n\
            # The world's origin is wherever you like: the end of the ruler will do. Two distances are the least;\n\
            # six or more spread over the depth that you want to measure are good.\n\
            # rotation (axis times angle, radians) is zero while the chart is only shifted.\n";
        for (number, distance) in DISTANCES.iter().enumerate() {
            let distance = distance * pitch;
            let _ = write!(
                text,
                "[[views]]\nname = \"{:02}\"\ntranslation = [0, 0, {distance}]\nrotation = [0, 0, 0]\n\n",
                number + 1
            );
        }
        Ok(text)
    }
}
