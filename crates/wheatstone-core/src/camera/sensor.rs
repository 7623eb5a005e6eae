//! From what a lens has distorted to pixels: a sensor that may be tilted, then focal lengths and
//! principal point.
//!
//! Source: the OpenCV documentation of `cv::calibrateCamera`, whose tauX and tauY the angles are, for
//! lenses after Scheimpflug; Louhichi, Fournel, Lavest & Ben Aissia 2007 (doi:10.1088/0957-0233/18/8/037).

use wheatstone_numeric::number::Number;

/// Derivatives of the pixel by a place before the sensor.
pub(crate) trait Image<N>: Copy {
    /// How the pixel moves where the place moves `along`.
    fn carry(self, along: [N; 2]) -> [N; 2];

    /// All of them, multiplied.
    fn scaled(self, by: N) -> Self;
}

/// By each coordinate only the same one changes.
#[derive(Clone, Copy)]
pub(crate) struct Straight<N>([N; 2]);

impl<N: Number> Image<N> for Straight<N> {
    #[inline(always)]
    fn carry(self, [x, y]: [N; 2]) -> [N; 2] {
        [self.0[0] * x, self.0[1] * y]
    }

    #[inline(always)]
    fn scaled(self, by: N) -> Self {
        Self([self.0[0] * by, self.0[1] * by])
    }
}

/// Row by row.
#[derive(Clone, Copy)]
pub(crate) struct Crossed<N>([[N; 2]; 2]);

impl<N: Number> Image<N> for Crossed<N> {
    #[inline(always)]
    fn carry(self, [x, y]: [N; 2]) -> [N; 2] {
        [self.0[0][0] * x + self.0[0][1] * y, self.0[1][0] * x + self.0[1][1] * y]
    }

    #[inline(always)]
    fn scaled(self, by: N) -> Self {
        let [[a, b], [c, d]] = self.0;
        Self([[a * by, b * by], [c * by, d * by]])
    }
}

/// What a sensor sees at one place.
pub(crate) struct OnSensor<N, I> {
    /// The place on the sensor, at unit focal length.
    pub(super) place: [N; 2],
    /// Derivatives of the pixel by the place before the sensor.
    pub(super) image: I,
    /// Derivatives of the pixel by both angles.
    pub(super) by_tilt: [[N; 2]; 2],
    /// 0; not a number where the light meets the sensor from behind.
    pub(super) seen: N,
}

/// How a sensor stands behind its lens.
pub(crate) trait Orientation {
    /// The form of its derivatives.
    type Image<N: Number>: Image<N>;

    /// Where a place meets it, with focal lengths by which the derivatives are in pixels.
    fn project<N: Number>(&self, place: [N; 2], focal: [N; 2]) -> OnSensor<N, Self::Image<N>>;

    /// The place before it of one on it; `None` where none goes there.
    fn untilted(&self, place: [f64; 2]) -> Option<[f64; 2]>;
}

/// Square to the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Upright;

impl Orientation for Upright {
    type Image<N: Number> = Straight<N>;

    #[inline(always)]
    fn project<N: Number>(&self, place: [N; 2], focal: [N; 2]) -> OnSensor<N, Straight<N>> {
        let zero = focal[0].all(0.0);
        OnSensor { place, image: Straight(focal), by_tilt: [[zero; 2]; 2], seen: zero }
    }

    fn untilted(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        Some(place)
    }
}

/// Turned about x, then about y: sines and cosines of tauX and tauY. OpenCV's product of matrices comes to
///
/// ```text
///  cos x           0             0
/// -sin x sin y   cos y           0
///  sin y        -sin x cos y   cos x cos y
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tilted {
    sine: [f64; 2],
    cosine: [f64; 2],
}

impl Tilted {
    pub(super) fn new(tilt: [f64; 2]) -> Self {
        Self { sine: tilt.map(libm::sin), cosine: tilt.map(libm::cos) }
    }
}

impl Orientation for Tilted {
    type Image<N: Number> = Crossed<N>;

    #[inline(always)]
    fn project<N: Number>(&self, [x, y]: [N; 2], focal: [N; 2]) -> OnSensor<N, Crossed<N>> {
        let ([sx, sy], [cx, cy]) = (self.sine, self.cosine);
        let all = |value: f64| x.all(value);
        let depth = all(sy) * x - all(sx * cy) * y + all(cx * cy);
        let inverse = all(1.0) / depth;
        let place = [all(cx) * x * inverse, (all(cy) * y - all(sx * sy) * x) * inverse];
        // Derivatives of the place by what changes both numerators and the depth.
        let by = |above: [N; 2], below: N| {
            [0, 1].map(|k| focal[k] * (above[k] - place[k] * below) * inverse)
        };
        let by_x = by([all(cx), all(-sx * sy)], all(sy));
        let by_y = by([all(0.0), all(cy)], all(-sx * cy));
        let by_tilt = [
            by([all(-sx) * x, all(-cx * sy) * x], all(-cx * cy) * y - all(sx * cy)),
            by(
                [all(0.0), all(-sy) * y - all(sx * cy) * x],
                all(cy) * x + all(sx * sy) * y - all(cx * sy),
            ),
        ];
        let image = Crossed([[by_x[0], by_y[0]], [by_x[1], by_y[1]]]);
        // A sensor turned by a right angle or more shows nothing.
        let faces = all(cx.min(cy)).held(0.0, f64::INFINITY);
        OnSensor { place, image, by_tilt, seen: faces + depth.held(0.0, f64::INFINITY) }
    }

    fn untilted(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let ([sx, sy], [cx, cy]) = (self.sine, self.cosine);
        let depth = cx * cy / (1.0 - sy * cx * x + sx * y);
        let back = x * depth / cx;
        (depth > 0.0 && cx.min(cy) > 0.0).then(|| [back, (y * depth + sx * sy * back) / cy])
    }
}
