//! Points at which a map from world to pixel is followed.

use super::exact::exact;
use crate::formats::{Optics, Rig, RigCamera};
use wheatstone_core::{
    Calibration,
    camera::{
        picture_domain::{Area, bounding},
        pinhole::Pinhole,
    },
    geometry::{Pixel, Point3, Pose, Vector3},
    method::{AnyReconstructor, Reconstructor},
};
use wheatstone_numeric::{random::Random, statistics::median};

/// Points with their pixels, a camera each, and what is known of the cameras.
pub(super) struct Samples<'a> {
    pub(super) pairs: Vec<Vec<(Point3, Pixel)>>,
    /// For models that have no map to pixels: what locates, and the points to be met.
    pub(super) intersection: Option<(&'a dyn Reconstructor, Vec<Point3>)>,
    /// Each camera's picture, and the part of it where points were seen.
    pub(super) areas: Vec<[Area; 2]>,
    /// Standard deviation of a pixel coordinate, a camera each; not finite where it is not known.
    pub(super) noise: Vec<f64>,
    /// Pose, focal lengths and principal point of each camera, where the map has them.
    pub(super) own: Option<Vec<(Pose, Pinhole)>>,
}

/// Enough for the twenty numbers of a camera, few enough for a second's work.
const POINTS: usize = 600;

/// Each camera's picture (where its points lie, if its size is not known), and the part of it where points were
/// seen.
pub(super) fn areas(model: &Calibration) -> Vec<[Area; 2]> {
    let camera = |camera: usize| {
        let pixels = model.data.pixels.iter().filter_map(|row| row.get(camera).copied().flatten());
        let shown = bounding(pixels.map(Pixel::from)).unwrap_or_default();
        [model.picture_size(camera).map_or(shown, picture), shown]
    };
    (0..model.reconstructor.cameras()).map(camera).collect()
}

/// Pixel (0, 0) is the middle of the first one.
fn picture([width, height]: [u32; 2]) -> Area {
    [-0.5, -0.5, f64::from(width) - 0.5, f64::from(height) - 0.5]
}

/// Of a model, over the volume that it was fitted to.
pub(super) fn of_model(model: &Calibration, seed: u64) -> Samples<'_> {
    let cameras = model.reconstructor.cameras();
    let points = model.data.places(POINTS, seed);
    let data = model.data.restored();
    let areas = areas(model);
    let noise = |camera: usize| {
        let seen = data.seen_by_camera(camera);
        let sigma = |(world, pixel): &(Point3, Pixel)| {
            model.reconstructor.pixel_sigma(camera, *pixel, *world)
        };
        median(&seen.iter().filter_map(sigma).collect::<Vec<_>>())
    };
    let noise = (0..cameras).map(noise).collect();
    if points.is_empty() || !model.reconstructor.has_projection() {
        let mut pairs = vec![Vec::new(); cameras];
        for row in &data.correspondences {
            let Some(found) = model.reconstructor.locate(&row.pixels) else { continue };
            for (pairs, pixel) in pairs.iter_mut().zip(&row.pixels) {
                pairs.extend(pixel.map(|pixel| (found.point, pixel)));
            }
        }
        let intersection = Some((&*model.reconstructor, points));
        return Samples { pairs, intersection, areas, noise, own: None };
    }
    let camera = |(camera, [_, [left, top, right, bottom]]): (usize, &[Area; 2])| {
        // What a camera was not shown it need not get right.
        let shown = |p: &Pixel| (*left..=*right).contains(&p.x) && (*top..=*bottom).contains(&p.y);
        let pair = |point: &Point3| {
            let pixel = model.reconstructor.project(camera, *point).filter(shown)?;
            Some((*point, pixel))
        };
        points.iter().filter_map(pair).collect()
    };
    let pairs = areas.iter().enumerate().map(camera).collect();
    let own = match &model.reconstructor {
        AnyReconstructor::NeuralCamera(found) => found.pinholes(),
        _ => exact(model).and_then(|rig| own(&rig)),
    };
    Samples { pairs, intersection: None, areas, noise, own }
}

/// Poses and pinholes of all cameras, if all have them.
fn own(rig: &Rig) -> Option<Vec<(Pose, Pinhole)>> {
    let camera = |camera: &RigCamera| {
        let is_mirrored = match &camera.optics {
            Optics::Brown(camera) => camera.mirrored,
            Optics::KannalaBrandt(camera) => camera.mirrored,
            Optics::Linear(_) => true,
        };
        camera.optics.pose().zip(camera.optics.pinhole()).filter(|_| !is_mirrored)
    };
    rig.cameras.iter().map(camera).collect()
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
    let mut areas = Vec::with_capacity(rig.cameras.len());
    for camera in &rig.cameras {
        // Without a size, the picture's middle is where the axis meets it.
        let guessed = camera.optics.pinhole().map(|lens| lens.principal.map(|value| 2.0 * value));
        let guessed = guessed.unwrap_or([1000.0; 2]).map(|side| side.max(2.0) as u32);
        let area = picture(camera.size.unwrap_or(guessed));
        areas.push([area; 2]);
        let [left, top, right, bottom] = area;
        let mut own = Vec::with_capacity(POINTS);
        for _ in 0..POINTS {
            let pixel = Pixel::new(random.uniform(left, right), random.uniform(top, bottom));
            // Stereo measures from two baselines off to fifty.
            let distance = baseline * 2.0 * libm::exp(random.uniform(0.0, libm::log(25.0)));
            let Some((origin, along)) = ray(&camera.optics, pixel) else { continue };
            let world = origin + along * distance;
            own.extend(camera.optics.project(world).map(|pixel| (world, pixel)));
        }
        pairs.push(own);
    }
    let noise = vec![f64::NAN; rig.cameras.len()];
    Samples { pairs, intersection: None, areas, noise, own: own(rig) }
}
