//! `wheatstone report`.

mod scene;

use super::{locate::needs_two_cameras, methods_named, reconstruct::depths::depths};
use crate::{
    browser::Showing,
    failure::{Failure, Outcome, worded},
    input::{Reading, Source, load},
    output::{refuse_inputs, refuse_other_than_page},
    prepare::Preparing,
    progress::Bar,
    verbosity::{remark, say},
};
use clap::Args;
use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration,
    dataset::Dataset,
    evaluate::{Comparison, compare},
    method::AnyMethod,
    report,
    report::{Material, PictureSource, Wording},
    storage::Output,
    synthetic::Truth,
};

/// Write a report on a model: accuracy, reprojection errors, coverage, and a 3-D view
///
/// Given a model, evaluates it on its own data by leave-one-view-out cross-validation. Given a
/// capture or a points file, compares the methods, then fits and evaluates the best. The report is
/// one HTML file and needs no network.
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone report model.json -o report.html\n  \
    wheatstone report model.json --pictures capture/ -o report.html\n  \
    wheatstone report capture/ -o report.html --json summary.json --figures figures/")]
pub(crate) struct Report {
    /// A model file, a capture, or a points file with X, Y, Z
    input: PathBuf,
    /// The HTML file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write all figures as numbers to this JSON file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write every figure as an SVG file to this folder
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// The capture that a model was fitted to, for its pictures
    #[arg(long, value_name = "CAPTURE")]
    pictures: Option<PathBuf>,
    /// Nearest and farthest depth of a scene in the capture's folder `scene`, in the model's unit [default:
    /// those that the model was fitted to, with a margin]
    #[arg(long, value_name = "NEAR:FAR", value_parser = depths)]
    range: Option<[f64; 2]>,
    /// Methods to compare before the fit to a capture or a points file, separated by commas, or `none`
    #[arg(long, value_delimiter = ',', default_values_t = COMPARED.map(String::from))]
    methods: Vec<String>,
    /// Skip leave-one-view-out cross-validation: the errors are then those on the fitted points
    #[arg(long)]
    no_validation: bool,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    showing: Showing,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    preparing: Preparing,
}

/// The methods that take seconds.
const COMPARED: [&str; 6] = ["dlt", "tsai", "brown", "kannala-brandt", "soloff", "neural-camera"];

impl Report {
    pub(crate) fn run(self) -> Outcome {
        refuse_inputs(&self.output, [&*self.input])?;
        refuse_other_than_page(&self.output)?;
        Output::check(&self.output)?;
        if let Some(json) = &self.json {
            refuse_inputs(json, [&*self.input])?;
            Output::check(json)?;
        }
        let bar = Bar::new();
        let report = if is_model(&self.input) { self.of_model(&bar)? } else { self.of_data(&bar)? };
        drop(bar);
        write(&report, &self.output, &self.showing)?;
        if let Some(json) = &self.json {
            report.write_summary(json)?;
            say!("Figures as numbers  {}", json.display());
        }
        if let Some(figures) = &self.figures {
            report.write_figures(figures)?;
            say!("Figures             {}", figures.display());
        }
        Ok(())
    }

    fn of_model(&self, bar: &Bar) -> Outcome<report::Report> {
        let model = Calibration::load(&self.input)?;
        needs_two_cameras(&model, "report")?;
        let pictures = match &self.pictures {
            Some(capture) => Some(load(capture, &self.reading, bar)?),
            None => None,
        };
        let source = pictures.as_ref().and_then(|loaded| loaded.source.as_ref());
        if self.pictures.is_some() && source.is_none() {
            return Err(Failure::usage(
                "`--pictures` names no capture",
                "give the folder that holds capture.toml",
            ));
        }
        if let Some(source) = source
            && source.capture.cameras.len() != model.reconstructor.cameras()
        {
            return Err(wheatstone::Error::Mismatch {
                what: "number of cameras",
                model: model.reconstructor.cameras().to_string(),
                data: source.capture.cameras.len().to_string(),
            }
            .into());
        }
        if let Some(loaded) = &pictures {
            tell_other_points(&model, &loaded.data);
        }
        let truth = pictures.as_ref().and_then(|loaded| loaded.truth.as_ref());
        self.judged(&model, (None, truth, source), bar)
    }

    fn of_data(&self, bar: &Bar) -> Outcome<report::Report> {
        let loaded = load(&self.input, &self.reading, bar)?;
        let truth = loaded.truth.as_ref();
        let prepared = self.preparing.run(&loaded, None, self.seed, bar)?;
        let comparison = match self.compared()? {
            methods if methods.is_empty() => None,
            methods => {
                let cameras = truth.map(|truth| truth.rig.cameras.as_slice());
                Some(compare(&methods, &prepared.data, cameras, self.seed, bar)?)
            }
        };
        let auto = AnyMethod::named("auto")?;
        let model = Calibration::fit(&auto, &prepared, self.seed, false, bar)?;
        self.judged(&model, (comparison.as_ref(), truth, loaded.source.as_ref()), bar)
    }

    fn compared(&self) -> Outcome<Vec<AnyMethod>> {
        if self.methods == ["none"] {
            return Ok(Vec::new());
        }
        methods_named(&self.methods)
    }

    fn judged(
        &self,
        model: &Calibration,
        (comparison, truth, source): (Option<&Comparison>, Option<&Truth>, Option<&Source>),
        bar: &Bar,
    ) -> Outcome<report::Report> {
        let pictures = source.map(|source| source.capture.scene()).transpose()?.flatten();
        if self.range.is_some() && pictures.is_none() {
            return Err(Failure::usage(
                "`--range` is of a scene, and the capture has none",
                "put a picture of each camera, named after it, into its folder `scene`",
            ));
        }
        let name = self.input.file_name().unwrap_or(self.input.as_os_str());
        let material = Material {
            wording: Wording(worded),
            title: name.to_string_lossy().into(),
            command: Some(self.command()),
            model,
            comparison,
            truth: truth.map(|truth| truth.rig.cameras.as_slice()),
            seen: source
                .map(|source| PictureSource { capture: &source.capture, found: &source.found }),
            held_out: !self.no_validation,
        };
        let mut report = report::Report::of(&material, bar)?;
        if let Some(pictures) = pictures {
            report.scene = Some(scene::figures(model, (&pictures, self.range), bar)?);
        }
        Ok(report)
    }

    /// What to type to get the report again.
    fn command(&self) -> String {
        let mut words = vec!["wheatstone".into(), "report".into(), quoted(&self.input)];
        if let Some(pictures) = &self.pictures {
            words.extend(["--pictures".into(), quoted(pictures)]);
        }
        if let Some([near, far]) = self.range {
            words.extend(["--range".into(), format!("{near}:{far}")]);
        }
        if self.methods != COMPARED {
            words.extend(["--methods".into(), self.methods.join(",")]);
        }
        if self.no_validation {
            words.push("--no-validation".into());
        }
        if self.seed != 0 {
            words.extend(["--seed".into(), self.seed.to_string()]);
        }
        words.extend(self.reading.words());
        words.extend(self.preparing.words());
        words.extend(["-o".into(), quoted(&self.output)]);
        words.join(" ")
    }
}

/// A path as a shell takes it.
pub(crate) fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Whether a path names a model and not data: models are JSON.
fn is_model(path: &Path) -> bool {
    path.is_file() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

/// Writes the page, says what it comes to and where it is, and shows it where that is asked for.
pub(crate) fn write(report: &report::Report, path: &Path, showing: &Showing) -> Outcome {
    report.write_html(path)?;
    present(report, path, showing);
    Ok(())
}

/// The same of a page that is written.
pub(crate) fn present(report: &report::Report, path: &Path, showing: &Showing) {
    say!("{}", report.verdict.sentence);
    say!("Report              {}", path.display());
    showing.show(path);
}

/// Says where pictures show so many more or fewer points than a model was fitted to that it was hardly to these.
fn tell_other_points(model: &Calibration, data: &Dataset) {
    /// Views without a chart and points of one camera make less of a difference.
    const MOST: f64 = 1.5;
    let fitted = model.training.n + model.outliers.len();
    let shown = data.correspondences.iter().filter(|row| row.seen_by() >= 2).count();
    let ratio = shown as f64 / fitted.max(1) as f64;
    if !(1.0 / MOST..=MOST).contains(&ratio) {
        remark!(
            "warning",
            "the pictures show {shown} points and the model was fitted to {fitted}: are they those that it was fitted to? \
             (`--pictures`)"
        );
    }
}
