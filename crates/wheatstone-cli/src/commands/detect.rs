//! `wheatstone detect`.

use super::print_json;
use crate::verbosity::say;
use crate::{
    failure::Outcome, input::open_and_detect, output::refuse_inputs, progress::Bar, table::table,
};
use clap::Args;
use serde_json::json;
use std::{
    io::Write,
    path::{Path, PathBuf},
};
use wheatstone::{
    capture::Capture,
    detection::Found,
    geometry::Pixel,
    imaging::{Annotated, Limits, read_image},
    numeric::statistics::median,
    storage, tables,
};

/// Detect chart points in every picture of a capture
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone detect capture/ -o points.csv\n  \
    wheatstone detect capture/ --draw found/ -o points.csv    also draw what was found")]
pub(crate) struct Detect {
    /// The capture: its folder or its capture.toml
    capture: PathBuf,
    /// The points file to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write copies of the pictures with the detections drawn in to this folder
    #[arg(long, value_name = "DIR")]
    draw: Option<PathBuf>,
    /// Round to whole pixels, as the 2001 paper measured
    #[arg(long)]
    whole_pixels: bool,
    /// Read pictures outside of the capture's folder too, where capture.toml or links lead there
    #[arg(long)]
    follow: bool,
    /// Print the number of points in each picture as JSON, instead of the points
    #[arg(long)]
    json: bool,
}

impl Detect {
    pub(crate) fn run(self) -> Outcome {
        if let Some(output) = &self.output {
            refuse_inputs(output, [&*self.capture])?;
        }
        let bar = Bar::new();
        let how = (self.follow, self.whole_pixels);
        let (capture, found) = open_and_detect(&self.capture, how, &bar)?;
        drop(bar);
        if let Some(folder) = &self.draw {
            draw(&capture, &found, folder)?;
        }
        if let Some(path) = &self.output {
            tables::save(&found.dataset, path)?;
        }
        say!("{}", summary(&capture, &found).trim_end());
        if self.json {
            print_json(&as_json(&capture, &found))?;
        } else if self.output.is_none() {
            std::io::stdout().write_all(tables::write(&found.dataset).as_bytes())?;
        }
        Ok(())
    }
}

fn summary(capture: &Capture, found: &Found) -> String {
    let mut heading = vec!["view"];
    heading.extend(capture.cameras.iter().map(|camera| camera.name.as_str()));
    let mut skipped = String::new();
    let mut rows = Vec::new();
    for (view, pictures) in capture.views.iter().zip(&found.pictures) {
        let mut row = vec![view.name.clone()];
        for picture in pictures {
            let Some(picture) = picture else {
                row.push("no picture".into());
                continue;
            };
            match &picture.outcome {
                Ok(detection) => row.push(detection.points.len().to_string()),
                Err(why) => {
                    row.push("-".into());
                    skipped += &format!("skipped {}: {why}\n", picture.path.display());
                }
            }
        }
        rows.push(row);
    }
    let all = found.pictures.iter().flatten().flatten().count();
    let seen = found.pictures.iter().flatten().flatten().filter(|p| p.outcome.is_ok()).count();
    let matched = found.dataset.correspondences.iter().filter(|c| c.seen_by() >= 2).count();
    format!(
        "{}{skipped}The chart was found in {seen} of {all} pictures; {matched} points were seen by two cameras or more\n",
        table(&heading, &rows)
    )
}

fn as_json(capture: &Capture, found: &Found) -> serde_json::Value {
    let mut pictures = Vec::new();
    for (view, row) in capture.views.iter().zip(&found.pictures) {
        for (camera, picture) in capture.cameras.iter().zip(row) {
            let outcome = picture.as_ref().map(|picture| &picture.outcome);
            let points = outcome.map_or(0, |found| found.as_ref().map_or(0, |d| d.points.len()));
            let skipped = match outcome {
                Some(outcome) => outcome.as_ref().err().map(String::as_str),
                None => Some("no picture"),
            };
            pictures.push(json!({
                "view": view.name,
                "camera": camera.name,
                "picture": picture.as_ref().map(|picture| &picture.path),
                "points": points,
                "skipped": skipped,
            }));
        }
    }
    json!({ "pictures": pictures })
}

/// Draws the points of every picture; neighbours in the order of their ids are joined.
pub(crate) fn draw(capture: &Capture, found: &Found, folder: &Path) -> Outcome {
    storage::write_folder(folder, |folder| draw_into(capture, found, folder))
}

fn draw_into(capture: &Capture, found: &Found, folder: &Path) -> Outcome {
    for (view, row) in capture.views.iter().zip(&found.pictures) {
        for (camera, picture) in capture.cameras.iter().zip(row) {
            let Some(picture) = picture else { continue };
            let image = read_image(&picture.path, Limits::default())?;
            let mut canvas = Annotated::new(&image);
            let points: Vec<Pixel> =
                picture.outcome.iter().flat_map(|d| d.points.iter().map(|p| p.1)).collect();
            let steps: Vec<f64> = points.windows(2).map(|p| (p[1] - p[0]).norm()).collect();
            let next_row = 2.5 * median(&steps);
            for pair in points.windows(2).filter(|p| (p[1] - p[0]).norm() < next_row) {
                canvas.line(pair[0], pair[1], [255, 190, 60]);
            }
            for (index, point) in points.iter().enumerate() {
                // Orange for the first point, so that one observes which way the chart is read.
                canvas.cross(*point, if index == 0 { [230, 90, 0] } else { [0, 90, 200] });
            }
            let [camera, view] = [&camera.name, &view.name].map(|name| storage::file_name(name));
            canvas.write_png(&folder.join(format!("{camera}-{view}.png")))?;
        }
    }
    Ok(())
}
