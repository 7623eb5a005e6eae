//! One camera fitted to known world points: starts, adjustment, and the choice of terms.
//!
//! Sources: bundle adjustment, Triggs, McLauchlan, Hartley & Fitzgibbon 2000
//! (doi:10.1007/3-540-44480-7_21), here with the points known, so that cameras do not depend on each
//! other; choice of terms by Akaike's information criterion corrected for small samples, Hurvich &
//! Tsai 1989 (doi:10.1093/biomet/76.2.297).

use super::{
    AnyReconstructor, CameraUncertainty, Fit, KnownLens, camera_uncertainty,
    chart_pose_uncertainty,
    checks::{enough, linear_camera},
    fitted_camera::FittedCamera,
    fitted_cameras::FittedCameras,
    resection_start::{Lens, starts},
};
use crate::{
    Error, Result,
    camera::{
        AdjustableCamera,
        batch_projection::BatchProjection,
        normal_equations::{PosedObservations, Sums},
        picture_domain::bounding,
        posed_lens::{POSE, PosedLens},
    },
    dataset::Dataset,
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Vector3},
};
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::cell::RefCell;
use wheatstone_numeric::{
    levenberg_marquardt::{NormalEquations, Patience, minimise},
    loss::Loss,
    progress::Progress,
    random::Random,
};

/// The first of a model's numbers that bends its lens: before it stand its pinhole's focal lengths and principal
/// point.
const FIRST_COEFFICIENT: usize = 4;

/// An adjusted camera.
#[derive(Clone, Debug)]
pub(super) struct Adjusted<L> {
    pub(super) camera: PosedLens<L>,
    /// Sum of squared pixel errors.
    pub(super) squares: f64,
    /// Unknowns that were adjusted, as [`PosedLens::adjust`] numbers them: 0 to 5 the pose, then the model's own.
    pub(super) adjusted: Vec<usize>,
}

/// Rotation matrix by its rotation vector, and the left Jacobian: the derivative of the turned
/// vector y by the rotation vector is -[y]x times it.
pub(super) fn turn(by: Vector3) -> (Matrix3<f64>, Matrix3<f64>) {
    let angle = by.norm();
    let cross = by.cross_matrix();
    let (first, second) = if angle < 1e-4 {
        // Series, where the quotients lose digits.
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        let square = angle * angle;
        ((1.0 - libm::cos(angle)) / square, (angle - libm::sin(angle)) / (square * angle))
    };
    let left = Matrix3::identity() + cross * first + cross * cross * second;
    (Pose::from_rotation_vector(Vector3::zeros(), by).rotation, left)
}

impl<L: BatchProjection> PosedLens<L> {
    fn moved(&self, free: &[usize], unknowns: &[f64]) -> (Self, Matrix3<f64>) {
        let (mut by, mut camera) = (Vector3::zeros(), self.clone());
        let mut own = camera.lens.parameters_mut();
        for (index, value) in free.iter().zip(unknowns) {
            match index {
                0..3 => by[*index] = *value,
                3..POSE => camera.camera_from_world.translation[index - 3] = *value,
                _ => *own[index - POSE] = *value,
            }
        }
        let (rotation, left) = turn(by);
        camera.camera_from_world.rotation = rotation * self.camera_from_world.rotation;
        (camera, left)
    }

    fn unknowns(&self, free: &[usize]) -> Vec<f64> {
        let mut model = self.lens.clone();
        let own = model.parameters_mut();
        let value = |index: &usize| match index {
            0..3 => 0.0,
            3..POSE => self.camera_from_world.translation[index - 3],
            _ => *own[index - POSE],
        };
        free.iter().map(value).collect()
    }

    /// The same camera with every coefficient of its lens at 0 but the `free` ones.
    fn without_others(&self, free: &[usize]) -> Self {
        let mut camera = self.clone();
        for (index, value) in camera.lens.parameters_mut().into_iter().enumerate() {
            if index >= FIRST_COEFFICIENT && !free.contains(&index) {
                *value = 0.0;
            }
        }
        camera
    }

    /// Adjusts the `free` unknowns (0 to 5 the pose, then the model's own numbers) until the sum of
    /// squared pixel errors is least.
    pub(super) fn adjust(
        &self,
        free: &[usize],
        pairs: &[(Point3, Pixel)],
        patience: Patience,
        progress: &dyn Progress,
    ) -> Result<Adjusted<L>> {
        // About the points' centre, rotation and translation hardly depend on each other.
        let centre = pairs.iter().map(|p| p.0.coords).sum::<Vector3>() / pairs.len() as f64;
        let mut start = self.clone();
        start.camera_from_world.translation += start.camera_from_world.rotation * centre;
        let seen =
            PosedObservations::new(pairs.iter().map(|(world, pixel)| (world - centre, *pixel)));
        let terms: Vec<usize> =
            free.iter().filter(|index| **index >= POSE).map(|index| index - POSE).collect();
        let mut own = POSE..;
        let place = |index: &usize| if *index < POSE { Some(*index) } else { own.next() };
        let places: Vec<usize> = free.iter().filter_map(place).collect();
        let room = RefCell::new(Sums::default());
        let evaluate = |unknowns: &[f64], normal: &mut NormalEquations| {
            let mut sums = room.borrow_mut();
            let (camera, left) = start.moved(free, unknowns);
            let posed =
                PosedLens { lens: &camera.lens, camera_from_world: camera.camera_from_world };
            sums.take(&posed, (&seen, &terms), Loss::Squares);
            sums.turn(&left);
            normal.add_square(&places, sums.unknowns, &sums.products);
            (sums.unseen == 0).then_some(sums.cost)
        };
        let found = minimise(&start.unknowns(free), patience, progress, evaluate)?;
        let (mut camera, _) = start.moved(free, &found.parameters);
        camera.camera_from_world.translation -= camera.camera_from_world.rotation * centre;
        Ok(Adjusted { camera, squares: 2.0 * found.cost, adjusted: free.to_vec() })
    }
}

/// Which of a model's own numbers may be adjusted: several choices, from few to many.
pub(super) struct NestedModels {
    /// The method's name.
    pub(super) method: &'static str,
    /// Each rung holds those of the rung below, and more; numbered as `parameters_mut` lists them, the
    /// pinhole's four first.
    pub(super) rungs: Vec<Vec<usize>>,
}

/// Steps that show where a start leads.
pub(super) const SCOUTING: Patience = Patience { steps: 12, least_gain: 1e-3 };

/// A step that gains less tells no more of which terms predict best.
const JUDGING: Patience = Patience { steps: 100, least_gain: 1e-6 };

/// Points that show where a start leads, chosen at random: more cost time only.
const SCOUTED: usize = 400;

/// Points that decide whether what is seen lies on a plane: enough that chance does not.
const LINEAR: usize = 10 * SCOUTED;

/// A step that gains less moves no unknown by a thousandth of its standard deviation.
pub(super) const FINAL: Patience = Patience { steps: 100, least_gain: 1e-9 };

/// How many times the squared errors of the best lens one may leave that explains the points about as well: 1.2 times its
/// errors. One that is too simple leaves many times as much, and terms that only follow noise gain some percent.
const AS_WELL: f64 = 1.44;

/// Pixel errors below this are rounding, and no evidence for more terms.
const ROUNDING: f64 = 1e-7;

impl NestedModels {
    fn unknowns(&self, rung: usize) -> Vec<usize> {
        (0..POSE).chain(self.rungs[rung].iter().map(|index| index + POSE)).collect()
    }

    /// The least points with which the lowest rung can be judged.
    fn points_needed(&self) -> usize {
        // Two equations a point; one more than unknowns leaves an error to estimate the noise from.
        let unknowns = POSE + self.rungs.first().map_or(0, Vec::len);
        ProjectionMatrix::POINTS_NEEDED.max((unknowns + 1).div_ceil(2))
    }

    /// The best camera of each rung that the points can carry.
    fn climb<L: Lens>(
        &self,
        pairs: &[(Point3, Pixel)],
        linear: &ProjectionMatrix,
        progress: &dyn Progress,
    ) -> Result<Vec<Adjusted<L>>> {
        let carried =
            |rung: usize| rung == 0 || 2 * pairs.len() > POSE + self.rungs[rung].len() + 2;
        let few = some_of(pairs, SCOUTED);
        let mut starts = starts::<L>(&few, linear);
        let mut found: Vec<Adjusted<L>> = Vec::with_capacity(self.rungs.len());
        for rung in (0..self.rungs.len()).filter(|rung| carried(*rung)) {
            let unknowns = self.unknowns(rung);
            let scout = |start: &PosedLens<L>| {
                let start = start.without_others(&self.rungs[rung]);
                possible(start.adjust(&unknowns, &few, SCOUTING, progress))
            };
            let scouted = starts.iter().map(scout).collect::<Result<Vec<_>>>()?;
            // Before, starts that differ by their lenses alone are the same.
            if self.rungs[rung].contains(&FIRST_COEFFICIENT) {
                starts = distinct(starts, &scouted);
            }
            let below = found.last().map(|last| scout(&last.camera)).transpose()?;
            let all = scouted.into_iter().chain(below).flatten();
            let best = all.min_by(|a, b| a.squares.total_cmp(&b.squares));
            let Some(scouted) = best else { continue };
            let adjusted = scouted.camera.adjust(&unknowns, pairs, JUDGING, progress);
            found.extend(possible(adjusted)?);
        }
        Ok(found)
    }

    /// The camera that predicts best, of all rungs.
    fn fit_camera<L: Lens>(
        &self,
        camera: usize,
        train: &Dataset,
        progress: &dyn Progress,
    ) -> Result<Adjusted<L>> {
        let pairs = pairs_of(self.method, camera, self.points_needed(), train)?;
        let linear = linear_camera(camera, &some_of(&pairs, LINEAR))?;
        let mut found = self.climb(&pairs, &linear, progress)?;
        // A search may end in a lens that folds the picture over; such a lens explains nothing.
        found.retain(|adjusted| adjusted.camera.sees_all(&pairs));
        let shown = bounding(pairs.iter().map(|(_, pixel)| *pixel));
        let holds = |adjusted: &Adjusted<L>| {
            shown.is_some_and(|area| adjusted.camera.lens.holds_over(area))
        };
        // One that does so next to where points were seen is given up for one that holds, if that explains them about as well.
        let least = |all: &mut dyn Iterator<Item = &Adjusted<L>>| {
            all.map(|adjusted| adjusted.squares).fold(f64::INFINITY, f64::min)
        };
        let best_of_all = least(&mut found.iter());
        if least(&mut found.iter().filter(|own| holds(own))) <= AS_WELL * best_of_all {
            found.retain(holds);
        }
        let criterion = |adjusted: &Adjusted<L>| {
            information(adjusted.squares, pairs.len(), adjusted.adjusted.len())
        };
        let best = found
            .into_iter()
            .min_by(|a, b| criterion(a).total_cmp(&criterion(b)))
            .ok_or_else(|| unexplained(self.method, camera))?;
        best.camera.adjust(&best.adjusted, &pairs, FINAL, progress)
    }

    /// Fits every camera on its own.
    pub(super) fn fit<L>(&self, train: &Dataset, progress: &dyn Progress) -> Result<Fit>
    where
        L: Lens,
        FittedCameras<L>: Into<AnyReconstructor>,
    {
        let found: Result<Vec<_>> = (0..train.cameras)
            .into_par_iter()
            .map(|camera| self.fit_camera::<L>(camera, train, progress))
            .collect();
        assemble(found?, None, train)
    }
}

/// Of starts that led to the same place the one that came furthest.
fn distinct<L>(starts: Vec<PosedLens<L>>, scouted: &[Option<Adjusted<L>>]) -> Vec<PosedLens<L>> {
    /// What scouting leaves open, and as much again several times.
    const SAME: f64 = 1.0 + 10.0 * SCOUTING.least_gain;
    // A start that led nowhere may yet do so with more terms.
    let reached = |found: &Option<Adjusted<L>>| found.as_ref().map_or(f64::NAN, |f| f.squares);
    let mut all: Vec<(f64, PosedLens<L>)> = scouted.iter().map(reached).zip(starts).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|other, kept| other.0 <= SAME * kept.0);
    all.into_iter().map(|(_, start)| start).collect()
}

/// At most so many of the pairs, at random, always the same ones.
fn some_of(pairs: &[(Point3, Pixel)], most: usize) -> Vec<(Point3, Pixel)> {
    if pairs.len() <= most {
        return pairs.to_vec();
    }
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    Random::new(pairs.len() as u64).shuffle(&mut order);
    order.truncate(most);
    order.sort_unstable();
    order.into_iter().map(|index| pairs[index]).collect()
}

/// Akaike's criterion corrected for small samples, of normal errors of unknown variance; the
/// variance is an unknown too.
pub(crate) fn information(squares: f64, points: usize, unknowns: usize) -> f64 {
    let equations = (2 * points) as f64;
    let (unknowns, rounding) = ((unknowns + 1) as f64, ROUNDING * ROUNDING);
    let left = (equations - unknowns - 1.0).max(0.5);
    equations * libm::log(squares / equations + rounding) + 2.0 * unknowns * equations / left
}

/// What one camera saw of the known points.
pub(super) fn pairs_of(
    method: &str,
    camera: usize,
    need: usize,
    train: &Dataset,
) -> Result<Vec<(Point3, Pixel)>> {
    let pairs = train.seen_by_camera(camera);
    enough(method, Some(camera), need, pairs.len())?;
    Ok(pairs)
}

/// No start explains what a camera saw.
pub(super) fn unexplained(method: &str, camera: usize) -> Error {
    Error::Degenerate {
        problem: format!("no `{method}` camera reproduces the pixels of camera {}", camera + 1),
        hint: "choose a method for wider lenses, or check the points for exchanged columns".into(),
    }
}

/// An adjustment that had nowhere to begin is none; other errors stay.
pub(super) fn possible<T>(adjusted: Result<T>) -> Result<Option<T>> {
    match adjusted {
        Ok(found) => Ok(Some(found)),
        Err(Error::Degenerate { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// The reconstructor of cameras adjusted to what each saw of `train`, with lenses that are known if there are.
pub(super) fn assemble<L>(
    found: Vec<Adjusted<L>>,
    lenses: Option<&[KnownLens<L>]>,
    train: &Dataset,
) -> Result<Fit>
where
    L: AdjustableCamera,
    FittedCameras<L>: Into<AnyReconstructor>,
{
    let mut errors = Vec::with_capacity(found.len());
    let mut cameras = Vec::with_capacity(found.len());
    let mut uncertainty = Vec::with_capacity(found.len());
    // Charts whose places were found have taken up as many equations as they have unknowns.
    let beside = chart_pose_uncertainty::unknowns(train) as f64 / train.cameras.max(1) as f64;
    for (index, Adjusted { camera, squares, adjusted }) in found.into_iter().enumerate() {
        let pairs = train.seen_by_camera(index);
        errors.push((squares, (2 * pairs.len()) as f64 - adjusted.len() as f64 - beside));
        let camera = FittedCamera::from(camera);
        let lens = lenses.and_then(|lenses| lenses.get(index));
        let open = CameraUncertainty::new(&camera, (&adjusted, lens, beside), &pairs);
        uncertainty.push(open.ok_or_else(|| Error::Degenerate {
            problem: format!("the points seen by camera {} do not determine it", index + 1),
            hint: "show it points at two or more distances, over the whole picture".into(),
        })?);
        cameras.push(camera);
    }
    if let Some(all) = chart_pose_uncertainty::covariance(&cameras, &uncertainty, lenses, train) {
        let mut first = 0;
        for open in &mut uncertainty {
            open.take(&all, first);
            first += open.numbers();
        }
    }
    for (open, weight) in uncertainty.iter_mut().zip(camera_uncertainty::weights(&errors)) {
        open.weight = weight;
    }
    let total = |(squares, freedom), (s, f): &(f64, f64)| (squares + s, freedom + f);
    let (squares, freedom) = errors.iter().fold((0.0, 0.0), total);
    let pixel_sigma = (squares / f64::max(freedom, 1.0)).sqrt();
    Ok(Fit::of(FittedCameras { cameras, uncertainty, pixel_sigma }))
}
