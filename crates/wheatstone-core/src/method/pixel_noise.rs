//! How far pixels lie from where a fitted camera expects them, as a function of the place in the
//! picture: even where the camera's model is right, uneven where the lens does what no term says.
//! Not of depth: charts stand at a few depths only, and what is learned there of each does not hold
//! between them, still less beyond.
//!
//! The logarithm of the variance is a polynomial of low order, fitted by maximum likelihood (Harvey
//! 1976, doi:10.2307/1913974); its order is chosen by Schwarz's criterion (1978,
//! doi:10.1214/aos/1176344136).

use crate::geometry::Pixel;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    least_squares::Factored,
    number::{Doubles, Number, registers, registers_mut},
    simd::{Simd, WithSimd, exponentials, on_widest},
};

/// Variance of one pixel coordinate about its prediction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelNoise {
    /// In squared pixels, where the terms come to nothing.
    level: f64,
    /// What is added to its logarithm: the monomials of the scaled place, by rising order, the
    /// constant left out. Empty where the noise is even.
    terms: Vec<f64>,
    /// Middle of the pixels fitted.
    middle: [f64; 2],
    /// Half their extent.
    half: [f64; 2],
}

/// Highest order tried: ten terms, which resolve a third of the picture.
const MOST_ORDER: usize = 3;

/// Its terms without the constant.
const TERMS: usize = (MOST_ORDER + 1) * (MOST_ORDER + 2) / 2 - 1;

/// Points a term of the polynomial, at least.
const POINTS_A_TERM: usize = 10;

/// Exponents of the monomials of orders 1 to `order`.
fn exponents(order: usize) -> impl Iterator<Item = [usize; 2]> {
    (1..=order).flat_map(|sum| (0..=sum).map(move |along_y| [sum - along_y, along_y]))
}

/// Monomials of orders 1 to `order`.
fn monomials([x, y]: [f64; 2], order: usize) -> Vec<f64> {
    let power = |value: f64, exponent: usize| (0..exponent).fold(1.0, |p, _| p * value);
    exponents(order).map(|[a, b]| power(x, a) * power(y, b)).collect()
}

/// A polynomial for the logarithm of half the mean square, and how likely it makes the squares.
fn harvey(places: &[[f64; 2]], squares: &[f64], order: usize) -> Option<(Vec<f64>, f64)> {
    // Scoring steps settle in a few; halved steps keep them from overshooting.
    const MOST_STEPS: usize = 60;
    let rows: Vec<f64> =
        places.iter().flat_map(|p| std::iter::once(1.0).chain(monomials(*p, order))).collect();
    let width = rows.len() / places.len();
    let factored = Factored::new(&rows, width)?;
    let column = |term: usize| rows.iter().skip(term).step_by(width);
    let columns: Vec<f64> = (1..width).flat_map(column).copied().collect();
    let judged = |terms: &[f64]| {
        let mut shares = squares.to_vec();
        let likelihood = on_widest(Likelihood { terms, columns: &columns, shares: &mut shares });
        (likelihood, shares)
    };
    let mean = squares.iter().sum::<f64>() / (2 * squares.len()) as f64;
    let mut terms = vec![0.0; width];
    terms[0] = libm::log(mean);
    let (mut best, mut shares) = judged(&terms);
    for _ in 0..MOST_STEPS {
        shares.iter_mut().for_each(|share| *share -= 1.0);
        let mut step = factored.solve(&shares)?;
        let better = (0..20).find_map(|_| {
            let moved: Vec<f64> = terms.iter().zip(step.iter()).map(|(t, s)| t + s).collect();
            step *= 0.5;
            let (reached, shares) = judged(&moved);
            (reached > best).then_some((moved, reached, shares))
        });
        let Some((moved, reached, found)) = better else { break };
        let gain = reached - best;
        (terms, best, shares) = (moved, reached, found);
        if gain < 1e-9 {
            break;
        }
    }
    best.is_finite().then_some((terms, best))
}

/// How likely squares are whose halves' logarithms are expected to be sums of terms; each one's half as a share of
/// what is expected takes its place.
struct Likelihood<'a> {
    /// The constant, and what the columns are multiplied by.
    terms: &'a [f64],
    /// Column by column, as many values as squares.
    columns: &'a [f64],
    shares: &'a mut [f64],
}

impl WithSimd for Likelihood<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { terms, columns, shares } = self;
        let (count, mut likelihood) = (shares.len(), 0.0);
        for (block, shares) in shares.chunks_mut(BLOCK).enumerate() {
            let mut logs = [-terms[0]; BLOCK];
            for (term, column) in terms[1..].iter().zip(columns.chunks_exact(count)) {
                for (log, value) in logs.iter_mut().zip(&column[block * BLOCK..][..shares.len()]) {
                    *log -= term * value;
                }
            }
            let mut inverse = logs;
            for pair in registers_mut::<S>(&mut inverse).as_chunks_mut::<2>().0 {
                *pair = exponentials(simd, *pair);
            }
            for ((share, log), inverse) in shares.iter_mut().zip(logs).zip(inverse) {
                *share *= 0.5 * inverse;
                likelihood += log - *share;
            }
        }
        likelihood
    }
}

impl PixelNoise {
    /// The same everywhere; `variance` in squared pixels.
    #[must_use]
    pub fn even(variance: f64) -> Self {
        Self { level: variance, terms: Vec::new(), middle: [0.0; 2], half: [1.0; 2] }
    }

    /// Of pixels, each with the sum of its two coordinates' squared errors; so many `unknowns` of the
    /// fit have made these smaller.
    #[must_use]
    pub fn fit(seen: &[(Pixel, f64)], unknowns: f64) -> Self {
        let equations = (2 * seen.len()) as f64;
        let total: f64 = seen.iter().map(|(_, square)| square).sum();
        let share = equations / (equations - unknowns).max(1.0);
        let even = Self::even(share * total / equations);
        let bounds = |axis: usize| {
            let values = seen.iter().map(|(pixel, _)| pixel[axis]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.fold(f64::NEG_INFINITY, f64::max);
            (0.5 * (low + high), 0.5 * (high - low))
        };
        let [(x, wide), (y, high)] = [0, 1].map(bounds);
        // Errors of rounding say nothing of the lens.
        if !(wide > 0.0 && high > 0.0 && total > 1e-12 * equations) {
            return even;
        }
        let scaled = Self { middle: [x, y], half: [wide, high], ..even.clone() };
        let places: Vec<[f64; 2]> = seen.iter().map(|(pixel, _)| scaled.place(*pixel)).collect();
        let squares: Vec<f64> = seen.iter().map(|(_, square)| *square).collect();
        let mut best = (even, f64::INFINITY);
        for order in 0..=MOST_ORDER {
            let terms = (order + 1) * (order + 2) / 2;
            if order > 0 && POINTS_A_TERM * terms > seen.len() {
                break;
            }
            let Some((found, likelihood)) = harvey(&places, &squares, order) else { break };
            let criterion = terms as f64 * libm::log(equations) - 2.0 * likelihood;
            if criterion < best.1 {
                let level = share * libm::exp(found[0]);
                let noise = Self { level, terms: found[1..].to_vec(), ..scaled.clone() };
                best = (noise, criterion);
            }
        }
        best.0
    }

    /// On -1..1; beyond the pixels fitted it is as at their edge.
    fn place(&self, pixel: Pixel) -> [f64; 2] {
        [0, 1].map(|axis| ((pixel[axis] - self.middle[axis]) / self.half[axis]).clamp(-1.0, 1.0))
    }

    /// In squared pixels, at a place of the picture, or in whatever plane it was fitted.
    #[must_use]
    pub fn variance(&self, pixel: Pixel) -> f64 {
        if self.terms.is_empty() {
            return self.level;
        }
        let powers = |value: f64| [1.0, value, value * value, value * value * value];
        let [x, y] = self.place(pixel).map(powers);
        let log: f64 =
            self.terms.iter().zip(exponents(MOST_ORDER)).map(|(t, [a, b])| t * (x[a] * y[b])).sum();
        self.level * libm::exp(log)
    }

    /// [`PixelNoise::variance`] of many pixels, x and y.
    pub(super) fn variances(&self, pixels: [&[f64]; 2]) -> Vec<f64> {
        let count = pixels[0].len().min(pixels[1].len());
        let mut variances = vec![self.level; count];
        if !self.terms.is_empty() {
            on_widest(Variances { noise: self, pixels, variances: &mut variances });
        }
        variances
    }

    pub(super) fn is_consistent(&self) -> bool {
        let numbers = self.terms.iter().chain(&self.middle).chain(&self.half);
        self.level >= 0.0
            && self.level.is_finite()
            && numbers.into_iter().all(|value| value.is_finite())
            && self.half.iter().all(|half| *half > 0.0)
            && (0..=MOST_ORDER).any(|order| terms_of(order) == self.terms.len())
    }
}

/// Pixels worked on at once: they fill pairs of registers of any width.
const BLOCK: usize = 64;

/// One run through columns.
struct Variances<'a> {
    noise: &'a PixelNoise,
    pixels: [&'a [f64]; 2],
    variances: &'a mut [f64],
}

impl WithSimd for Variances<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { noise, pixels: [x, y], variances } = self;
        let (mut terms, mut places) = ([0.0; TERMS], [[0.0; BLOCK]; 2]);
        terms[..noise.terms.len()].copy_from_slice(&noise.terms);
        let mut told = [0.0; BLOCK];
        for (block, out) in variances.chunks_mut(BLOCK).enumerate() {
            for (axis, (places, pixels)) in places.iter_mut().zip([x, y]).enumerate() {
                places[..out.len()].copy_from_slice(&pixels[block * BLOCK..][..out.len()]);
                for place in places.iter_mut() {
                    *place = (*place - noise.middle[axis]) / noise.half[axis];
                    *place = place.clamp(-1.0, 1.0);
                }
            }
            let [x, y] = places.each_ref().map(|place| registers::<S>(place).as_chunks::<2>().0);
            let (told_pairs, _) = registers_mut::<S>(&mut told).as_chunks_mut::<2>();
            for (told, (x, y)) in told_pairs.iter_mut().zip(x.iter().zip(y)) {
                for (told, (x, y)) in told.iter_mut().zip(x.iter().zip(y)) {
                    *told = logarithm(&terms, [Doubles(simd, *x), Doubles(simd, *y)]).1;
                }
                *told = exponentials(simd, *told);
            }
            for (out, told) in out.iter_mut().zip(&told) {
                *out = noise.level * told;
            }
        }
    }
}

/// What the terms, in the order of [`exponents`], come to at a place.
#[inline(always)]
fn logarithm<N: Number>(terms: &[f64; TERMS], [x, y]: [N; 2]) -> N {
    let [t_x, t_y, t_xx, t_xy, t_yy, t_xxx, t_xxy, t_xyy, t_yyy] = *terms;
    let squares = x.all(t_xx).add_product(x.all(t_xxx), x).add_product(x.all(t_xxy), y);
    let along = x.all(t_x).add_product(squares, x);
    let crossed = x.all(t_xy).add_product(x.all(t_xyy), y);
    let down = x.all(t_yy).add_product(x.all(t_yyy), y);
    let down = x.all(t_y).add_product(crossed, x).add_product(down, y);
    (along * x).add_product(down, y)
}

/// Monomials of orders 1 to `order`.
fn terms_of(order: usize) -> usize {
    (order + 1) * (order + 2) / 2 - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::{random::Random, simd::on_each};

    fn noisy(sigma: impl Fn(f64, f64) -> f64) -> PixelNoise {
        let mut random = Random::new(9);
        let mut draw = |_| {
            let pixel = Pixel::new(random.uniform(0.0, 640.0), random.uniform(0.0, 480.0));
            let (x, y) = (random.normal(), random.normal());
            (pixel, (x * x + y * y) * sigma(pixel.x, pixel.y).powi(2))
        };
        let seen: Vec<(Pixel, f64)> = (0..600).map(&mut draw).collect();
        PixelNoise::fit(&seen, 12.0)
    }

    #[test]
    fn many_pixels_have_the_variance_of_each() {
        let mut random = Random::new(4);
        for order in 0..=MOST_ORDER {
            let terms = (0..terms_of(order)).map(|_| random.normal()).collect();
            let (middle, half) = ([320.0, 240.0], [300.0, 200.0]);
            let noise = PixelNoise { level: 0.3, terms, middle, half };
            // The last block is not full, and some lie beyond.
            let mut column = |size: f64| -> Vec<f64> {
                (0..BLOCK + 13).map(|_| random.uniform(-0.1 * size, 1.1 * size)).collect()
            };
            let (x, y) = (column(640.0), column(480.0));
            for ((x, y), found) in x.iter().zip(&y).zip(noise.variances([&x, &y])) {
                let wanted = noise.variance(Pixel::new(*x, *y));
                assert!((found / wanted - 1.0).abs() < 1e-13, "{order}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn likelihoods_are_those_of_plain_sums_at_every_width() {
        let mut random = Random::new(5);
        let (count, terms) = (BLOCK + 13, [0.4, -1.3, 0.7]);
        let squares: Vec<f64> = (0..count).map(|_| random.uniform(0.1, 2.0)).collect();
        let columns: Vec<f64> = (0..2 * count).map(|_| random.normal()).collect();
        let mut all = vec![squares.clone(); 4];
        let mut next = all.iter_mut();
        let columns = columns.as_slice();
        let found = on_each(|| Likelihood { terms: &terms, columns, shares: next.next().unwrap() });
        let log =
            |index: usize| terms[0] + terms[1] * columns[index] + terms[2] * columns[count + index];
        let share = |index: usize| 0.5 * squares[index] * libm::exp(-log(index));
        let wanted: f64 = (0..count).map(|index| -log(index) - share(index)).sum();
        assert!((found[0] - wanted).abs() < 1e-11, "{} {wanted}", found[0]);
        for (index, found) in all[0].iter().enumerate() {
            assert!((found / share(index) - 1.0).abs() < 1e-13);
        }
        for (one, shares) in found.iter().zip(&all) {
            assert!(one.to_bits() == found[0].to_bits() && *shares == all[0]);
        }
    }

    #[test]
    fn even_noise_stays_even_and_uneven_noise_is_followed() {
        let even = noisy(|_, _| 0.3);
        assert!(even.terms.is_empty() && (even.level.sqrt() - 0.3).abs() < 0.02, "{even:?}");
        let truth = |x: f64, _: f64| libm::exp(-2.0 + 2.0 * ((x - 320.0) / 320.0).powi(2));
        let uneven = noisy(truth);
        assert!(uneven.is_consistent());
        for x in [20.0, 200.0, 320.0, 500.0, 620.0] {
            let ratio = uneven.variance(Pixel::new(x, 240.0)).sqrt() / truth(x, 240.0);
            assert!((0.85..1.18).contains(&ratio), "{x}: {ratio}");
        }
        let edge = uneven.variance(Pixel::new(640.0, 240.0));
        assert!((uneven.variance(Pixel::new(2000.0, 240.0)) / edge - 1.0).abs() < 0.05);
        assert_eq!(
            PixelNoise::fit(&[(Pixel::origin(), 0.0); 3], 0.0).variance(Pixel::origin()),
            0.0
        );
    }
}
