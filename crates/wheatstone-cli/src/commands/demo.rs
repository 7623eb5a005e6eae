//! `wheatstone demo`: the complete workflow on rendered pictures.

mod scene;

use super::{
    detect::draw,
    fit::with_epochs,
    report::{present, quoted},
};
use crate::verbosity::say;
use crate::{
    browser::Showing,
    failure::{Outcome, worded},
    progress::Bar,
    table::{figure, table},
};
use clap::Args;
use scene::{Accuracy, SceneSummary};
use serde::Serialize;
use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration,
    camera::PosedCamera,
    capture::Capture,
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    detection::{DetectionSettings, Found, detect},
    evaluate::{Evaluation, evaluate, floor},
    geometry::Vector3,
    method::AnyMethod,
    numeric::statistics::{median, percentile},
    preparation::Preparation,
    report::{Material, MethodFigures, PictureSource as Pictures, Report, Wording},
    storage,
    synthetic::{Rig, Sensor, Stage, write_capture},
    tables,
};

/// Run the complete workflow on rendered pictures: detect, fit, evaluate, reconstruct, report
///
/// Renders two unaligned cameras that look at a grid of lines at 50 to 140 cm, finds the crossings,
/// fits the 2001 paper's network and the direct linear transformation, and evaluates them on
/// held-out charts between the fitted ones. Then it reconstructs a scene, and holds the point cloud
/// against the truth. All results are in the output folder; begin with report.html.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone demo --open\n  wheatstone demo --out story/ --json > summary.json"
)]
pub(crate) struct Demo {
    /// The folder for all results
    #[arg(long, value_name = "DIR", default_value = "demo-out")]
    out: PathBuf,
    /// Epochs of the paper's training
    #[arg(long, default_value_t = 100_000)]
    epochs: u64,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    showing: Showing,
}

/// `summary.json`.
#[derive(Serialize)]
struct Summary {
    unit: String,
    detection: DetectionScore,
    whole_pixel_detection: DetectionScore,
    methods: Vec<MethodSummary>,
    scene: SceneSummary,
}

/// Detected points against where they truly are.
#[derive(Serialize)]
struct DetectionScore {
    pictures: usize,
    visible: usize,
    found: usize,
    median_error_px: f64,
    p95_error_px: f64,
}

#[derive(Serialize)]
struct MethodSummary {
    method: String,
    pixels: &'static str,
    model: String,
    training: Evaluation,
    exam: Evaluation,
    ratio_to_floor: f64,
}

/// A rendered capture with what was found in it, to a fraction of a pixel and to whole pixels.
struct Detections {
    capture: Capture,
    sub_pixel: Found,
    whole_pixel: Dataset,
}

/// Between the paper's distances.
const EXAM: Stage = Stage { near: 57.5, far: 132.5, step: 15.0 };

/// Method, preset, and whether it gets whole pixels.
const DEMONSTRATED: [(&str, &str, bool); 5] = [
    ("network", "paper", true),
    ("network", "default", true),
    ("dlt", "default", true),
    ("network", "default", false),
    ("dlt", "default", false),
];

/// The name of the report in the folder.
const REPORT: &str = "report.html";

impl Demo {
    pub(crate) fn run(self) -> Outcome {
        let (summary, report) = storage::write_folder(&self.out, |folder| self.fill(folder))?;
        self.tell(&summary, &report)
    }

    /// Writes all results.
    fn fill(&self, folder: &Path) -> Outcome<(Summary, Report)> {
        let bar = Bar::new();
        let rig = Rig::named("paper", 2)?;
        let chart = AnyChart::from(LineGrid::default());
        let say = |text: &str| say!("{text}");
        say("Two unaligned cameras look at a grid of lines, 5 cm apart, at 50 to 140 cm");
        let [capture, exam] = ["capture", "exam"].map(|name| folder.join(name));
        let training =
            self.picture((&rig, &chart), (&capture, Stage::default(), self.seed), &bar)?;
        let exam = self.picture((&rig, &chart), (&exam, EXAM, self.seed + 1), &bar)?;
        draw(&training.capture, &training.sub_pixel, &folder.join("detections"))?;
        let score = |data: &Dataset| score(&rig, &training.capture, data);
        let detection = score(&training.sub_pixel.dataset);
        let whole_pixel_detection = score(&training.whole_pixel);
        let pictures = training.sub_pixel.pictures.iter().flatten().flatten().count();
        say(&format!(
            "Found {} of {} visible crossings in {pictures} pictures, to {} px (median)",
            detection.found,
            detection.visible,
            figure(detection.median_error_px)
        ));
        let mut methods = Vec::new();
        for (name, preset, whole) in DEMONSTRATED {
            let mut method = AnyMethod::named(name)?.preset(preset)?;
            if preset == "paper" {
                method = with_epochs(&method, self.epochs)?;
            }
            let (train, test) = if whole {
                (&training.whole_pixel, &exam.whole_pixel)
            } else {
                (&training.sub_pixel.dataset, &exam.sub_pixel.dataset)
            };
            let label = if preset == "paper" { "network of 2001" } else { name };
            let rows = (train, test, whole);
            methods.push(self.fit((&method, label), rows, (&rig, folder), &bar)?);
        }
        let unit = training.sub_pixel.dataset.unit.clone();
        let best = best_model(&methods);
        let model = Calibration::load(&folder.join(best))?;
        let (scene, drawn) = scene::reconstruct(&model, (&rig, self.seed), (folder, best), &bar)?;
        let summary = Summary { unit, detection, whole_pixel_detection, methods, scene };
        let mut report = self.report(&summary, (&training, &rig), folder, &bar)?;
        report.scene = Some(drawn);
        let mut text = serde_json::to_vec_pretty(&summary).map_err(std::io::Error::from)?;
        text.push(b'\n');
        storage::write(&folder.join("summary.json"), &text)?;
        report.write_html(&folder.join(REPORT))?;
        Ok((summary, report))
    }

    fn picture(
        &self,
        (rig, chart): (&Rig, &AnyChart),
        (folder, stage, seed): (&Path, Stage, u64),
        bar: &Bar,
    ) -> Outcome<Detections> {
        let views = stage.views()?;
        write_capture(folder, (rig, chart), (&views, true), (Sensor::default(), seed), bar)?;
        let capture = Capture::open(folder)?;
        let sub_pixel = detect(&capture, DetectionSettings::default(), bar)?;
        let points = folder.join("points.csv");
        tables::save(&sub_pixel.dataset, &points)?;
        let mut whole_pixel = sub_pixel.dataset.clone();
        for row in &mut whole_pixel.correspondences {
            for pixel in row.pixels.iter_mut().flatten() {
                *pixel = pixel.map(f64::round);
            }
        }
        let points = folder.join("points-whole-pixels.csv");
        tables::save(&whole_pixel, &points)?;
        Ok(Detections { capture, sub_pixel, whole_pixel })
    }

    fn fit(
        &self,
        (method, label): (&AnyMethod, &str),
        (train, test, whole): (&Dataset, &Dataset, bool),
        (rig, folder): (&Rig, &Path),
        bar: &Bar,
    ) -> Outcome<MethodSummary> {
        let prepared = Preparation::default().run(train.clone(), self.seed, bar)?;
        let mut model = Calibration::fit(method, &prepared, self.seed, false, bar)?;
        let size = |camera: &PosedCamera| Some([camera.width as u32, camera.height as u32]);
        model.sizes = rig.cameras.iter().map(size).collect();
        let pixels = if whole { "whole pixels" } else { "sub-pixel" };
        let file = format!("{label}-{pixels}.json").replace(' ', "-");
        model.save(&folder.join(&file))?;
        let exam = evaluate(&*model.reconstructor, test, model.viewpoint)?;
        let allowed = floor(&rig.cameras, test)?;
        Ok(MethodSummary {
            method: label.into(),
            pixels,
            model: file,
            ratio_to_floor: exam.rms / allowed.rms,
            training: model.training,
            exam,
        })
    }

    /// The best of the fits, judged view by view, beside the others.
    fn report(
        &self,
        summary: &Summary,
        (seen, rig): (&Detections, &Rig),
        folder: &Path,
        bar: &Bar,
    ) -> Outcome<Report> {
        let file = best_model(&summary.methods);
        let mut command = format!("wheatstone demo --out {}", quoted(&self.out));
        if self.seed != 0 {
            command += &format!(" --seed {}", self.seed);
        }
        let material = Material {
            wording: Wording(worded),
            title: format!("demo: {file}"),
            command: Some(command),
            model: &Calibration::load(&folder.join(file))?,
            comparison: None,
            truth: Some(&rig.cameras),
            seen: Some(Pictures { capture: &seen.capture, found: &seen.sub_pixel }),
            held_out: true,
        };
        let mut report = Report::of(&material, bar)?;
        let row = |method: &MethodSummary| MethodFigures {
            method: format!("{}, {}", method.method, method.pixels),
            rms: Some(method.exam.rms),
            median: Some(method.exam.median),
            p95: Some(method.exam.p95),
            ratio_to_floor: Some(method.ratio_to_floor),
            located: Some([method.exam.located, method.exam.n]),
            chosen: method.model == file,
            problem: None,
        };
        report.methods = summary.methods.iter().map(row).collect();
        Ok(report)
    }

    /// Says what came of it, and where it is.
    fn tell(&self, summary: &Summary, report: &Report) -> Outcome {
        let row = |m: &MethodSummary| {
            vec![
                format!("{}, {}", m.method, m.pixels),
                figure(m.training.mean_percent),
                figure(m.exam.mean_percent),
                figure(m.exam.rms),
                figure(m.exam.p95),
                figure(m.ratio_to_floor),
            ]
        };
        let rows: Vec<Vec<String>> = summary.methods.iter().map(row).collect();
        let heading = ["method", "fitted, mean %", "exam, mean %", "rms cm", "95 % cm", "x floor"];
        say!("\nErrors on held-out charts between the fitted ones:\n");
        say!("{}", table(&heading, &rows));
        say!(
            "mean %: of the distance from the cameras; x floor: times the error that pixel noise alone causes"
        );
        tell_scene(&summary.scene);
        say!("\nThe best of them, by leave-one-view-out cross-validation:");
        present(report, &self.out.join(REPORT), &self.showing);
        say!("Pictures            {}", show(&self.out, "detections"));
        say!("Point cloud         {}", show(&self.out.join(scene::RESULTS), "scene.html"));
        say!("Models and figures  {}", show(&self.out, "summary.json"));
        say!("Next                wheatstone compare {}", show(&self.out, "capture"));
        if self.json {
            super::print_json(summary)?;
        }
        Ok(())
    }
}

/// The file of the best of the fits.
fn best_model(methods: &[MethodSummary]) -> &str {
    let rms = |method: &&MethodSummary| method.exam.rms;
    let best = methods.iter().min_by(|a, b| rms(a).total_cmp(&rms(b)));
    best.map_or("", |best| &best.model)
}

/// Says how far a reconstructed scene is from the truth.
fn tell_scene(scene: &SceneSummary) {
    let row = |(place, own): (&str, &Accuracy)| {
        vec![
            place.into(),
            format!("{:.0} %", 100.0 * own.share),
            figure(own.median),
            figure(own.ratio_to_floor),
            own.within.map(|share| format!("{:.0}", 100.0 * share)).join(", "),
        ]
    };
    say!(
        "\nA scene that the best of them reconstructs: {} points, {:.0} % of the pixels\n",
        scene.points,
        100.0 * scene.density
    );
    let parts = [("inside", &scene.inside), ("outside", &scene.outside)];
    let parts = parts.into_iter().filter_map(|(place, own)| Some((place, own.as_ref()?)));
    let rows: Vec<Vec<String>> = parts.map(row).collect();
    let heading = ["calibrated volume", "points", "median cm", "x floor", "within 1, 2 sigma %"];
    say!("{}", table(&heading, &rows));
    say!("x floor: times the error of the same matches, triangulated with the true cameras");
}

fn show(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

/// Compares found points with where they fall; a crossing is visible where the whole of it, a line's
/// width about its middle, lies in the picture.
fn score(rig: &Rig, capture: &Capture, found: &Dataset) -> DetectionScore {
    let points = capture.chart.points();
    let line_width = match &capture.chart {
        AnyChart::LineGrid(grid) => grid.line_width * grid.pitch,
        _ => 0.0,
    };
    let (mut visible, mut errors) = (0, Vec::new());
    for (view, pose) in capture.views.iter().map(|view| view.world_from_chart).enumerate() {
        let Some(pose) = pose else { continue };
        for (index, camera) in rig.cameras.iter().enumerate() {
            for (id, point) in points.iter().enumerate() {
                let corner = |x: f64, y: f64| {
                    let moved = point + Vector3::new(x * line_width, y * line_width, 0.0);
                    camera.project_visible(pose.transform(moved))
                };
                let all = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
                let Some(truth) = camera.project_visible(pose.transform(*point)) else { continue };
                if all.iter().any(|(x, y)| corner(*x, *y).is_none()) {
                    continue;
                }
                visible += 1;
                let name = id.to_string();
                let seen = found
                    .correspondences
                    .iter()
                    .find(|row| row.view == view && row.id.as_deref() == Some(&*name))
                    .and_then(|row| row.pixels[index]);
                errors.extend(seen.map(|pixel| (pixel - truth).norm()));
            }
        }
    }
    DetectionScore {
        pictures: capture.views.len() * rig.cameras.len(),
        visible,
        found: errors.len(),
        median_error_px: median(&errors),
        p95_error_px: percentile(&errors, 0.95),
    }
}
