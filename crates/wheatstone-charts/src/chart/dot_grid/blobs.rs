//! Patches that are darker or brighter than what lies around them and have an ellipse's shape.

use super::ground::Window;
use crate::imaging::GrayImage;
use nalgebra::Matrix2;
use wheatstone_core::geometry::Pixel;

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
    let range = range(image);
    let least = LEAST_CONTRAST * range;
    // Grey levels are not told apart beyond single precision.
    if least <= 1e-4 || image.width().min(image.height()) < 5 || is_texture(image, range, outline) {
        return Blobs::default();
    }
    found(image, least, outline)
}

fn found(image: &GrayImage, least: f64, outline: Outline) -> Blobs {
    let [mut dark, mut bright] = runs(image, least);
    Blobs { dark: patches(image, &mut dark, outline), bright: patches(image, &mut bright, outline) }
}

/// Whether a large picture is full of clear patches, by samples of it: no chart has as many, and to find them
/// all would take a second. Smaller pictures of it are searched all the same.
fn is_texture(image: &GrayImage, range: f64, outline: Outline) -> bool {
    let (width, height) = (image.width(), image.height());
    if width * height < LARGE || width.min(height) < SAMPLES * SAMPLE {
        return false;
    }
    let middle = |at: usize, size: usize| (2 * at + 1) * size / (2 * SAMPLES) - SAMPLE / 2;
    let places = (0..SAMPLES * SAMPLES).map(|at| (at % SAMPLES, at / SAMPLES));
    let clear = places.map(|(column, row)| {
        let (left, top) = (middle(column, width), middle(row, height));
        let sample = GrayImage::from_fn(SAMPLE, SAMPLE, |x, y| image.row(top + y)[left + x]);
        let blobs = found(&sample, LEAST_CONTRAST * range, outline);
        let all = blobs.dark.iter().chain(&blobs.bright);
        all.filter(|blob| blob.contrast > CLEAR * range).count()
    });
    let sampled = SAMPLES * SAMPLES * SAMPLE * SAMPLE;
    clear.sum::<usize>() * width * height > MOST_CLEAR * sampled
}

/// In pixels: pictures below this take less than half a second, whatever they show.
const LARGE: usize = 4_000_000;
/// Samples across and down, and their side in pixels: a fiftieth of 12 megapixels.
const SAMPLES: usize = 5;
/// See [`SAMPLES`].
const SAMPLE: usize = 96;
/// Contrast of a clear patch as a share of the picture's range. Noise of a picture that shows something else
/// has a twentieth, noise alone a sixth.
const CLEAR: f64 = 0.08;
/// Clear patches of a picture that are a texture. Noise of 12 megapixels has 32 000, photographs of charts up to
/// 400, and dots of a grid of 10 000 are wide enough for the half of a picture.
const MOST_CLEAR: usize = 10_000;

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
    let mut found = [Vec::new(), Vec::new()];
    let mut above = [0, 0];
    let mut window = Window::new(image);
    let mut differences = vec![0.0_f32; image.width()];
    for row in 0..image.height() {
        window.move_to(row);
        window.differences(row, least, &mut differences);
        let begin = [found[0].len(), found[1].len()];
        lengthen(&mut found, row as u32, &differences);
        for side in [0, 1] {
            join(&mut found[side], above[side], begin[side]);
        }
        above = begin;
    }
    found
}

/// Adds a row's runs: pixels side by side that differ in one sense.
fn lengthen(found: &mut [Vec<Run>; 2], row: u32, differences: &[f32]) {
    let mut x = 0;
    while x < differences.len() {
        let first = differences[x];
        let begin = x;
        if first == 0.0 {
            x += 1;
            continue;
        }
        let bright = first > 0.0;
        let mut sum = 0.0;
        while x < differences.len() && differences[x] != 0.0 && (differences[x] > 0.0) == bright {
            sum += differences[x].abs();
            x += 1;
        }
        let runs = &mut found[usize::from(bright)];
        let (parent, first, last) = (runs.len() as u32, begin as u32, x as u32 - 1);
        runs.push(Run { row, first, last, parent, difference: sum });
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
    // Noise makes millions of runs; few of them belong to anything as large as a dot. A run's parent comes
    // before it, so that in order every run finds its patch's first one in a step.
    let mut counts = vec![0_u32; runs.len()];
    for index in 0..runs.len() {
        let first = runs[runs[index].parent as usize].parent;
        runs[index].parent = first;
        counts[first as usize] += runs[index].last - runs[index].first + 1;
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
    let sums_of = |index: usize| {
        let patch = runs[index].parent as usize;
        (places[patch] != u32::MAX).then(|| (places[patch] as usize, origin(&runs[patch])))
    };
    let (right, bottom) = (image.width() as u32 - 1, image.height() as u32 - 1);
    for (index, run) in runs.iter().enumerate() {
        let Some((place, origin)) = sums_of(index) else { continue };
        let across = run.first == 0 || run.last == right;
        sums[place].add(run, origin, across || run.row == 0 || run.row == bottom);
    }
    let mut blobs: Vec<Option<(Blob, Matrix2<f64>)>> = vec![None; sums.len()];
    for (index, run) in runs.iter().enumerate() {
        let Some((place, origin)) = sums_of(index) else { continue };
        // A patch's first run is its root.
        if run.parent as usize == index {
            blobs[place] = sums[place]
                .blob(origin)
                .and_then(|blob| Some((blob, blob.covariance.try_inverse()?)));
        }
        let Some((blob, inverse)) = blobs[place] else { continue };
        let most = outline.most_reach()[usize::from(sums[place].count < SMALL)];
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
