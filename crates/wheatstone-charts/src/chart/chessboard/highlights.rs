//! Corners at the rim of a highlight, where light that is reflected by the paper's gloss is added to that of the
//! squares: white is cut off at the largest value of the camera, dark is not and falls off across the corner, and the
//! saddle is drawn aside by up to a pixel.

use super::{
    growth::{steps, window},
    seed::Labels,
};
use crate::{
    chart::{ChartSearch, Detection},
    imaging::GrayImage,
};
use nalgebra::Vector2;
use std::collections::BTreeSet;
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::statistics::median;

/// How much lighter than on the rest of the board dark squares are in a highlight, as a share of the white beside them:
/// strong light on a part of the board makes both lighter. Rendered highlights: most corners beyond it are 0.2 to 0.9 px
/// off, those below 0.04 px. Photographs come to 0.18, where a board is overexposed and lit unevenly.
const LIGHTER: f64 = 0.2;
/// Weight in a corner's window of pixels at the largest value. White squares have half of it.
const CUT_OFF: f64 = 0.25;
/// Values that count as the largest, as a share of it: noise and compression.
const LARGEST: f32 = 0.99;

/// The same readings without the corners that a highlight has drawn aside. An overexposed board loses none: its dark
/// squares are alike.
pub(in crate::chart) fn without(
    image: &GrayImage,
    labels: &Labels,
    seen: ChartSearch,
) -> ChartSearch {
    let drawn = drawn_aside(image, labels);
    let ChartSearch::Found(mut readings) = seen else { return seen };
    if !drawn.is_empty() {
        for Detection { points, .. } in &mut readings {
            points.retain(|(_, at)| !drawn.contains(&bits(*at)));
        }
    }
    ChartSearch::Found(readings)
}

fn bits(at: Pixel) -> [u64; 2] {
    [at.x.to_bits(), at.y.to_bits()]
}

fn drawn_aside(image: &GrayImage, labels: &Labels) -> BTreeSet<[u64; 2]> {
    let all: Vec<Window> = labels
        .iter()
        .filter_map(|(label, at)| {
            let (along, down) = steps(labels, *label)?;
            Some(Window::new(image, *at, window(along.norm().min(down.norm()))))
        })
        .collect();
    if all.is_empty() {
        return BTreeSet::new();
    }
    let typical = median(&all.iter().map(Window::darkness).collect::<Vec<_>>());
    let mut lighter = all.iter().filter(|it| it.darkness() - typical > LIGHTER).peekable();
    // Most pictures have no such corner, and need not be read for their largest value.
    if lighter.peek().is_none() {
        return BTreeSet::new();
    }
    let largest = image.values().iter().copied().fold(0.0, f32::max);
    let is_cut_off = |it: &&Window| it.share_above(image, LARGEST * largest) > CUT_OFF;
    lighter.filter(is_cut_off).map(|it| bits(it.at)).collect()
}

/// What a corner's window shows.
struct Window {
    at: Pixel,
    sigma: f64,
    /// In grey values: what a tenth of the pixels are darker than, and a tenth lighter.
    dark: f64,
    light: f64,
}

impl Window {
    fn new(image: &GrayImage, at: Pixel, sigma: f64) -> Self {
        let mut values: Vec<f32> =
            places(at, sigma).into_iter().map(|(x, y)| image.at(x, y)).collect();
        let tenth = values.len() / 10;
        let dark = f64::from(*values.select_nth_unstable_by(tenth, f32::total_cmp).1);
        let last = values.len() - 1 - tenth;
        let light = f64::from(*values.select_nth_unstable_by(last, f32::total_cmp).1);
        Self { at, sigma, dark, light }
    }

    /// Dark as a share of light: 0 is black.
    fn darkness(&self) -> f64 {
        self.dark / self.light.max(f64::MIN_POSITIVE)
    }

    /// Weight of the pixels that are at least so light.
    fn share_above(&self, image: &GrayImage, least: f32) -> f64 {
        let (mut above, mut all) = (0.0, 0.0);
        for (x, y) in places(self.at, self.sigma) {
            let away = Vector2::new(x as f64, y as f64) - self.at.coords;
            let weight = libm::exp(-away.norm_squared() / 2.0 / (self.sigma * self.sigma));
            all += weight;
            above += if image.at(x, y) >= least { weight } else { 0.0 };
        }
        above / all
    }
}

/// The pixels of a saddle's window.
fn places(at: Pixel, sigma: f64) -> Vec<(isize, isize)> {
    let reach = (3.0 * sigma).ceil() as isize;
    let (x, y) = (at.x.round() as isize, at.y.round() as isize);
    let row = |y: isize| (x - reach..=x + reach).map(move |x| (x, y));
    (y - reach..=y + reach).flat_map(row).collect()
}
