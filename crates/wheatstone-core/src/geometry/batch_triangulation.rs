//! Where the straight rays of a point meet: of one point, or of as many as fill a register.
//!
//! A camera is a projective one, `(u, v) = (P1 X, P2 X) / (P3 X)`, and says of each point that it lies on
//! its plane at `at + along * nearness + bend * nearness^2`, the nearness being `1 / P3 X`: any bundle of
//! rays that are straight, or nearly, is of this form. A first point comes from the linear equations, and
//! one Gauss-Newton step on the plane's errors, told in pixels, makes it the most likely one (Hartley &
//! Sturm 1997, doi:10.1006/cviu.1997.0547) but for terms of the third order in the errors. Two cameras have a
//! shorter way.

mod polynomials;
mod covariance;
mod ray_polynomial;
mod two_views;

pub(crate) use covariance::{PRODUCTS, UncertainMatrix, propagate};
pub(crate) use polynomials::{POWERS, Polynomials, SoloffPolynomial, TERMS};
pub(crate) use ray_polynomial::{
    ALONG, BENT, PLAIN, RayPolynomial, RayPolynomials, SCALED, StraightCamera, Triangulated,
};
use ray_polynomial::{in_pixels, straight};
use two_views::TwoViews;
use wheatstone_numeric::number::Number;

/// Normal equations of a point: XX, XY, XZ, YY, YZ, ZZ, and the right side.
struct Normal<N> {
    left: [N; 6],
    right: [N; 3],
}

impl<N: Number> Normal<N> {
    #[inline(always)]
    fn new(zero: N) -> Self {
        Self { left: [zero; 6], right: [zero; 3] }
    }

    /// Adds two equations `rows . step = errors`, weighed.
    #[inline(always)]
    fn add(&mut self, rows: [[N; 3]; 2], errors: [N; 2], weight: N) {
        const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let [a, b] = rows;
        let mut heavy = rows;
        for row in &mut heavy {
            for value in row {
                *value = *value * weight;
            }
        }
        for (sum, (i, j)) in self.left.iter_mut().zip(PAIRS) {
            *sum = sum.add_product(heavy[0][i], a[j]).add_product(heavy[1][i], b[j]);
        }
        for (sum, (a, b)) in self.right.iter_mut().zip(heavy[0].iter().zip(&heavy[1])) {
            *sum = sum.add_product(*a, errors[0]).add_product(*b, errors[1]);
        }
    }

    /// The cofactors of the left side, XX, XY, XZ, YY, YZ, ZZ, and one over its determinant: their product is its
    /// inverse.
    #[inline(always)]
    fn cofactors(&self) -> ([N; 6], N) {
        let [xx, xy, xz, yy, yz, zz] = self.left;
        let a = (yy * zz).subtract_product(yz, yz);
        let b = (xz * yz).subtract_product(xy, zz);
        let c = (xy * yz).subtract_product(xz, yy);
        let d = (xx * zz).subtract_product(xz, xz);
        let e = (xy * xz).subtract_product(xx, yz);
        let f = (xx * yy).subtract_product(xy, xy);
        let determinant = (xx * a).add_product(xy, b).add_product(xz, c);
        ([a, b, c, d, e, f], xx.all(1.0) / determinant)
    }

    /// The solution.
    #[inline(always)]
    fn solve(&self) -> [N; 3] {
        let [x, y, z] = self.right;
        let ([a, b, c, d, e, f], by) = self.cofactors();
        let mut solution = [by; 3];
        for (value, [a, b, c]) in solution.iter_mut().zip([[a, b, c], [b, d, e], [c, e, f]]) {
            *value = (a * x).add_product(b, y).add_product(c, z) * by;
        }
        solution
    }
}

/// One camera's equations for a point: `rows . X - right`, over the depth, is how far the point is from
/// where it was seen, on the plane.
struct Equations<N> {
    rows: [[N; 3]; 2],
    right: [N; 2],
}

impl<N: Number> Equations<N> {
    /// With the bend taken as it is at `nearness`.
    #[inline(always)]
    fn new<const KIND: u8>(camera: &StraightCamera, seen: &RayPolynomial<N>, nearness: N) -> Self {
        let zero = nearness.all(0.0);
        let [at, along] = straight::<N, KIND>(seen, nearness);
        let (mut rows, mut right) = ([[zero; 3]; 2], [zero; 2]);
        let depth = &camera.rows[2];
        for axis in 0..2 {
            let (own, at) = (&camera.rows[axis], at[axis]);
            if KIND & (ALONG | BENT) != 0 {
                right[axis] = along[axis];
            }
            for i in 0..3 {
                rows[axis][i] = zero.all(own[i]).subtract_product(zero.all(depth[i]), at);
            }
            right[axis] = right[axis].add_product(zero.all(depth[3]), at) - zero.all(own[3]);
        }
        Self { rows, right }
    }

    /// How far a point with this nearness is from where it was seen, on the plane.
    #[inline(always)]
    fn errors(&self, point: [N; 3], nearness: N) -> [N; 2] {
        let mut errors = self.right;
        for (error, row) in errors.iter_mut().zip(&self.rows) {
            let sum = (row[0] * point[0]).add_product(row[1], point[1]);
            let sum = sum.add_product(row[2], point[2]);
            *error = (sum - *error) * nearness;
        }
        errors
    }
}

/// Rows by steps on the plane as rows by pixels.
#[inline(always)]
fn rows_in_pixels<N: Number, const KIND: u8>(scale: [N; 4], rows: [[N; 3]; 2]) -> [[N; 3]; 2] {
    let mut out = rows;
    for i in 0..3 {
        [out[0][i], out[1][i]] = in_pixels::<N, KIND>(scale, [rows[0][i], rows[1][i]]);
    }
    out
}

#[inline(always)]
fn nearness<N: Number>(camera: &StraightCamera, [x, y, z]: [N; 3]) -> N {
    let row = &camera.rows[2];
    let depth = x.all(row[3]).add_product(x.all(row[0]), x).add_product(x.all(row[1]), y);
    x.all(1.0) / depth.add_product(x.all(row[2]), z)
}

/// Cameras made ready to say where points are that all of them see.
#[derive(Clone, Debug)]
pub(crate) struct Cameras {
    each: Vec<StraightCamera>,
    /// What is known of them beside that where there are two.
    two_views: Option<TwoViews>,
}

impl Cameras {
    pub(crate) fn new(each: Vec<StraightCamera>) -> Self {
        Self { two_views: TwoViews::new(&each), each }
    }

    /// How many.
    pub(crate) fn count(&self) -> usize {
        self.each.len()
    }

    /// Where the rays of a point meet, of cameras of this kind; `zero` is one of the numbers to compute with.
    /// The squares of two cameras are not numbers where the point is better asked for [by all](Self::triangulate_all).
    #[inline(always)]
    pub(crate) fn meet<N: Number, const KIND: u8>(
        &self,
        ray_polynomials: &(impl RayPolynomials<N> + ?Sized),
        zero: N,
    ) -> Triangulated<N> {
        match &self.two_views {
            Some(two_views) => two_views.meet::<N, KIND>(ray_polynomials, zero),
            None => meet::<N, KIND>(&self.each, ray_polynomials, zero),
        }
    }

    /// The same as any number of cameras would say it.
    pub(crate) fn triangulate_all<const KIND: u8>(
        &self,
        ray_polynomials: &[RayPolynomial<f64>],
    ) -> Triangulated<f64> {
        meet::<f64, KIND>(&self.each, ray_polynomials, 0.0)
    }
}

/// Where the rays of a point meet, of any number of cameras of this kind; `zero` is one of the numbers to
/// compute with.
#[inline(always)]
fn meet<N: Number, const KIND: u8>(
    cameras: &[StraightCamera],
    ray_polynomials: &(impl RayPolynomials<N> + ?Sized),
    zero: N,
) -> Triangulated<N> {
    let mut first = Normal::new(zero);
    for (index, camera) in cameras.iter().enumerate() {
        let seen = ray_polynomials.of(index);
        let equations = Equations::new::<KIND>(camera, &seen, zero.all(camera.nearness));
        let rows = rows_in_pixels::<N, KIND>(seen.scale, equations.rows);
        let right = in_pixels::<N, KIND>(seen.scale, equations.right);
        first.add(rows, right, zero.all(camera.weight * camera.nearness * camera.nearness));
    }
    let mut point = first.solve();
    let mut second = Normal::new(zero);
    for (index, camera) in cameras.iter().enumerate() {
        let seen = ray_polynomials.of(index);
        let near = nearness(camera, point);
        let equations = Equations::new::<KIND>(camera, &seen, near);
        let errors = equations.errors(point, near);
        let mut rows = equations.rows;
        for (row, error) in rows.iter_mut().zip(errors) {
            for (value, depth) in row.iter_mut().zip(camera.rows[2]) {
                *value = value.subtract_product(error, zero.all(depth)) * near;
            }
        }
        let rows = rows_in_pixels::<N, KIND>(seen.scale, rows);
        second.add(rows, in_pixels::<N, KIND>(seen.scale, errors), zero.all(camera.weight));
    }
    let step = second.solve();
    for axis in 0..3 {
        point[axis] = point[axis] - step[axis];
    }
    let (mut squares, mut first_nearness) = (zero, zero);
    for (index, camera) in cameras.iter().enumerate() {
        let seen = ray_polynomials.of(index);
        let near = nearness(camera, point);
        let equations = Equations::new::<KIND>(camera, &seen, near);
        let [x, y] = in_pixels::<N, KIND>(seen.scale, equations.errors(point, near));
        squares =
            squares + ((x * x).add_product(y, y) + near.held(camera.range[0], camera.range[1]));
        if index == 0 {
            first_nearness = near;
        }
    }
    Triangulated { point, squares, nearness: first_nearness }
}
