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
        CalibratedMap, LocatedBatch, Locator, PixelSigmas, Reconstructor,
        mismatch::{
            MismatchTest, PixelScatter, exchanged_cameras, mismatched_share, noisier_pixels,
        },
    },
    tables::{
        ColumnNames, LocatedColumns, Rows, SigmaColumns, TableOptions, TableReader, TableStyle,
        is_text,
    },
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
    /// Standard deviation of a pixel coordinate in the points file, for error bars and mismatches: a number, or
    /// the column that has it, or the columns, one for each camera [default: that of the model's own points]
    #[arg(long, value_name = "PIXELS|COLUMNS", value_parser = pixel_noise)]
    pixel_sigma: Option<PixelNoise>,
}

/// A probability that leaves both answers possible.
fn rate(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("give a value between 0 and 1".into()) }
}

/// How noisy pixels are.
#[derive(Clone)]
enum PixelNoise {
    /// All of them alike, in pixels.
    Known(f64),
    /// As these columns say.
    Columns(Vec<String>),
}

/// A number, or names of columns separated by commas.
fn pixel_noise(text: &str) -> Result<PixelNoise, String> {
    if text.parse::<f64>().is_ok() {
        return positive(text).map(PixelNoise::Known);
    }
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    if names.iter().any(String::is_empty) {
        return Err("give a number, or names of columns separated by commas".into());
    }
    Ok(PixelNoise::Columns(names))
}

/// How noisy the pixels of rows are, by the columns of their table.
enum Sigmas {
    Unknown,
    Known(f64),
    Columns(SigmaColumns),
}

impl Sigmas {
    fn of(noise: Option<PixelNoise>, input: &TableReader) -> Outcome<Self> {
        Ok(match noise {
            None => Self::Unknown,
            Some(PixelNoise::Known(sigma)) => Self::Known(sigma),
            Some(PixelNoise::Columns(names)) => Self::Columns(input.sigma_columns(&names)?),
        })
    }

    /// One standard deviation for all of some rows: of columns, the root of the mean square of those of seen pixels.
    fn typical(&self, rows: &VecDeque<Rows>) -> Outcome<Option<f64>> {
        let columns = match self {
            Self::Unknown => return Ok(None),
            Self::Known(sigma) => return Ok(Some(*sigma)),
            Self::Columns(columns) => columns,
        };
        let (mut sum, mut count) = (0.0, 0);
        for rows in rows {
            for sigma in
                rows.pixel_sigmas(columns)?.into_iter().flatten().filter(|it| it.is_finite())
            {
                sum += sigma * sigma;
                count += 1;
            }
        }
        Ok((count > 0).then(|| (sum / f64::from(count)).sqrt()))
    }

    fn locate(&self, locator: &mut Locator, rows: &Rows, places: &mut LocatedBatch) -> Outcome {
        let columns;
        let sigmas = match self {
            Self::Unknown => None,
            Self::Known(sigma) => Some(PixelSigmas::One(*sigma)),
            Self::Columns(names) => {
                columns = rows.pixel_sigmas(names)?;
                Some(PixelSigmas::Each(columns.iter().map(Vec::as_slice).collect()))
            }
        };
        locator.locate_noisy_into(&rows.pixels(), sigmas.as_ref(), places);
        Ok(())
    }
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
        let sigmas = Sigmas::of(self.pixel_sigma, &input)?;
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
        let mut locator = model.locator();
        let mut rows = Arriving { rows: tables::start(input), first: VecDeque::new() };
        rows.gather(CHECKED)?;
        let first = rows.first.iter().flat_map(|rows| pixels_by_row(&rows.pixels()));
        let map = CalibratedMap::new(&*model.reconstructor)
            .with_pixel_sigma(sigmas.typical(&rows.first)?);
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
            sigmas.locate(&mut locator, &rows, &mut places)?;
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
