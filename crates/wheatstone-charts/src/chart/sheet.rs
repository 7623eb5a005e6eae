//! Charts as sheets to print, to true scale: with their name, and a ruler to check the print by.

mod pdf;
mod svg;

use super::{AnyChart, Chart, Shape, refused};
use wheatstone_core::{Error, Result};

/// The units that a sheet can have.
pub const UNITS: [&str; 4] = ["mm", "cm", "m", "in"];

/// Length of the ruler below the chart, in millimetres.
const RULER: f64 = 100.0;

/// What most printers leave white along the edges of the paper, in millimetres.
const MARGIN: f64 = 4.5;

/// Height of the ruler with its figures, in millimetres.
const RULER_HEIGHT: f64 = 5.2;

/// Height of letters, and distance of lines of text, in millimetres.
const LETTERS: [f64; 2] = [2.3, 2.7];

/// Between the ruler and the text beside it, in millimetres: the last figure sticks out.
const GAP: f64 = 8.0;

const NOTE: &str = "Print at 100 %: where the ruler is not 100 mm long, the print is not to scale.";

/// Millimetres in one of [`UNITS`]; `None` for any other.
#[must_use]
pub fn millimetres_per(unit: &str) -> Option<f64> {
    match unit {
        "mm" => Some(1.0),
        "cm" => Some(10.0),
        "m" => Some(1000.0),
        "in" => Some(25.4),
        _ => None,
    }
}

/// A size of paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    /// 210 x 297 mm.
    A4,
    /// 8.5 x 11 inches.
    Letter,
}

impl Paper {
    /// The names of all.
    pub const NAMES: [&str; 2] = ["a4", "letter"];

    /// The paper of this name.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "a4" => Ok(Self::A4),
            "letter" => Ok(Self::Letter),
            _ => Err(Error::UnknownName {
                kind: "paper",
                name: name.into(),
                known: Self::NAMES.map(String::from).to_vec(),
            }),
        }
    }

    /// Width and height in millimetres, upright.
    #[must_use]
    pub fn size(self) -> [f64; 2] {
        match self {
            Self::A4 => [210.0, 297.0],
            Self::Letter => [215.9, 279.4],
        }
    }
}

/// A chart on a page, with its name and a ruler below its white margin.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    title: String,
    /// Width and height in millimetres.
    size: [f64; 2],
    /// Black, in millimetres from the top-left corner of the page.
    shapes: Vec<Shape>,
    texts: Vec<Text>,
}

/// A line of text; `at` is where its baseline begins, in millimetres.
#[derive(Clone, Debug, PartialEq)]
struct Text {
    at: [f64; 2],
    words: String,
}

/// A chart in millimetres.
struct Measured {
    /// Left, top, right and bottom of the white board, and of what is black on it.
    board: [f64; 4],
    ink: [f64; 4],
}

impl Measured {
    fn of(chart: &dyn Chart, scale: f64) -> Self {
        let mut ink = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for shape in chart.shapes() {
            let [left, top, right, bottom] = scaled(shape, scale, [0.0; 2]).edges();
            ink = [ink[0].min(left), ink[1].min(top), ink[2].max(right), ink[3].max(bottom)];
        }
        Self { board: chart.board().map(|edge| edge * scale), ink }
    }

    /// Width and height, `times` as large, with as much white as the chart and the printer need.
    fn needs(&self, times: f64) -> [f64; 2] {
        [0, 1].map(|axis| {
            let [first, last] = self.white(axis).map(|white| (times * white).max(MARGIN));
            first + times * (self.ink[axis + 2] - self.ink[axis]) + last
        })
    }

    /// Width of the white on both sides.
    fn white(&self, axis: usize) -> [f64; 2] {
        [self.ink[axis] - self.board[axis], self.board[axis + 2] - self.ink[axis + 2]]
    }
}

/// Whether the text stands beside the ruler on a page of this width, and how high they are together.
fn footer(title: &str, width: f64) -> (bool, f64) {
    let beside = 2.0 * MARGIN + RULER + GAP + text_width(title).max(text_width(NOTE)) <= width;
    (beside, RULER_HEIGHT + if beside { 0.0 } else { 2.0 * LETTERS[1] })
}

/// A little more than the width of a line in Helvetica, in millimetres.
fn text_width(words: &str) -> f64 {
    0.56 * LETTERS[0] * words.chars().count() as f64
}

fn scaled(shape: Shape, scale: f64, moved: [f64; 2]) -> Shape {
    let [x, y] = moved;
    match shape {
        Shape::Rectangle([left, top, right, bottom]) => Shape::Rectangle([
            scale * left + x,
            scale * top + y,
            scale * right + x,
            scale * bottom + y,
        ]),
        Shape::Disc(centre, radius) => {
            Shape::Disc([scale * centre[0] + x, scale * centre[1] + y], scale * radius)
        }
    }
}

/// A length as it is written: a millionth of a millimetre is finer than any printer.
fn written(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// The page on which a chart `times` as large fits, if any does: upright or turned, as the chart is.
fn page(chart: &Measured, title: &str, paper: Paper, times: f64) -> Option<[f64; 2]> {
    let [width, height] = chart.needs(times);
    let [short, long] = paper.size();
    let upright = [[short, long], [long, short]];
    let turned = [[long, short], [short, long]];
    let pages = if width > height { turned } else { upright };
    pages
        .into_iter()
        .find(|page| width <= page[0] && height + footer(title, page[0]).1 + MARGIN <= page[1])
}

fn scale_of(unit: &str) -> Result<f64> {
    millimetres_per(unit).ok_or_else(|| Error::UnknownName {
        kind: "unit",
        name: unit.into(),
        known: UNITS.map(String::from).to_vec(),
    })
}

/// How many times as large the chart may be to fit the paper; 1 or more where it fits.
///
/// # Errors
///
/// [`Error::UnknownName`] for a unit that is not in [`UNITS`].
pub fn largest(chart: &AnyChart, unit: &str, paper: Paper) -> Result<f64> {
    let scale = scale_of(unit)?;
    let (measured, title) = (Measured::of(&**chart, scale), title(chart, scale));
    // What fits is found by halving between nothing and a chart as wide as the paper is long.
    let (mut fits, mut too_large) = (0.0, paper.size()[1] / (measured.ink[2] - measured.ink[0]));
    for _ in 0..60 {
        let middle = 0.5 * (fits + too_large);
        match page(&measured, &title, paper, middle) {
            Some(_) => fits = middle,
            None => too_large = middle,
        }
    }
    Ok(if page(&measured, &title, paper, 1.0).is_some() { fits.max(1.0) } else { fits })
}

fn title(chart: &AnyChart, scale: f64) -> String {
    format!("{}, {}", chart.kind(), chart.label(scale))
}

impl Sheet {
    /// The chart, whose lengths are in `unit`, on a page of its own size or on `paper`.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`] for a unit that is not in [`UNITS`]; [`Error::Setting`] for a chart that
    /// does not fit the paper, with the size that would.
    pub fn new(chart: &AnyChart, unit: &str, paper: Option<Paper>) -> Result<Self> {
        let scale = scale_of(unit)?;
        let (measured, title) = (Measured::of(&**chart, scale), title(chart, scale));
        let size = match paper {
            Some(paper) => page(&measured, &title, paper, 1.0)
                .ok_or_else(|| too_large(chart, unit, (&measured, &title), paper))?,
            None => {
                let [width, height] = measured.needs(1.0);
                let lines = text_width(&title).max(text_width(NOTE)).max(RULER + GAP);
                let width = width.max(lines + 2.0 * MARGIN);
                [width, height + footer(&title, width).1 + MARGIN]
            }
        };
        let (beside, footer) = footer(&title, size[0]);
        // The ink in the middle of what the footer leaves, between equal parts of white.
        let free = [size[0], size[1] - footer - MARGIN];
        let needed = measured.needs(1.0);
        let moved = [0, 1].map(|axis| {
            let white = measured.white(axis)[0].max(MARGIN);
            (free[axis] - needed[axis]) / 2.0 + white - measured.ink[axis]
        });
        let shapes = chart.shapes().into_iter().map(|shape| scaled(shape, scale, moved));
        let mut sheet = Self { size, shapes: shapes.collect(), texts: Vec::new(), title };
        sheet.add_footer(size[1] - footer - MARGIN, beside);
        Ok(sheet)
    }

    /// The ruler below `top`, and the text beside or below it.
    fn add_footer(&mut self, top: f64, beside: bool) {
        let line = |left, top, right, bottom| Shape::Rectangle([left, top, right, bottom]);
        // Lines are a fifth of a millimetre wide, their middles at the millimetres.
        let (half, base) = (0.1, top + 2.5);
        self.shapes.push(line(MARGIN - half, base - half, MARGIN + RULER + half, base + half));
        for tick in 0..=10_u32 {
            let x = MARGIN + f64::from(tick) * RULER / 10.0;
            let height = if tick % 5 == 0 { 2.5 } else { 1.5 };
            self.shapes.push(line(x - half, base - height, x + half, base));
            if tick % 5 == 0 {
                let unit = if tick == 10 { " mm" } else { "" };
                let figure = 10 * tick;
                // The figure's middle, without its unit, below the tick.
                let left = x - text_width(&figure.to_string()) / 2.0;
                let at = [left.max(MARGIN), top + RULER_HEIGHT - 0.4];
                self.texts.push(Text { at, words: format!("{figure}{unit}") });
            }
        }
        let [x, y] = if beside {
            [MARGIN + RULER + GAP, base - half]
        } else {
            [MARGIN, top + RULER_HEIGHT + LETTERS[0]]
        };
        for (row, words) in [&self.title, NOTE].into_iter().enumerate() {
            let at = [x, y + row as f64 * LETTERS[1]];
            self.texts.push(Text { at, words: words.to_owned() });
        }
    }

    /// What is printed below the chart: its kind, its counts and its sizes in millimetres.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// As an SVG drawing.
    #[must_use]
    pub fn svg(&self) -> String {
        svg::draw(self)
    }

    /// As a PDF of one page.
    #[must_use]
    pub fn pdf(&self) -> Vec<u8> {
        pdf::draw(self)
    }
}

/// The step in which sizes are suggested, in units: a millimetre, or a twentieth of an inch.
fn step(unit: &str) -> f64 {
    if unit == "in" { 0.05 } else { 1.0 / millimetres_per(unit).unwrap_or(1.0) }
}

/// A size of so many units, rounded down to one that is easily measured.
#[must_use]
pub fn rounded_down(size: f64, unit: &str) -> f64 {
    let coarse = step(unit);
    let fine = if size < 10.0 * coarse { coarse / 10.0 } else { coarse };
    // The quotient is a whole number of steps, so that the decimal is the shortest one.
    let per_unit = (1.0 / fine).round().max(1.0);
    if fine > 1.0 { (size / fine).floor() * fine } else { (size * per_unit).floor() / per_unit }
}

fn too_large(
    chart: &AnyChart,
    unit: &str,
    (measured, title): (&Measured, &str),
    paper: Paper,
) -> Error {
    let [width, height] = measured.needs(1.0);
    let [short, long] = paper.size();
    let page = if width > height { [long, short] } else { [short, long] };
    let height = height + footer(title, page[0]).1 + MARGIN;
    let times = largest(chart, unit, paper).unwrap_or_default();
    let name = Paper::NAMES[paper as usize];
    let takes = format!(
        "with its white margin, name and ruler the chart takes {} x {} mm, and {name} is {} x {} mm",
        width.ceil(),
        height.ceil(),
        page[0],
        page[1]
    );
    match chart.size() {
        Some((setting, value)) => {
            let most = rounded_down(value * times, unit);
            let need = format!("at most {most} {unit}, or fewer columns and rows: {takes}");
            refused(setting, format!("{value} {unit}"), need)
        }
        None => {
            let need = format!("points at most {times:.2} times as far apart: {takes}");
            refused("points", format!("{} x {} mm", width.ceil(), height.ceil()), need)
        }
    }
}
