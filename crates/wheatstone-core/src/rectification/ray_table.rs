//! The lines along which two cameras see, and the places nearest to where those of each camera meet.

use super::maps::Maps;
use crate::{
    Error, Result,
    error::{Hint, Remedy},
    geometry::{Pixel, Point3, Ray, Vector3, triangulation},
};
use nalgebra::Matrix2;
use wheatstone_numeric::statistics::percentile;

/// What the lines say.
pub(super) struct RayTable {
    /// The place nearest to all lines of a camera.
    pub(super) centres: [Point3; 2],
    /// The mean direction in which the cameras look.
    pub(super) forward: Vector3,
    /// The mean direction in which their rows run.
    pub(super) along_rows: Vector3,
    /// Whether the world is left-handed, as the cameras see it.
    pub(super) mirrored: bool,
}

/// What a camera's map does about a place.
struct Local {
    /// Unit vector along the line of sight, away from the camera or towards it.
    along: Vector3,
    /// Unit vector in which x grows.
    row: Vector3,
    /// How much smaller things look at the end of a step along it; positive for away.
    shrinking: f64,
}

impl RayTable {
    /// Of two cameras, through the places that they see.
    pub(super) fn of(maps: &Maps, places: &[Point3]) -> Result<Self> {
        let locals: Vec<[Option<Local>; 2]> =
            places.iter().map(|place| [0, 1].map(|side| local(maps, side, *place))).collect();
        let sum = |side: usize, of: fn(&Local) -> Vector3| {
            locals.iter().filter_map(|both| both[side].as_ref()).map(of).sum::<Vector3>()
        };
        // A camera's own hand: whether x, y and the way that it looks turn as the world's axes do.
        let hand = [0, 1].map(|side| {
            let shrinking = locals.iter().filter_map(|both| Some(both[side].as_ref()?.shrinking));
            if shrinking.sum::<f64>() < 0.0 { -1.0 } else { 1.0 }
        });
        let looks = [0, 1].map(|side| sum(side, |local| local.along).normalize() * hand[side]);
        let forward = (looks[0] + looks[1]).try_normalize(1e-3).ok_or_else(opposed)?;
        let rows = [0, 1].map(|side| sum(side, |local| local.row).normalize());
        let depths: Vec<f64> = places.iter().map(|place| forward.dot(&place.coords)).collect();
        // Of the space's two ends the outermost points are few.
        let ends = [percentile(&depths, 0.05), percentile(&depths, 0.95)];
        let centre = |side: usize| {
            let lines = places.iter().zip(&locals).filter_map(|(place, both)| {
                let along = both[side].as_ref()?.along;
                let pixel = maps.project(side, *place)?;
                let reach = |depth| reached(maps, side, (*place, along), pixel, (forward, depth));
                let (origin, far) = (reach(ends[0])?, reach(ends[1])?);
                Some(Ray { origin, direction: (far - origin).try_normalize(0.0)? })
            });
            // Lines within a minute of arc of each other have no centre.
            triangulation::nearest(lines, 1e-7).ok_or_else(|| parallel(maps.cameras[side]))
        };
        Ok(Self {
            centres: [centre(0)?, centre(1)?],
            forward,
            along_rows: rows[0] + rows[1],
            mirrored: hand[0] + hand[1] < 0.0,
        })
    }
}

fn opposed() -> Error {
    Error::Degenerate {
        problem: "the two cameras look at the same space from opposite sides".into(),
        hint: Hint::new("choose two cameras that look the same way", Remedy::TwoCameras),
    }
}

fn parallel(camera: usize) -> Error {
    Error::Degenerate {
        problem: format!("the rays of camera {} do not meet in one centre", camera + 1),
        hint: "a telecentric lens has no projection centre; a rectified pair needs two".into(),
    }
}

fn local(maps: &Maps, side: usize, place: Point3) -> Option<Local> {
    let slopes = maps.slopes(side, place)?;
    let (x, y) = (slopes.row(0).transpose(), slopes.row(1).transpose());
    let across = x.cross(&y);
    let along = across.try_normalize(0.0)?;
    let area = |place: Point3| {
        let slopes = maps.slopes(side, place)?;
        Some(slopes.row(0).transpose().cross(&slopes.row(1).transpose()).norm())
    };
    // A hundred steps are a hundredth of the space: far enough for differences of differences.
    let by = along * (100.0 * maps.step);
    let shrinking = (area(place - by)? - area(place + by)?) / across.norm();
    Some(Local { along, row: x.try_normalize(0.0)?, shrinking })
}

/// The point at a depth along `forward` that a camera observes at `pixel`, sought from the line through
/// `start`.
pub(super) fn reached(
    maps: &Maps,
    side: usize,
    (start, along): (Point3, Vector3),
    pixel: Pixel,
    (forward, depth): (Vector3, f64),
) -> Option<Point3> {
    // Newton's steps square a small error each time; lines of sight are nearly straight to begin with.
    const STEPS: usize = 6;
    let steep = forward.dot(&along);
    if steep.abs() < 0.05 {
        return None;
    }
    let mut place = start + along * ((depth - forward.dot(&start.coords)) / steep);
    let first = forward.cross(&if forward.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() });
    let plane =
        nalgebra::Matrix3x2::from_columns(&[first.normalize(), forward.cross(&first.normalize())]);
    for _ in 0..STEPS {
        let off = pixel - maps.project(side, place)?;
        if off.norm() < 1e-9 {
            break;
        }
        let slopes: Matrix2<f64> = maps.slopes(side, place)? * plane;
        place += plane * (slopes.try_inverse()? * off);
    }
    // What has not come near by then runs off beyond what the model knows.
    let off = (pixel - maps.project(side, place)?).norm();
    (off < 1e-3).then_some(place)
}
