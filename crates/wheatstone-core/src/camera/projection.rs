//! How the directions before a lens are mapped to a plane: by the tangent of their angle from the
//! axis, as a pinhole does, or by the angle itself, as most fisheye lenses nearly do.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153).

use super::sensor::Image;
use crate::geometry::Vector3;
use wheatstone_numeric::number::Number;

/// Normalised image coordinates of a point.
#[derive(Clone, Copy)]
pub(crate) struct Normalised<N> {
    /// Where it is; the axis is at (0, 0).
    pub(super) place: [N; 2],
    /// Squared distance from the axis.
    pub(super) square: N,
    /// The place over the x and y of the point before the lens.
    scale: N,
    /// 0; not a number where the point cannot be seen.
    pub(super) seen: N,
}

/// One way to map directions to normalised coordinates.
pub(crate) trait Projection {
    /// The place of a point before the lens.
    fn normalise<N: Number>(point: [N; 3]) -> Normalised<N>;

    /// Derivatives of the pixel's x, then y, by the point, where the distortion has the derivatives
    /// `stretch` by the place and the sensor has `image` by what is distorted.
    fn by_point<N: Number, I: Image<N>>(
        point: [N; 3],
        normalised: &Normalised<N>,
        stretch: [[N; 2]; 2],
        image: I,
    ) -> [[N; 3]; 2];

    /// Where a place on the plane looks; `None` where no direction is mapped.
    fn direction(place: [f64; 2]) -> Option<Vector3>;

    /// How far from the axis a point is mapped that is `radius` from it at `depth`; `None` where it
    /// is not.
    fn distance(radius: f64, depth: f64) -> Option<f64>;
}

/// By the tangent: straight lines stay straight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Perspective;

impl Projection for Perspective {
    #[inline(always)]
    fn normalise<N: Number>([x, y, z]: [N; 3]) -> Normalised<N> {
        let place = [x / z, y / z];
        let square = place[0] * place[0] + place[1] * place[1];
        Normalised { place, square, scale: z.all(1.0) / z, seen: z.held(0.0, f64::INFINITY) }
    }

    #[inline(always)]
    fn by_point<N: Number, I: Image<N>>(
        _: [N; 3],
        normalised: &Normalised<N>,
        stretch: [[N; 2]; 2],
        image: I,
    ) -> [[N; 3]; 2] {
        let near = image.scaled(normalised.scale);
        let by_x = near.carry([stretch[0][0], stretch[1][0]]);
        let by_y = near.carry([stretch[0][1], stretch[1][1]]);
        let ([x, y], zero) = (normalised.place, normalised.scale.all(0.0));
        [
            [by_x[0], by_y[0], zero - (by_x[0] * x + by_y[0] * y)],
            [by_x[1], by_y[1], zero - (by_x[1] * x + by_y[1] * y)],
        ]
    }

    fn direction([x, y]: [f64; 2]) -> Option<Vector3> {
        Some(Vector3::new(x, y, 1.0).normalize())
    }

    fn distance(radius: f64, depth: f64) -> Option<f64> {
        (depth > 0.0).then(|| radius / depth)
    }
}

/// By the angle: it sees behind itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equidistant;

impl Equidistant {
    /// On the axis the picture is that of a pinhole: so it is, to rounding, this far from it.
    const NEAR: f64 = 1e-150;

    #[inline(always)]
    fn radius<N: Number>([x, y, _]: [N; 3]) -> N {
        (x * x + y * y).root().max_with(x.all(Self::NEAR))
    }
}

impl Projection for Equidistant {
    #[inline(always)]
    fn normalise<N: Number>(point: [N; 3]) -> Normalised<N> {
        let ([x, y, z], radius) = (point, Self::radius(point));
        let angle = angle(radius, z);
        let scale = angle / radius;
        // Behind the camera there is nothing on the axis.
        let seen = z.max_with(radius - z.all(Self::NEAR)).held(0.0, f64::INFINITY);
        Normalised { place: [x * scale, y * scale], square: angle * angle, scale, seen }
    }

    #[inline(always)]
    fn by_point<N: Number, I: Image<N>>(
        point: [N; 3],
        normalised: &Normalised<N>,
        stretch: [[N; 2]; 2],
        image: I,
    ) -> [[N; 3]; 2] {
        let ([x, y, z], radius) = (point, Self::radius(point));
        let (east, south) = (x / radius, y / radius);
        let inverse = z.all(1.0) / (x * x + y * y + z * z);
        let along = z * inverse - normalised.scale;
        let (mixed, back) = (east * south * along, z.all(0.0) - inverse);
        let by_x = [normalised.scale + east * east * along, mixed];
        let by_y = [mixed, normalised.scale + south * south * along];
        let by_z = [x * back, y * back];
        let [first, second] = [
            image.carry([stretch[0][0], stretch[1][0]]),
            image.carry([stretch[0][1], stretch[1][1]]),
        ];
        let mut slopes = [[z.all(0.0); 3]; 2];
        for (k, row) in slopes.iter_mut().enumerate() {
            for (slope, by) in row.iter_mut().zip([by_x, by_y, by_z]) {
                *slope = first[k] * by[0] + second[k] * by[1];
            }
        }
        slopes
    }

    fn direction([x, y]: [f64; 2]) -> Option<Vector3> {
        let angle = (x * x + y * y).sqrt();
        let sine = if angle > 0.0 { libm::sin(angle) / angle } else { 1.0 };
        let direction = Vector3::new(x * sine, y * sine, libm::cos(angle));
        (angle <= std::f64::consts::PI).then(|| direction.normalize())
    }

    fn distance(radius: f64, depth: f64) -> Option<f64> {
        Some(libm::atan2(radius, depth))
    }
}

/// The angle from the axis, 0 to pi: `atan2(radius, z)` within some roundings, for a `radius` above 0.
#[inline(always)]
fn angle<N: Number>(radius: N, z: N) -> N {
    let one = z.all(1.0);
    let (ahead, distance) = (z.magnitude(), (radius * radius + z * z).root());
    // The tangent of half the angle, halved twice more: an eighth of the angle is at most pi / 16.
    let halved = |tangent: N| tangent / (one + (one + tangent * tangent).root());
    let tangent = halved(halved(radius / (distance + ahead)));
    let square = tangent * tangent;
    // The series of the arcus tangent: of tan(pi / 16) the term after these is 6e-19.
    const TERMS: i32 = 12;
    let mut sum = z.all(0.0);
    for term in (0..TERMS).rev() {
        sum = z.all(1.0 / f64::from(2 * term + 1)) - square * sum;
    }
    let angle = z.all(8.0) * tangent * sum;
    // 1 ahead, -1 behind: there it is what is missing to half a turn.
    let side = z / ahead.max_with(z.all(f64::MIN_POSITIVE));
    let missing = z.all(std::f64::consts::PI) - angle - angle;
    angle + (one - side) * z.all(0.5) * missing
}
