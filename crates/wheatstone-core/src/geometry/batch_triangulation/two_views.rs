//! Where the rays of two cameras meet: a third of the work that any number of cameras takes.
//!
//! Two pixels miss a common point by one number only. A step of both, the shortest in pixels, takes that
//! miss away (Sampson 1982, doi:10.1016/0146-664X(82)90101-0; for two views Lindstrom 2010,
//! doi:10.1109/CVPR.2010.5539785), and the rays through what is then seen meet in the most likely point but for
//! terms of the third order in the errors.
//!
//! There are loops here where closures would be shorter: those would not become part of a kernel.

use super::ray_polynomial::{
    ALONG, BENT, RayPolynomial, RayPolynomials, SCALED, StraightCamera, Triangulated, in_pixels,
    straight,
};
use nalgebra::{Matrix3, Vector3};
use wheatstone_numeric::number::Number;

/// What two projective cameras have to do with each other. Rows are by u, by v and constant, of a place on
/// the first camera's plane.
#[derive(Clone, Debug)]
pub(super) struct TwoViews {
    /// The first camera's centre.
    centre: [f64; 3],
    /// From there to the point of depth one.
    rays: [[f64; 3]; 3],
    /// The second camera's picture of that centre, homogeneous,
    begin: [f64; 3],
    /// and of the way from there.
    towards: [[f64; 3]; 3],
    /// How far a pixel of each camera gives way.
    ease: [f64; 2],
    /// About the nearness of what each observes.
    nearness: [f64; 2],
    /// Between which nearnesses each camera's ray polynomials hold.
    ranges: [[f64; 2]; 2],
}

/// The first camera's ray as the second one observes it: at depth `d` from the first camera it is at `begin +
/// towards d`, homogeneous, and goes by where the second one saw the point with `by d - right`.
struct Ray<N> {
    begin: [N; 3],
    towards: [N; 3],
    /// Where the second camera saw the point.
    second: [N; 2],
    by: [N; 2],
    right: [N; 2],
}

/// What two steps leave of a miss is held against what they were to leave: so much more of the squares, and so
/// many squared pixels, are taken.
const MORE: f64 = 0.02;
const LITTLE: f64 = 1e-4;

#[inline(always)]
fn linear<N: Number>(row: [f64; 3], [u, v]: [N; 2]) -> N {
    (u.all(row[0]) * u).add_product(u.all(row[1]), v)
}

#[inline(always)]
fn affine<N: Number>(row: [f64; 3], [u, v]: [N; 2]) -> N {
    u.all(row[2]).add_product(u.all(row[0]), u).add_product(u.all(row[1]), v)
}

/// A number in each coordinate, everywhere the same.
#[inline(always)]
fn all<N: Number, const D: usize>(zero: N, values: [f64; D]) -> [N; D] {
    let mut numbers = [zero; D];
    for (number, value) in numbers.iter_mut().zip(values) {
        *number = zero.all(value);
    }
    numbers
}

#[inline(always)]
fn square<N: Number>([x, y]: [N; 2]) -> N {
    (x * x).add_product(y, y)
}

/// A step on the plane from one in pixels, times the determinant of the scale.
#[inline(always)]
fn undone<N: Number>([a, b, c, d]: [N; 4], [x, y]: [N; 2]) -> [N; 2] {
    [(d * x).subtract_product(b, y), (a * y).subtract_product(c, x)]
}

impl TwoViews {
    /// Of two cameras; `None` of any other number, and where the first has no centre.
    pub(super) fn new(cameras: &[StraightCamera]) -> Option<Self> {
        let [first, second] = cameras else { return None };
        let linear =
            |camera: &StraightCamera| Matrix3::from_fn(|row, column| camera.rows[row][column]);
        let last = |camera: &StraightCamera| Vector3::from(camera.rows.map(|row| row[3]));
        let rows = |matrix: &Matrix3<f64>| {
            [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)]))
        };
        let rays = linear(first).try_inverse()?;
        let centre = -(rays * last(first));
        let whole = first.weight + second.weight;
        Some(Self {
            centre: centre.into(),
            rays: rows(&rays),
            begin: (linear(second) * centre + last(second)).into(),
            towards: rows(&(linear(second) * rays)),
            ease: [second.weight, first.weight].map(|other| other / whole),
            nearness: [first.nearness, second.nearness],
            ranges: [first.range, second.range],
        })
    }

    /// Where the rays of a point meet, of cameras of this kind; not numbers where one such step does not
    /// take the miss away.
    #[inline(always)]
    pub(super) fn meet<N: Number, const KIND: u8>(
        &self,
        ray_polynomials: &(impl RayPolynomials<N> + ?Sized),
        zero: N,
    ) -> Triangulated<N> {
        let seen = [ray_polynomials.of(0), ray_polynomials.of(1)];
        let mut nearness = all(zero, self.nearness);
        if KIND & BENT != 0 {
            let ray = self.ray::<N, KIND>(&seen, nearness);
            let (above, below) = ray.depth();
            nearness = [below / above, ray.seen_at(above / below).1];
        }
        let ray = self.ray::<N, KIND>(&seen, nearness);
        let (steps, told) = self.steps::<N, KIND>(&seen, &ray);
        let mut moved = seen;
        for (seen, [step, _]) in moved.iter_mut().zip(&steps) {
            seen.at = [seen.at[0] - step[0], seen.at[1] - step[1]];
        }
        let ray = self.ray::<N, KIND>(&moved, nearness);
        let (above, below) = ray.depth();
        let (depth, first) = (above / below, below / above);
        let (place, near) = ray.seen_at(depth);
        let [at, along] = straight::<N, KIND>(&seen[1], near);
        let mut missed = [place[0] - at[0], place[1] - at[1]];
        if KIND & (ALONG | BENT) != 0 {
            for (missed, along) in missed.iter_mut().zip(along) {
                *missed = missed.subtract_product(along, near);
            }
        }
        let squares = square(steps[0][1]) + square(in_pixels::<N, KIND>(seen[1].scale, missed));
        // Where epipolar lines turn as fast as the miss is taken away there is more to do.
        let held =
            squares.subtract_product(told, zero.all(1.0 + MORE)).held(f64::NEG_INFINITY, LITTLE)
                + first.held(self.ranges[0][0], self.ranges[0][1])
                + near.held(self.ranges[1][0], self.ranges[1][1]);
        let [at, beside] = straight::<N, KIND>(&moved[0], nearness[0]);
        let mut point = all(zero, self.centre);
        for (point, row) in point.iter_mut().zip(self.rays) {
            *point = point.add_product(depth, affine(row, at));
            if KIND & (ALONG | BENT) != 0 {
                *point = *point + linear(row, beside);
            }
        }
        Triangulated { point, squares: squares + held, nearness: first }
    }

    /// The first camera's ray as the second one observes it.
    #[inline(always)]
    fn ray<N: Number, const KIND: u8>(
        &self,
        seen: &[RayPolynomial<N>; 2],
        nearness: [N; 2],
    ) -> Ray<N> {
        let [first, beside] = straight::<N, KIND>(&seen[0], nearness[0]);
        let [second, along] = straight::<N, KIND>(&seen[1], nearness[1]);
        let zero = first[0].all(0.0);
        let mut begin = all(zero, self.begin);
        if KIND & (ALONG | BENT) != 0 {
            // It does not begin in the camera's centre.
            for (begin, row) in begin.iter_mut().zip(self.towards) {
                *begin = *begin + linear(row, beside);
            }
        }
        let mut towards = [zero; 3];
        for (towards, row) in towards.iter_mut().zip(self.towards) {
            *towards = affine(row, first);
        }
        let (mut by, mut right) = ([zero; 2], [zero; 2]);
        for axis in 0..2 {
            by[axis] = towards[axis].subtract_product(second[axis], towards[2]);
            right[axis] = (zero - begin[axis]).add_product(second[axis], begin[2]);
            if KIND & (ALONG | BENT) != 0 {
                right[axis] = right[axis] + along[axis];
            }
        }
        Ray { begin, towards, second, by, right }
    }

    /// The shortest steps that take the miss away, of each camera on its plane and in pixels; and the sum of
    /// their squares.
    #[inline(always)]
    fn steps<N: Number, const KIND: u8>(
        &self,
        seen: &[RayPolynomial<N>; 2],
        ray: &Ray<N>,
    ) -> ([[[N; 2]; 2]; 2], N) {
        let Ray { begin, towards, second, by, right } = ray;
        let miss = (by[0] * right[1]).subtract_product(by[1], right[0]);
        // How it goes with the first camera's place, and with the second's.
        let mut by_first = [miss; 2];
        for (column, slope) in by_first.iter_mut().enumerate() {
            let [u, v, depth] = self.towards;
            let [u, v, depth] = all(miss, [u[column], v[column], depth[column]]);
            let (u, v) =
                (u.subtract_product(second[0], depth), v.subtract_product(second[1], depth));
            *slope = (u * right[1]).subtract_product(v, right[0]);
        }
        let by_second = [
            (by[1] * begin[2]).add_product(towards[2], right[1]) * miss.all(-1.0),
            (by[0] * begin[2]).add_product(towards[2], right[0]),
        ];
        // And with pixels.
        let (mut slopes, mut shares) = ([by_first, by_second], [miss; 2]);
        if KIND & SCALED != 0 {
            for ((slope, share), seen) in slopes.iter_mut().zip(&mut shares).zip(seen) {
                let [a, b, c, d] = seen.scale;
                *share = a.all(1.0) / (a * d).subtract_product(b, c);
                let [x, y] = undone([a, c, b, d], *slope);
                *slope = [x * *share, y * *share];
            }
        }
        let ease = all(miss, self.ease);
        let most = (square(slopes[0]) * ease[0]).add_product(square(slopes[1]), ease[1]);
        let pull = miss / most;
        let mut steps = [[[miss; 2]; 2]; 2];
        for (camera, steps) in steps.iter_mut().enumerate() {
            let by = pull * ease[camera];
            let pixels = [slopes[camera][0] * by, slopes[camera][1] * by];
            *steps = [pixels; 2];
            if KIND & SCALED != 0 {
                let [u, v] = undone(seen[camera].scale, pixels);
                steps[0] = [u * shares[camera], v * shares[camera]];
            }
        }
        let told = square(steps[0][1]) + square(steps[1][1]);
        (steps, told)
    }
}

impl<N: Number> Ray<N> {
    /// The depth at which it goes by the second camera's place the nearest: a number and that by which it is to be
    /// divided.
    #[inline(always)]
    fn depth(&self) -> (N, N) {
        let Self { by, right, .. } = self;
        ((by[0] * right[0]).add_product(by[1], right[1]), square(*by))
    }

    /// Where the second camera observes the point of this depth, and the nearness to it.
    #[inline(always)]
    fn seen_at(&self, depth: N) -> ([N; 2], N) {
        let mut seen = self.begin;
        for (seen, towards) in seen.iter_mut().zip(self.towards) {
            *seen = seen.add_product(towards, depth);
        }
        let [u, v, other] = seen;
        let near = depth.all(1.0) / other;
        ([u * near, v * near], near)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::meet, *};

    fn camera(rows: [[f64; 4]; 3], weight: f64) -> StraightCamera {
        StraightCamera { rows, nearness: 0.1, weight, range: [0.0, f64::INFINITY] }
    }

    /// Two cameras that look at what is ten units off from two units apart, turned towards each other.
    fn cameras(weights: [f64; 2]) -> [StraightCamera; 2] {
        [
            camera([[1.0, 0.0, 0.0, 0.3], [0.0, 1.0, 0.05, 0.0], [0.0, 0.0, 1.0, 0.1]], weights[0]),
            camera(
                [[0.98, 0.0, 0.2, -2.0], [0.0, 1.0, 0.0, 0.1], [-0.2, 0.01, 0.98, 0.2]],
                weights[1],
            ),
        ]
    }

    fn seen(
        camera: &StraightCamera,
        [x, y, z]: [f64; 3],
        own: &RayPolynomial<f64>,
    ) -> RayPolynomial<f64> {
        let [u, v, depth] = camera.rows.map(|[a, b, c, d]| a * x + b * y + c * z + d);
        let near = 1.0 / depth;
        let shift = [0, 1].map(|axis| (own.along[axis] + own.curvature[axis] * near) * near);
        RayPolynomial { at: [u * near - shift[0], v * near - shift[1]], ..*own }
    }

    /// What lenses of each kind do to all pixels alike.
    const LENSES: [RayPolynomial<f64>; 2] = [
        RayPolynomial {
            at: [0.0; 2],
            along: [0.3, -0.1],
            curvature: [0.2, 0.4],
            scale: [800.0, 30.0, -20.0, 700.0],
        },
        RayPolynomial {
            at: [0.0; 2],
            along: [-0.2, 0.05],
            curvature: [0.1, -0.3],
            scale: [500.0, -10.0, 60.0, 520.0],
        },
    ];

    fn largest_gap<const KIND: u8>(error: f64) -> f64 {
        let cameras = cameras([1.0, 0.25]);
        let two_views = TwoViews::new(&cameras).unwrap();
        let mut largest = 0.0_f64;
        for index in 0..200 {
            let along = |step: usize| (index * step % 199) as f64 / 99.5 - 1.0;
            let point = [along(7) * 3.0, along(31) * 3.0, 10.0 + along(53) * 3.0];
            let mut ray_polynomials = [0, 1].map(|camera| {
                let mut own = LENSES[camera];
                if KIND & SCALED == 0 {
                    own.scale = [1.0, 0.0, 0.0, 1.0];
                }
                if KIND & ALONG == 0 {
                    own.along = [0.0; 2];
                }
                if KIND & BENT == 0 {
                    own.curvature = [0.0; 2];
                }
                seen(&cameras[camera], point, &own)
            });
            for (camera, ray_polynomial) in ray_polynomials.iter_mut().enumerate() {
                ray_polynomial.at[0] += error * along(11 + camera);
                ray_polynomial.at[1] += error * along(17 + camera);
            }
            let own = two_views.meet::<f64, KIND>(&ray_polynomials[..], 0.0);
            let all = meet::<f64, KIND>(&cameras, &ray_polynomials[..], 0.0);
            if error > 0.0 {
                let [own, all] = [own.squares, all.squares];
                assert!((own - all).abs() <= 0.01 * all + 1e-5, "{own} {all}");
            }
            let wanted = if error > 0.0 { all.point } else { point };
            for (own, truth) in own.point.into_iter().zip(wanted) {
                largest = largest.max((own - truth).abs());
            }
        }
        largest
    }

    #[test]
    fn rays_without_errors_meet_where_they_come_from() {
        assert!(largest_gap::<SCALED>(0.0) < 1e-12);
        assert!(largest_gap::<{ SCALED | ALONG }>(0.0) < 1e-12);
        // Of the curvature one step is taken.
        assert!(largest_gap::<{ SCALED | ALONG | BENT }>(0.0) < 1e-7);
    }

    #[test]
    fn others_meet_where_those_of_any_number_of_cameras_do_but_for_the_third_order() {
        // Such errors move points by about a hundredth.
        assert!(largest_gap::<SCALED>(2e-4) < 1e-6);
        assert!(largest_gap::<{ SCALED | ALONG }>(2e-4) < 1e-6);
        assert!(largest_gap::<{ SCALED | ALONG | BENT }>(2e-4) < 1e-5);
    }

    #[test]
    fn cameras_in_one_place_see_no_point() {
        let [first, _] = cameras([1.0; 2]);
        let two_views = TwoViews::new(&[first.clone(), first.clone()]).unwrap();
        let none = RayPolynomial { at: [0.0; 2], ..LENSES[0] };
        let ray_polynomials = [0, 1].map(|_| seen(&first, [1.0, 2.0, 9.0], &none));
        assert!(two_views.meet::<f64, SCALED>(&ray_polynomials[..], 0.0).squares.is_nan());
        assert!(TwoViews::new(std::slice::from_ref(&first)).is_none());
    }
}
