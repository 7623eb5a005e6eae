//! Drawing in SVG: axes, marks, legends. Colours come from classes of `figure.css`, so that one
//! drawing suits light and dark pages.

pub(super) mod bars;
pub(super) mod colour;
pub(super) mod scale;
pub(super) mod space;

use super::text::escape;
use maud::{Markup, PreEscaped, html};
use scale::Scale;
use std::fmt::Write;

/// What all drawings look like.
pub(super) const STYLE: &str = include_str!("../page/figure.css");

/// One drawing, with what it shows in words.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows, for those who cannot see it.
    pub alternative: String,
    /// A heading of its own, where a figure has several panels.
    pub heading: String,
    /// Width and height.
    pub(super) size: [f64; 2],
    /// What is drawn, without the enclosing element.
    pub(super) body: Markup,
}

impl Panel {
    /// As part of the page.
    pub(super) fn inline(&self) -> Markup {
        let [width, height] = self.size.map(short);
        let area = format!("0 0 {width} {height}");
        let label = escape(&self.alternative);
        html! {
            svg.plot width=(width) height=(height) viewBox=(area) role="img" aria-label=(label) {
                (self.body)
            }
        }
    }

    /// As an SVG file of its own.
    #[must_use]
    pub fn standalone(&self) -> String {
        let [width, height] = self.size.map(short);
        let area = format!("0 0 {width} {height}");
        let drawing = html! {
            svg xmlns="http://www.w3.org/2000/svg" class="plot alone" width=(width) height=(height) viewBox=(area) {
                title { (escape(&self.alternative)) }
                style { (PreEscaped(STYLE)) }
                rect.ground width=(width) height=(height) {}
                (self.body)
            }
            "\n"
        };
        drawing.into_string()
    }
}

/// A length in a drawing: tenths are finer than any screen.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or_else(|| text.clone(), str::to_owned)
}

/// Marks between two axes.
pub(super) struct Plot {
    across: Scale,
    up: Scale,
    /// Left, top, right and bottom of what the axes enclose.
    inside: [f64; 4],
    size: [f64; 2],
    body: Markup,
    legend: Vec<(String, String)>,
}

/// Width of an ordinary drawing; half a page wide it is shown at its own size.
pub(super) const WIDTH: f64 = 480.0;

/// Height of one.
pub(super) const HEIGHT: f64 = 320.0;

/// Room for labels: left, top, right, bottom.
const MARGINS: [f64; 4] = [72.0, 34.0, 14.0, 46.0];

/// Room above where there is no legend.
const BARE: f64 = 8.0;

/// About the width of a letter of the legend, which narrow screens show larger.
const LETTER: f64 = 7.4;

impl Plot {
    /// Axes with their names, which give the units.
    pub(super) fn new(across: (Scale, &str), up: (Scale, &str)) -> Self {
        let [left, top, right, bottom] = MARGINS;
        let inside = [left, top, WIDTH - right, HEIGHT - bottom];
        Self::sized(([WIDTH, HEIGHT], inside), across, up)
    }

    fn sized(
        (size, inside): ([f64; 2], [f64; 4]),
        across: (Scale, &str),
        up: (Scale, &str),
    ) -> Self {
        let mut plot = Self {
            across: across.0,
            up: up.0,
            inside,
            size,
            body: Markup::default(),
            legend: Vec::new(),
        };
        plot.draw_axes(across.1, up.1);
        plot
    }

    /// Equal lengths across and up, with up pointing down where `downwards`; `scale` is the length
    /// of a unit in the drawing, where several drawings share one.
    pub(super) fn square(
        across: (f64, f64),
        up: (f64, f64),
        (downwards, scale): (bool, Option<f64>),
        names: [&str; 2],
    ) -> Self {
        let [left, _, right, bottom] = MARGINS;
        let (wide, high) = ((across.1 - across.0).max(1e-300), (up.1 - up.0).max(1e-300));
        // A drawing much higher than wide would fill the screen: it gets narrower instead.
        let width = WIDTH - left - right;
        let scale = scale.unwrap_or((width / wide).min(1.1 * width / high));
        let (width, height) = ((wide * scale).max(120.0), (high * scale).max(60.0));
        let inside = [left, BARE, left + width, BARE + height];
        let size = [left + width + right, BARE + height + bottom];
        let up = if downwards { (up.1, up.0) } else { up };
        let axes = (Scale::exactly(across.0, across.1), Scale::exactly(up.0, up.1));
        Self::sized((size, inside), (axes.0, names[0]), (axes.1, names[1]))
    }

    fn draw_axes(&mut self, across: &str, up: &str) {
        let [left, top, right, bottom] = self.inside;
        let count = |length: f64, each: f64| (length / each).max(2.0) as usize;
        for (value, label) in self.across.ticks(count(right - left, 70.0)) {
            let x = short(self.x(value));
            let path = format!("M{x} {}V{}", short(top), short(bottom));
            self.add(html! {
                path.grid d=(path) {}
                text x=(x) y=(short(bottom + 16.0)) class="tick mid" { (label) }
            });
        }
        for (value, label) in self.up.ticks(count(bottom - top, 46.0)) {
            let y = self.y(value);
            let path = format!("M{} {}H{}", short(left), short(y), short(right));
            self.add(html! {
                path.grid d=(path) {}
                text x=(short(left - 6.0)) y=(short(y + 4.0)) class="tick end" { (label) }
            });
        }
        let (middle, centre) = ((left + right) / 2.0, (top + bottom) / 2.0);
        let turned = format!("translate(14 {}) rotate(-90)", short(centre));
        self.add(html! {
            text x=(short(middle)) y=(short(self.size[1] - 10.0)) class="name mid" { (escape(across)) }
            text transform=(turned) class="name mid" { (escape(up)) }
        });
    }

    pub(super) fn x(&self, value: f64) -> f64 {
        let share = self.across.share(value).clamp(-0.5, 1.5);
        self.inside[0] + share * (self.inside[2] - self.inside[0])
    }

    pub(super) fn y(&self, value: f64) -> f64 {
        let share = self.up.share(value).clamp(-0.5, 1.5);
        self.inside[3] - share * (self.inside[3] - self.inside[1])
    }

    /// A line through points, in the look of `class`, named in the legend.
    pub(super) fn line(&mut self, points: &[[f64; 2]], class: &str, name: &str) {
        let finite = points.iter().filter(|p| p[0].is_finite() && p[1].is_finite());
        let mut path = String::new();
        for [x, y] in finite {
            let letter = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{letter}{} {}", short(self.x(*x)), short(self.y(*y)));
        }
        self.add(html! { path class={ "line " (class) } d=(path) {} });
        if !name.is_empty() {
            self.legend.push((format!("line {class}"), name.into()));
        }
    }

    /// A round mark; `point` is the number of the point that it stands for.
    pub(super) fn dot(
        &mut self,
        [x, y]: [f64; 2],
        class: &str,
        (radius, point): (f64, Option<usize>),
    ) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        let [x, y] = [short(self.x(x)), short(self.y(y))];
        self.add(html! { circle class=(class) cx=(x) cy=(y) r=(short(radius)) data-p=[point] {} });
    }

    /// A filled rectangle between two corners, with words that appear when it is pointed at.
    pub(super) fn cell(&mut self, [x0, y0, x1, y1]: [f64; 4], fill: &str, words: &str) {
        let (a, b) = (self.x(x0).min(self.x(x1)), self.x(x0).max(self.x(x1)));
        let (c, d) = (self.y(y0).min(self.y(y1)), self.y(y0).max(self.y(y1)));
        let (fill, class) =
            if fill.starts_with('#') { (Some(fill), None) } else { (None, Some(fill)) };
        // Half a tenth more, so that no seams show.
        let [width, height] = [short(b - a + 0.1), short(d - c + 0.1)];
        self.add(html! {
            rect fill=[fill] class=[class] x=(short(a)) y=(short(c)) width=(width) height=(height) {
                title { (escape(words)) }
            }
        });
    }

    /// Anything else, in units of the drawing.
    pub(super) fn add(&mut self, svg: Markup) {
        self.body.0 += &svg.0;
    }

    pub(super) fn finish(mut self, heading: &str, alternative: &str) -> Panel {
        self.draw_legend();
        Panel {
            alternative: alternative.into(),
            heading: heading.into(),
            size: self.size,
            body: self.body,
        }
    }

    /// From the left in one row or two; more would cover the drawing.
    fn draw_legend(&mut self) {
        let (mut x, mut y) = (self.inside[0], 12.0);
        for (class, name) in std::mem::take(&mut self.legend) {
            let width = 30.0 + LETTER * name.chars().count() as f64;
            if x + width > self.size[0] && x > self.inside[0] {
                (x, y) = (self.inside[0], y + 15.0);
            }
            let (left, line) = (short(x), short(y));
            self.add(html! {
                @if class.starts_with("line") {
                    path class=(class) d={ "M" (left) " " (line) "h18" } {}
                } @else {
                    circle class=(class) cx=(short(x + 9.0)) cy=(line) r="4" {}
                }
                text x=(short(x + 23.0)) y=(short(y + 4.0)) class="tick" { (escape(&name)) }
            });
            x += width;
        }
    }
}

/// A colour bar with its ends and its middle, below a map: `values` from the darkest to the
/// lightest.
pub(super) fn colour_bar((low, high): (f64, f64), unit: &str, panel: &mut Panel) {
    let [width, height] = panel.size;
    let (left, right) = (MARGINS[0], width - MARGINS[2]);
    let steps = 40;
    let step = (right - left) / f64::from(steps);
    for index in 0..steps {
        let place = (f64::from(index) + 0.5) / f64::from(steps);
        let (left, width) = (short(left + f64::from(index) * step), short(step + 0.3));
        let bar = html! {
            rect x=(left) y=(short(height)) width=(width) height="10" fill=(colour::cividis(place)) {}
        };
        panel.body.0 += &bar.0;
    }
    // Three do not fit below a narrow bar.
    let middle = ((left + right) / 2.0, (low + high) / 2.0, "mid");
    let middle = Some(middle).filter(|_| right - left > 240.0);
    for (x, value, class) in [(left, low, ""), (right, high, "end")].into_iter().chain(middle) {
        // Counts have no decimals.
        let value =
            if value.fract() == 0.0 { value.to_string() } else { super::text::figure(value) };
        let label = html! {
            text x=(short(x)) y=(short(height + 24.0)) class={ "tick " (class) } {
                (value) " " (escape(unit))
            }
        };
        panel.body.0 += &label.0;
    }
    panel.size[1] += 32.0;
}
