//! One camera fitted to points of which some may be wrong: a lens from telephoto to fisheye, weights
//! that let gross errors go, and what the lens formula leaves over as a smooth field.
//!
//! Source: iteratively reweighted least squares with Cauchy's weight, Holland & Welsch 1977
//! (doi:10.1080/03610927708827533).

use super::field::Field;
use crate::{
    camera::{AdjustableCamera, kannala_brandt::KannalaBrandt},
    geometry::{Pixel, Point3, Pose, Vector3},
    method::kannala_brandt::starting_cameras,
};
use nalgebra::{Matrix2x3, Matrix3, SMatrix, SVector, Vector2};
use wheatstone_numeric::{
    simd::{Simd, WithSimd, on_widest},
    statistics::median,
};

/// Unknowns of a camera: rotation, translation, focal lengths, principal point, four coefficients.
pub(super) const UNKNOWNS: usize = 14;

/// A world point and where the camera saw it.
pub(super) type Pair = (Point3, Pixel);

/// A camera as the clinic observes it.
#[derive(Clone, Debug)]
pub(super) struct RobustCamera {
    pub(super) lens: KannalaBrandt,
    /// Determinant -1 for a mirrored camera or a left-handed world.
    pub(super) rotation: Matrix3<f64>,
    pub(super) translation: Vector3,
    /// What the formula leaves over.
    field: Field,
}

impl RobustCamera {
    /// Fits to all pairs, from the best of several starts. `None` where they determine no camera.
    pub(super) fn fit(pairs: &[Pair], steps: usize) -> Option<Self> {
        // More points take time only.
        const STARTING: usize = 150;
        let few: Vec<Pair> =
            pairs.iter().step_by(pairs.len().div_ceil(STARTING).max(1)).copied().collect();
        let mut best: Option<(f64, Self)> = None;
        for (lens, rotation, translation) in starting_cameras(&few) {
            let start = Self { lens, rotation, translation, field: Field::nothing() };
            let camera = start.refined(&few, steps);
            let error = camera.median_error(&few);
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, camera));
            }
        }
        best.map(|(_, camera)| camera)
    }

    /// Where a world point falls, by the formula alone.
    fn formula(&self, world: Point3) -> Option<Pixel> {
        let point = Point3::from(self.rotation * world.coords + self.translation);
        let (pixel, _) = self.lens.project_with_slopes(point, &mut [[0.0; 2]; 8])?;
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// Where a world point falls.
    pub(super) fn project(&self, world: Point3) -> Option<Pixel> {
        let pixel = self.formula(world)?;
        Some(pixel + self.field.at(pixel))
    }

    /// Learns the field from what the formula leaves over at these pairs.
    pub(super) fn learn_field(&mut self, pairs: &[Pair]) {
        // More say no more of it, and each is asked for at every point.
        const TAUGHT: usize = 400;
        let seen: Vec<(Pixel, Vector2<f64>)> = pairs
            .iter()
            .step_by(pairs.len().div_ceil(TAUGHT).max(1))
            .filter_map(|(world, pixel)| {
                let place = self.formula(*world)?;
                Some((place, pixel - place))
            })
            .collect();
        let size: Vec<f64> = seen.iter().map(|(_, rest)| rest.norm()).collect();
        // Gross errors teach nothing.
        let most = 5.0 * median(&size);
        let taught: Vec<_> = seen.into_iter().filter(|(_, rest)| rest.norm() <= most).collect();
        self.field = Field::of(&taught, 0.05 * extent(pairs).max(1.0));
    }

    /// Pixel error of a pair.
    pub(super) fn error(&self, (world, pixel): &Pair) -> Vector2<f64> {
        // Where it is not seen at all it is as wrong as can be.
        self.project(*world).map_or(Vector2::new(1e6, 1e6), |seen| pixel - seen)
    }

    /// Median length of the errors.
    pub(super) fn median_error(&self, pairs: &[Pair]) -> f64 {
        let errors: Vec<f64> = pairs.iter().map(|pair| self.error(pair).norm()).collect();
        if errors.is_empty() { f64::INFINITY } else { median(&errors) }
    }

    /// The camera's centre in the world.
    pub(super) fn centre(&self) -> Point3 {
        Point3::from(-(self.rotation.transpose() * self.translation))
    }

    /// Distance along the axis.
    pub(super) fn depth(&self, world: Point3) -> f64 {
        (self.rotation * world.coords + self.translation).z
    }

    /// Whether its picture is a mirror's, or the world is left-handed.
    pub(super) fn is_mirrored(&self) -> bool {
        self.rotation.determinant() < 0.0
    }

    /// Where its axis meets the picture.
    pub(super) fn principal(&self) -> Pixel {
        self.lens.pinhole.principal.into()
    }

    /// Its focal lengths in pixels.
    pub(super) fn focal(&self) -> [f64; 2] {
        self.lens.pinhole.focal
    }

    /// Standard deviation of where its axis meets the picture, in pixels: the larger of x's and y's.
    pub(super) fn principal_uncertainty(&self, pairs: &[Pair]) -> Option<f64> {
        let normal = Normal::weighed(&self.without_field(), pairs, cauchy);
        let inverse = normal.matrix.try_inverse()?;
        let largest = inverse[(8, 8)].max(inverse[(9, 9)]);
        (largest > 0.0).then(|| largest.sqrt())
    }

    /// Whether the points tell on which side of their middle they are nearer: the camera that observes
    /// the same with near and far exchanged, mirrored, errs clearly more. Weak perspective does not
    /// tell (Necker's cube).
    pub(super) fn tells_near_from_far(&self, pairs: &[Pair]) -> bool {
        let own = self.without_field();
        let depths: Vec<f64> = pairs.iter().map(|pair| own.depth(pair.0)).collect();
        let mut other = own.clone();
        other.rotation.row_mut(2).neg_mut();
        other.translation.z = 2.0 * median(&depths) - own.translation.z;
        let other = other.refined(pairs, 15);
        other.median_error(pairs) > 1.3 * own.median_error(pairs)
    }

    /// The same camera after steps of Gauss and Newton (damped) under Cauchy's weight.
    pub(super) fn refined(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, UNKNOWNS)
    }

    /// The same lens at another place.
    pub(super) fn moved(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, 6)
    }

    fn adjusted(&self, pairs: &[Pair], steps: usize, unknowns: usize) -> Self {
        let mut camera = self.clone();
        let mut damping = 1e-4;
        let mut seen = Linearised::by(&camera, pairs);
        let mut current = Normal::of(&seen, (&camera, unknowns), seen.scale(), cauchy);
        for _ in 0..steps {
            let Some(step) = current.step(damping) else { break };
            let tried = camera.stepped(&step);
            let then = Linearised::by(&tried, pairs);
            let cost = then.cost((&tried, unknowns), current.scale);
            if cost.is_finite() && cost < current.cost {
                (camera, seen) = (tried, then);
                damping = (damping * 0.2_f64).max(1e-9);
                if 1.0 - cost / current.cost < 1e-6 {
                    break;
                }
                current = Normal::of(&seen, (&camera, unknowns), seen.scale(), cauchy);
            } else {
                damping *= 10.0;
            }
        }
        camera.upright()
    }

    /// The same camera with positive focal lengths: a negative one is an axis that runs the other way.
    fn upright(mut self) -> Self {
        for axis in 0..2 {
            if self.lens.pinhole.focal[axis] < 0.0 {
                self.lens.pinhole.focal[axis] *= -1.0;
                self.rotation.row_mut(axis).neg_mut();
                self.translation[axis] *= -1.0;
            }
        }
        self
    }

    fn stepped(&self, step: &SVector<f64, UNKNOWNS>) -> Self {
        let mut camera = self.clone();
        let turn =
            Pose::from_rotation_vector(Vector3::zeros(), Vector3::new(step[0], step[1], step[2]));
        camera.rotation = turn.rotation * self.rotation;
        camera.translation += Vector3::new(step[3], step[4], step[5]);
        for axis in 0..2 {
            camera.lens.pinhole.focal[axis] += step[6 + axis];
            camera.lens.pinhole.principal[axis] += step[8 + axis];
        }
        for (value, by) in camera.lens.coefficients.iter_mut().zip(step.iter().skip(10)) {
            *value += by;
        }
        camera
    }
}

/// The sides of the box round the pixels.
pub(super) fn sides(pairs: &[Pair]) -> [f64; 2] {
    [0, 1].map(|axis: usize| {
        let values = || pairs.iter().map(|(_, pixel)| pixel[axis]);
        let low = values().fold(f64::INFINITY, f64::min);
        values().fold(0.0, |side, value| f64::max(side, value - low))
    })
}

/// The larger of them.
pub(super) fn extent(pairs: &[Pair]) -> f64 {
    sides(pairs).into_iter().fold(0.0, f64::max)
}

/// Cauchy's weight.
fn cauchy(error: f64, scale: f64) -> f64 {
    1.0 / (1.0 + (error / scale).powi(2)) / (scale * scale)
}

/// A camera's errors at the pairs that it observes, and how they change with its numbers.
struct Linearised {
    rows: Vec<Row>,
    /// Pairs that it does not see.
    unseen: usize,
}

/// Of one pair: the pixel's slopes by a turn, the point in the camera's frame, the lens's numbers; its error.
struct Row {
    by_turn: Matrix2x3<f64>,
    by_point: Matrix2x3<f64>,
    by_lens: [[f64; 2]; 8],
    error: Vector2<f64>,
}

impl Linearised {
    fn by(camera: &RobustCamera, pairs: &[Pair]) -> Self {
        let row = |(world, pixel): &Pair| {
            let turned = camera.rotation * world.coords;
            let mut by_lens = [[0.0; 2]; 8];
            let point = Point3::from(turned + camera.translation);
            let (seen, by_point) = camera.lens.project_with_slopes(point, &mut by_lens)?;
            // The field counts in a pose's refit, not while the lens itself is fitted (it is nothing then).
            let error = pixel - (seen + camera.field.at(seen));
            Some(Row { by_turn: by_point * -turned.cross_matrix(), by_point, by_lens, error })
        };
        let rows: Vec<Row> = pairs.iter().filter_map(row).collect();
        Self { unseen: pairs.len() - rows.len(), rows }
    }

    /// 1.2 medians of the errors' length, about a standard deviation and a half; nothing is exact.
    fn scale(&self) -> f64 {
        let errors: Vec<f64> = self.rows.iter().map(|row| row.error.norm()).collect();
        (1.2 * median(&errors)).max(1e-3)
    }

    /// What Cauchy's weight makes least.
    fn cost(&self, (camera, unknowns): (&RobustCamera, usize), scale: f64) -> f64 {
        let of = |row: &Row| libm::log1p(row.error.norm_squared() / (scale * scale));
        let lens = if unknowns == UNKNOWNS { Normal::default().hold_lens(camera) } else { 0.0 };
        self.unseen as f64 * 1e3 + self.rows.iter().map(of).sum::<f64>() + lens
    }
}

/// Normal equations, under Cauchy's weight unless said otherwise.
#[derive(Default)]
pub(super) struct Normal {
    pub(super) matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    pub(super) gradient: SVector<f64, UNKNOWNS>,
    cost: f64,
    pub(super) scale: f64,
}

impl Normal {
    /// Of all unknowns, with a weight by an error's length and the errors' scale, both in pixels.
    pub(super) fn weighed(
        camera: &RobustCamera,
        pairs: &[Pair],
        weigh: fn(f64, f64) -> f64,
    ) -> Self {
        let seen = Linearised::by(camera, pairs);
        Self::of(&seen, (camera, UNKNOWNS), seen.scale(), weigh)
    }

    fn of(
        seen: &Linearised,
        (camera, unknowns): (&RobustCamera, usize),
        scale: f64,
        weigh: fn(f64, f64) -> f64,
    ) -> Self {
        let mut normal =
            Self { cost: seen.cost((camera, unknowns), scale), scale, ..Self::default() };
        on_widest(Added { normal: &mut normal, rows: &seen.rows, unknowns, weigh });
        if unknowns == UNKNOWNS {
            normal.hold_lens(camera);
        }
        normal
    }

    /// Coefficients beyond what lenses have are unlikely: standard deviation 1 about nothing. What it costs.
    fn hold_lens(&mut self, camera: &RobustCamera) -> f64 {
        let mut cost = 0.0;
        for (index, value) in camera.lens.coefficients.iter().enumerate() {
            self.matrix[(10 + index, 10 + index)] += 1.0;
            self.gradient[10 + index] -= value;
            cost += value * value / 2.0;
        }
        // Pixels are nearly square: the logarithm of their aspect is known to 0.1 beforehand.
        let [fx, fy] = camera.lens.pinhole.focal;
        let gap = libm::log((fx / fy).abs().max(1e-9)) / 0.1;
        let (by_x, by_y) = (10.0 / fx, -10.0 / fy);
        self.matrix[(6, 6)] += by_x * by_x;
        self.matrix[(7, 7)] += by_y * by_y;
        self.matrix[(6, 7)] += by_x * by_y;
        self.matrix[(7, 6)] += by_x * by_y;
        self.gradient[6] -= by_x * gap;
        self.gradient[7] -= by_y * gap;
        cost + gap * gap / 2.0
    }

    fn step(&self, damping: f64) -> Option<SVector<f64, UNKNOWNS>> {
        let mut matrix = self.matrix;
        for index in 0..UNKNOWNS {
            let value = matrix[(index, index)];
            matrix[(index, index)] = if value > 0.0 { value * (1.0 + damping) } else { 1.0 };
        }
        Some(matrix.cholesky()?.solve(&self.gradient))
    }
}

/// Adds what the first unknowns make of each row.
struct Added<'a> {
    normal: &'a mut Normal,
    rows: &'a [Row],
    unknowns: usize,
    weigh: fn(f64, f64) -> f64,
}

impl WithSimd for Added<'_> {
    type Output = ();

    /// Written number by number: the compiler makes registers of columns, as wide as there are.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { normal, rows, unknowns, weigh } = self;
        for Row { by_turn, by_point, by_lens, error } in rows {
            let weight = weigh(error.norm(), normal.scale);
            let [x, y]: [[f64; UNKNOWNS]; 2] = std::array::from_fn(|axis| {
                std::array::from_fn(|index| match index {
                    0..3 => by_turn[(axis, index)],
                    3..6 => by_point[(axis, index - 3)],
                    _ if unknowns == UNKNOWNS => by_lens[index - 6][axis],
                    _ => 0.0,
                })
            });
            for column in 0..unknowns {
                let (by_x, by_y) = (weight * x[column], weight * y[column]);
                normal.gradient[column] += by_x * error.x + by_y * error.y;
                // Whole columns, which are quicker than what is below the diagonal.
                let mut column = normal.matrix.column_mut(column);
                for (sum, (x, y)) in column.iter_mut().zip(x.iter().zip(&y)) {
                    *sum += by_x * x + by_y * y;
                }
            }
        }
    }
}

impl RobustCamera {
    /// Forgets the field.
    pub(super) fn without_field(&self) -> Self {
        Self { field: Field::nothing(), ..self.clone() }
    }
}
