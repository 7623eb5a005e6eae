//! `wheatstone compare`.

use super::{
    methods_named, print_json,
    report::{quoted, write as write_report},
};
use crate::verbosity::say;
use crate::{
    browser::Showing,
    failure::{Failure, Outcome, worded},
    input::{Loaded, Reading, load},
    output::{refuse_inputs, refuse_other_than_page},
    prepare::{Preparing, suspected_stage, warn_of_stage},
    progress::Bar,
    table::{figure, figure_or_dash, table},
};
use clap::Args;
use std::path::PathBuf;
use wheatstone::{
    Calibration, Error,
    dataset::split::{FoldKind, grouped},
    evaluate::{Budget, Comparison, MethodScore, Part, compare},
    method::AnyMethod,
    numeric::statistics::root_mean_square,
    preparation::Prepared,
    report::{Material, PictureSource, Report, Wording},
    storage::Output,
};

/// Compare methods by leave-one-view-out cross-validation
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone compare points.csv\n  \
    wheatstone compare capture/ -o report.html\n  \
    wheatstone compare capture/ --methods dlt,network --json")]
pub(crate) struct Compare {
    /// A capture, or a points file with X, Y, Z
    input: PathBuf,
    /// Methods, separated by commas, or `all`
    #[arg(long, default_value = "all", value_delimiter = ',')]
    methods: Vec<String>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    /// Write a report that compares the methods and shows the recommended one in detail
    #[arg(short = 'o', long, value_name = "FILE", visible_alias = "output")]
    report: Option<PathBuf>,
    #[command(flatten)]
    showing: Showing,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    preparing: Preparing,
}

impl Compare {
    pub(crate) fn run(self) -> Outcome {
        if let Some(path) = &self.report {
            refuse_inputs(path, [&*self.input])?;
            refuse_other_than_page(path)?;
            Output::check(path)?;
        }
        let bar = Bar::new();
        let methods = methods_named(&self.methods)?;
        let loaded = load(&self.input, &self.reading, &bar)?;
        let cameras = loaded.truth.as_ref().map(|truth| truth.rig.cameras.as_slice());
        let prepared = self.preparing.run(&loaded, None, self.seed, &bar)?;
        let found = compare(&methods, &prepared.data, cameras, self.seed, &bar)?;
        let stage = suspected_stage(&prepared, &bar);
        if found.methods.iter().all(|row| row.rms.is_none()) {
            return Err(no_method_worked(&found));
        }
        let page = match &self.report {
            Some(path) => Some((path, self.page(&found, (&loaded, &prepared), &bar)?)),
            None => None,
        };
        drop(bar);
        if !self.json {
            say!("{}", as_text(&found).trim_end());
        }
        if let Some((path, page)) = page {
            say!("");
            write_report(&page, path, &self.showing)?;
        }
        if self.json {
            return print_json(&found);
        }
        warn_of_stage(stage, &found.unit);
        Ok(())
    }

    /// The method to be trusted, fitted to all of the data and judged in depth, beside its rivals; the
    /// comparison alone where it cannot be fitted to all at once.
    fn page(
        &self,
        found: &Comparison,
        (loaded, prepared): (&Loaded, &Prepared),
        bar: &Bar,
    ) -> Outcome<Report> {
        let name = self.input.file_name().unwrap_or(self.input.as_os_str());
        let (title, command) = (name.to_string_lossy().into_owned(), Some(self.command()));
        let fit = |chosen: &String| {
            Calibration::fit(&AnyMethod::named(chosen)?, prepared, self.seed, false, bar)
        };
        let model = match found.chosen.as_ref().map(fit) {
            Some(Ok(model)) => model,
            Some(Err(e @ Error::Cancelled)) => return Err(e.into()),
            _ => return Ok(Report::of_comparison(found, &title, command, Wording(worded))),
        };
        let seen = loaded.source.as_ref();
        let material = Material {
            wording: Wording(worded),
            title,
            command,
            model: &model,
            comparison: Some(found),
            truth: loaded.truth.as_ref().map(|truth| truth.rig.cameras.as_slice()),
            seen: seen
                .map(|source| PictureSource { capture: &source.capture, found: &source.found }),
            held_out: true,
        };
        Ok(Report::of(&material, bar)?)
    }

    /// What to type to get the page again.
    fn command(&self) -> String {
        let mut words = vec!["wheatstone".into(), "compare".into(), quoted(&self.input)];
        if self.methods != ["all"] {
            words.extend(["--methods".into(), self.methods.join(",")]);
        }
        if self.seed != 0 {
            words.extend(["--seed".into(), self.seed.to_string()]);
        }
        words.extend(self.reading.words());
        words.extend(self.preparing.words());
        words.extend(self.report.iter().flat_map(|path| ["-o".into(), quoted(path)]));
        words.join(" ")
    }
}

fn no_method_worked(found: &Comparison) -> Failure {
    let problem = found.methods.iter().find_map(|row| row.problem.clone());
    Error::Degenerate {
        problem: format!(
            "no method could be fitted; {}",
            problem.unwrap_or_else(|| "there are too few views for cross-validation".into())
        ),
        hint: "give more views or points, spread over more distances".into(),
    }
    .into()
}

/// The figures as a table, with what they mean.
pub(crate) fn as_text(found: &Comparison) -> String {
    let unit = &found.unit;
    let heading = [
        "method", "rms", "median", "95 %", "mean %", "X", "Y", "Z", "between", "beyond", "x floor",
        "fit s",
    ];
    let rows: Vec<Vec<String>> = found.methods.iter().map(row).collect();
    let folds: Vec<&str> =
        found.methods.iter().flat_map(|m| m.folds.iter().map(|f| f.view.as_str())).collect();
    let count = folds.len() / found.methods.len().max(1);
    let folds = &folds[..count.min(folds.len())];
    let scheme = match grouped(folds.iter().copied()) {
        Some([views, groups]) => {
            format!("Leave-one-group-out cross-validation over {views} views in {groups} groups")
        }
        None => format!("Leave-one-view-out cross-validation over {count} views"),
    };
    let mut text = format!(
        "{scheme}, errors in {unit} ({})\n\n{}\n",
        folds.join("; "),
        table(&heading, &rows)
    );
    text += "between, beyond: rms of views within the range of the fitted ones, and of the outermost (extrapolated)\n";
    for method in &found.methods {
        if method.located < method.n {
            text += &format!(
                "note: {} located {} of {} points\n",
                method.method, method.located, method.n
            );
        }
        if let Some(problem) = &method.problem {
            text += &format!("note: {} could not be fitted {problem}\n", method.method);
        }
    }
    text += &wrong_models(found);
    if let Some(floor) = &found.floor {
        text +=
            &format!("The pixel noise alone causes {} {unit} rms: the floor\n", figure(floor.rms));
    }
    if let Some(chosen) = &found.chosen {
        text += &format!("Recommended, by held-out error and simplicity: {chosen}\n");
    }
    if let Some(budget) = &found.budget {
        text += &budget_as_text(budget, unit);
    }
    text
}

/// What an error is made of, a line a cause.
pub(crate) fn budget_as_text(budget: &Budget, unit: &str) -> String {
    let causes = [
        ("pixel noise", budget.detector),
        ("lens model", budget.lens_model),
        ("chart poses", budget.stage),
        ("extrapolation", budget.extrapolation),
    ];
    let row = |(name, part): (&str, Part)| {
        vec![name.into(), format!("{:.0} %", 100.0 * part.share), figure(part.rms)]
    };
    let rows: Vec<Vec<String>> = causes.into_iter().map(row).collect();
    format!(
        "\nContributions to its squared error (rms in {unit})\n\n{}\
         {} times the floor set by a pixel noise of {} px\n",
        table(&["cause", "share", "rms"], &rows),
        figure(budget.ratio_to_floor),
        figure(budget.pixel_noise)
    )
}

/// Says which camera models do not hold here: those that err clearly more than the best method.
fn wrong_models(found: &Comparison) -> String {
    const MODELS: [&str; 4] = ["dlt", "tsai", "brown", "kannala-brandt"];
    // What chance makes of the errors of two sound methods is a few percent.
    const CLEARLY: f64 = 1.1;
    // On the outermost views a sound model of a few points errs more, too.
    let error = |method: &MethodScore| rms_of(method, FoldKind::Interpolation).or(method.rms);
    let least = found.methods.iter().filter_map(error).fold(f64::INFINITY, f64::min);
    let mut text = String::new();
    for method in found.methods.iter().filter(|m| MODELS.contains(&m.method.as_str())) {
        if let Some(ratio) = error(method).map(|rms| rms / least).filter(|ratio| *ratio > CLEARLY) {
            text += &format!(
                "note: {}'s error is {} times the best: its lens model does not fit these cameras, or the charts do not stand where they were said to\n",
                method.method,
                figure(ratio)
            );
        }
    }
    text
}

/// Over the folds of a kind. Points count alike, whichever fold they are in.
fn rms_of(method: &MethodScore, kind: FoldKind) -> Option<f64> {
    let parts = method.folds.iter().filter(|fold| fold.kind == kind);
    let weighted: Vec<f64> =
        parts.filter_map(|fold| Some(vec![fold.rms?; fold.located])).flatten().collect();
    (!weighted.is_empty()).then(|| root_mean_square(&weighted))
}

fn row(method: &MethodScore) -> Vec<String> {
    let of_kind = |kind| figure_or_dash(rms_of(method, kind));
    let along = |axis: usize| figure_or_dash(method.rms_xyz.map(|rms| rms[axis]));
    vec![
        method.method.clone(),
        figure_or_dash(method.rms),
        figure_or_dash(method.median),
        figure_or_dash(method.p95),
        figure_or_dash(method.mean_percent),
        along(0),
        along(1),
        along(2),
        of_kind(FoldKind::Interpolation),
        of_kind(FoldKind::Extrapolation),
        figure_or_dash(method.ratio_to_floor),
        figure(method.fit_seconds),
    ]
}
