//! One camera fitted to points of which some may be wrong: a lens from telephoto to fisheye, weights
//! that let gross errors go, and what the lens formula leaves over as a smooth field.
//!
//! Source: iteratively reweighted least squares with Cauchy's weight, Holland & Welsch 1977
//! (doi:10.1080/03610927708827533).

use super::{
    field::Field,
    pairs::{Pair, extent},
};
use crate::{
    camera::{AdjustableCamera, kannala_brandt::KannalaBrandt, posed_lens::PosedLens},
    geometry::{Pixel, Point3, Pose, Vector3},
    method::kannala_brandt::starting_cameras,
};
use nalgebra::{Matrix2x3, Matrix3, SMatrix, SVector, Vector2};
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience, Problem, search},
    progress::Silent,
    simd::{Simd, WithSimd, on_widest},
    statistics::median,
};

/// Unknowns of a camera: rotation, translation, focal lengths, principal point, four coefficients.
pub(super) const UNKNOWNS: usize = 14;

/// A camera as the clinic observes it.
#[derive(Clone, Debug)]
pub(super) struct RobustCamera {
    pub(super) posed: PosedLens<KannalaBrandt>,
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
        for posed in starting_cameras(&few) {
            let start = Self { posed, field: Field::nothing() };
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
        let point =
            Point3::from(self.rotation() * world.coords + self.posed.camera_from_world.translation);
        let (pixel, _) = self.posed.lens.project_with_slopes(point, &mut [[0.0; 2]; 8])?;
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

    /// World to camera axes; determinant -1 for a mirrored camera or a left-handed world.
    pub(super) fn rotation(&self) -> Matrix3<f64> {
        self.posed.camera_from_world.rotation
    }

    /// The camera's centre in the world.
    pub(super) fn centre(&self) -> Point3 {
        Point3::from(-(self.rotation().transpose() * self.posed.camera_from_world.translation))
    }

    /// Distance along the axis.
    pub(super) fn depth(&self, world: Point3) -> f64 {
        (self.rotation() * world.coords + self.posed.camera_from_world.translation).z
    }

    /// Whether its picture is a mirror's, or the world is left-handed.
    pub(super) fn is_mirrored(&self) -> bool {
        self.rotation().determinant() < 0.0
    }

    /// Where its axis meets the picture.
    pub(super) fn principal(&self) -> Pixel {
        self.posed.lens.pinhole.principal.into()
    }

    /// Its focal lengths in pixels.
    pub(super) fn focal(&self) -> [f64; 2] {
        self.posed.lens.pinhole.focal
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
        other.posed.camera_from_world.rotation.row_mut(2).neg_mut();
        other.posed.camera_from_world.translation.z =
            2.0 * median(&depths) - own.posed.camera_from_world.translation.z;
        let other = other.refined(pairs, 15);
        other.median_error(pairs) > 1.3 * own.median_error(pairs)
    }

    /// The same camera after at most so many steps under Cauchy's weight.
    pub(super) fn refined(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, UNKNOWNS)
    }

    /// The same lens at another place.
    pub(super) fn moved(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, 6)
    }

    fn adjusted(&self, pairs: &[Pair], steps: usize, unknowns: usize) -> Self {
        let patience = Patience { steps, least_gain: 1e-6 };
        let resection = Resection { pairs, unknowns };
        let found = search(&resection, self.clone(), (patience, Damping::marquardt(1e-4)), &Silent);
        let camera = found.ok().flatten().map_or_else(|| self.clone(), |found| found.state);
        camera.upright()
    }

    /// The same camera with positive focal lengths: a negative one is an axis that runs the other way.
    fn upright(mut self) -> Self {
        for axis in 0..2 {
            if self.posed.lens.pinhole.focal[axis] < 0.0 {
                self.posed.lens.pinhole.focal[axis] *= -1.0;
                self.posed.camera_from_world.rotation.row_mut(axis).neg_mut();
                self.posed.camera_from_world.translation[axis] *= -1.0;
            }
        }
        self
    }

    fn stepped(&self, step: &SVector<f64, UNKNOWNS>) -> Self {
        let mut camera = self.clone();
        let turn =
            Pose::from_rotation_vector(Vector3::zeros(), Vector3::new(step[0], step[1], step[2]));
        camera.posed.camera_from_world.rotation =
            turn.rotation * self.posed.camera_from_world.rotation;
        camera.posed.camera_from_world.translation += Vector3::new(step[3], step[4], step[5]);
        for axis in 0..2 {
            camera.posed.lens.pinhole.focal[axis] += step[6 + axis];
            camera.posed.lens.pinhole.principal[axis] += step[8 + axis];
        }
        for (value, by) in camera.posed.lens.coefficients.iter_mut().zip(step.iter().skip(10)) {
            *value += by;
        }
        camera
    }
}

/// Cauchy's weight.
fn cauchy(error: f64, scale: f64) -> f64 {
    1.0 / (1.0 + (error / scale).powi(2)) / (scale * scale)
}

/// A camera's pose, and its lens unless the unknowns are but six, from pairs of which some may be wrong.
struct Resection<'a> {
    pairs: &'a [Pair],
    unknowns: usize,
}

impl Problem for Resection<'_> {
    type State = RobustCamera;
    type Equations = (Linearised, Normal);
    type Step = SVector<f64, UNKNOWNS>;

    fn linearise(&self, camera: &RobustCamera) -> Option<(Linearised, Normal)> {
        let seen = Linearised::by(camera, self.pairs);
        let normal = Normal::of(&seen, (camera, self.unknowns), seen.scale(), cauchy);
        normal.cost.is_finite().then_some((seen, normal))
    }

    fn step(&self, (_, normal): &Self::Equations, damping: f64) -> Option<(Self::Step, f64)> {
        normal.step(damping)
    }

    fn moved(&self, camera: &RobustCamera, step: &Self::Step) -> RobustCamera {
        camera.stepped(step)
    }

    fn cost(&self, (_, normal): &Self::Equations) -> f64 {
        normal.cost
    }

    fn gain(&self, (_, before): &Self::Equations, (seen, after): &Self::Equations) -> f64 {
        before.cost - seen.cost(before.scale) - after.held
    }
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
            let turned = camera.rotation() * world.coords;
            let mut by_lens = [[0.0; 2]; 8];
            let point = Point3::from(turned + camera.posed.camera_from_world.translation);
            let (seen, by_point) = camera.posed.lens.project_with_slopes(point, &mut by_lens)?;
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
    fn cost(&self, scale: f64) -> f64 {
        let of = |row: &Row| 0.5 * libm::log1p(row.error.norm_squared() / (scale * scale));
        self.unseen as f64 * 1e3 + self.rows.iter().map(of).sum::<f64>()
    }
}

/// Normal equations, under Cauchy's weight unless said otherwise.
#[derive(Default)]
pub(super) struct Normal {
    pub(super) matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    pub(super) gradient: SVector<f64, UNKNOWNS>,
    /// Half of what Cauchy's weight makes least, and what an unlikely lens costs.
    cost: f64,
    held: f64,
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
        let mut normal = Self { scale, ..Self::default() };
        on_widest(Added { normal: &mut normal, rows: &seen.rows, unknowns, weigh });
        if unknowns == UNKNOWNS {
            normal.held = normal.hold_lens(camera);
        }
        normal.cost = seen.cost(scale) + normal.held;
        normal
    }

    /// Coefficients beyond what lenses have are unlikely: standard deviation 1 about nothing. What it costs.
    fn hold_lens(&mut self, camera: &RobustCamera) -> f64 {
        let mut cost = 0.0;
        for (index, value) in camera.posed.lens.coefficients.iter().enumerate() {
            self.matrix[(10 + index, 10 + index)] += 1.0;
            self.gradient[10 + index] -= value;
            cost += value * value / 2.0;
        }
        // Pixels are nearly square: the logarithm of their aspect is known to 0.1 beforehand.
        let [fx, fy] = camera.posed.lens.pinhole.focal;
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

    /// A damped step, and by how much it lowers the cost if these equations hold for it.
    fn step(&self, damping: f64) -> Option<(SVector<f64, UNKNOWNS>, f64)> {
        let mut matrix = self.matrix;
        for index in 0..UNKNOWNS {
            let value = matrix[(index, index)];
            matrix[(index, index)] = if value > 0.0 { value * (1.0 + damping) } else { 1.0 };
        }
        let step = matrix.cholesky()?.solve(&self.gradient);
        let held = self.matrix.diagonal().component_mul(&step);
        Some((step, 0.5 * (step.dot(&self.gradient) + damping * step.dot(&held))))
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
