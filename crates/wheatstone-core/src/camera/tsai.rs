//! Tsai's camera: a pinhole whose picture must be stretched radially to become ideal.
//!
//! Source: Tsai 1987 (doi:10.1109/JRA.1987.1087109), with the first coefficient only, as the paper
//! recommends. The distortion is told from the distorted place to the ideal one, the other way round
//! than in Brown's model.

use super::{
    composed::Composed,
    distortion::{Distorted, Distortion, Undistorted, radial},
    pinhole::Pinhole,
    projection::Perspective,
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::number::Number;

/// Ideal radius = r (1 + kappa r^2) for a distorted radius r, both on the plane z = 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tsai {
    /// Focal lengths and principal point; the ratio of the focal lengths is the paper's scale factor
    /// s_x.
    pub pinhole: Pinhole,
    /// The paper's kappa_1 times the squared focal length: no unit. Positive for barrel distortion.
    pub kappa: f64,
}

impl Default for Tsai {
    fn default() -> Self {
        Self { pinhole: Pinhole::default(), kappa: 0.2 }
    }
}

/// A cubic told the other way round.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InverseCubic {
    kappa: f64,
}

/// Of Newton's method, and the share of a radius that is no step any more.
const MOST_STEPS: usize = 100;
const LEAST_STEP: f64 = 1e-15;

impl InverseCubic {
    /// The ideal radius from which on there is no distorted one: the cubic has its highest value, 2/3 of the
    /// radius there, at r^2 = -1 / (3 kappa).
    fn fold(self) -> f64 {
        if self.kappa < 0.0 { (2.0 / 3.0) / (-3.0 * self.kappa).sqrt() } else { f64::INFINITY }
    }

    /// The distorted radius of an ideal one: the root of the cubic on the branch that starts at the axis,
    /// by Newton's method.
    #[inline(always)]
    fn distorted<N: Number>(self, ideal: N) -> N {
        let (one, zero) = (ideal.all(1.0), ideal.all(0.0));
        let (kappa, slope) = (ideal.all(self.kappa), ideal.all(3.0 * self.kappa));
        // From 0 upwards the cubic is concave (kappa < 0) and Newton's steps stay below the root;
        // it is convex otherwise and they stay above it once they are there.
        let mut radius = if self.kappa < 0.0 { zero } else { ideal };
        for _ in 0..MOST_STEPS {
            let square = radius * radius;
            let step = (ideal - radius * (one + kappa * square)) / (one + slope * square);
            // Where a step no longer moves the radius it stays, whatever the others of a register do.
            let least = ideal.all(LEAST_STEP) * (radius + step);
            let moves = one - (least - step.magnitude()).beyond(0.0);
            if moves.is_zero() {
                break;
            }
            radius = radius + moves * step;
        }
        radius
    }
}

impl Distortion for InverseCubic {
    const NUMBERS: usize = 1;

    #[inline(always)]
    fn distort<N: Number>(
        &self,
        place: [N; 2],
        square: N,
        slopes: Option<&mut [[N; 2]]>,
    ) -> Distorted<N> {
        let ideal = square.root();
        let radius = self.distorted(ideal);
        let (one, kappa, square) = (ideal.all(1.0), ideal.all(self.kappa), radius * radius);
        let rise = one + ideal.all(3.0 * self.kappa) * square;
        let (growth, factor) = (one / rise, one / (one + kappa * square));
        let by_kappa = ideal.all(0.0) - square * growth * factor;
        slopes
            .into_iter()
            .flatten()
            .take(1)
            .for_each(|slope| *slope = place.map(|value| value * by_kappa));
        // (growth - factor) / (2 ideal^2), without the quotient of two small numbers at the axis.
        let slope = ideal.all(-self.kappa) * growth * factor * factor * factor;
        radial(place, factor, slope, rise.held(0.0, f64::INFINITY) + ideal.held(-1.0, self.fold()))
    }

    fn rises(&self, square: f64) -> bool {
        square.sqrt() < self.fold()
    }

    fn undistorted(&self, [x, y]: [f64; 2]) -> Undistorted {
        let square = x * x + y * y;
        if 1.0 + 3.0 * self.kappa * square <= 0.0 {
            return Undistorted::Nowhere;
        }
        let factor = 1.0 + self.kappa * square;
        Undistorted::To([x * factor, y * factor])
    }
}

impl Composed for Tsai {
    type Projection = Perspective;
    type Distortion = InverseCubic;

    #[inline(always)]
    fn distortion(&self) -> InverseCubic {
        InverseCubic { kappa: self.kappa }
    }

    #[inline(always)]
    fn pinhole(&self) -> &Pinhole {
        &self.pinhole
    }

    fn numbers_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, kappa } = self;
        pinhole.numbers_mut().into_iter().chain([kappa]).collect()
    }
}
