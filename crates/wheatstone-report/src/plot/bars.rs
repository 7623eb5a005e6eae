//! Lying bars, one a row, with their names to the left and their values at their ends.

use super::{
    super::text::{escape, figure},
    LETTER, Panel, WIDTH, short,
};
use maud::{Markup, html};

/// One bar.
pub(crate) struct Bar {
    pub(crate) label: String,
    /// Its length; none draws no bar but says so.
    pub(crate) value: Option<f64>,
    /// A thin mark beside it.
    pub(crate) mark: Option<f64>,
    /// The class that colours it.
    pub(crate) class: &'static str,
    /// Words behind the value.
    pub(crate) note: String,
}

/// Height of a row.
const ROW: f64 = 26.0;

/// Room for names at least.
const NAMES: f64 = 138.0;

/// Letters of a name; longer ones are cut, and whole in the words that appear when pointed at.
const LETTERS: usize = 30;

/// Room for values.
const VALUES: f64 = 124.0;

fn shortened(label: &str) -> String {
    if label.chars().count() <= LETTERS {
        return label.into();
    }
    let start: String = label.chars().take(LETTERS - 1).collect();
    format!("{start}…")
}

/// The names of classes, beside their marks.
fn legend_of(legend: &[(&str, &str)]) -> Markup {
    let mut x = 6.0;
    let mut places = Vec::with_capacity(legend.len());
    for (class, words) in legend {
        places.push((x, class, words));
        x += 30.0 + LETTER * words.chars().count() as f64;
    }
    html! {
        @for (x, class, words) in places {
            @if class.starts_with("line") {
                path class=(class) d={ "M" (short(x + 6.0)) " 5v14" } {}
            } @else {
                rect class=(class) x=(short(x)) y="7" width="12" height="10" {}
            }
            text.tick x=(short(x + 17.0)) y="16" { (escape(words)) }
        }
    }
}

/// One row whose top is at `y`; `length` gives the length of a value's bar.
fn row_of(row: &Bar, (names, y): (f64, f64), length: &dyn Fn(f64) -> f64) -> Markup {
    let value = row.value.map_or_else(|| "-".into(), figure);
    let (note, line) = (escape(&row.note), short(y + 17.0));
    let end = row.value.unwrap_or(0.0).max(row.mark.unwrap_or(0.0));
    let (top, height) = (short(y + 1.0), short(ROW - 2.0));
    html! {
        g {
            title { (escape(&row.label)) ": " (value) " " (note) }
            text class="tick end" x=(short(names - 8.0)) y=(line) { (escape(&shortened(&row.label))) }
            @if let Some(value) = row.value.filter(|value| value.is_finite()) {
                rect class=(row.class) x=(short(names)) y=(short(y + 4.0))
                    width=(short(length(value).max(1.0))) height=(short(ROW - 8.0)) {}
            }
            @if let Some(mark) = row.mark.filter(|mark| mark.is_finite()) {
                path class="line marked" d={ "M" (short(names + length(mark))) " " (top) "v" (height) } {}
            }
            text.tick x=(short(names + length(end) + 7.0)) y=(line) { (value) " " (note) }
        }
    }
}

/// Draws bars from nought; `legend` names classes, `name` the axis with its unit. Bars beyond `cut`
/// end there.
pub(crate) fn bars(
    rows: &[Bar],
    legend: &[(&str, &str)],
    (name, cut): (&str, f64),
    alternative: &str,
) -> Panel {
    let values = rows.iter().flat_map(|row| [row.value, row.mark]).flatten();
    let most = values.filter(|value| value.is_finite()).fold(0.0, f64::max).min(cut).max(1e-300);
    let letters = rows.iter().map(|row| shortened(&row.label).chars().count()).max().unwrap_or(0);
    let names = (8.0 + LETTER * letters as f64).max(NAMES);
    let length = |value: f64| (WIDTH - names - VALUES) * (value / most).clamp(0.0, 1.0);
    let top = if legend.is_empty() { 8.0 } else { 26.0 };
    let foot = top + ROW * rows.len() as f64;
    let left = short(names);
    let body = html! {
        (legend_of(legend))
        @for (index, row) in rows.iter().enumerate() {
            (row_of(row, (names, top + ROW * index as f64), &length))
        }
        path.axis d={ "M" (left) " " (short(top)) "V" (short(foot)) } {}
        text.name x=(left) y=(short(foot + 18.0)) { (escape(name)) }
    };
    Panel {
        alternative: alternative.into(),
        heading: String::new(),
        size: [WIDTH, foot + 28.0],
        body,
    }
}
