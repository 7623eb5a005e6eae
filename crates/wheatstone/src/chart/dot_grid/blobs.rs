//! Patches that are darker or brighter than what lies around them and have an ellipse's shape.

use crate::{geometry::Pixel, imaging::GrayImage};
use nalgebra::Matrix2;

/// A patch that can be a dot.
#[derive(Clone, Copy, Debug)]
pub(in crate::chart) struct Blob {
    /// Mean of its pixels.
    pub(in crate::chart) centre: Pixel,
    /// Their covariance. That of an ellipse's inside is a quarter of its squared half axes.
    pub(in crate::chart) covariance: Matrix2<f64>,
    /// How far it differs from the mean around it, in grey levels.
    pub(in crate::chart) contrast: f64,
}

impl Blob {
    /// Of the ellipse with this covariance, in square pixels.
    pub(in crate::chart) fn area(&self) -> f64 {
        area(&self.covariance)
    }

    /// Where it is, and how large, in the picture of which this one is the `halvings`-th half.
    pub(in crate::chart) fn restored(&self, halvings: usize) -> Self {
        let factor = (1_usize << halvings) as f64;
        Self {
            // Pixel centres are whole numbers, so pictures share their edges at -0.5.
            centre: Pixel::from((self.centre.coords.add_scalar(0.5) * factor).add_scalar(-0.5)),
            covariance: self.covariance * (factor * factor),
            ..*self
        }
    }
}

/// Area of the ellipse whose inside has this covariance.
pub(in crate::chart) fn area(covariance: &Matrix2<f64>) -> f64 {
    4.0 * std::f64::consts::PI * covariance.determinant().max(0.0).sqrt()
}

/// Dark and bright patches.
#[derive(Default)]
pub(in crate::chart) struct Blobs {
    pub(in crate::chart) dark: Vec<Blob>,
    pub(in crate::chart) bright: Vec<Blob>,
}

/// Half a side of the window whose mean parts dark from bright: a window of 33 pixels holds dots of
/// 26 with ground around them; larger dots are found in smaller pictures.
const HALF_WINDOW: usize = 16;
/// Share of the window's standard deviation by which a patch differs from its mean. A third keeps dots
/// apart at the ground's side where they fill half of it, and pale ones in where they fill a twentieth.
const DEVIATION: f64 = 0.35;
/// Share of the picture's range below which differences are those of noise and paper.
const LEAST_CONTRAST: f64 = 0.02;
/// In pixels: smaller patches have no shape.
const LEAST_AREA: f64 = 6.0;
/// In pixels: the area of the largest disc that the window parts from its ground.
const MOST_AREA: f64 = 650.0;
/// Squared distance, in standard deviations, of the pixel that lies farthest out: 4 in an ellipse, 6 in a
/// square or parallelogram, more where anything sticks out. Pixels of small patches are coarse.
const MOST_REACH: [f64; 2] = [5.2, 6.5];
/// The same for any compact convex outline: 6 in a parallelogram, and what blur and pixels add.
const CONVEX_REACH: [f64; 2] = [6.9, 7.5];
/// In pixels: patches below this are small in the sense of [`MOST_REACH`].
const SMALL: f64 = 40.0;
/// Area by count and area by covariance, ratio: 1 in an ellipse, 0.6 in a ring half as wide as its radius.
const FILLED: (f64, f64) = (0.85, 1.12);
/// Of the axes of an ellipse: a disc tilted by 80 degrees.
const MOST_SLENDER: f64 = 6.0;

/// What a patch's outline may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::chart) enum Outline {
    /// That of a disc seen from anywhere.
    Ellipse,
    /// That of a square or a disc.
    Convex,
}

impl Outline {
    fn most_reach(self) -> [f64; 2] {
        match self {
            Self::Ellipse => MOST_REACH,
            Self::Convex => CONVEX_REACH,
        }
    }
}

/// Pixels of one row, beside each other, on one side of the mean.
struct Run {
    row: u32,
    first: u32,
    last: u32,
    /// An earlier run of the same patch, or itself.
    parent: u32,
    difference: f32,
}

/// All patches of a picture that have such an outline.
pub(in crate::chart) fn find(image: &GrayImage, outline: Outline) -> Blobs {
    let least = LEAST_CONTRAST * range(image);
    // Grey levels are not told apart beyond single precision.
    if least <= 1e-4 || image.width().min(image.height()) < 5 {
        return Blobs::default();
    }
    let [mut dark, mut bright] = runs(image, least);
    Blobs { dark: patches(image, &mut dark, outline), bright: patches(image, &mut bright, outline) }
}

/// Between the darkest and the brightest thousandth.
fn range(image: &GrayImage) -> f64 {
    // Ten thousand pixels tell.
    let step = (image.values().len() / 10_000).max(1);
    let mut values: Vec<f32> = image.values().iter().step_by(step).copied().collect();
    values.sort_by(f32::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    f64::from(at(0.999) - at(0.001))
}

/// Runs of dark and of bright pixels, joined to those of the row above that they touch.
fn runs(image: &GrayImage, least: f64) -> [Vec<Run>; 2] {
    let (width, height) = (image.width(), image.height());
    let mut columns = vec![(0.0_f64, 0.0_f64); width];
    let add = |columns: &mut Vec<(f64, f64)>, row: usize, sign: f64| {
        for (sum, value) in columns.iter_mut().zip(image.row(row)) {
            let value = f64::from(*value);
            sum.0 += sign * value;
            sum.1 += sign * value * value;
        }
    };
    (0..HALF_WINDOW.min(height)).for_each(|row| add(&mut columns, row, 1.0));
    let mut found = [Vec::new(), Vec::new()];
    let mut above = [0, 0];
    let mut sums = vec![(0.0, 0.0); width + 1];
    for row in 0..height {
        if row + HALF_WINDOW < height {
            add(&mut columns, row + HALF_WINDOW, 1.0);
        }
        if row > HALF_WINDOW {
            add(&mut columns, row - HALF_WINDOW - 1, -1.0);
        }
        for (x, column) in columns.iter().enumerate() {
            sums[x + 1] = (sums[x].0 + column.0, sums[x].1 + column.1);
        }
        let rows = (row + HALF_WINDOW).min(height - 1) - row.saturating_sub(HALF_WINDOW) + 1;
        let begin = [found[0].len(), found[1].len()];
        for (x, value) in image.row(row).iter().enumerate() {
            let (left, right) = (x.saturating_sub(HALF_WINDOW), (x + HALF_WINDOW + 1).min(width));
            let count = ((right - left) * rows) as f64;
            let mean = (sums[right].0 - sums[left].0) / count;
            let variance = (sums[right].1 - sums[left].1) / count - mean * mean;
            let difference = f64::from(*value) - mean;
            if difference.abs() > least.max(DEVIATION * variance.max(0.0).sqrt()) {
                let side = usize::from(difference > 0.0);
                let difference = difference.abs() as f32;
                lengthen(&mut found[side], begin[side], (row as u32, x as u32), difference);
            }
        }
        for side in [0, 1] {
            join(&mut found[side], above[side], begin[side]);
        }
        above = begin;
    }
    found
}

/// Adds a pixel to the row's last run, or begins another.
fn lengthen(runs: &mut Vec<Run>, begin: usize, (row, x): (u32, u32), difference: f32) {
    let parent = runs.len() as u32;
    match runs[begin..].last_mut() {
        Some(run) if run.last + 1 == x => {
            run.last = x;
            run.difference += difference;
        }
        _ => runs.push(Run { row, first: x, last: x, parent, difference }),
    }
}

/// Joins the runs from `begin` on, those of one row, to those from `above` on, of the row before.
fn join(runs: &mut [Run], above: usize, begin: usize) {
    let (mut upper, mut lower) = (above, begin);
    while upper < begin && lower < runs.len() {
        if runs[upper].first <= runs[lower].last && runs[lower].first <= runs[upper].last {
            let (a, b) = (root(runs, upper), root(runs, lower));
            runs[a.max(b)].parent = a.min(b) as u32;
        }
        if runs[upper].last < runs[lower].last {
            upper += 1;
        } else {
            lower += 1;
        }
    }
}

fn root(runs: &mut [Run], mut run: usize) -> usize {
    while runs[run].parent as usize != run {
        runs[run].parent = runs[runs[run].parent as usize].parent;
        run = runs[run].parent as usize;
    }
    run
}

/// Sums over a patch, of places counted from its first pixel.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    difference: f64,
    at_border: bool,
}

impl Sums {
    fn add(&mut self, run: &Run, (x, y): (f64, f64), at_border: bool) {
        let count = f64::from(run.last - run.first + 1);
        let middle = f64::from(run.first + run.last) / 2.0 - x;
        let down = f64::from(run.row) - y;
        self.count += count;
        self.x += count * middle;
        self.y += count * down;
        self.xx += count * (middle * middle + (count * count - 1.0) / 12.0);
        self.xy += count * middle * down;
        self.yy += count * down * down;
        self.difference += f64::from(run.difference);
        self.at_border |= at_border;
    }

    /// The patch, where its moments are those of an ellipse.
    fn blob(&self, (x, y): (f64, f64)) -> Option<Blob> {
        if self.at_border || self.count < LEAST_AREA || self.count > MOST_AREA {
            return None;
        }
        let (across, down) = (self.x / self.count, self.y / self.count);
        // A pixel is a square: its own covariance is a twelfth.
        let xx = self.xx / self.count - across * across + 1.0 / 12.0;
        let yy = self.yy / self.count - down * down + 1.0 / 12.0;
        let xy = self.xy / self.count - across * down;
        let covariance = Matrix2::new(xx, xy, xy, yy);
        let filled = self.count / area(&covariance);
        let (half, spread) = ((xx + yy) / 2.0, ((xx - yy) * (xx - yy) / 4.0 + xy * xy).sqrt());
        let slender = (half + spread) > MOST_SLENDER * MOST_SLENDER * (half - spread);
        (filled > FILLED.0 && filled < FILLED.1 && !slender).then(|| Blob {
            centre: Pixel::new(x + across, y + down),
            covariance,
            contrast: self.difference / self.count,
        })
    }
}

/// The patches that have such an outline.
fn patches(image: &GrayImage, runs: &mut [Run], outline: Outline) -> Vec<Blob> {
    // Noise makes millions of runs; few of them belong to anything as large as a dot.
    let mut counts = vec![0_u32; runs.len()];
    for index in 0..runs.len() {
        counts[root(runs, index)] += runs[index].last - runs[index].first + 1;
    }
    let mut sums: Vec<Sums> = Vec::new();
    let mut places = vec![u32::MAX; runs.len()];
    for (place, count) in places.iter_mut().zip(counts) {
        if (LEAST_AREA..=MOST_AREA).contains(&f64::from(count)) {
            *place = sums.len() as u32;
            sums.push(Sums::default());
        }
    }
    let origin = |run: &Run| (f64::from(run.first), f64::from(run.row));
    let sums_of = |runs: &mut [Run], index: usize| {
        let patch = root(runs, index);
        (places[patch] != u32::MAX).then(|| (places[patch] as usize, origin(&runs[patch])))
    };
    let (right, bottom) = (image.width() as u32 - 1, image.height() as u32 - 1);
    for index in 0..runs.len() {
        let Some((place, origin)) = sums_of(runs, index) else { continue };
        let run = &runs[index];
        let across = run.first == 0 || run.last == right;
        sums[place].add(run, origin, across || run.row == 0 || run.row == bottom);
    }
    let mut blobs: Vec<Option<(Blob, Matrix2<f64>)>> = vec![None; sums.len()];
    for index in 0..runs.len() {
        let Some((place, origin)) = sums_of(runs, index) else { continue };
        // A patch's first run is its root.
        if root(runs, index) == index {
            blobs[place] = sums[place]
                .blob(origin)
                .and_then(|blob| Some((blob, blob.covariance.try_inverse()?)));
        }
        let Some((blob, inverse)) = blobs[place] else { continue };
        let most = outline.most_reach()[usize::from(sums[place].count < SMALL)];
        let run = &runs[index];
        let sticks_out = [run.first, run.last].into_iter().any(|x| {
            let from = Pixel::new(f64::from(x), f64::from(run.row)) - blob.centre;
            (from.transpose() * inverse * from)[0] > most
        });
        if sticks_out {
            blobs[place] = None;
        }
    }
    blobs.into_iter().flatten().map(|(blob, _)| blob).collect()
}
