//! `wheatstone evaluate`.

use super::{
    compare::budget_as_text,
    locate::{FALSE_ALARM, refuse_exchanged},
    print_json,
};
use crate::{
    failure::Outcome,
    input::{Reading, load},
    progress::Bar,
    table::{figure, table},
    verbosity::{remark, say},
};
use clap::Args;
use std::path::PathBuf;
use wheatstone::{
    Calibration,
    calibration::{Judgement, PointJudgement},
    dataset::Dataset,
    evaluate::{BoardEvaluation, BoardView, Coverage, Deviation, Evaluation, LinearError},
    geometry::Pixel,
    method::{Reconstructor, mismatch::MismatchTest},
    numeric::progress::Silent,
};

/// Measure the error of a model on points with known coordinates
#[derive(Args)]
#[command(after_help = "Example:\n  wheatstone evaluate model.json exam.csv --json")]
pub(crate) struct Evaluate {
    /// The model file
    model: PathBuf,
    /// A capture or a points file with X, Y, Z; not the one that was fitted
    input: PathBuf,
    /// First align the frame of the points to that of the model by the best rigid motion, for
    /// models from a hand-held board
    #[arg(long)]
    align: bool,
    /// Error bars within the frame of the model, as `locate --relative` has them
    #[arg(long)]
    relative: bool,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
}

impl Evaluate {
    pub(crate) fn run(mut self) -> Outcome {
        let bar = Bar::new();
        let mut model = Calibration::load(&self.model)?;
        if self.relative {
            model.stage_covariance = model.stage_covariance.map(|stage| stage.relative());
        }
        // A points file's numbers are in the model's unit unless it says otherwise.
        self.reading.unit.get_or_insert_with(|| model.unit.clone());
        let data = load(&self.input, &self.reading, &bar)?.data;
        let mut found = model.judge(data.clone(), self.align, &bar)?;
        let is_located = !matches!(found, Judgement::Pixels(_));
        if is_located {
            // A model of other cameras, or of these in another order, shows in the pixels alone.
            let pixels: Vec<_> =
                data.correspondences.iter().map(|row| row.pixels.clone()).collect();
            refuse_exchanged(&*model.reconstructor, &pixels, FALSE_ALARM)?;
        }
        let framed = match &mut found {
            Judgement::Points(found) if !self.align => {
                let rms = agreement_when_moved(&model, data.clone(), found)?;
                // A frame that is off as a whole would count as an error of the lens model.
                found.budget.take_if(|_| rms.is_some());
                rms
            }
            _ => None,
        };
        drop(bar);
        if let (Judgement::Points(found), None) = (&mut found, framed) {
            // So would a frame that is stretched or sheared.
            found.budget.take_if(|_| found.linear.is_some());
        }
        if self.json {
            return print_json(&found);
        }
        match &found {
            Judgement::Pixels(found) => tell_one_camera(found),
            Judgement::Boards(found) => tell_boards(found),
            Judgement::Points(found) => tell(found),
        }
        let data = data.in_unit(&model.unit)?;
        let fitted = model.data.share_of(&data);
        if fitted > 0.5 && is_located {
            tell_fitted(&model, fitted);
        }
        if let Judgement::Points(found) = &found {
            tell_mismatches(&model, &data, self.align, found)?;
        }
        match (framed, &found) {
            (Some(rms), _) => tell_other_frame(rms, &model.unit),
            (None, Judgement::Points(PointJudgement { linear: Some(linear), .. })) => {
                tell_linear(linear);
            }
            _ => {}
        }
        Ok(())
    }
}

/// Says so where most of the error is of a few points whose pixels do not belong together.
fn tell_mismatches(
    model: &Calibration,
    data: &Dataset,
    align: bool,
    found: &PointJudgement,
) -> Outcome {
    /// Without them this share of the error is left at most.
    const LEFT: f64 = 0.5;
    let (test, map) = (MismatchTest::new(FALSE_ALARM, data.cameras), model.map());
    let matches = |pixels: &[Option<Pixel>]| {
        let seen = pixels.iter().flatten().count();
        map.locate(pixels).is_some_and(|found| !test.is_mismatch(&found, seen))
    };
    let rest = data.subset(|_, row| matches(&row.pixels));
    let (count, whole) = (rest.known().count(), data.known().count());
    if count == whole || 2 * count < whole {
        return Ok(());
    }
    let Judgement::Points(others) = model.judge(rest, align, &Silent)? else { return Ok(()) };
    if others.evaluation.rms < LEFT * found.evaluation.rms {
        remark!(
            "note",
            "{} of {whole} points are mismatches: their pixels show no one point. Without them the error is {} {} rms. Where a camera did not see a point, leave its cells empty",
            whole - count,
            figure(others.evaluation.rms),
            model.unit
        );
    }
    Ok(())
}

/// The error of the points moved as a whole, where that explains nearly all of it: their frame is not the model's.
fn agreement_when_moved(
    model: &Calibration,
    data: Dataset,
    found: &PointJudgement,
) -> Outcome<Option<f64>> {
    /// An alignment that leaves this share of the error has explained it; it takes a part of any.
    const LEFT: f64 = 0.1;
    if found.coverage.is_some_and(|held| held.p95 > 0.5) {
        return Ok(None);
    }
    let Judgement::Points(aligned) = model.judge(data, true, &Silent)? else { return Ok(None) };
    let rms = aligned.evaluation.rms;
    Ok((rms < LEFT * found.evaluation.rms).then_some(rms))
}

fn tell_other_frame(rms: f64, unit: &str) {
    remark!(
        "note",
        "moved as a whole, the points agree with the model to {} {unit}: their world frame is not the model's; a model from a board in the hand has a frame of its own (`--align`)",
        figure(rms)
    );
}

/// Says how the frames of the model and of the points are stretched or sheared against each other.
fn tell_linear(linear: &LinearError) {
    /// Parts of the largest that are told.
    const SMALL: f64 = 0.2;
    const AXES: [&str; 3] = ["X", "Y", "Z"];
    let all = linear.slopes.iter().flatten();
    let least = SMALL * all.fold(0.0, |most: f64, slope| most.max(slope.abs()));
    let each = (0..3).flat_map(|of| (0..3).map(move |by| (of, by, linear.slopes[of][by])));
    let told: Vec<String> = each
        .filter(|(.., slope)| slope.abs() > least)
        .map(|(of, by, slope)| format!("{} by {:+.2} % of {}", AXES[of], 100.0 * slope, AXES[by]))
        .collect();
    remark!(
        "note",
        "{:.0} % of the squared error is linear in the coordinates, which no lens makes: {}. The chart poses of the fit, or of these points, are off so: a wrong pitch, a stage that moves obliquely to the chart, a camera that drifted while the stage advanced",
        100.0 * linear.share,
        told.join(", ")
    );
}

/// Says that points are not new to the model, and what is known of its error on new ones.
fn tell_fitted(model: &Calibration, share: f64) {
    let held_out = match &model.validation {
        Some(validation) => format!(
            "the held-out error ({}) is {} {} rms",
            validation.scheme(),
            figure(validation.all.rms),
            model.unit
        ),
        None => "the held-out error is unknown, as the fit was not cross-validated".into(),
    };
    let percent = 100.0 * share;
    remark!(
        "note",
        "the model was fitted to {percent:.0} % of these points, and errors on new points are larger; {held_out}"
    );
}

/// The figures of one camera, in words.
fn tell_one_camera(found: &Evaluation) {
    say!("{} of {} pixels evaluated", found.located, found.n);
    say!(
        "Reprojection error {} px rms, {} px median, 95 % below {} px",
        figure(found.rms),
        figure(found.median),
        figure(found.p95)
    );
}

/// What boards in the hand say, in words.
fn tell_boards(found: &BoardEvaluation) {
    let unit = &found.unit;
    say!(
        "{} of {} points located, on boards whose poses are unknown, in {} views",
        found.located,
        found.n,
        found.views.len()
    );
    let held = |error: &Deviation| {
        format!(
            "{} {unit} rms, expected {}; {:.1} % within their 95 % error bars",
            figure(error.rms),
            figure(error.expected),
            100.0 * error.within95
        )
    };
    for (name, lengths) in [("neighbours", &found.neighbours), ("the ends", &found.across)] {
        say!(
            "Distances between {name} ({} {unit} on average): mean error {} ± {} {unit} ({:+.3} %), {}",
            figure(lengths.length),
            figure(lengths.bias),
            figure(lengths.bias_sigma),
            100.0 * lengths.bias / lengths.length,
            held(&lengths.error)
        );
    }
    say!("Flatness: {}", held(&found.flatness));
    say!("Shape, each board moved to its points as a whole: {} {unit} rms", figure(found.shape));
    let camera = |(index, error): (usize, &Option<f64>)| {
        Some(format!("camera {} {} px", index + 1, figure((*error)?)))
    };
    let cameras: Vec<String> = found.cameras.iter().enumerate().filter_map(camera).collect();
    if !cameras.is_empty() {
        say!("Reprojection error of the boards placed so: {} rms", cameras.join(", "));
    }
    let row = |view: &BoardView| {
        let figures = [view.bias, view.flatness, view.shape].map(figure);
        [vec![view.view.clone(), view.located.to_string()], figures.to_vec()].concat()
    };
    let rows: Vec<Vec<String>> = found.views.iter().map(row).collect();
    let heading = ["view", "points", "mean length error", "flatness", "shape"];
    say!("{}", table(&heading, &rows).trim_end());
}

/// The figures in words.
fn tell(judged: &PointJudgement) {
    let found = &judged.evaluation;
    let unit = &found.unit;
    let [x, y, z] = found.rms_xyz.map(figure);
    say!("{} of {} points located", found.located, found.n);
    say!(
        "Error {} {unit} rms, {} {unit} median, 95 % below {} {unit}; {} % of the distance on average",
        figure(found.rms),
        figure(found.median),
        figure(found.p95),
        figure(found.mean_percent)
    );
    say!("Along X {x}, Y {y}, Z {z} {unit} rms");
    if let Some(Coverage { p68, p95 }) = judged.coverage {
        say!(
            "The 68 % and 95 % error ellipsoids contain {:.1} % and {:.1} % of the points",
            100.0 * p68,
            100.0 * p95
        );
    }
    if let Some(budget) = &judged.budget {
        say!("{}", budget_as_text(budget, unit).trim_end());
    }
}
