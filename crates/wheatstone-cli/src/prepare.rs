//! What is done to data before they are fitted, as options, and what is said about it.

use crate::{
    failure::Outcome,
    input::Loaded,
    progress::Bar,
    table::{figure, table},
    verbosity::{detail, remark, say},
};
use clap::{Args, builder::PossibleValuesParser};
use wheatstone::{
    fit::{
        bundle::{BundleSettings, Gauge},
        stage::{Significance, StagePrior, ViewOffset, suspect},
    },
    method::AnyMethod,
    preparation::{
        EstimatedPoses, Preparation, Prepared,
        checks::{Examination, Severity, compare_baseline},
        outliers::Outlier,
    },
};

/// How data are prepared.
#[derive(Args, Clone)]
#[command(next_help_heading = "Preparation")]
pub(crate) struct Preparing {
    /// Correct faults of the data where that is safe
    #[arg(long)]
    fix: bool,
    /// Continue in spite of faults that make a fit worthless
    #[arg(long)]
    pub(crate) force: bool,
    /// Fit gross outliers too, instead of excluding them
    #[arg(long)]
    keep_outliers: bool,
    /// The baseline of cameras 1 and 2 as measured on the rig, in the data's unit, and the
    /// tolerance, such as `200` or `200:1%`: without it a wrong scale goes unnoticed
    #[arg(long, value_name = "LENGTH[:PERCENT]", value_parser = baseline)]
    expect_baseline: Option<(f64, f64)>,
    /// Standard deviation of the given chart positions, in the data's unit: the true positions are
    /// then estimated with the cameras
    #[arg(long, value_name = "LENGTH")]
    stage_sigma: Option<f64>,
    /// The world frame if no chart pose is given (hand-held board): the chart of the first view, or
    /// the first camera
    #[arg(long, value_name = "FRAME", default_value = "first-view", value_parser = PossibleValuesParser::new(Gauge::NAMES))]
    gauge: String,
}

/// A length and a tolerance in percent.
pub(crate) fn baseline(text: &str) -> Result<(f64, f64), String> {
    let (length, tolerance) = text.split_once(':').unwrap_or((text, "1%"));
    let positive = |text: &str| {
        text.trim().parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite())
    };
    let tolerance = positive(tolerance.trim_end_matches('%'));
    match (positive(length), tolerance) {
        (Some(length), Some(percent)) => Ok((length, percent / 100.0)),
        _ => Err("give a length and a tolerance, such as `200` or `200:1%`".into()),
    }
}

/// Pictures in words, by view and camera.
pub(crate) fn pictures(pictures: &[(String, usize)]) -> String {
    let name = |(view, camera): &(String, usize)| format!("view `{view}` of camera {}", camera + 1);
    pictures.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Percent of outliers beyond which something else than a slip now and then is likely.
const MANY: f64 = 5.0;

/// Outliers that are listed before the rest is counted.
const LISTED: usize = 8;

impl Preparing {
    /// Prepares what was loaded, and tells what was found.
    pub(crate) fn run(
        &self,
        loaded: &Loaded,
        method: Option<&AnyMethod>,
        seed: u64,
        bar: &Bar,
    ) -> Outcome<Prepared> {
        let preparation = Preparation {
            repair: self.fix,
            insist: self.force,
            baseline: self.expect_baseline,
            keep_outliers: self.keep_outliers,
            stage: self.stage(&loaded.sigmas()),
            bundle_settings: BundleSettings {
                gauge: Gauge::named(&self.gauge)?,
                keep_gross: self.keep_outliers,
                ..BundleSettings::default()
            },
            ..Preparation::default()
        }
        .for_method(method);
        let unit = loaded.data.unit.clone();
        let points = loaded.data.correspondences.len();
        let prepared = preparation.run(loaded.data.clone(), seed, bar)?;
        for finding in &prepared.examination.findings {
            let mended = self.fix && finding.is_fixable();
            let word = if mended { "corrected: " } else { "" };
            let text = format!("{word}{} ({})", finding.explanation, finding.code);
            match finding.severity {
                Severity::Information if !mended => detail!("note: {text}"),
                Severity::Information => remark!("note", "{text}"),
                _ => remark!("warning", "{text}"),
            }
        }
        if !prepared.left_out.is_empty() {
            let left_out = pictures(&prepared.left_out);
            remark!("warning", "left out, as nothing corrects them: {left_out}");
        }
        if let Some(placed) = &prepared.placed {
            tell_placed(placed, &unit);
        }
        tell_outliers(&prepared.outliers, points);
        if self.expect_baseline.is_none() {
            tell_layout(&prepared, preparation.lenses.is_empty());
        }
        if let Some(holds) = baseline_holds(&prepared.examination, self.expect_baseline, &unit) {
            say!("{holds}");
        }
        if !prepared.stage.is_empty() {
            say!("{}", stage_table(&prepared.stage, &unit).trim_end());
        }
        Ok(prepared)
    }

    /// The options that prepare so again.
    pub(crate) fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        for (given, word) in
            [(self.fix, "--fix"), (self.force, "--force"), (self.keep_outliers, "--keep-outliers")]
        {
            if given {
                words.push(word.into());
            }
        }
        if let Some((length, tolerance)) = self.expect_baseline {
            let percent = 100.0 * tolerance;
            words.extend(["--expect-baseline".into(), format!("{length}:{percent}%")]);
        }
        if let Some(sigma) = self.stage_sigma {
            words.extend(["--stage-sigma".into(), sigma.to_string()]);
        }
        if self.gauge != Gauge::NAMES[0] {
            words.extend(["--gauge".into(), self.gauge.clone()]);
        }
        words
    }

    /// The prior of the charts' places: that of the option, and each view's own.
    fn stage(&self, sigmas: &[(String, f64)]) -> Option<StagePrior> {
        let largest = sigmas.iter().map(|(_, sigma)| *sigma).fold(0.0, f64::max);
        let offset_sigma = self.stage_sigma.or((largest > 0.0).then_some(largest))?;
        Some(StagePrior { views: sigmas.to_vec(), ..StagePrior::of(offset_sigma) })
    }
}

/// Where the cameras stand: measured, or said to be unknown, so that no summary is silent about it. With known lenses one
/// plane does not tell before the fit.
fn tell_layout(prepared: &Prepared, has_no_lenses: bool) {
    let words: Vec<&str> =
        prepared.examination.layout.iter().map(|layout| &*layout.words).collect();
    if prepared.data.cameras < 2 || words.is_empty() && !has_no_lenses {
        return;
    }
    let found = match words.is_empty() {
        true => "the camera positions are unknown".into(),
        false => words.join("; "),
    };
    // Steps that are wrong by a factor are taken up by the focal length, and the baseline stays.
    let hidden = match prepared.placed {
        None => {
            "a wrong scale, pitch or stage step, or exchanged cameras (`--expect-baseline`, `--expect-distance`)"
        }
        Some(_) => "a wrong scale or pitch, or exchanged cameras (`--expect-baseline`)",
    };
    remark!("note", "{found}; compare this with your rig: the data cannot reveal {hidden}");
}

/// Where charts of unknown place were found.
fn tell_placed(placed: &EstimatedPoses, unit: &str) {
    let distances: Vec<String> = placed
        .baselines
        .iter()
        .enumerate()
        .map(|(index, distance)| {
            format!("cameras 1 and {}: {} {unit}", index + 2, figure(*distance))
        })
        .collect();
    let apart = distances.join(", ");
    let apart = if apart.is_empty() { apart } else { format!("; baseline of {apart}") };
    let freed = if placed.freed { "; then refined together with the neural cameras" } else { "" };
    remark!(
        "note",
        "estimated the chart poses of {} views by bundle adjustment with `{}` lenses, reprojection error {} px rms{freed}{apart}",
        placed.views.len(),
        placed.lens,
        figure(placed.rms)
    );
    if !placed.unplaced.is_empty() {
        remark!(
            "warning",
            "too few points to estimate the chart pose in: {}",
            placed.unplaced.join(", ")
        );
    }
}

/// Whether charts seem to have stood elsewhere than was said; none where that was solved for, where nobody said it, and
/// where data do not tell (one view, too few points).
pub(crate) fn suspected_stage(prepared: &Prepared, bar: &Bar) -> Option<Significance> {
    let is_given = prepared.stage.is_empty() && prepared.placed.is_none();
    let found = if is_given { suspect(&prepared.data, bar).ok() } else { None };
    found.filter(is_told)
}

/// Whether places as they would be estimated explain what speaks against those given: by nothing they explain nothing.
fn is_told(found: &Significance) -> bool {
    found.is_clear() && found.estimated_sigma > 0.0
}

/// Warns of it.
pub(crate) fn warn_of_stage(stage: Option<Significance>, unit: &str) {
    if let Some(stage) = stage {
        let size = figure(stage.estimated_sigma);
        remark!(
            "warning",
            "the held-out errors suggest that the chart poses are off by about {size} {unit}: `--stage-sigma {size}` estimates them"
        );
    }
}

/// The first of the outliers by name.
pub(crate) fn named_outliers(outliers: &[Outlier], rest: &str) -> String {
    let name = |outlier: &Outlier| {
        let id = outlier.id.clone().unwrap_or_else(|| format!("row {}", outlier.row + 1));
        let view =
            if outlier.view.is_empty() { String::new() } else { format!("view {} ", outlier.view) };
        format!("{view}point {id} ({} px)", figure(outlier.residual))
    };
    let listed: Vec<String> = outliers.iter().take(LISTED).map(name).collect();
    let more = outliers.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more{rest}") } else { String::new() };
    listed.join(", ") + &more
}

fn tell_outliers(outliers: &[Outlier], points: usize) {
    if outliers.is_empty() {
        return;
    }
    let share = 100.0 * outliers.len() as f64 / points as f64;
    let text = format!(
        "excluded {} of {points} points as outliers: {}",
        outliers.len(),
        named_outliers(outliers, ", listed in the model")
    );
    if share > MANY {
        remark!(
            "warning",
            "{text}; {share:.0} % is a lot: check whether labels or pictures are mixed up"
        );
    } else {
        remark!("note", "{text}");
    }
}

/// That the baseline is the one that was measured, where it is.
pub(crate) fn baseline_holds(
    examination: &Examination,
    expected: Option<(f64, f64)>,
    unit: &str,
) -> Option<String> {
    let (length, tolerance) = expected?;
    if compare_baseline(examination, length, tolerance).is_some() {
        return None;
    }
    let own = examination.layout.first()?.baseline;
    Some(format!(
        "The baseline is {} {unit} by these data, as measured (ratio {:.4})",
        figure(own),
        own / length
    ))
}

/// Where the charts are believed to have stood.
fn stage_table(stage: &[ViewOffset], unit: &str) -> String {
    let row = |view: &ViewOffset| {
        let mut cells = vec![view.view.clone()];
        for axis in 0..3 {
            cells.push(format!("{} +- {}", figure(view.offset[axis]), figure(view.sigma[axis])));
        }
        for axis in 0..3 {
            cells.push(format!(
                "{} +- {}",
                figure(view.observable[axis]),
                figure(view.observable_sigma[axis])
            ));
        }
        let angle = view.rotation.iter().map(|angle| angle * angle).sum::<f64>().sqrt();
        cells.push(figure(angle.to_degrees()));
        cells
    };
    let rows: Vec<Vec<String>> = stage.iter().map(row).collect();
    let heading =
        ["view", "X", "Y", "Z", "observable X", "observable Y", "observable Z", "turned, degrees"];
    format!(
        "Estimated chart positions minus nominal ones, in {unit}:\n\n{}\n\
         observable: the part that the pixels determine. A shift common to all views, or one that grows in\n\
         proportion along the stage (its scale, its skew), cannot be distinguished from a change of the\n\
         cameras: it stays at its nominal value, and the error bars of located points include it\n\
         (`locate --relative` leaves it out)\n",
        table(&heading, &rows)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_that_are_off_by_nothing_are_not_told() {
        let of =
            |estimated_sigma: f64| Significance { chi_square: 100.0, degrees: 10, estimated_sigma };
        assert!(of(0.0).is_clear() && !is_told(&of(0.0)));
        assert!(is_told(&of(2e-5)));
        // What is printed can be given back.
        assert!(figure(2e-5).parse::<f64>().unwrap() > 0.0);
    }
}
