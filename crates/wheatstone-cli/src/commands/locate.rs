//! `wheatstone locate`.

use crate::{
    failure::Outcome,
    input::{columns, positive},
    interruption,
    output::refuse_inputs,
    progress::Counter,
    table::figure,
    tables::{self, Sink},
    verbosity::remark,
};
use clap::Args;
use std::{
    collections::VecDeque,
    io::IsTerminal,
    path::PathBuf,
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    time::{Duration, Instant},
};
use wheatstone::{
    Calibration, Error,
    geometry::{Pixel, PixelColumns},
    method::{
        CalibratedMap, LocatedBatch, Reconstructor,
        mismatch::{
            MismatchTest, PixelScatter, exchanged_cameras, mismatched_share, noisier_pixels,
        },
    },
    tables::{ColumnNames, LocatedColumns, Rows, TableOptions, TableReader, TableStyle, is_text},
};

/// Triangulate: turn matched pixels into 3-D points with error bars
///
/// Triangulation from two or more cameras, each point with its covariance and its residual (the
/// reprojection error), in the frame and the unit of the model.
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone locate model.json pixels.csv -o points.csv\n  \
    producer | wheatstone locate model.json - | consumer\n\n\
    Appends to every row: X,Y,Z and their standard deviations sX,sY,sZ, in world units; residual, the\n\
         rms reprojection error in pixels; trust, whether the point is `inside` the calibrated volume, at its\n\
         `edge`, or `outside`; and mismatch, `yes` where the rays do not intersect, so that the pixels are\n\
         probably mismatched. Rows that cannot be located keep their place, with empty cells. Input columns\n\
         with one of these names are renamed to input_X and so on.")]
pub(crate) struct Locate {
    /// The model file
    model: PathBuf,
    /// A points file with columns x1,y1,x2,y2,… (CSV, Parquet, Arrow), or - for standard input
    points: PathBuf,
    /// The file to write (CSV; Parquet or Arrow by extension), or - for standard output
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// Append the covariance matrix of X, Y, Z as well: cXX,cXY,cXZ,cYY,cYZ,cZZ
    #[arg(long)]
    covariance: bool,
    /// Error bars within the frame of the model, for models fitted with `--stage-sigma`: without the errors
    /// of shift, scale and skew that all points share
    #[arg(long)]
    relative: bool,
    /// Names of the columns in the points file: NAME=COLUMN,… or all names in order (`_`: none)
    #[arg(long, value_name = "NAMES", value_parser = columns)]
    columns: Option<ColumnNames>,
    /// Share of correct matches that may be called a mismatch
    #[arg(long, value_name = "RATE", default_value_t = FALSE_ALARM, value_parser = rate)]
    false_alarm: f64,
    /// Standard deviation of a pixel coordinate in the points file, for error bars and mismatches [default:
    /// that of the model's own points]
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    pixel_sigma: Option<f64>,
}

/// A probability that leaves both answers possible.
fn rate(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("give a value between 0 and 1".into()) }
}

impl Locate {
    pub(crate) fn run(self) -> Outcome {
        refuse_inputs(&self.output, [&*self.model, &*self.points])?;
        let mut model = Calibration::load(&self.model)?;
        if self.relative {
            model.stage_covariance = model.stage_covariance.map(|stage| stage.relative());
        }
        needs_two_cameras(&model, "locate")?;
        let standard = self.output.as_os_str() == "-";
        let options = TableOptions {
            columns: self.columns.clone(),
            prompt: standard && self.points.as_os_str() == "-",
            ..TableOptions::default()
        };
        let input = TableReader::open(&self.points, &options)?;
        if input.cameras() != model.reconstructor.cameras() {
            return Err(Error::Mismatch {
                what: "number of cameras",
                model: model.reconstructor.cameras().to_string(),
                data: input.cameras().to_string(),
            }
            .into());
        }
        let added = LocatedColumns {
            covariance: self.covariance,
            rounded: is_text(&self.output),
            test: MismatchTest::new(self.false_alarm, input.cameras()),
        };
        let names = added.names(input.names());
        let style = TableStyle { unit: Some(model.unit.clone()), ..input.style() };
        let sink = Sink::create(&self.output, names, style)?;
        let (mut counter, mut done) =
            (Counter::new(standard && std::io::stdout().is_terminal()), 0);
        let mut locator = model.locator().with_pixel_sigma(self.pixel_sigma);
        let mut rows = Arriving { rows: tables::start(input), first: VecDeque::new() };
        rows.gather(CHECKED)?;
        let first = rows.first.iter().flat_map(|rows| pixels_by_row(&rows.pixels()));
        let map = CalibratedMap::new(&*model.reconstructor).with_pixel_sigma(self.pixel_sigma);
        refuse_exchanged(&map, &first.take(CHECKED).collect::<Vec<_>>(), self.false_alarm)?;
        // Columns that are not written come back, for the next rows: new memory costs as much as what fills it.
        let (back, spare) = channel::<LocatedBatch>();
        let writing = sink.start(move |rows, mut places: LocatedBatch| {
            let columns = added.of(&rows.pixels(), &mut places);
            // Nobody may be there to take it any more.
            let _ = back.send(places);
            columns
        });
        while let Some(rows) = rows.next()? {
            let mut places = spare.try_recv().unwrap_or_default();
            locator.locate_into(&rows.pixels(), &mut places);
            done += rows.count() as u64;
            if !writing.write(rows, places) {
                break;
            }
            counter.reach(done);
        }
        writing.finish()
    }
}

/// Rows as they come.
struct Arriving {
    rows: Receiver<Outcome<Rows>>,
    /// Those that have come already.
    first: VecDeque<Rows>,
}

impl Arriving {
    /// Waits for so many rows, or what comes before the end, or soon after the first.
    fn gather(&mut self, count: usize) -> Outcome {
        // A slow producer's rows are held back no longer than this.
        const PATIENCE: Duration = Duration::from_secs(1);
        let (mut gathered, mut until) = (0, None);
        while gathered < count {
            let Some(rows) = self.wait(until)? else { break };
            gathered += rows.count();
            self.first.push_back(rows);
            until.get_or_insert_with(|| Instant::now() + PATIENCE);
        }
        Ok(())
    }

    /// The next rows; none at the end.
    fn next(&mut self) -> Outcome<Option<Rows>> {
        match self.first.pop_front() {
            Some(rows) => Ok(Some(rows)),
            None => self.wait(None),
        }
    }

    /// The next rows that come until then; none at the end, or where none do.
    fn wait(&self, until: Option<Instant>) -> Outcome<Option<Rows>> {
        // How often one who wants to stop is caught.
        const TURN: Duration = Duration::from_millis(100);
        loop {
            if interruption::asked() {
                return Err(Error::Cancelled.into());
            }
            match self.rows.recv_timeout(TURN) {
                Ok(rows) => return rows.map(Some),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if until.is_some_and(|until| Instant::now() >= until) {
                return Ok(None);
            }
        }
    }
}

/// The pixels of each point, a camera each.
fn pixels_by_row(pixels: &PixelColumns) -> Vec<Vec<Option<Pixel>>> {
    let count = pixels.points().min(CHECKED);
    (0..count).map(|row| pixels.point(row).collect()).collect()
}

/// Refuses what one camera alone cannot do.
pub(crate) fn needs_two_cameras(model: &Calibration, what: &str) -> Outcome {
    if model.reconstructor.cameras() > 1 {
        return Ok(());
    }
    Err(Error::Degenerate {
        problem: format!(
            "`{what}` needs two cameras or more, and this model has one: a single camera cannot triangulate"
        ),
        hint: "calibrate it together with a second camera, from views that both see; `export` writes this one for other programs".into(),
    }
    .into())
}

/// Rows that speak for all of a table.
const CHECKED: usize = 512;

/// Share of correct matches that may be called a mismatch, unless said otherwise.
pub(super) const FALSE_ALARM: f64 = 0.001;

/// Refuses pixels that would match with two cameras exchanged, and do not as they are.
pub(crate) fn refuse_other_order(
    map: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Outcome {
    let rows = &pixels[..pixels.len().min(CHECKED)];
    let Some((a, b)) = exchanged_cameras(map, rows, rate) else { return Ok(()) };
    Err(Error::Faulty {
        code: "cameras-swapped".into(),
        problem: format!(
            "the pixels are mismatched, but would match with cameras {} and {} exchanged",
            a + 1,
            b + 1
        ),
        hint: "give the columns in the order of the cameras that the model was fitted to".into(),
    }
    .into())
}

/// Refuses pixels whose columns stand for other cameras than those of the model; warns where most do
/// not belong together anyway. The first rows speak for all.
pub(crate) fn refuse_exchanged(
    map: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Outcome {
    refuse_other_order(map, pixels, rate)?;
    let rows = &pixels[..pixels.len().min(CHECKED)];
    if let Some(PixelScatter { sigma, assumed }) = noisier_pixels(map, rows) {
        let sigma = figure(sigma);
        remark!(
            "warning",
            "the pixels scatter by about {sigma} px, and the error bars are for {} px: they are too short, and correct matches are called mismatches. `locate --pixel-sigma {sigma}` has both for such pixels; if they should be as good as those of the calibration, a camera may have moved (`check --against`)",
            figure(assumed)
        );
        return Ok(());
    }
    match mismatched_share(map, rows, rate) {
        Some(share) if share > 0.5 => remark!(
            "warning",
            "{:.0} % of the first {} points have rays that do not intersect: does this model belong to these cameras?",
            100.0 * share,
            rows.len()
        ),
        _ => {}
    }
    Ok(())
}
