//! Points at which a map from world to pixel is followed.

use super::{Optics, Rig};
use wheatstone_core::{
    Calibration,
    geometry::{Pixel, Point3, Vector3},
    method::Reconstructor,
};
use wheatstone_numeric::random::Random;

/// Points with their pixels, a camera each; and for models that have no map to pixels, what locates.
pub(super) struct Samples<'a> {
    pub(super) pairs: Vec<Vec<(Point3, Pixel)>>,
    pub(super) intersection: Option<(&'a dyn Reconstructor, Vec<Point3>)>,
}

/// Enough for the twenty numbers of a camera, few enough for a second's work.
const POINTS: usize = 600;

/// Of a model, over the volume that it was fitted to.
pub(super) fn of_model(model: &Calibration, seed: u64) -> Samples<'_> {
    let cameras = model.reconstructor.cameras();
    let points = model.data.places(POINTS, seed);
    let data = model.data.restored();
    if points.is_empty() || !model.reconstructor.has_projection() {
        let mut pairs = vec![Vec::new(); cameras];
        for row in &data.correspondences {
            let Some(found) = model.reconstructor.locate(&row.pixels) else { continue };
            for (pairs, pixel) in pairs.iter_mut().zip(&row.pixels) {
                pairs.extend(pixel.map(|pixel| (found.point, pixel)));
            }
        }
        return Samples { pairs, intersection: Some((&*model.reconstructor, points)) };
    }
    let camera = |camera: usize| {
        let seen = data.seen_by_camera(camera);
        let low = |axis: usize| seen.iter().map(|(_, p)| p[axis]).fold(f64::INFINITY, f64::min);
        let high = |axis: usize| seen.iter().map(|(_, p)| p[axis]).fold(-f64::INFINITY, f64::max);
        let (low, high) = ([low(0), low(1)], [high(0), high(1)]);
        // What a camera was not shown it need not get right.
        let shown = |pixel: &Pixel| (0..2).all(|a| pixel[a] >= low[a] && pixel[a] <= high[a]);
        let pair = |point: &Point3| {
            let pixel = model.reconstructor.project(camera, *point).filter(shown)?;
            Some((*point, pixel))
        };
        points.iter().filter_map(pair).collect()
    };
    Samples { pairs: (0..cameras).map(camera).collect(), intersection: None }
}

/// Where a pixel looks: a point and a direction.
fn ray(optics: &Optics, pixel: Pixel) -> Option<(Point3, Vector3)> {
    match optics {
        Optics::Brown(camera) => camera.ray(pixel).map(|ray| (ray.origin, ray.direction)),
        Optics::KannalaBrandt(camera) => camera.ray(pixel).map(|ray| (ray.origin, ray.direction)),
        Optics::Linear(matrix) => {
            let linear = matrix.0.fixed_view::<3, 3>(0, 0).into_owned();
            let along = linear.try_inverse()? * Vector3::new(pixel.x, pixel.y, 1.0);
            Some((matrix.centre()?, along.try_normalize(0.0)?))
        }
    }
}

/// Of a rig, all over its pictures and from near to far.
pub(super) fn of_rig(rig: &Rig, seed: u64) -> Samples<'static> {
    let centres: Vec<Point3> = rig
        .cameras
        .iter()
        .filter_map(|camera| match &camera.optics {
            Optics::Linear(matrix) => matrix.centre(),
            other => Some(Point3::from(other.pose()?.inverse().translation)),
        })
        .collect();
    let apart = centres.iter().map(|centre| (centre - centres[0]).norm()).fold(0.0, f64::max);
    let baseline = if apart > 0.0 { apart } else { 1.0 };
    let mut random = Random::new(seed);
    let mut pairs = Vec::with_capacity(rig.cameras.len());
    for camera in &rig.cameras {
        // Without a size, the picture's middle is where the axis meets it.
        let guessed = camera.optics.pinhole().map(|lens| lens.principal.map(|value| 2.0 * value));
        let size = camera.size.map(|size| size.map(f64::from)).or(guessed);
        let [width, height] = size.unwrap_or([1000.0, 1000.0]).map(|side| side.max(2.0));
        let mut own = Vec::with_capacity(POINTS);
        for _ in 0..POINTS {
            let pixel =
                Pixel::new(random.uniform(-0.5, width - 0.5), random.uniform(-0.5, height - 0.5));
            // Stereo measures from two baselines off to fifty.
            let distance = baseline * 2.0 * libm::exp(random.uniform(0.0, libm::log(25.0)));
            let Some((origin, along)) = ray(&camera.optics, pixel) else { continue };
            let world = origin + along * distance;
            own.extend(camera.optics.project(world).map(|pixel| (world, pixel)));
        }
        pairs.push(own);
    }
    Samples { pairs, intersection: None }
}
