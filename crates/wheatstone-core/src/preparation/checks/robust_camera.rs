//! One camera fitted to points of which some may be wrong: a lens from telephoto to fisheye, weights
//! that let gross errors go, and what the lens formula leaves over as a smooth field.
//!
//! Source: iteratively reweighted least squares with Cauchy's weight, Holland & Welsch 1977
//! (doi:10.1080/03610927708827533).

use super::{
    decentred_camera::{DecentredCamera, UNKNOWNS},
    field::Field,
    pairs::{Pair, extent},
    resection::{Linearised, Normal, POSE, cauchy},
};
use crate::{
    geometry::{Pixel, Point3, Pose, Vector3},
    method::kannala_brandt::starting_cameras,
};
use nalgebra::{Matrix3, SVector, Vector2};
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience, Problem, search},
    progress::Silent,
    statistics::median,
};

/// A camera as the clinic observes it.
#[derive(Clone, Debug)]
pub(super) struct RobustCamera {
    pub(super) formula: DecentredCamera,
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
            let formula = DecentredCamera { posed, decentring: None };
            let start = Self { formula, field: Field::nothing() };
            let camera = start.refined(&few, steps);
            let error = camera.median_error(&few);
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, camera));
            }
        }
        best.map(|(_, camera)| camera)
    }

    /// The same lens, with tangential terms to be fitted.
    pub(super) fn decentred(mut self) -> Self {
        self.formula.decentring = Some([0.0; 2]);
        self
    }

    /// Where a world point falls.
    pub(super) fn project(&self, world: Point3) -> Option<Pixel> {
        let pixel = self.formula.project(world)?;
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
                let place = self.formula.project(*world)?;
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
        self.formula.posed.camera_from_world.rotation
    }

    /// The camera's centre in the world.
    pub(super) fn centre(&self) -> Point3 {
        Point3::from(
            -(self.rotation().transpose() * self.formula.posed.camera_from_world.translation),
        )
    }

    /// Distance along the axis.
    pub(super) fn depth(&self, world: Point3) -> f64 {
        (self.rotation() * world.coords + self.formula.posed.camera_from_world.translation).z
    }

    /// Whether its picture is a mirror's, or the world is left-handed.
    pub(super) fn is_mirrored(&self) -> bool {
        self.rotation().determinant() < 0.0
    }

    /// Where its axis meets the picture.
    pub(super) fn principal(&self) -> Pixel {
        self.formula.posed.lens.pinhole.principal.into()
    }

    /// Its focal lengths in pixels.
    pub(super) fn focal(&self) -> [f64; 2] {
        self.formula.posed.lens.pinhole.focal
    }

    /// Standard deviation of where its axis meets the picture, in pixels: the larger of x's and y's.
    pub(super) fn principal_uncertainty(&self, pairs: &[Pair]) -> Option<f64> {
        let normal = Normal::weighed(&self.formula, pairs, cauchy);
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
        other.formula.posed.camera_from_world.rotation.row_mut(2).neg_mut();
        other.formula.posed.camera_from_world.translation.z =
            2.0 * median(&depths) - own.formula.posed.camera_from_world.translation.z;
        let other = other.refined(pairs, 15);
        other.median_error(pairs) > 1.3 * own.median_error(pairs)
    }

    /// The same camera after at most so many steps under Cauchy's weight.
    pub(super) fn refined(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, self.formula.unknowns())
    }

    /// The same lens at another place.
    pub(super) fn moved(&self, pairs: &[Pair], steps: usize) -> Self {
        self.adjusted(pairs, steps, POSE)
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
            if self.formula.posed.lens.pinhole.focal[axis] < 0.0 {
                self.formula.posed.lens.pinhole.focal[axis] *= -1.0;
                self.formula.posed.camera_from_world.rotation.row_mut(axis).neg_mut();
                self.formula.posed.camera_from_world.translation[axis] *= -1.0;
            }
        }
        self
    }

    fn stepped(&self, step: &SVector<f64, UNKNOWNS>) -> Self {
        let mut camera = self.clone();
        let turn =
            Pose::from_rotation_vector(Vector3::zeros(), Vector3::new(step[0], step[1], step[2]));
        camera.formula.posed.camera_from_world.rotation =
            turn.rotation * self.formula.posed.camera_from_world.rotation;
        camera.formula.posed.camera_from_world.translation +=
            Vector3::new(step[3], step[4], step[5]);
        for axis in 0..2 {
            camera.formula.posed.lens.pinhole.focal[axis] += step[6 + axis];
            camera.formula.posed.lens.pinhole.principal[axis] += step[8 + axis];
        }
        let coefficients = camera.formula.posed.lens.coefficients.iter_mut();
        for (value, by) in coefficients
            .chain(camera.formula.decentring.iter_mut().flatten())
            .zip(step.iter().skip(10))
        {
            *value += by;
        }
        camera
    }

    /// Forgets the field.
    pub(super) fn without_field(&self) -> Self {
        Self { field: Field::nothing(), ..self.clone() }
    }
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
        let seen = Linearised::by(&camera.formula, &camera.field, self.pairs);
        let normal = Normal::of(&seen, (&camera.formula, self.unknowns), seen.scale(), cauchy);
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
