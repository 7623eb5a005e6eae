//! Places that look like crossings: where a picture is dark in both directions.

use super::level::Polarity;
use crate::imaging::{GrayImage, filter::gaussian_blur};
use nalgebra::Vector2;
use wheatstone_core::geometry::Pixel;

/// Blur before second derivatives, in pixels: lines of 1 to 5 px answer to it.
const BLUR: f64 = 1.5;
/// Least curvature in grey levels a square pixel. A line of 30 levels, one pixel wide, that ends
/// at a crossing has 1.3; noise of 2 levels has 0.14.
const LEAST_CURVATURE: f32 = 0.6;
/// Radius of the ring on which arms are looked for: past the blurred crossing, and well short of a
/// neighbour 12 px away.
const RING: f64 = 5.5;
/// Samples on the ring, about one a pixel.
const AROUND: usize = 32;
/// Candidates of one polarity that are kept, strongest first: more than 12 megapixels show crossings
/// 25 px apart. Grids may have more, since they grow without candidates; without a limit, noise on
/// such a picture would make 400 000.
const MOST: usize = 25_000;
/// Least evenness (see [`Seed`]) of a place worth starting from; noise seldom passes it.
const LEAST_EVENNESS: f64 = 0.4;

/// A place that is dark in both directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// The pixel.
    pub(super) pixel: Pixel,
    /// The lesser of the two curvatures, in grey levels a square pixel.
    pub(super) curvature: f32,
}

/// A candidate with arms.
#[derive(Clone, Debug)]
pub(super) struct Seed {
    /// Which candidate.
    pub(super) candidate: usize,
    /// Unit vectors along the arms, clockwise in the picture.
    pub(super) arms: Vec<Vector2<f64>>,
    /// How alike the arms are, and how alike the gaps between them: 1 for a crossing alone on an
    /// even ground, near 0 for clutter.
    pub(super) evenness: f64,
}

/// Candidates and seeds of one polarity, seeds by falling promise.
#[derive(Default)]
pub(super) struct Candidates {
    /// Row by row.
    pub(super) places: Vec<Candidate>,
    /// The promising ones.
    pub(super) seeds: Vec<Seed>,
}

/// Looks for crossings of dark lines and of light ones.
pub(super) fn find(image: &GrayImage) -> [(Polarity, Candidates); 2] {
    let blurred = gaussian_blur(image, BLUR);
    let mut both =
        [(Polarity::Dark, Candidates::default()), (Polarity::Light, Candidates::default())];
    let width = image.width();
    if width < 5 || image.height() < 5 {
        return both;
    }
    // Determinants of three neighbouring rows, with the sign of the curvature.
    let mut rows = [vec![0.0; width], vec![0.0; width], vec![0.0; width]];
    for y in 1..image.height() - 1 {
        rows.rotate_left(1);
        determinants(&blurred, y, &mut rows[2]);
        for x in 1..width - 1 {
            let value: f32 = rows[1][x];
            let sign = if value > 0.0 { 1.0 } else { -1.0 };
            // Most pixels end here: smaller than the least curvature squared.
            if value * sign < LEAST_CURVATURE * LEAST_CURVATURE {
                continue;
            }
            if !is_peak(&rows, x, sign) {
                continue;
            }
            let curvature = lesser_curvature(&blurred, x, y - 1);
            if curvature >= LEAST_CURVATURE {
                let pixel = Pixel::new(x as f64, y as f64 - 1.0);
                both[usize::from(sign < 0.0)].1.places.push(Candidate { pixel, curvature });
            }
        }
    }
    let ring = ring();
    for (polarity, candidates) in &mut both {
        keep_strongest(&mut candidates.places);
        let places = candidates.places.iter().enumerate();
        candidates.seeds = places
            .filter_map(|(i, place)| arms((&blurred, *polarity), &ring, i, place.pixel))
            .collect();
        // Four arms before three before two.
        candidates.seeds.sort_by(|a, b| {
            b.arms.len().cmp(&a.arms.len()).then(b.evenness.total_cmp(&a.evenness))
        });
    }
    both
}

/// The Hessian's determinant along a row, where both curvatures have one sign: with that sign;
/// elsewhere 0.
fn determinants(image: &GrayImage, y: usize, out: &mut [f32]) {
    let (above, row, below) = (image.row(y - 1), image.row(y), image.row(y + 1));
    for x in 1..row.len() - 1 {
        let twice = 2.0 * row[x];
        let xx = row[x - 1] + row[x + 1] - twice;
        let yy = above[x] + below[x] - twice;
        let xy = 0.25 * (above[x - 1] + below[x + 1] - above[x + 1] - below[x - 1]);
        let determinant = (xx * yy - xy * xy).max(0.0);
        out[x] = if xx > 0.0 { determinant } else { -determinant };
    }
}

/// Whether the middle row has its peak at `x`, of one sign. Of equal neighbours, the first in reading order is
/// the maximum.
fn is_peak(rows: &[Vec<f32>; 3], x: usize, sign: f32) -> bool {
    let [above, row, below] = rows.each_ref().map(|row| &row[x - 1..=x + 1]);
    let peak = row[1] * sign;
    let (earlier, later) =
        ([above[0], above[1], above[2], row[0]], [row[2], below[0], below[1], below[2]]);
    // All eight are compared: in noise one branch is cheaper than many that cannot be foreseen.
    let lower = earlier.iter().fold(true, |all, other| all & (other * sign < peak));
    later.iter().fold(lower, |all, other| all & (other * sign <= peak))
}

/// The smaller magnitude of the Hessian's eigenvalues.
fn lesser_curvature(image: &GrayImage, x: usize, y: usize) -> f32 {
    let [above, row, below] = [y - 1, y, y + 1].map(|row| &image.row(row)[x - 1..=x + 1]);
    let xx = row[0] + row[2] - 2.0 * row[1];
    let yy = above[1] + below[1] - 2.0 * row[1];
    let xy = 0.25 * (above[0] + below[2] - above[2] - below[0]);
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    mean.abs() - (half * half + xy * xy).sqrt()
}

/// Drops the weakest beyond [`MOST`]; the order stays.
fn keep_strongest(places: &mut Vec<Candidate>) {
    if places.len() > MOST {
        let mut curvatures: Vec<f32> = places.iter().map(|place| place.curvature).collect();
        let (_, least, _) = curvatures.select_nth_unstable_by(MOST, |a, b| b.total_cmp(a));
        places.retain(|place| place.curvature > *least);
    }
}

/// Unit vector at a sample of the ring.
fn direction(i: f64) -> Vector2<f64> {
    let angle = i * (2.0 * std::f64::consts::PI / AROUND as f64);
    Vector2::new(libm::cos(angle), libm::sin(angle))
}

/// The ring's samples about its centre.
fn ring() -> [Vector2<f64>; AROUND] {
    std::array::from_fn(|i| RING * direction(i as f64))
}

/// The arms of a candidate: the stretches of a ring about it that are darker than half way.
fn arms(
    (image, polarity): (&GrayImage, Polarity),
    ring: &[Vector2<f64>; AROUND],
    candidate: usize,
    centre: Pixel,
) -> Option<Seed> {
    if !image.contains(centre, RING) {
        return None;
    }
    let ring = ring.map(|offset| polarity.sign() * image.sample(centre + offset));
    let (low, high) = ring
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    let half = 0.5 * (low + high);
    let start = (0..AROUND).find(|i| ring[*i] >= half && ring[(i + 1) % AROUND] < half)?;
    let (mut arms, mut evenness) = (Vec::new(), 1.0_f64);
    let share = |value: f32| f64::from(value / (high - low));
    let mut at = start + 1;
    while at < start + 1 + AROUND {
        let value = |i: usize| ring[i % AROUND];
        let inside = value(at) < half;
        let length = (at..start + 1 + AROUND).take_while(|i| (value(*i) < half) == inside).count();
        let run = at..at + length;
        if inside {
            let weight = |i: usize| f64::from(half - value(i));
            let total: f64 = run.clone().map(weight).sum();
            let middle = run.clone().map(|i| i as f64 * weight(i)).sum::<f64>() / total;
            let deepest = run.map(value).fold(f32::INFINITY, f32::min);
            evenness = evenness.min(share(high - deepest) * 2.0 - 1.0);
            arms.push(direction(middle));
            // More than a third of the ring is no arm.
            evenness = if length * 3 > AROUND { 0.0 } else { evenness };
        } else {
            let lightest = run.map(value).fold(f32::NEG_INFINITY, f32::max);
            evenness = evenness.min(share(lightest - low) * 2.0 - 1.0);
        }
        at += length;
    }
    let good = (2..=4).contains(&arms.len()) && evenness >= LEAST_EVENNESS;
    good.then_some(Seed { candidate, arms, evenness })
}
