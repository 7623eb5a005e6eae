//! `wheatstone locate`.

use crate::{
    failure::Outcome,
    progress::Counter,
    tables::{Rows, Sink},
    voice::remark,
};
use clap::Args;
use std::{io::IsTerminal, path::PathBuf};
use wheatstone::{
    Calibration, Error,
    dataset::points_file::Column,
    geometry::Pixel,
    method::{
        Located, locate_all,
        mismatch::{MismatchTest, exchanged_cameras, mismatched_share},
    },
};

/// Turn matched pixels into points in the world
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone locate model.json pixels.csv -o points.csv\n  \
    producer | wheatstone locate model.json - | consumer\n\n\
    Appends to every row: X,Y,Z and sX,sY,sZ (one standard deviation), in world units; residual, in\n\
    pixels; trust, which is `inside` the space that the model was fitted to, its `edge`, or `outside`;\n\
    and mismatch, which is `yes` where the pixels do not show one point.\n\
    Rows that cannot be located keep their place, with empty cells. Columns of the input that have\n\
    one of these names go on as input_X and so on.")]
pub(crate) struct Locate {
    /// The model file
    model: PathBuf,
    /// A points file with columns x1,y1,x2,y2,… (CSV, or Parquet by extension), or - for standard input
    points: PathBuf,
    /// Where the points go (CSV, or Parquet by extension), or - for standard output
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// Append the covariance of X, Y, Z as well: cXX,cXY,cXZ,cYY,cYZ,cZZ
    #[arg(long)]
    covariance: bool,
    /// How often a true match may be called a mismatch
    #[arg(long, value_name = "RATE", default_value = "0.001", value_parser = rate)]
    false_alarm: f64,
}

/// A probability that leaves both answers possible.
fn rate(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("it lies between 0 and 1".into()) }
}

/// Rows that are read, located and written at once: enough to occupy all cores, little to hold.
const ROWS_AT_ONCE: usize = 16_384;

/// What is appended to each row.
const COLUMNS: [&str; 9] = ["X", "Y", "Z", "sX", "sY", "sZ", "residual", "trust", "mismatch"];

/// What is appended where the covariance is asked for.
const COVARIANCE: [&str; 6] = ["cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"];

impl Locate {
    pub(crate) fn run(self) -> Outcome {
        let model = Calibration::load(&self.model)?;
        needs_two_cameras(&model, "locate")?;
        let mut rows = Rows::open(&self.points)?;
        if rows.cameras() != model.reconstructor.cameras() {
            return Err(Error::Mismatch {
                what: "number of cameras",
                model: model.reconstructor.cameras().to_string(),
                data: rows.cameras().to_string(),
            }
            .into());
        }
        let names = self.header(rows.names().iter().map(String::as_str));
        let mut out = Sink::create(&self.output, names, rows.delimiter())?;
        let shows_rows = self.output.as_os_str() == "-" && std::io::stdout().is_terminal();
        let (mut counter, mut done) = (Counter::new(shows_rows), 0);
        let test = MismatchTest::new(self.false_alarm, rows.cameras());
        while let Some(chunk) = rows.next(ROWS_AT_ONCE)? {
            if done == 0 {
                refuse_exchanged(&model, &chunk.pixels, self.false_alarm)?;
            }
            done += chunk.pixels.len() as u64;
            let found = self.found(&model, &chunk.pixels, &test);
            out.write(chunk, found)?;
            counter.reach(done);
        }
        out.finish()
    }

    /// The appended columns; empty where nothing was located or a figure does not exist.
    fn found(
        &self,
        model: &Calibration,
        pixels: &[Vec<Option<Pixel>>],
        test: &MismatchTest,
    ) -> Vec<Column> {
        let located = locate_all(&*model.reconstructor, pixels);
        let trusted = model.volume.trust_all(pixels);
        let numbers = |of: &dyn Fn(&Located) -> f64| {
            let cell = |found: &Option<Located>| found.as_ref().map(of).filter(|v| v.is_finite());
            Column::Numbers(located.iter().map(cell).collect())
        };
        let mut columns: Vec<Column> = Vec::with_capacity(COLUMNS.len() + COVARIANCE.len());
        columns.extend((0..3).map(|axis| numbers(&|found| found.point[axis])));
        columns.extend((0..3).map(|axis| numbers(&|found| found.covariance[(axis, axis)].sqrt())));
        columns.push(numbers(&|found| found.residual));
        let trust = located.iter().zip(&trusted);
        let trust = trust.map(|(found, trust)| found.as_ref().map(|_| trust.to_string()));
        columns.push(Column::Texts(trust.collect()));
        let mismatch = |(found, pixels): (&Option<Located>, &Vec<Option<Pixel>>)| {
            let seen = pixels.iter().flatten().count();
            let missed = test.is_mismatch(found.as_ref()?, seen);
            missed.then(|| "yes".to_owned())
        };
        columns.push(Column::Texts(located.iter().zip(pixels).map(mismatch).collect()));
        if self.covariance {
            let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
            columns.extend(places.map(|place| numbers(&|found| found.covariance[place])));
        }
        columns
    }

    /// The input's columns and the appended ones, each name once.
    fn header<'a>(&self, columns: impl Iterator<Item = &'a str>) -> Vec<String> {
        let covariance = if self.covariance { &COVARIANCE[..] } else { &[] };
        let appended = || COLUMNS.iter().chain(covariance);
        let free = |name: &str| {
            if appended().any(|own| *own == name) { format!("input_{name}") } else { name.into() }
        };
        columns.map(free).chain(appended().map(|name| (*name).into())).collect()
    }
}

/// Refuses what one camera alone cannot do.
pub(crate) fn needs_two_cameras(model: &Calibration, what: &str) -> Outcome {
    if model.reconstructor.cameras() > 1 {
        return Ok(());
    }
    Err(Error::Degenerate {
        problem: format!(
            "`{what}` needs two cameras or more, and this model has one: it tells a direction, not a distance"
        ),
        hint: "calibrate it together with a second camera, from views that both see; `export` hands this one to other programs".into(),
    }
    .into())
}

/// Refuses pixels whose columns stand for other cameras than those of the model; warns where most do
/// not belong together anyway. The first rows speak for all.
pub(crate) fn refuse_exchanged(
    model: &Calibration,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Outcome {
    const ROWS: usize = 512;
    let rows = &pixels[..pixels.len().min(ROWS)];
    if let Some((a, b)) = exchanged_cameras(&*model.reconstructor, rows, rate) {
        return Err(Error::Faulty {
            code: "cameras-swapped".into(),
            problem: format!(
                "the pixels do not belong together, but would with cameras {} and {} exchanged",
                a + 1,
                b + 1
            ),
            hint: "give the columns in the order of the cameras that the model was fitted to"
                .into(),
        }
        .into());
    }
    match mismatched_share(&*model.reconstructor, rows, rate) {
        Some(share) if share > 0.5 => remark!(
            "warning",
            "{:.0} % of the first {} points have pixels that do not show one point: is this the model of these cameras?",
            100.0 * share,
            rows.len()
        ),
        _ => {}
    }
    Ok(())
}
