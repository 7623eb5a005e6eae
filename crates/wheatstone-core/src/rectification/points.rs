//! The space that two cameras were shown: places in it, and the parts of the pictures that show them.

use super::{PairSettings, Source, maps::Maps};
use crate::{
    Calibration, Error, Result,
    error::{Hint, Remedy},
    geometry::{Pixel, Point3},
};
use wheatstone_numeric::random::Random;

/// What both cameras see.
pub(super) struct Shown {
    /// Places in the world.
    pub(super) places: Vec<Point3>,
    /// The pictures, in the order of the cameras that were asked for.
    pub(super) sources: [Source; 2],
    /// The larger width and height of the two pictures, or of what was shown in them.
    pub(super) size: [u32; 2],
}

/// Enough for figures of two digits at each of several depths.
const PLACES: usize = 1500;

/// The least number of places from which two centres can be told.
const NEEDED: usize = 8;

/// What the model says, or was told, of the size of a camera's pictures.
fn size(model: &Calibration, wanted: &PairSettings, camera: usize) -> Option<[u32; 2]> {
    wanted.sizes.get(camera).copied().flatten().or_else(|| model.picture_size(camera))
}

/// The space that a model was shown; of one that came without points, what its pictures show from two
/// to fifty baselines off.
pub(super) fn shown(model: &Calibration, maps: &Maps, wanted: &PairSettings) -> Result<Shown> {
    let sizes = maps.cameras.map(|camera| size(model, wanted, camera));
    let picture = |size: [u32; 2]| size.map(|side| [-0.5, f64::from(side) - 0.5]);
    let (candidates, regions) = match trained(model, maps) {
        Some(regions) => (model.data.places(PLACES, 0), regions),
        None => match sizes {
            [Some(left), Some(right)] => {
                (before(model, maps, left), [picture(left), picture(right)])
            }
            _ => return Err(no_size()),
        },
    };
    let inside = |pixel: Pixel, region: &[[f64; 2]; 2]| {
        (0..2).all(|axis| pixel[axis] >= region[axis][0] && pixel[axis] <= region[axis][1])
    };
    let seen = |place: &Point3| {
        (0..2).all(|side| {
            maps.project(side, *place).is_some_and(|pixel| inside(pixel, &regions[side]))
        })
    };
    let places: Vec<Point3> = candidates.into_iter().filter(seen).collect();
    if places.len() < NEEDED {
        return Err(Error::Degenerate {
            problem: format!(
                "cameras {} and {} have almost no common field of view",
                maps.cameras[0] + 1,
                maps.cameras[1] + 1
            ),
            hint: Hint::new("choose two cameras that have one", Remedy::TwoCameras),
        });
    }
    let sources = [0, 1].map(|side| Source {
        picture: sizes[side].map_or(regions[side], picture),
        shown: regions[side],
    });
    let side = |axis: usize| {
        let span = |source: &Source| source.picture[axis][1] - source.picture[axis][0];
        f64::max(span(&sources[0]), span(&sources[1])).ceil().max(2.0) as u32
    };
    Ok(Shown { places, sources, size: [side(0), side(1)] })
}

/// Least and largest x and y of the pixels that the model was shown, a camera each.
fn trained(model: &Calibration, maps: &Maps) -> Option<[[[f64; 2]; 2]; 2]> {
    let data = model.data.restored();
    let region = |camera: usize| {
        let seen = data.seen_by_camera(camera);
        [0, 1].map(|axis| {
            seen.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, pixel)| {
                [low.min(pixel[axis]), high.max(pixel[axis])]
            })
        })
    };
    let both = maps.cameras.map(region);
    both.iter().flatten().all(|[low, high]| low < high).then_some(both)
}

/// Places before the left camera, from two baselines off to fifty.
fn before(model: &Calibration, maps: &Maps, [width, height]: [u32; 2]) -> Vec<Point3> {
    // Stereo measures at such distances: nearer the views part, farther a baseline shows nothing.
    const NEAR: f64 = 2.0;
    const FAR: f64 = 50.0;
    let middle = Pixel::new(f64::from(width) / 2.0, f64::from(height) / 2.0);
    let centre = |camera: usize| model.reconstructor.ray(camera, middle).map(|ray| ray.origin);
    let [Some(left), Some(right)] = maps.cameras.map(centre) else { return Vec::new() };
    let baseline = (right - left).norm();
    let mut random = Random::new(0);
    // Of narrow or converging views most places before one camera are not before the other.
    let place = |_| {
        let pixel = Pixel::new(
            random.uniform(-0.5, f64::from(width) - 0.5),
            random.uniform(-0.5, f64::from(height) - 0.5),
        );
        let distance = baseline * NEAR * libm::exp(random.uniform(0.0, libm::log(FAR / NEAR)));
        Some(model.reconstructor.ray(maps.cameras[0], pixel)?.at(distance))
    };
    (0..3 * PLACES).filter_map(place).collect()
}

fn no_size() -> Error {
    Error::Degenerate {
        problem: "the field of view of this model's cameras is unknown: it has neither points nor the size of its pictures".into(),
        hint: Hint::new("give the size of the pictures", Remedy::ImageSize),
    }
}
