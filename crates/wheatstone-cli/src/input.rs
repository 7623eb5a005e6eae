//! The two kinds of input that most commands take: a capture or a points file.

use crate::verbosity::remark;
use crate::{failure::Outcome, progress::Bar};
use clap::Args;
use std::path::{Path, PathBuf};
use wheatstone::{
    capture::{Capture, FILE_NAME, Reach},
    dataset::Dataset,
    detection::{DetectionSettings, Found, detect},
    fit::bundle,
    formats::{Format, Given, gather, guess},
    synthetic::Truth,
    tables::{ColumnNames, Duplicates, TableOptions, TableReader},
};

/// How input is read.
#[derive(Args, Clone)]
pub(crate) struct Reading {
    /// Round detected points to whole pixels, as the 2001 paper measured them (captures only)
    #[arg(long)]
    pub(crate) whole_pixels: bool,
    /// Read pictures outside of the capture's folder too, where capture.toml or links lead there
    #[arg(long)]
    pub(crate) follow: bool,
    /// Unit of lengths; a points file in another unit is converted [default: that of the file, else
    /// of the truth file beside it, else mm]
    #[arg(long)]
    pub(crate) unit: Option<String>,
    /// Keep the first of duplicate rows in a points file, instead of refusing it
    #[arg(long)]
    pub(crate) drop_duplicates: bool,
    /// Names of the columns in a points file: NAME=COLUMN,… or all names in order (`_`: none)
    #[arg(long, value_name = "NAMES", value_parser = columns)]
    pub(crate) columns: Option<ColumnNames>,
}

/// `x1=u_left,y1=v_left` or `x1,y1,x2,y2,X,Y,Z`.
pub(crate) fn columns(text: &str) -> Result<ColumnNames, String> {
    ColumnNames::parse(text).map_err(|error| {
        let hint = error.hint().map(|hint| format!("; {hint}")).unwrap_or_default();
        format!("{error}{hint}")
    })
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("give a value above 0".into()) }
}

/// Correspondences with what is known of their truth.
pub(crate) struct Loaded {
    pub(crate) data: Dataset,
    pub(crate) truth: Option<Truth>,
    /// The pictures, where a capture was read.
    pub(crate) source: Option<Source>,
}

/// A capture with what was found in it.
pub(crate) struct Source {
    pub(crate) capture: Capture,
    pub(crate) found: Found,
}

impl Loaded {
    /// Width and height of each camera's pictures, where a capture has them or the truth tells them.
    pub(crate) fn sizes(&self) -> Vec<Option<[u32; 2]>> {
        if let Some(source) = &self.source {
            return source.capture.sizes();
        }
        let cameras = self.truth.iter().flat_map(|truth| &truth.rig.cameras);
        let sizes: Vec<_> =
            cameras.map(|camera| Some([camera.width as u32, camera.height as u32])).collect();
        if sizes.len() == self.data.cameras { sizes } else { Vec::new() }
    }

    /// Views of a capture whose places have a standard deviation of their own.
    pub(crate) fn sigmas(&self) -> Vec<(String, f64)> {
        let views = self.source.iter().flat_map(|source| &source.capture.views);
        views.filter_map(|view| Some((view.name.clone(), view.sigma?))).collect()
    }
}

impl Reading {
    /// The options that give this reading.
    pub(crate) fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.whole_pixels {
            words.push("--whole-pixels".into());
        }
        if self.follow {
            words.push("--follow".into());
        }
        if let Some(unit) = &self.unit {
            words.extend(["--unit".into(), unit.clone()]);
        }
        if self.drop_duplicates {
            words.push("--drop-duplicates".into());
        }
        if let Some(columns) = &self.columns {
            words.extend(["--columns".into(), columns.to_string()]);
        }
        words
    }
}

/// Whether a path names a capture: a folder, or a TOML file.
fn is_capture(path: &Path) -> bool {
    (path.is_dir() && foreign_table(path).is_none())
        || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The format of points in files of another program, as `convert` reads and writes them; none for captures
/// and for tables of our own. What is no regular file cannot be read twice, and is a table.
fn foreign_table(path: &Path) -> Option<&'static Format> {
    let is_folder = path.is_dir() && !path.join(FILE_NAME).exists();
    if !is_folder && !path.is_file() {
        return None;
    }
    let format = guess(&[path.into()]).ok().flatten()?;
    (!format.is_calibration() && !format.is_table()).then_some(format)
}

/// Reads correspondences, detecting the chart first where a capture is given.
pub(crate) fn load(path: &Path, reading: &Reading, bar: &Bar) -> Outcome<Loaded> {
    load_where(path, reading, true, bar)
}

/// The same, also of matched pixels of which nothing else is known.
pub(crate) fn load_any(path: &Path, reading: &Reading, bar: &Bar) -> Outcome<Loaded> {
    load_where(path, reading, false, bar)
}

fn load_where(path: &Path, reading: &Reading, needs_places: bool, bar: &Bar) -> Outcome<Loaded> {
    let truth = truth_beside(path)?;
    if is_capture(path) {
        let (capture, found) = open_and_detect(path, (reading.follow, reading.whole_pixels), bar)?;
        let pictures = found.pictures.iter().flatten().flatten();
        let skipped = pictures.filter(|p| p.outcome.is_err()).count();
        if skipped > 0 {
            remark!(
                "note",
                "the chart was not found in {skipped} pictures; `wheatstone detect` says why"
            );
        }
        let data = found.dataset.clone();
        let truth = truth.filter(|_| !bundle::needed(&data));
        return Ok(Loaded { data, truth, source: Some(Source { capture, found }) });
    }
    if let Some(format) = foreign_table(path) {
        let given = Given { unit: reading.unit.clone(), ..Given::default() };
        let data = format.read_points(&gather(format, &[path.into()])?, &given)?;
        return Ok(Loaded { data, truth, source: None });
    }
    let duplicates = if reading.drop_duplicates { Duplicates::Drop } else { Duplicates::Refuse };
    let told = reading.unit.clone().or_else(|| truth.as_ref().map(|truth| truth.unit.clone()));
    let options = TableOptions {
        columns: reading.columns.clone(),
        unit: told,
        duplicates,
        ..TableOptions::default()
    };
    let reader = TableReader::open(path, &options)?;
    if let Some(note) = reader.note() {
        remark!("note", "{note}");
    }
    if needs_places {
        reader.needs_points()?;
    }
    let is_assumed = options.unit.is_none() && reader.lacks_unit();
    let data = reader.gather(&options)?;
    if is_assumed {
        let path = path.display();
        remark!("note", "{path} does not say its unit of lengths: mm is assumed (`--unit`)");
    }
    // Charts held by hand get a frame of their own, in which the true cameras do not stand.
    let truth = truth.filter(|_| !bundle::needed(&data));
    Ok(Loaded { data, truth, source: None })
}

/// Opens a capture and looks for its chart.
pub(crate) fn open_and_detect(
    path: &Path,
    (follow, whole_pixels): (bool, bool),
    bar: &Bar,
) -> Outcome<(Capture, Found)> {
    let reach = if follow { Reach::Anywhere } else { Reach::Folder };
    let capture = Capture::open_within(path, reach)?;
    for told in [capture.order_of_pairs(), capture.passed_over()].into_iter().flatten() {
        remark!("note", "{told}");
    }
    tell_missing(&capture);
    let settings = DetectionSettings { whole_pixels, ..DetectionSettings::default() };
    let found = detect(&capture, settings, bar)?;
    let (named, elsewhere) = found.named_elsewhere(&capture);
    if elsewhere > 0 {
        remark!(
            "warning",
            "in {elsewhere} of {named} pictures the chart was found with points elsewhere than the start file says: give each of its rows the view in a column `view`, and check the ids"
        );
    }
    Ok((capture, found))
}

/// Says which views are used without which cameras.
fn tell_missing(capture: &Capture) {
    // Beyond some, the rest is counted.
    const LISTED: usize = 5;
    let missing: Vec<String> =
        capture.missing().map(|(camera, view)| format!("view {view} by `{camera}`")).collect();
    if missing.is_empty() {
        return;
    }
    let more = missing.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed = missing.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    remark!(
        "note",
        "there is no picture of {listed}{more}: these views are used without these cameras"
    );
}

/// The truth file that belongs to the input, if there is one.
fn truth_beside(path: &Path) -> Outcome<Option<Truth>> {
    let folder: PathBuf = match path.file_name() {
        Some(name) if name == FILE_NAME => path.parent().unwrap_or(Path::new("")).into(),
        _ => path.into(),
    };
    let beside = Truth::path_beside(&folder);
    Ok(if beside.is_file() { Some(Truth::load(&beside)?) } else { None })
}
