//! Which pixels are good, given a camera or a start.

use super::start::{Start, lengths, scale};
use crate::{
    geometry::{Pixel, Point3},
    method::neural_camera::NeuralCameraReconstructor,
};
use rayon::prelude::*;
use wheatstone_numeric::statistics::median;

/// Standard deviation of a coordinate from the lengths of errors of two: the median of a Rayleigh
/// distribution is `sqrt(2 ln 2)` of them.
pub(super) fn rayleigh_sigma(lengths: &[f64]) -> f64 {
    median(lengths) / (2.0 * std::f64::consts::LN_2).sqrt()
}

/// Neighbours by which a residual is judged: those around it on a grid.
const NEIGHBOURS: usize = 8;

/// Points among which neighbours are sought, at most.
const MOST_NEIGHBOURS: usize = 2000;

/// No detector errs less than this share of the picture's spread (0.02 px of 640x480), and no fit of
/// noise-free points misses them by less.
const LEAST_SIGMA: f64 = 1e-4;

/// The noise, if a robust polynomial already leaves nothing but noise and no pixel sticks out of it.
pub(super) fn nothing_stands_out(start: &Start) -> Option<f64> {
    let errors = lengths(&start.residuals);
    let sigma = scale(&errors);
    let largest = errors.iter().copied().fold(0.0, f64::max);
    // What misses the polynomial by less is no gross outlier whatever the level.
    if largest > 4.0 * sigma {
        return None;
    }
    // White residuals: neighbours' do not agree. Of n products the mean has a deviation of
    // 1 / sqrt(2 n): a fifth is six of them for 400 points.
    let members: Vec<usize> = (0..start.places.len()).collect();
    let nearest: Vec<Vec<usize>> = neighbours(&start.places, &members);
    let (mut products, mut squares) = (0.0, 0.0);
    for (index, near) in nearest.iter().enumerate() {
        let own = start.residuals[index].coords;
        products += near.iter().map(|other| own.dot(&start.residuals[*other].coords)).sum::<f64>()
            / near.len().max(1) as f64;
        squares += own.norm_squared();
    }
    (products < 0.2 * squares).then_some(sigma)
}

/// The nearest members of each point, itself left out.
fn neighbours(places: &[[f64; 3]], members: &[usize]) -> Vec<Vec<usize>> {
    let step = members.len().div_ceil(MOST_NEIGHBOURS).max(1);
    let members: Vec<usize> = members.iter().copied().step_by(step).collect();
    let known: Vec<([f64; 3], usize)> =
        members.into_iter().map(|index| (places[index], index)).collect();
    let of = |(index, place): (usize, &[f64; 3])| {
        // The nearest so far, in rising order: of thousands hardly any get in.
        let mut near = [(f64::INFINITY, usize::MAX); NEIGHBOURS];
        for (other, name) in &known {
            let square: f64 =
                place.iter().zip(other).map(|(own, other)| (own - other) * (own - other)).sum();
            if square < near[NEIGHBOURS - 1].0 && *name != index {
                let rank = near.partition_point(|(nearer, _)| *nearer <= square);
                near[rank..].rotate_right(1);
                near[rank] = (square, *name);
            }
        }
        near.iter().map(|(_, name)| *name).filter(|name| *name != usize::MAX).collect()
    };
    places.par_iter().enumerate().map(of).collect()
}

/// Least share of its own noise that a residual is taken to hold: a point far from all others holds
/// less, but a linear fit's algebra is not to be trusted there.
const LEAST_SHARE: f64 = 0.01;

/// A camera, and the points to which it was fitted.
pub(super) struct Fitted {
    pub(super) camera: NeuralCameraReconstructor,
    pub(super) members: Vec<usize>,
}

/// The share of points that may have come to those of a fit for another to go on from there.
const FEW_MORE: f64 = 0.1;

impl Fitted {
    /// Whether `members` are the points that it was fitted to, and few more. One that was left out since may
    /// have bent the camera to where no refit would leave.
    pub(super) fn has_nearly(&self, members: &[usize]) -> bool {
        self.members.iter().all(|member| members.binary_search(member).is_ok())
            && members.len() as f64 <= (1.0 + FEW_MORE) * self.members.len() as f64
    }
}

/// Judges the pixels of one camera.
pub(super) struct Decision<'a> {
    pairs: &'a [(Point3, Pixel)],
    places: &'a [[f64; 3]],
    level: f64,
    /// How far each pixel is from the start's.
    first: Vec<f64>,
    pub(super) least_sigma: f64,
    pub(super) most_sigma: f64,
}

/// What was decided.
pub(super) struct Verdict {
    /// Which pixels are good.
    pub(super) good: Vec<bool>,
    /// Variance of each prediction, with the noise, over that of the noise.
    shares: Vec<f64>,
    /// How far each is from where it should be, in pixels.
    pub(super) errors: Vec<f64>,
    /// Standard deviation of a coordinate of the good ones.
    pub(super) pixel_sigma: f64,
    /// The same by the fitted ones' median, unlimited.
    pub(super) misfit: f64,
}

impl<'a> Decision<'a> {
    pub(super) fn new(pairs: &'a [(Point3, Pixel)], start: &'a Start, level: f64) -> Self {
        let along = |axis: usize| {
            let values: Vec<f64> = pairs.iter().map(|(_, pixel)| pixel[axis]).collect();
            let centre = median(&values);
            median(&values.iter().map(|value| (value - centre).abs()).collect::<Vec<_>>())
        };
        let first = lengths(&start.residuals);
        Self {
            pairs,
            places: &start.places,
            level,
            least_sigma: LEAST_SIGMA * along(0).max(along(1)),
            most_sigma: 2.0 * scale(&first),
            first,
        }
    }

    /// The pixels that the robust polynomial agrees with.
    pub(super) fn by_start(&self) -> Vec<bool> {
        let sigma = scale(&self.first).max(self.least_sigma);
        // A Rayleigh distribution leaves one in 270,000 beyond. Bumps that are lost here come back with
        // the neural camera.
        self.first.iter().map(|error| *error < 5.0 * sigma).collect()
    }

    /// Holds all pixels against a camera that was fitted to the accepted ones.
    pub(super) fn held(&self, fitted: &Fitted) -> Held {
        let noise = fitted.camera.pixel_sigma().first().copied().unwrap_or(f64::NAN);
        let mut member = vec![false; self.pairs.len()];
        fitted.members.iter().for_each(|index| member[*index] = true);
        let seen: Vec<(f64, f64)> = self
            .pairs
            .par_iter()
            .zip(&member)
            .map(|((world, pixel), member)| {
                let Some((at, covariance)) = fitted.camera.predict(0, *world) else {
                    return (f64::INFINITY, 1.0);
                };
                let own = (0.5 * covariance.trace() / (noise * noise) - 1.0).max(0.0);
                // What a point says of itself is taken out of its residual.
                let share = if *member { (1.0 - own).max(LEAST_SHARE) } else { 1.0 + own };
                ((pixel - at).norm(), share)
            })
            .collect();
        let whitened: Vec<f64> = seen.iter().map(|(error, share)| error / share.sqrt()).collect();
        let inside: Vec<f64> = fitted.members.iter().map(|index| whitened[*index]).collect();
        let near = neighbours(self.places, &fitted.members);
        let local = |near: &Vec<usize>| {
            rayleigh_sigma(&near.iter().map(|other| whitened[*other]).collect::<Vec<_>>())
        };
        Held {
            noise,
            misfit: rayleigh_sigma(&inside),
            local: near.iter().map(local).collect(),
            whitened,
            seen,
            fitted: fitted.members.len(),
        }
    }

    /// Judges all pixels. `wary` while bad ones may be among those fitted: the noise is then the median's,
    /// not the fit's.
    pub(super) fn verdict(&self, held: &Held, (wary, most_sigma): (bool, f64)) -> Verdict {
        let sigma = if wary { held.misfit } else { held.misfit.max(held.noise) };
        let sigma = sigma.min(most_sigma).max(self.least_sigma);
        let freedom = (2.0 * held.fitted as f64 - 11.0).max(2.0);
        // The tail of Fisher's F with 2 and so many degrees of freedom, (1 + x^2 / n)^(-n / 2) of an
        // error of x deviations, in closed form.
        let limit = (freedom * (libm::pow(self.level, -2.0 / freedom) - 1.0)).sqrt();
        let judged = held.whitened.iter().zip(&held.local);
        Verdict {
            good: judged.map(|(error, local)| *error <= limit * sigma.max(*local)).collect(),
            shares: held.seen.iter().map(|(_, share)| *share).collect(),
            // Where the camera observes nothing the polynomial still says how far off the pixel is.
            errors: held
                .seen
                .iter()
                .zip(&self.first)
                .map(|((own, _), first)| if own.is_finite() { *own } else { *first })
                .collect(),
            pixel_sigma: sigma,
            misfit: held.misfit,
        }
    }
}

/// All pixels of a camera beside where a fit to some of them observes their points.
pub(super) struct Held {
    /// Standard deviation of a coordinate by the fit.
    noise: f64,
    /// The same by the fitted ones' median.
    misfit: f64,
    /// Of each pixel: how far off it is, and the variance of that over the noise's.
    seen: Vec<(f64, f64)>,
    /// How far off, in deviations of what was to be expected for a noise of 1.
    whitened: Vec<f64>,
    /// Standard deviation of a coordinate among the nearest fitted ones.
    local: Vec<f64>,
    /// How many were fitted.
    fitted: usize,
}

impl Verdict {
    /// Good pixels that the fit can predict within so many standard deviations of the noise: fit for
    /// the next round.
    pub(super) fn members(&self, reach: f64) -> Vec<bool> {
        let judged = self.good.iter().zip(&self.shares);
        judged.map(|(good, share)| *good && *share < reach * reach).collect()
    }

    /// Whether a pixel is good for want of a prediction.
    pub(super) fn is_unsure(&self, index: usize, reach: f64) -> bool {
        self.good[index] && self.shares[index] >= reach * reach
    }
}
