//! `wheatstone check`.

use super::{camera_motion, print_json};
use crate::{
    failure::{Failure, Outcome},
    input::{Reading, load},
    output::refuse_inputs,
    prepare::{baseline, baseline_holds, named_outliers, pictures},
    progress::Bar,
    table::figure,
    verbosity::say,
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    io::Write,
    path::{Path, PathBuf},
};
use wheatstone::{
    Error,
    dataset::Dataset,
    fit::bundle::BundleSettings,
    preparation::{
        self,
        checks::{self, Examination, ExpectedDistance, Finding, Severity},
        outliers::{Outlier, screen},
    },
    synthetic::fault_survey::{Recorded, Survey, Tally, survey},
    tables,
};

/// Check calibration data for faults: what is wrong, where, and how to correct it
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone check points.csv\n  \
    wheatstone check points.csv --fix repaired.csv\n  \
    wheatstone check capture/ --expect-baseline 200:1% --json\n  \
    wheatstone check today.csv --against model.json    have the cameras moved?\n  \
    wheatstone check --survey 500      how often faults are identified, on random captures\n\n\
    The exit status is 1 if a fatal fault remains, if a camera moved, or if `--fix` could only leave\n    pictures out, or correct a size by an estimate\n    (`fit --fix` takes an estimate with `--force` only).")]
pub(crate) struct Check {
    /// A capture, or a points file with X, Y, Z; with --against also matched pixels alone
    #[arg(required_unless_present = "survey")]
    input: Option<PathBuf>,
    /// Check instead whether the cameras still stand as they did when this model was fitted: which camera moved, by how
    /// much, and how sure that is
    #[arg(long, value_name = "MODEL", conflicts_with_all = ["fix", "expect_baseline", "survey"])]
    against: Option<PathBuf>,
    /// Write a points file in which the faults that can be corrected safely are corrected
    #[arg(long, value_name = "OUT")]
    fix: Option<PathBuf>,
    /// The baseline of cameras 1 and 2 as measured on the rig, in the data's unit, and the
    /// tolerance, such as `200` or `200:1%`
    #[arg(long, value_name = "LENGTH[:PERCENT]", value_parser = baseline)]
    expect_baseline: Option<(f64, f64)>,
    /// How far apart the charts of two views are as measured on the stage, in the data's unit, such as
    /// `050:140:90`; may be given again
    #[arg(long, value_name = "VIEW:VIEW:LENGTH", value_parser = distance)]
    expect_distance: Vec<ExpectedDistance>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
    /// Instead of checking data, test the checks on this many random captures with known faults
    #[arg(long, value_name = "N", conflicts_with_all = ["input", "fix", "expect_baseline"])]
    survey: Option<usize>,
    /// Let the survey draw points at random places instead of charts: no two views share one
    #[arg(long, requires = "survey", conflicts_with = "hand_held")]
    scattered: bool,
    /// Let the survey draw charts held by hand, whose poses are estimated; a capture takes some seconds
    #[arg(long, requires = "survey")]
    hand_held: bool,
    /// Seed of the survey
    #[arg(long, default_value_t = 0, requires = "survey")]
    seed: u64,
    #[command(flatten)]
    reading: Reading,
}

impl Check {
    pub(crate) fn run(self) -> Outcome {
        if let Some(captures) = self.survey {
            let recorded = match (self.scattered, self.hand_held) {
                (true, _) => Recorded::Scattered,
                (_, true) => Recorded::HeldByHand,
                _ => Recorded::Charts,
            };
            let found = survey(captures, self.seed, recorded);
            if self.json {
                return print_json(&found);
            }
            write!(std::io::stdout(), "{}", as_markdown(&found))?;
            return Ok(());
        }
        let Some(input) = &self.input else {
            return Err(Failure::usage("no data to check", "name a capture or a points file"));
        };
        if let Some(model) = &self.against {
            return camera_motion::check(input, model, self.reading.clone(), self.json);
        }
        if let Some(output) = &self.fix {
            refuse_inputs(output, [&**input])?;
        }
        let bar = Bar::new();
        let data = load(input, &self.reading, &bar)?.data;
        let examination = self.examine(&data, &bar)?;
        let outliers = outliers(&data, &examination, &bar)?;
        drop(bar);
        if self.json {
            let mut told = examination.to_json(1);
            told["outliers"] = outliers.iter().map(outlier_as_json).collect();
            print_json(&told)?;
        } else {
            say!("{}", as_text(&examination, &data, &outliers).trim_end());
            if let Some(holds) = baseline_holds(&examination, self.expect_baseline, &data.unit) {
                say!("{holds}");
            }
        }
        match &self.fix {
            Some(output) => self.write_repaired(&data, &examination, output),
            None => {
                none_remains(&examination, "correct them as described above, or try `--fix OUT`")
            }
        }
    }

    /// Writes the data with the faults corrected, and says what is left of them.
    fn write_repaired(&self, data: &Dataset, examination: &Examination, output: &Path) -> Outcome {
        let settings = BundleSettings::default();
        let repaired = preparation::repair(data, examination, settings, &Bar::new())?;
        tables::save(&repaired, output)?;
        say!(
            "Wrote {}: {} of {} faults corrected, {} of {} points kept",
            output.display(),
            examination.findings.iter().filter(|finding| finding.is_fixable()).count(),
            alarms(examination),
            repaired.correspondences.len(),
            data.correspondences.len()
        );
        let after = self.examine(&repaired, &Bar::new())?;
        none_remains(&after, "record the remaining views again, or remove them by hand")?;
        let left_out = checks::left_out(data, &examination.findings);
        if !left_out.is_empty() {
            return Err(Error::Degenerate {
                problem: format!(
                    "nothing corrects these pictures, and they were left out: {}",
                    pictures(&left_out)
                ),
                hint: format!(
                    "record these views again; {} has no fault, but a calibration with it is less certain, most of all where these views were",
                    output.display()
                )
                .into(),
            }
            .into());
        }
        match examination.findings.iter().find(|finding| finding.is_estimate) {
            Some(Finding { explanation, .. }) => Err(Error::Degenerate {
                problem: format!("corrected by an estimate from the pixels: {explanation}"),
                hint: "measure it and give the true value: the calibration takes on the error of the estimate".into(),
            }
            .into()),
            None => Ok(()),
        }
    }

    fn examine(&self, data: &Dataset, bar: &Bar) -> Outcome<Examination> {
        // What is written must have no fault in any view.
        let examine = match self.fix {
            Some(_) => preparation::examine_every_view,
            None => preparation::examine,
        };
        let mut examination = examine(data, BundleSettings::default(), bar)?;
        if let Some((length, tolerance)) = self.expect_baseline {
            let differs = checks::compare_baseline(&examination, length, tolerance);
            examination.findings.splice(0..0, differs);
        }
        for expected in &self.expect_distance {
            examination.findings.splice(0..0, checks::compare_distance(data, expected)?);
        }
        Ok(examination)
    }
}

/// `050:140:90`.
fn distance(text: &str) -> Result<ExpectedDistance, String> {
    let parsed = text.rsplit_once(':').and_then(|(views, length)| {
        let (first, second) = views.split_once(':')?;
        let length = length.trim().parse::<f64>().ok().filter(|l| *l > 0.0 && l.is_finite())?;
        Some(ExpectedDistance { views: [first.into(), second.into()], length })
    });
    parsed.ok_or_else(|| "give two views and a length, such as `050:140:90`".into())
}

/// An error where a fatal fault is there.
fn none_remains(examination: &Examination, hint: &str) -> Outcome {
    let remaining = fatal(examination);
    if remaining.is_empty() {
        return Ok(());
    }
    Err(Error::Degenerate {
        problem: format!("fatal faults in the data: {}", remaining.join(", ")),
        hint: hint.into(),
    }
    .into())
}

fn fatal(examination: &Examination) -> Vec<&'static str> {
    let fatal = examination.findings.iter().filter(|f| f.severity == Severity::Fatal);
    let mut codes: Vec<&'static str> = fatal.map(|finding| finding.code).collect();
    codes.dedup();
    codes
}

fn alarms(examination: &Examination) -> usize {
    examination.findings.iter().filter(|f| f.severity > Severity::Information).count()
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Information => "note",
        other => other.name(),
    }
}

/// Whether charts stood one behind the other.
fn is_on_a_stage(examination: &Examination) -> bool {
    examination.findings.iter().any(|finding| finding.code == "planes-parallel")
}

/// Points that no camera saw where they are said to be, unless a fault explains that. Of charts held by hand they show
/// once these are placed, which a fit does.
fn outliers(data: &Dataset, examination: &Examination, bar: &Bar) -> Outcome<Vec<Outlier>> {
    if !fatal(examination).is_empty() {
        return Ok(Vec::new());
    }
    Ok(screen(data, 0, bar)?.outliers)
}

/// Rows and cameras counted from 1.
fn outlier_as_json(outlier: &Outlier) -> Value {
    json!({
        "row": outlier.row + 1,
        "view": outlier.view,
        "id": outlier.id,
        "cameras": outlier.cameras.iter().map(|camera| camera + 1).collect::<Vec<_>>(),
        "residual": outlier.residual,
    })
}

/// What people read.
fn as_text(examination: &Examination, data: &Dataset, outliers: &[Outlier]) -> String {
    let mut text = String::new();
    for finding in &examination.findings {
        text += &format!("{}[{}]: {}\n", word(finding.severity), finding.code, finding.explanation);
        for (name, value) in &finding.figures {
            text += &format!("  {name}: {}\n", figure(*value));
        }
        let way_out = if finding.is_fixable() { "; `wheatstone check --fix OUT` does" } else { "" };
        text += &format!("  hint: {}{way_out}\n", finding.hint);
    }
    if alarms(examination) == 0 {
        text += &format!(
            "No fault found in {} points of {} cameras\n",
            data.correspondences.len(),
            data.cameras
        );
    }
    if !outliers.is_empty() {
        text += &format!(
            "{} of {} points lie elsewhere than their pixels say, and `fit` excludes them as outliers: {}\n",
            outliers.len(),
            data.correspondences.len(),
            named_outliers(outliers, " (`--json` lists them)")
        );
    }
    text += "What these data cannot show:\n";
    for statement in &examination.cannot_be_seen {
        text += &format!("  {}: {}\n", statement.what, statement.check);
    }
    if let Some(first) = examination.layout.first().filter(|it| it.baseline.is_finite()) {
        let length = figure(first.baseline);
        text +=
            &format!("  `--expect-baseline {length}:1%` compares it with a measured baseline\n");
    }
    if let Some([first, .., last]) = is_on_a_stage(examination).then_some(&data.views[..]) {
        text += &format!(
            "  `--expect-distance {first}:{last}:LENGTH` compares how far apart two charts are with what was measured\n"
        );
    }
    for camera in examination.layout.iter().skip(1) {
        text += &format!("  {}\n", camera.words);
    }
    text
}

/// A row of the confusion matrix, the most frequent name first.
fn named(row: &Tally) -> String {
    let mut named: Vec<(&String, &usize)> = row.named.iter().collect();
    named.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    named.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}

/// The survey as the table of docs/fault-clinic.md.
fn as_markdown(found: &Survey) -> String {
    let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    let mut text =
        "| fault | captures | identified | misidentified | missed | named as |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for row in &found.faults {
        text += &format!(
            "| {} | {} | {} | {} | {} | {} |\n",
            row.fault,
            row.captures,
            row.rightly,
            row.otherwise,
            row.missed,
            named(row)
        );
    }
    let sum = |count: fn(&Tally) -> usize| found.faults.iter().map(count).sum::<usize>();
    let all = sum(|row| row.captures);
    text += &format!(
        "| all | {all} | {} ({:.1} %) | {} | {} | |\n\n",
        sum(|row| row.rightly),
        share(sum(|row| row.rightly), all),
        sum(|row| row.otherwise),
        sum(|row| row.missed)
    );
    text += "| captures without fault | captures | false alarms |\n|---|---|---|\n";
    for row in &found.clean {
        text += &format!(
            "| {} | {} | {} ({:.1} %) |\n",
            row.fault,
            row.captures,
            row.otherwise,
            share(row.otherwise, row.captures)
        );
    }
    text
}
