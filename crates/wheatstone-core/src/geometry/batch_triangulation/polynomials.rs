//! Where the rays of cameras meet that are polynomials of the world: Gauss-Newton steps on the pixels' errors,
//! from where projective cameras beside them would have the point.
//!
//! The polynomials are those of Soloff, Adrian & Liu 1997 (doi:10.1088/0957-0233/8/12/008), equation 26.
//!
//! There are loops here where closures would be shorter: those would not become part of a kernel.

use super::{Normal, RayPolynomials, Triangulated};
use wheatstone_numeric::number::Number;

/// Terms of a pixel coordinate.
pub(crate) const TERMS: usize = 19;

/// Powers of X, Y and Z of each term: of the third degree in all, and of the second in Z.
pub(crate) const POWERS: [[u8; 3]; TERMS] = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [2, 0, 0],
    [1, 1, 0],
    [0, 2, 0],
    [3, 0, 0],
    [2, 1, 0],
    [1, 2, 0],
    [0, 3, 0],
    [0, 0, 1],
    [1, 0, 1],
    [0, 1, 1],
    [2, 0, 1],
    [1, 1, 1],
    [0, 2, 1],
    [0, 0, 2],
    [1, 0, 2],
    [0, 1, 2],
];

/// Where the terms with Z begin, and those with its square.
const WITH_Z: usize = 10;
const WITH_SQUARE: usize = 16;

/// A camera that is a polynomial of the world.
#[derive(Clone, Debug)]
pub(crate) struct SoloffPolynomial {
    /// The factors of [`POWERS`], for x and for y, in pixels.
    pub(crate) factors: [[f64; TERMS]; 2],
    /// Their covariance in squared pixels, of those for x as of those for y, row by row as far as the diagonal.
    pub(crate) covariance: [[f64; TERMS]; TERMS],
}

/// Cameras that are polynomials of the world.
#[derive(Clone, Debug)]
pub(crate) struct Polynomials {
    /// Each of them.
    pub(crate) cameras: Vec<SoloffPolynomial>,
    /// Where the world's coordinates are 0 for them, and
    pub(crate) centre: [f64; 3],
    /// where they are 1 farther on.
    pub(crate) half: [f64; 3],
}

/// Steps from farther off than so many do not lead there.
const MOST_STEPS: usize = 6;

/// A step that leaves more squared pixels than this to further ones is not the last: a thousandth of what good
/// pixels scatter by.
const LEFT: f64 = 1e-8;

/// So few squared pixels are no step any more, but rounding.
const ROUNDING: f64 = 1e-12;

impl Polynomials {
    /// The most likely point near one that is not far off; its squares are not numbers where steps do not reach it.
    /// The nearness is left as it is. Every number of a register takes the steps that it needs by itself.
    #[inline(always)]
    pub(crate) fn refine<N: Number>(
        &self,
        ray_polynomials: &(impl RayPolynomials<N> + ?Sized),
        start: Triangulated<N>,
    ) -> Triangulated<N> {
        let zero = start.nearness.all(0.0);
        let (mut place, mut squares, mut open) = (self.scaled(start.point), zero, zero.all(1.0));
        let mut before = zero.all(f64::MAX);
        for steps in 0..MOST_STEPS {
            let Step { by, own, left } = self.step(ray_polynomials, place);
            for axis in 0..3 {
                place[axis] = place[axis].add_product(open, by[axis]);
            }
            squares = squares + open * (left - squares);
            // Errors go with the square of those before and, with the rays' miss, with themselves.
            let bent = own / (before + zero.all(f64::MIN_POSITIVE));
            let next = bent * bent * (own + left) * (own / (own + zero.all(ROUNDING)));
            before = own;
            if steps > 0 {
                open = open * next.beyond(LEFT);
            }
            if open.is_zero() {
                break;
            }
        }
        let mut point = place;
        for axis in 0..3 {
            point[axis] =
                zero.all(self.centre[axis]).add_product(place[axis], zero.all(self.half[axis]));
        }
        Triangulated { point, squares: squares + open.held(-0.5, 0.5), nearness: start.nearness }
    }

    /// A point on the polynomials' coordinates.
    #[inline(always)]
    pub(super) fn scaled<N: Number>(&self, mut point: [N; 3]) -> [N; 3] {
        for (axis, value) in point.iter_mut().enumerate() {
            let by = value.all(1.0 / self.half[axis]);
            *value = (*value - value.all(self.centre[axis])) * by;
        }
        point
    }

    /// The step from a place.
    #[inline(always)]
    fn step<N: Number>(
        &self,
        ray_polynomials: &(impl RayPolynomials<N> + ?Sized),
        place: [N; 3],
    ) -> Step<N> {
        let zero = place[0].all(0.0);
        let (mut normal, mut squares) = (Normal::new(zero), zero);
        for (index, camera) in self.cameras.iter().enumerate() {
            let seen = ray_polynomials.of(index).at;
            let (mut rows, mut errors) = ([[zero; 3]; 2], [zero; 2]);
            for axis in 0..2 {
                let (value, slopes) = polynomial(&camera.factors[axis], place);
                rows[axis] = slopes;
                errors[axis] = seen[axis] - value;
                squares = squares.add_product(errors[axis], errors[axis]);
            }
            normal.add(rows, errors, zero.all(1.0));
        }
        let by = normal.solve();
        let mut own = zero;
        for (step, right) in by.iter().zip(&normal.right) {
            own = own.add_product(*step, *right);
        }
        Step { by, own, left: (squares - own).max_with(zero) }
    }
}

/// A step of a search.
struct Step<N> {
    by: [N; 3],
    /// What it moves pixels by, squared.
    own: N,
    /// Their squared errors after it, as far as slopes tell.
    left: N,
}

/// The value of a polynomial, and its slopes.
#[inline(always)]
pub(super) fn polynomial<N: Number>(factors: &[f64; TERMS], [x, y, z]: [N; 3]) -> (N, [N; 3]) {
    let zero = x.all(0.0);
    // In powers of X and Y alone, at this Z, and how their factors go with it.
    let (mut flat, mut slope) = ([zero; WITH_Z], [zero; WITH_SQUARE - WITH_Z]);
    for (flat, factor) in flat.iter_mut().zip(factors) {
        *flat = zero.all(*factor);
    }
    for (slope, factor) in slope.iter_mut().zip(&factors[WITH_Z..]) {
        *slope = zero.all(*factor);
    }
    for (slope, factor) in slope.iter_mut().zip(&factors[WITH_SQUARE..]) {
        *slope = slope.add_product(z, zero.all(*factor));
    }
    for (flat, slope) in flat.iter_mut().zip(&slope) {
        *flat = flat.add_product(z, *slope);
    }
    for (slope, factor) in slope.iter_mut().zip(&factors[WITH_SQUARE..]) {
        *slope = slope.add_product(z, zero.all(*factor));
    }
    let [c, cx, cy, cxx, cxy, cyy, cxxx, cxxy, cxyy, cyyy] = flat;
    let [d, dx, dy, dxx, dxy, dyy] = slope;
    // Of xxx, xxy and yyy, which no power of Z goes with: multiplied before they fill a register.
    let (three_xxx, three_yyy) = (zero.all(3.0 * factors[6]), zero.all(3.0 * factors[9]));
    let two_xxy = zero.all(2.0 * factors[7]);
    // By powers of Y, each a polynomial of X.
    let ones = c.add_product(x, cx.add_product(x, cxx.add_product(x, cxxx)));
    let ys = cy.add_product(x, cxy.add_product(x, cxxy));
    let squares = cyy.add_product(x, cxyy);
    let value = ones.add_product(y, ys.add_product(y, squares.add_product(y, cyyy)));
    let along = cx.add_product(x, (cxx + cxx).add_product(x, three_xxx));
    let across = cxy.add_product(x, two_xxy).add_product(y, cxyy);
    let by_x = along.add_product(y, across);
    let by_y = ys.add_product(y, (squares + squares).add_product(y, three_yyy));
    let along = d.add_product(x, dx.add_product(x, dxx));
    let across = dy.add_product(x, dxy).add_product(y, dyy);
    let by_z = along.add_product(y, across);
    (value, [by_x, by_y, by_z])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::batch_triangulation::RayPolynomial;
    use wheatstone_numeric::random::Random;

    fn term(place: [f64; 3], powers: [u8; 3]) -> f64 {
        (0..3).map(|axis| place[axis].powi(i32::from(powers[axis]))).product()
    }

    #[test]
    fn values_and_slopes_are_those_of_the_sum_of_terms() {
        let mut random = Random::new(5);
        let mut any = || random.uniform(-1.0, 1.0);
        for _ in 0..50 {
            let factors: [f64; TERMS] = std::array::from_fn(|_| any());
            let place: [f64; 3] = std::array::from_fn(|_| any());
            let sum = |place: [f64; 3]| -> f64 {
                factors
                    .iter()
                    .zip(POWERS)
                    .map(|(factor, powers)| factor * term(place, powers))
                    .sum()
            };
            let (value, slopes) = polynomial(&factors, place);
            assert!((value - sum(place)).abs() < 1e-14);
            for axis in 0..3 {
                const STEP: f64 = 1e-5;
                let [more, less] = [STEP, -STEP].map(|step| {
                    let mut beside = place;
                    beside[axis] += step;
                    sum(beside)
                });
                assert!((slopes[axis] - (more - less) / (2.0 * STEP)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn steps_reach_a_point_nearby_and_say_where_they_do_not() {
        let mut random = Random::new(6);
        // Two cameras of a thousand pixels each way, with terms of higher degree of some pixels.
        let sides = [[1.0, 0.2, 0.4], [-0.1, 1.0, 0.1], [1.0, -0.2, -0.5], [0.2, 1.0, 0.3]];
        let mut factors = sides.map(|slopes| {
            let mut factors = [0.0; TERMS];
            factors.iter_mut().for_each(|factor| *factor = random.uniform(-8.0, 8.0));
            (factors[1], factors[2], factors[10]) =
                (500.0 * slopes[0], 500.0 * slopes[1], 500.0 * slopes[2]);
            factors
        });
        factors.iter_mut().for_each(|factors| factors[0] = 500.0);
        let [a, b, c, d] = factors;
        let (centre, half) = ([10.0, -20.0, 900.0], [100.0, 80.0, 30.0]);
        let camera = |factors| SoloffPolynomial { factors, covariance: [[0.0; TERMS]; TERMS] };
        let cameras = vec![camera([a, b]), camera([c, d])];
        let polynomials = Polynomials { cameras, centre, half };
        for off in [0.0, 0.005, 0.02, 0.3, 40.0] {
            let place = [0.4, -0.7, 0.5];
            let ray_polynomial = |[a, b]: [[f64; TERMS]; 2]| {
                let at = [polynomial(&a, place).0, polynomial(&b, place).0];
                RayPolynomial {
                    at,
                    along: [0.0; 2],
                    curvature: [0.0; 2],
                    scale: [1.0, 0.0, 0.0, 1.0],
                }
            };
            let ray_polynomials = [ray_polynomial([a, b]), ray_polynomial([c, d])];
            let begin = [0, 1, 2].map(|axis| centre[axis] + half[axis] * (place[axis] + off));
            let start = Triangulated { point: begin, squares: f64::NAN, nearness: 0.1 };
            let found = polynomials.refine(&ray_polynomials[..], start);
            if off > 30.0 {
                assert!(found.squares.is_nan(), "{off}: {found:?}");
                continue;
            }
            assert!(found.squares < 1e-6 && found.nearness == 0.1, "{off}: {found:?}");
            for axis in 0..3 {
                let error = (found.point[axis] - centre[axis]) / half[axis] - place[axis];
                assert!(error.abs() * 500.0 < 1e-3, "{off}: {error}");
            }
        }
    }
}
