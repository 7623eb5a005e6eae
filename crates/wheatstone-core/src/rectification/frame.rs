//! How the virtual cameras stand, and how large their pictures are.

use super::{PairSettings, VirtualPair, maps::Maps, points::Shown, ray_table::RayTable};
use crate::{
    Calibration, Error, Result,
    error::{Hint, Remedy},
    geometry::{Point3, Pose, Vector3},
};
use nalgebra::{Matrix2, Matrix3, Matrix3x2};

/// The virtual cameras, with the maps and the order of the cameras that they stand for.
pub(super) struct Framed<'a> {
    pub(super) pair: VirtualPair,
    pub(super) maps: Maps<'a>,
    /// Whether the first of the wanted cameras turned out to be the right one.
    pub(super) exchanged: bool,
}

/// Pictures may grow to so many times the size of the model's own to hold what both cameras were shown.
const MOST_GROWTH: f64 = 2.0;

/// The pair whose centres are those of the sight lines.
pub(super) fn pair<'a>(
    mut maps: Maps<'a>,
    shown: &Shown,
    lines: &RayTable,
    model: &Calibration,
    wanted: &PairSettings,
) -> Result<Framed<'a>> {
    let [mut left, mut right] = lines.centres;
    let exchanged = (right - left).dot(&lines.along_rows) < 0.0;
    if exchanged {
        std::mem::swap(&mut left, &mut right);
        maps.cameras.swap(0, 1);
    }
    let rotation = rotation(right - left, lines.forward, lines.mirrored)?;
    let rectified_from_world = Pose { rotation, translation: -(rotation * left.coords) };
    let baseline = (right - left).norm();
    let placed = in_view(&shown.places, &rectified_from_world, baseline)?;
    // Errors of a line that misses the centre are linear in the inverse depth: about its mean they are even.
    let depth = placed.len() as f64 / placed.iter().map(|place| 1.0 / place.z).sum::<f64>();
    let seen = [Extent::of(&placed, 0.0), Extent::of(&placed, baseline)];
    let scale = [0, 1].map(|side| {
        let aside = if side == 1 { baseline } else { 0.0 };
        let [x, y] = seen[side].middle();
        let at = Point3::new(x * depth + aside, y * depth, depth);
        magnification(&maps, side, &rectified_from_world, at)
    });
    let [Some(a), Some(b)] = scale else { return Err(behind()) };
    let (size, focal) = size(&seen, shown.size, (a + b) / 2.0, wanted);
    let pair = VirtualPair {
        cameras: maps.cameras,
        unit: model.unit.clone(),
        size,
        focal,
        principal: principal(&seen, size, focal),
        baseline,
        rectified_from_world,
        depth,
    };
    Ok(Framed { pair, maps, exchanged })
}

/// What is farther from the virtual axis than so many times its depth, along the baseline, is not shown: flat pictures would
/// be stretched by more than 30 times there.
const MOST_SLOPE: f64 = 3.0;

/// The places that both virtual cameras can show, in the left one's frame.
fn in_view(places: &[Point3], rectified_from_world: &Pose, baseline: f64) -> Result<Vec<Point3>> {
    let is_in_view = |place: &Point3| {
        [0.0, baseline].iter().all(|aside| (place.x - aside).abs() < MOST_SLOPE * place.z)
    };
    let placed = places.iter().map(|place| rectified_from_world.transform(*place));
    let in_front: Vec<Point3> = placed.filter(|place| place.z > 0.0).collect();
    if in_front.is_empty() {
        return Err(behind());
    }
    let in_view: Vec<Point3> = in_front.into_iter().filter(is_in_view).collect();
    if 2 * in_view.len() < places.len() {
        return Err(in_line());
    }
    Ok(in_view)
}

/// Rows: along the baseline; down; forward.
fn rotation(baseline: Vector3, forward: Vector3, mirrored: bool) -> Result<Matrix3<f64>> {
    // Nearer to the line between the cameras than six degrees nothing is left of what rows share.
    const LEAST_SINE: f64 = 0.1;
    let in_one_place = || Error::Degenerate {
        problem: "the two cameras have the same centre".into(),
        hint: "triangulation needs a baseline".into(),
    };
    let x = baseline.try_normalize(0.0).ok_or_else(in_one_place)?;
    let across = forward - x * x.dot(&forward);
    let z = across.try_normalize(LEAST_SINE * forward.norm()).ok_or_else(in_line)?;
    let y = z.cross(&x) * if mirrored { -1.0 } else { 1.0 };
    Ok(Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]))
}

fn in_line() -> Error {
    Error::Degenerate {
        problem: "one of the two cameras stands behind the other".into(),
        hint: "row alignment needs cameras beside or above each other".into(),
    }
}

fn behind() -> Error {
    Error::Degenerate {
        problem: "the rays of the cameras meet behind them, not in front".into(),
        hint: Hint::new("evaluate the model, and fit again", Remedy::Evaluate),
    }
}

/// What places look like from a virtual camera, at focal length 1.
struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Extent {
    fn of(placed: &[Point3], aside: f64) -> Self {
        let mut extent = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        for place in placed {
            for (axis, value) in
                [(place.x - aside) / place.z, place.y / place.z].into_iter().enumerate()
            {
                extent.low[axis] = extent.low[axis].min(value);
                extent.high[axis] = extent.high[axis].max(value);
            }
        }
        extent
    }

    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.low[axis] + self.high[axis]) / 2.0)
    }

    fn span(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            low: [0, 1].map(|axis| self.low[axis].min(other.low[axis])),
            high: [0, 1].map(|axis| self.high[axis].max(other.high[axis])),
        }
    }
}

/// How many of the camera's pixels there are to one of a virtual camera of focal length 1, along a side.
fn magnification(maps: &Maps, side: usize, rectified_from_world: &Pose, at: Point3) -> Option<f64> {
    let slopes = maps.slopes(side, rectified_from_world.inverse().transform(at))?;
    // A step of 1 at focal length 1 is one of the depth.
    let across = rectified_from_world.rotation.transpose() * Matrix3x2::identity() * at.z;
    let area: Matrix2<f64> = slopes * across;
    let scale = area.determinant().abs().sqrt();
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

/// Width and height, and the focal length: the scale of the model's pictures where what both cameras
/// were shown then fits, in pictures as large as those or larger; otherwise as small as makes it fit, but not below
/// [`LEAST_SCALE`]: then the border is cut off.
fn size(seen: &[Extent; 2], own: [u32; 2], scale: f64, wanted: &PairSettings) -> ([u32; 2], f64) {
    let focal = wanted.focal.unwrap_or(scale);
    let both = seen[0].with(&seen[1]);
    let apart = seen[0].span(0).max(seen[1].span(0));
    let in_common = MARGIN * both.span(0) * focal <= MOST_FOR_COMMON * f64::from(own[0]);
    let spans = [if in_common { both.span(0) } else { apart }, both.span(1)];
    let size = wanted.size.unwrap_or_else(|| {
        [0, 1].map(|axis| {
            let (own, need) = (f64::from(own[axis]), MARGIN * spans[axis] * focal);
            // Some programs want sides that are multiples of 4.
            let grown = (need / 4.0).ceil() * 4.0;
            if need <= own { own as u32 } else { grown.min(MOST_GROWTH * own) as u32 }
        })
    });
    if wanted.focal.is_some() {
        return (size, focal);
    }
    let need = [apart, spans[1]].map(|span| MARGIN * span * focal);
    let fits = [0, 1].map(|axis| f64::from(size[axis]) / need[axis]);
    (size, focal * fits[0].min(fits[1]).clamp(LEAST_SCALE, 1.0))
}

/// What a wide lens shows at its border would take all pixels from the middle of a flat picture: the scale of the
/// middle shrinks by this much at most. A fisheye lens of 260 px that was shown charts up to its border would be left with
/// 154.
const LEAST_SCALE: f64 = 0.8;

/// Nothing of what was shown lies at the very border.
const MARGIN: f64 = 1.05;

/// Programs for dense stereo take it for granted that a far point has no disparity: for that, pictures may
/// be so many times as wide as the model's.
const MOST_FOR_COMMON: f64 = 1.25;

/// What both were shown is in the middle; where it fits in so, a far point has no disparity.
fn principal(seen: &[Extent; 2], size: [u32; 2], focal: f64) -> [[f64; 2]; 2] {
    let centre = |axis: usize| (f64::from(size[axis]) - 1.0) / 2.0;
    let both = seen[0].with(&seen[1]);
    let [x, y] = both.middle();
    let y = centre(1) - focal * y;
    if both.span(0) * focal <= f64::from(size[0]) {
        return [[centre(0) - focal * x, y]; 2];
    }
    [0, 1].map(|side| [centre(0) - focal * seen[side].middle()[0], y])
}
