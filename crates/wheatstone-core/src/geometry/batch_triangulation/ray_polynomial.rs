//! What cameras say of a point.

use wheatstone_numeric::number::Number;

/// A projective camera and how it counts.
#[derive(Clone, Debug)]
pub(crate) struct StraightCamera {
    /// Rows of the projection.
    pub(crate) rows: [[f64; 4]; 3],
    /// About the nearness of what it observes, where all points begin.
    pub(crate) nearness: f64,
    /// What a squared pixel of error counts.
    pub(crate) weight: f64,
    /// Between which nearnesses its ray polynomials hold.
    pub(crate) range: [f64; 2],
}

/// What one camera says of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayPolynomial<N> {
    /// Where it is seen on the plane.
    pub(crate) at: [N; 2],
    /// How that goes with the nearness.
    pub(crate) along: [N; 2],
    /// And with its square.
    pub(crate) curvature: [N; 2],
    /// Pixels that go with a step on the plane: x by u, x by v, y by u, y by v.
    pub(crate) scale: [N; 4],
}

/// What all cameras say of a point, asked for again and again: copies of it would not stay in registers.
pub(crate) trait RayPolynomials<N> {
    /// What one camera says.
    fn of(&self, camera: usize) -> RayPolynomial<N>;
}

impl<N: Copy> RayPolynomials<N> for [RayPolynomial<N>] {
    #[inline(always)]
    fn of(&self, camera: usize) -> RayPolynomial<N> {
        self[camera]
    }
}

/// Where a point is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangulated<N> {
    /// X, Y, Z.
    pub(crate) point: [N; 3],
    /// Sum of squared errors over all pixel coordinates; not a number where the point lies nowhere, or
    /// where some camera's ray polynomials do not hold.
    pub(crate) squares: N,
    /// The nearness to the first camera.
    pub(crate) nearness: N,
}

/// What cameras say beside where they see a point: nothing but that, of cameras without a lens. What is not
/// said is not read.
pub(crate) const PLAIN: u8 = 0;
/// A step on the plane is not one in the picture.
pub(crate) const SCALED: u8 = 1;
/// Rays have no common centre: the plane's point goes along with the nearness,
pub(crate) const ALONG: u8 = 2;
/// and with its square.
pub(crate) const BENT: u8 = 4;

/// A ray polynomial as one of a straight ray, with the curvature taken as it is at this nearness: where on the plane, and
/// how that goes with the nearness.
#[inline(always)]
pub(super) fn straight<N: Number, const KIND: u8>(
    seen: &RayPolynomial<N>,
    nearness: N,
) -> [[N; 2]; 2] {
    let (mut at, mut along) = (seen.at, seen.along);
    if KIND & BENT != 0 {
        for axis in 0..2 {
            let curvature = seen.curvature[axis] * nearness;
            at[axis] = at[axis].subtract_product(curvature, nearness);
            along[axis] = along[axis] + curvature + curvature;
        }
    }
    [at, along]
}

/// Steps on the plane as pixels.
#[inline(always)]
pub(super) fn in_pixels<N: Number, const KIND: u8>(scale: [N; 4], [u, v]: [N; 2]) -> [N; 2] {
    if KIND & SCALED == 0 {
        return [u, v];
    }
    [(scale[0] * u).add_product(scale[1], v), (scale[2] * u).add_product(scale[3], v)]
}
