//! Cameras whose lenses are known: only their poses are adjusted.
//!
//! A pose is started from the map between a flat chart and the plane at distance one (Zhang 2000,
//! doi:10.1109/34.888718), or linearly where points are not flat, and adjusted until the reprojection error is least. What
//! is uncertain of a lens the pose takes up: both are in the camera's covariance.

use super::{
    AnyMethod, AnyReconstructor, Fit, FittedCameras, KnownLens,
    resection::{Adjusted, FINAL, SCOUTING, assemble, pairs_of, possible, unexplained},
    resection_start::Lens,
};
use crate::{
    Error, Result,
    camera::{
        AdjustableCamera, AnyCamera,
        posed_lens::{POSE, PosedLens},
    },
    dataset::Dataset,
    geometry::{
        Pixel, Point3, Pose, ProjectionMatrix, Vector3, other_tilt, planar_pose, principal_axes,
    },
};
use nalgebra::Matrix3;
use rayon::prelude::*;
use wheatstone_numeric::progress::Progress;

impl<L: AdjustableCamera> FittedCameras<L> {
    /// The lenses, with what is uncertain of them.
    #[must_use]
    pub fn lenses(&self) -> Vec<KnownLens<L>> {
        let each = self.cameras.iter().zip(&self.uncertainty);
        let known = each.map(|(camera, open)| {
            let count = camera.model.clone().parameters_mut().len();
            let is_open = |number: &usize| open.of_model(*number, *number).is_some();
            let numbers: Vec<usize> = (0..count).filter(is_open).collect();
            let pairs = numbers.iter().flat_map(|a| numbers.iter().map(move |b| (*a, *b)));
            let covariance = pairs.filter_map(|(a, b)| open.of_model(a, b)).collect();
            KnownLens { model: camera.model.clone(), numbers, covariance }
        });
        known.collect()
    }

    /// [`FittedCameras::lenses`] of cameras that could have had more `numbers` (the lens's, as it lists them) when they were
    /// fitted to `train`, but did without those that predicted no better: what is uncertain of these is kept too. They are
    /// not known to be 0.
    #[must_use]
    pub fn lenses_among(&self, numbers: &[usize], train: &Dataset) -> Vec<KnownLens<L>> {
        let each = self.lenses().into_iter().zip(&self.cameras).zip(&self.uncertainty).enumerate();
        let known = each.map(|(index, ((lens, camera), open))| {
            let pairs = train.seen_by_camera(index);
            let omitted = open.of_omitted(camera, numbers, &pairs);
            omitted.map_or(lens.clone(), |omitted| lens.with_omitted(omitted))
        });
        known.collect()
    }
}

impl AnyMethod {
    /// The numbers that its lenses may have, as they list them; none for a method without lenses apart from poses.
    #[must_use]
    pub fn lens_numbers(&self) -> Vec<usize> {
        match self {
            Self::Brown(brown) => brown.numbers(),
            Self::KannalaBrandt(fisheye) => fisheye.numbers(),
            _ => Vec::new(),
        }
    }

    /// The lenses that it keeps, one a camera; none for a method that finds them.
    #[must_use]
    pub fn known_lenses(&self) -> Vec<AnyCamera> {
        match self {
            Self::Brown(brown) => brown.lenses.iter().map(|l| l.model.into()).collect(),
            Self::KannalaBrandt(fisheye) => fisheye.lenses.iter().map(|l| l.model.into()).collect(),
            _ => Vec::new(),
        }
    }
}

/// Fits where the cameras with these lenses, one a camera, stand.
pub(super) fn fit<L>(
    lenses: &[KnownLens<L>],
    train: &Dataset,
    progress: &dyn Progress,
) -> Result<Fit>
where
    L: Lens,
    FittedCameras<L>: Into<AnyReconstructor>,
{
    if lenses.len() != train.cameras {
        return Err(Error::Degenerate {
            problem: format!("{} known lenses for {} cameras", lenses.len(), train.cameras),
            hint: "give one lens a camera, in the order of the cameras".into(),
        });
    }
    let pose = |(camera, lens): (usize, &KnownLens<L>)| pose(camera, &lens.model, train, progress);
    let found: Result<Vec<_>> = lenses.par_iter().enumerate().map(pose).collect();
    assemble(found?, Some(lenses), train)
}

/// The least points that determine a pose and show how well they fit it.
const LEAST: usize = 4;

fn pose<L: Lens>(
    camera: usize,
    lens: &L,
    train: &Dataset,
    progress: &dyn Progress,
) -> Result<Adjusted<L>> {
    const NAME: &str = "known lenses";
    let free: Vec<usize> = (0..POSE).collect();
    let pairs = pairs_of(NAME, camera, LEAST, train)?;
    let mut best: Option<Adjusted<L>> = None;
    for camera_from_world in starts(camera, lens, train, &pairs) {
        let start = PosedLens { lens: lens.clone(), camera_from_world };
        let Some(found) = possible(start.adjust(&free, &pairs, SCOUTING, progress))? else {
            continue;
        };
        let is_better = best.as_ref().is_none_or(|best| found.squares < best.squares);
        if is_better && found.camera.sees_all(&pairs) {
            best = Some(found);
        }
    }
    let best = best.ok_or_else(|| unexplained(NAME, camera))?;
    best.camera.adjust(&free, &pairs, FINAL, progress)
}

/// Poses from which the adjustment may begin: of the flat views with most points, each with the other of the two poses in
/// which they look nearly alike, and of all points at once.
fn starts<L: Lens>(
    camera: usize,
    lens: &L,
    train: &Dataset,
    pairs: &[(Point3, Pixel)],
) -> Vec<Pose> {
    const VIEWS: usize = 3;
    let mut views: Vec<Vec<(Point3, Pixel)>> = vec![Vec::new(); train.views.len().max(1)];
    for (world, row) in train.known() {
        if let (Some(view), Some(Some(pixel))) = (views.get_mut(row.view), row.pixels.get(camera)) {
            view.push((world, *pixel));
        }
    }
    views.sort_by_key(|view| std::cmp::Reverse(view.len()));
    let of_view = |view: &Vec<(Point3, Pixel)>| of_plane(lens, view);
    let mut found: Vec<Pose> = views.iter().take(VIEWS).filter_map(of_view).flatten().collect();
    found.extend(of_plane(lens, pairs).into_iter().flatten());
    found.extend(linear(lens, pairs));
    found
}

/// Where a pixel's ray meets the plane at distance one.
fn on_plane<L: Lens>(lens: &L, pixel: Pixel) -> Option<Pixel> {
    let ray = lens.ray(pixel)?.direction;
    // Beyond eighty degrees the plane runs away.
    (ray.z > 0.17).then(|| Pixel::new(ray.x / ray.z, ray.y / ray.z))
}

/// The two poses that see flat points nearly alike; `None` for points that are not flat, or too few.
fn of_plane<L: Lens>(lens: &L, pairs: &[(Point3, Pixel)]) -> Option<[Pose; 2]> {
    /// Thickness over extent.
    const FLAT: f64 = 0.02;
    let points: Vec<Point3> = pairs.iter().map(|pair| pair.0).collect();
    if points.len() < LEAST {
        return None;
    }
    let (middle, [first, second, _], spread) = principal_axes(&points);
    if spread[2] > FLAT * spread[0] {
        return None;
    }
    let flat: Vec<(Pixel, Pixel)> = pairs
        .iter()
        .filter_map(|(world, pixel)| {
            let own = world - middle;
            Some((Pixel::new(own.dot(&first), own.dot(&second)), on_plane(lens, *pixel)?))
        })
        .collect();
    let plane = Pose {
        rotation: Matrix3::from_columns(&[first, second, first.cross(&second)]),
        translation: middle.coords,
    };
    let seen = planar_pose(&flat)?;
    let turn = other_tilt(seen.translation, seen.rotation.column(2).into_owned());
    let other = Pose { rotation: turn * seen.rotation, ..seen };
    Some([seen, other].map(|pose| pose.after(&plane.inverse())))
}

/// The pose of a linear camera through points that are not flat.
fn linear<L: Lens>(lens: &L, pairs: &[(Point3, Pixel)]) -> Option<Pose> {
    let ahead = |(world, pixel): &(Point3, Pixel)| Some((*world, on_plane(lens, *pixel)?));
    let seen: Vec<(Point3, Pixel)> = pairs.iter().filter_map(ahead).collect();
    let (inner, rotation, translation) = ProjectionMatrix::fit(&seen)?.decompose()?;
    // Its focal length is one but for noise: what it says of the distance is the lens's to say.
    let focal = 0.5 * (inner[(0, 0)] + inner[(1, 1)]);
    let translation: Vector3 = Vector3::new(translation.x, translation.y, translation.z / focal);
    Some(Pose { rotation, translation })
}
