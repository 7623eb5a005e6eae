//! What bends the picture on the plane on which directions are mapped: radial, tangential and
//! thin-prism terms, each with its derivatives.
//!
//! Sources: D. C. Brown 1971, "Close-range camera calibration", Photogrammetric Engineering 37(8),
//! for the radial and tangential parts; Weng, Cohen & Herniou 1992 (doi:10.1109/34.159901) for the
//! thin prism.

use super::monotonic::stays_positive;
use wheatstone_numeric::number::Number;

/// Where a place goes.
pub(crate) struct Distorted<N> {
    pub(super) place: [N; 2],
    /// Derivatives by the place before, row by row.
    pub(super) stretch: [[N; 2]; 2],
    /// 0; not a number where there is no such place.
    pub(super) seen: N,
}

/// The way back to the place before, in closed form.
pub(crate) enum Undistorted {
    /// It is known.
    To([f64; 2]),
    /// No place goes there.
    Nowhere,
    /// There is no closed form.
    ToBeSearched,
}

/// A map of the plane onto itself with numbers of its own.
pub(crate) trait Distortion {
    /// How many.
    const NUMBERS: usize;

    /// Where a place at this squared distance from the axis goes, beyond the fold too; the first of
    /// `slopes`, where they are asked for, become the derivatives by its numbers.
    fn distort<N: Number>(
        &self,
        place: [N; 2],
        square: N,
        slopes: Option<&mut [[N; 2]]>,
    ) -> Distorted<N>;

    /// Whether distances from the axis grow all the way to this square; beyond, the picture folds
    /// over.
    fn rises(&self, square: f64) -> bool;

    /// The place that goes to `distorted`.
    fn undistorted(&self, distorted: [f64; 2]) -> Undistorted;
}

/// k1 s + k2 s^2 and so on, with the derivative by s.
#[inline(always)]
fn polynomial<N: Number, const K: usize>(k: [f64; K], s: N) -> (N, N) {
    let (mut sum, mut slope) = (s.all(0.0), s.all(0.0));
    for (index, k) in k.into_iter().enumerate().rev() {
        let (own, rise) = (s.all(k), s.all((index + 1) as f64 * k));
        let is_last = index + 1 == K;
        sum = s * if is_last { own } else { own + sum };
        slope = if is_last { rise } else { rise + s * slope };
    }
    (sum, slope)
}

/// What moves places along the radius: a factor, with its derivative by the squared radius.
#[inline(always)]
pub(super) fn radial<N: Number>([x, y]: [N; 2], factor: N, slope: N, seen: N) -> Distorted<N> {
    let two = x.all(2.0);
    let mixed = two * x * y * slope;
    let stretch = [[factor + two * x * x * slope, mixed], [mixed, factor + two * y * y * slope]];
    Distorted { place: [x * factor, y * factor], stretch, seen }
}

/// The factor 1 + k1 s + k2 s^2 + k3 s^3 + k4 s^4 at the squared distance s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polynomial(pub(super) [f64; 4]);

impl Polynomial {
    /// Newton's steps at most, and the longest: it keeps to the branch that starts at the axis.
    const MOST_STEPS: usize = 50;
    const LONGEST: f64 = 0.5;
}

impl Distortion for Polynomial {
    const NUMBERS: usize = 4;

    #[inline(always)]
    fn distort<N: Number>(
        &self,
        place: [N; 2],
        square: N,
        slopes: Option<&mut [[N; 2]]>,
    ) -> Distorted<N> {
        let (sum, slope) = polynomial(self.0, square);
        if let Some(slopes) = slopes {
            let mut next = place;
            for slope in slopes.iter_mut().take(Self::NUMBERS) {
                next = next.map(|value| value * square);
                *slope = next;
            }
        }
        radial(place, square.all(1.0) + sum, slope, square.all(0.0))
    }

    fn rises(&self, square: f64) -> bool {
        let [k1, k2, k3, k4] = self.0;
        stays_positive([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4], square)
    }

    fn undistorted(&self, [x, y]: [f64; 2]) -> Undistorted {
        let wanted = (x * x + y * y).sqrt();
        let distorted = |radius: f64| {
            let square = radius * radius;
            let (sum, slope) = polynomial(self.0, square);
            (radius * (1.0 + sum), 1.0 + sum + 2.0 * square * slope)
        };
        let mut radius = wanted;
        for _ in 0..Self::MOST_STEPS {
            let (reached, slope) = distorted(radius);
            let step = (wanted - reached) / slope;
            radius += step.clamp(-Self::LONGEST, Self::LONGEST);
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (reached, slope) = distorted(radius);
        if slope.is_nan() || slope <= 0.0 || (reached - wanted).abs() > 1e-11 {
            return Undistorted::Nowhere;
        }
        let scale = if wanted > 0.0 { radius / wanted } else { 1.0 };
        Undistorted::To([x * scale, y * scale])
    }
}

/// A rational radial part, then tangential and thin-prism terms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rational {
    /// k1, k2, k3.
    pub(super) above: [f64; 3],
    /// p1, p2.
    pub(super) tangential: [f64; 2],
    /// k4, k5, k6.
    pub(super) below: [f64; 3],
    /// s1 to s4.
    pub(super) prism: [f64; 4],
}

impl Rational {
    /// The part along the radius; derivatives by k1, k2, k3, then by k4, k5, k6.
    #[inline(always)]
    fn radial<N: Number>(&self, [x, y]: [N; 2], s: N) -> (Distorted<N>, [[N; 2]; 6]) {
        let (one, zero) = (s.all(1.0), s.all(0.0));
        let ((above, rise), (below, fall)) = (polynomial(self.above, s), polynomial(self.below, s));
        let denominator = one + below;
        let factor = (one + above) / denominator;
        let slope = (rise - factor * fall) / denominator;
        let inverse = one / denominator;
        let (x_over, y_over) = (x * inverse, y * inverse);
        let by = |power: N| [x_over * power, y_over * power];
        let by_below = |power: N| by((zero - power) * factor);
        let (s2, s3) = (s * s, s * s * s);
        let slopes = [by(s), by(s2), by(s3), by_below(s), by_below(s2), by_below(s3)];
        (radial([x, y], factor, slope, denominator.held(0.0, f64::INFINITY)), slopes)
    }
}

/// Adds p1 and p2; derivatives by them.
#[inline(always)]
fn add_tangential<N: Number>(
    p: [f64; 2],
    [x, y]: [N; 2],
    s: N,
    distorted: &mut Distorted<N>,
) -> [[N; 2]; 2] {
    let ([p1, p2], [two, six]) = ([s.all(p[0]), s.all(p[1])], [s.all(2.0), s.all(6.0)]);
    let Distorted { place, stretch, .. } = distorted;
    place[0] = place[0] + two * p1 * x * y + p2 * (s + two * x * x);
    place[1] = place[1] + p1 * (s + two * y * y) + two * p2 * x * y;
    stretch[0][0] = stretch[0][0] + two * p1 * y + six * p2 * x;
    stretch[0][1] = stretch[0][1] + two * p1 * x + two * p2 * y;
    stretch[1][0] = stretch[0][1];
    stretch[1][1] = stretch[1][1] + six * p1 * y + two * p2 * x;
    [[two * x * y, s + two * y * y], [s + two * x * x, two * x * y]]
}

/// Adds s1 to s4; derivatives by them.
#[inline(always)]
fn add_prism<N: Number>(
    terms: [f64; 4],
    [x, y]: [N; 2],
    s: N,
    distorted: &mut Distorted<N>,
) -> [[N; 2]; 4] {
    let [s1, s2, s3, s4] = terms;
    let ([s1, s2, s3, s4], two) = ([s.all(s1), s.all(s2), s.all(s3), s.all(s4)], s.all(2.0));
    let (along_x, along_y) = (two * (s1 + two * s2 * s), two * (s3 + two * s4 * s));
    let Distorted { place, stretch, .. } = distorted;
    place[0] = place[0] + s * (s1 + s * s2);
    place[1] = place[1] + s * (s3 + s * s4);
    for (row, along) in stretch.iter_mut().zip([along_x, along_y]) {
        *row = [row[0] + x * along, row[1] + y * along];
    }
    let (zero, square) = (s.all(0.0), s * s);
    [[s, zero], [square, zero], [zero, s], [zero, square]]
}

impl Distortion for Rational {
    const NUMBERS: usize = 12;

    #[inline(always)]
    fn distort<N: Number>(
        &self,
        place: [N; 2],
        square: N,
        slopes: Option<&mut [[N; 2]]>,
    ) -> Distorted<N> {
        let (mut distorted, [k1, k2, k3, k4, k5, k6]) = self.radial(place, square);
        let [p1, p2] = add_tangential(self.tangential, place, square, &mut distorted);
        let [s1, s2, s3, s4] = add_prism(self.prism, place, square, &mut distorted);
        if let Some(slopes) = slopes {
            let own = [k1, k2, k3, p1, p2, k4, k5, k6, s1, s2, s3, s4];
            slopes.iter_mut().zip(own).for_each(|(slope, own)| *slope = own);
        }
        distorted
    }

    fn rises(&self, square: f64) -> bool {
        let ([k1, k2, k3], [k4, k5, k6]) = (self.above, self.below);
        if self.below == [0.0; 3] {
            return stays_positive([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3], square);
        }
        // The derivative of the radius by the radius, times the squared denominator.
        let mut growth = [0.0; 7];
        for (i, above) in [1.0, k1, k2, k3].into_iter().enumerate() {
            for (j, below) in [1.0, k4, k5, k6].into_iter().enumerate() {
                growth[i + j] += above * below * (1.0 + 2.0 * i as f64 - 2.0 * j as f64);
            }
        }
        stays_positive([1.0, k4, k5, k6], square) && stays_positive(growth, square)
    }

    fn undistorted(&self, distorted: [f64; 2]) -> Undistorted {
        let Self { above, tangential, below, prism } = self;
        let mut terms = above.iter().chain(tangential).chain(below).chain(prism);
        if terms.all(|value| *value == 0.0) {
            Undistorted::To(distorted)
        } else {
            Undistorted::ToBeSearched
        }
    }
}
