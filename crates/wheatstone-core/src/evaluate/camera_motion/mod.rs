//! Whether the cameras still stand as they stood when a map was fitted, by what they see now: points at known places, a board
//! in the hand, or matched points of anything.
//!
//! Each camera's frame is left free to turn and to shift, and its focal length to change, until the reprojection error is
//! least; places that nobody measured are eliminated (Triggs et al. 2000, doi:10.1007/3-540-44480-7_21). A motion is
//! one that neither the noise of the pixels nor what is uncertain of the fit makes: the covariance of the gradients holds
//! both. Which camera moved, and how, is what explains the pixels with the fewest numbers (Schwarz 1978,
//! doi:10.1214/aos/1176344136).

mod choice;
mod frame;
mod rows;
mod scene;
mod solution;

pub use choice::Change;

use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3, Vector3},
    method::Reconstructor,
};
use choice::{Choice, Search};
use frame::CameraFrame;
use nalgebra::DMatrix;
use rows::{COLUMNS, Place, Rig, ZOOM};
use scene::Scene;
use serde::Serialize;
use solution::Solution;
use wheatstone_numeric::{
    progress::Progress,
    statistics::{chi_square_beyond, chi_square_upper_quantile, root_mean_square},
};

/// False alarms: so seldom do cameras that did not move seem to.
const RATE: f64 = 5e-4;

/// What is known of where things are that the cameras see now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Known {
    /// Their places in the frame of the map.
    Places,
    /// Their places on a board somewhere.
    Boards,
    /// Only that the cameras see the same points.
    Matches,
}

/// What the cameras' pixels say of their motion since a map was fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CameraMotion {
    /// The unit of lengths.
    pub unit: String,
    /// What is known of what they see.
    pub known: Known,
    /// Points, or boards' points, that were used.
    pub n: usize,
    /// Pixels and matches that were left out as gross errors.
    pub left_out: usize,
    /// The probability that cameras which did not move look so, or more so.
    pub chance: f64,
    /// What changed; nothing where `chance` is above one in two thousand, or no motion explains what differs.
    pub changes: Vec<CameraChange>,
    /// The probability of what these changes leave unexplained.
    pub chance_of_rest: f64,
    /// Standard deviation of a pixel coordinate as these pixels show it, with all cameras free, and as the map expects it.
    pub pixel_sigma: f64,
    /// See there.
    pub expected_pixel_sigma: f64,
    /// What these pixels could show, a camera.
    pub noticeable: Vec<Noticeable>,
}

impl CameraMotion {
    /// Whether the changes, if there are any, leave no more than noise and fit make by themselves.
    #[must_use]
    pub fn is_explained(&self) -> bool {
        self.chance_of_rest >= RATE
    }
}

/// One change.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CameraChange {
    /// The camera, counted from 0. Others follow that the pixels do not tell from it, the likeliest first. All of them where
    /// they moved together against the given places, as they do where those are in another frame.
    pub cameras: Vec<usize>,
    /// The probability of each, given that something changed.
    pub confidence: Vec<f64>,
    /// Whether all cameras moved alike.
    pub together: bool,
    /// How it changed.
    pub change: Change,
    /// The turn about the camera's own axes (pitch about x, yaw about y, roll about z), a rotation vector in degrees; where all
    /// moved together, that of the given places about the axes of the world.
    pub turn: [f64; 3],
    /// Its standard deviations.
    pub turn_sigma: [f64; 3],
    /// How far the camera moved along its own axes (x right, y down, z forward); where all moved together, the middle of the
    /// given places along those of the world.
    pub shift: [f64; 3],
    /// Its standard deviations.
    pub shift_sigma: [f64; 3],
    /// The share by which the focal length changed.
    pub focal_length: f64,
    /// Its standard deviation.
    pub focal_length_sigma: f64,
}

/// The smallest motions of one camera alone that would be noticed in 19 of 20 cases.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Noticeable {
    /// Pitch, yaw and roll in degrees; infinite where no such turn can be seen.
    pub turn: [f64; 3],
    /// Shifts along x, y and z.
    pub shift: [f64; 3],
    /// The share by which the focal length changes.
    pub focal_length: f64,
}

/// Looks for motions of the cameras of `map` since it was fitted, by what they see in `data`. `axes` are the optical axes in
/// the world (unit vectors, one a camera) about which cameras roll; where they are not known they are taken to lead through
/// the middle of a camera's pixels. Covariances are taken for `widened` times what noise and fit make them: 1, or more for a
/// map whose errors at points held out are larger than it says.
///
/// # Errors
///
/// [`Error::Degenerate`] for maps that are no cameras, or do not know how uncertain they are, and where the cameras do not
/// see what they saw, or too few points; [`Error::Cancelled`].
pub fn camera_motion(
    (map, axes): (&dyn Reconstructor, &[Vector3]),
    data: &Dataset,
    widened: f64,
    progress: &dyn Progress,
) -> Result<CameraMotion> {
    let Scene { groups, mut places } = Scene::of(map, data);
    let mut rig = Rig { map, frames: frames((map, axes), data)?, middle: middle(data), groups };
    let given = rig.middle.is_some();
    if !given && rig.frames.len() == 1 {
        return Err(Error::Degenerate {
            problem: "one camera shows its motion only against points at known places".into(),
            hint: "give the places of the points, in the frame of the model".into(),
        });
    }
    let (whole, left_out) = all_free(&mut rig, &mut places, progress)?;
    let unknown = || degenerate("what these points tell of the cameras is not finite");
    let variance = variance(&rig, &whole).ok_or_else(unknown)?;
    let expected = expected_sigma(&rig);
    belonging(expected * variance.sqrt(), expected)?;
    let errors = map.fit_errors();
    let search =
        Search { rig: &rig, errors: errors.as_ref(), variance, widened, rate: RATE, progress };
    let still = solve(&rig, places.clone(), Vec::new(), progress)?;
    let judged = |solution: &Solution| solution.against(&search.noise(solution)?);
    let against = judged(&still).ok_or_else(unknown)?;
    let (found, choices) = search.run(still)?;
    let rest = judged(&found).ok_or_else(unknown)?;
    let noise = search.noise(&found).ok_or_else(unknown)?;
    let covariance = found.covariance(&noise).ok_or_else(unknown)?;
    let change = |choice: &Choice| change(&rig, &found, choice, &covariance);
    let known = match (given, places.iter().any(|place| matches!(place, Place::Board(_)))) {
        (true, _) => Known::Places,
        (false, true) => Known::Boards,
        (false, false) => Known::Matches,
    };
    let noise = search.noise(&whole).ok_or_else(unknown)?;
    let (power, rank) = whole.power(&noise).ok_or_else(unknown)?;
    Ok(CameraMotion {
        unit: data.unit.clone(),
        known,
        n: points(&rig, &places),
        left_out,
        chance: against.chance(),
        changes: choices.iter().map(change).collect(),
        chance_of_rest: rest.chance(),
        pixel_sigma: expected * variance.sqrt(),
        expected_pixel_sigma: expected,
        noticeable: power.chunks_exact(COLUMNS).map(|own| noticeable(own, rank)).collect(),
    })
}

fn degenerate(problem: &str) -> Error {
    Error::Degenerate {
        problem: problem.into(),
        hint: "record more points, over all of the pictures and at several distances".into(),
    }
}

/// Where the cameras stand.
fn frames(
    (map, axes): (&dyn Reconstructor, &[Vector3]),
    data: &Dataset,
) -> Result<Vec<CameraFrame>> {
    let frame = |camera: usize| {
        let pixels = data.correspondences.iter().filter_map(|row| *row.pixels.get(camera)?);
        let pixels: Vec<Pixel> = pixels.collect();
        CameraFrame::of(map, (camera, axes.get(camera).copied()), &pixels).ok_or_else(|| {
            degenerate(&format!("the pixels of camera {} do not tell where it stands", camera + 1))
        })
    };
    (0..map.cameras()).map(frame).collect()
}

/// The middle of the places given.
fn middle(data: &Dataset) -> Option<Point3> {
    let count = data.known().count();
    let sum: Vector3 = data.known().map(|(world, _)| world.coords).sum();
    (count > 0).then(|| Point3::from(sum / count as f64))
}

/// All columns that can be free together: where nothing is at a given place the first camera stays.
fn free(rig: &Rig<'_>, given: bool) -> Vec<usize> {
    let first = if given { 0 } else { ZOOM.start };
    (first..COLUMNS * rig.frames.len()).collect()
}

fn enough(rig: &Rig<'_>, given: bool) -> Result<()> {
    /// Equations a number of the cameras' motion, at least.
    const EACH: usize = 3;
    let own = |group: &rows::Group, per: usize| (2 * group.seen.len()).saturating_sub(per);
    let equations: usize =
        rig.groups.iter().map(|group| own(group, if given { 0 } else { 3 })).sum();
    let needed = EACH * free(rig, given).len();
    if equations >= needed {
        return Ok(());
    }
    Err(degenerate(&format!(
        "the pixels give {equations} equations, and motions of the cameras need {needed}"
    )))
}

/// The least reprojection error with all cameras free, without gross errors; how many pixels those were.
fn all_free(
    rig: &mut Rig<'_>,
    places: &mut Vec<Place>,
    progress: &dyn Progress,
) -> Result<(Solution, usize)> {
    /// Gross errors hide behind each other.
    const ROUNDS: usize = 10;
    let pixels = |rig: &Rig<'_>| rig.groups.iter().map(|group| group.seen.len()).sum::<usize>();
    let (given, before) = (rig.middle.is_some(), pixels(rig));
    let solved = |rig: &Rig<'_>, places: &[Place]| {
        enough(rig, given)?;
        solve(rig, places.to_vec(), free(rig, given), progress)
    };
    let mut whole = solved(rig, places)?;
    for _ in 0..ROUNDS {
        let outliers = scene::outliers(rig, &whole);
        if outliers.is_empty() {
            break;
        }
        scene::leave_out(rig, places, &outliers);
        whole = solved(rig, places)?;
    }
    Ok((whole, before - pixels(rig)))
}

/// Of the pixels about what all free cameras expect, in units of what the map expects.
fn variance(rig: &Rig<'_>, whole: &Solution) -> Option<f64> {
    let (squares, count) = whole.squares();
    let (_, rank) = whole.power(&whole.noise(rig, 1.0, None)?)?;
    Some((squares / count.saturating_sub(rank).max(1) as f64).max(f64::MIN_POSITIVE))
}

/// Standard deviation of a pixel coordinate by the map, root mean square.
fn expected_sigma(rig: &Rig<'_>) -> f64 {
    let sigmas = rig.groups.iter().flat_map(|group| group.seen.iter().map(|seen| seen.sigma));
    root_mean_square(&sigmas.collect::<Vec<_>>())
}

/// Refuses pixels that no motion brings together.
fn belonging(sigma: f64, expected: f64) -> Result<()> {
    /// Of the noise: matches of natural texture are not so bad.
    const MOST: f64 = 20.0;
    /// Pixels.
    const LEAST: f64 = 3.0;
    if sigma < LEAST.max(MOST * expected) {
        return Ok(());
    }
    Err(Error::Degenerate {
        problem: format!(
            "however the cameras moved, reprojection errors of {sigma:.1} px remain, where the model expects {expected:.2}"
        ),
        hint: "check that pixels of one row show one point, that they are of these cameras, and the size of the chart".into(),
    })
}

fn solve(
    rig: &Rig<'_>,
    places: Vec<Place>,
    columns: Vec<usize>,
    progress: &dyn Progress,
) -> Result<Solution> {
    Solution::of(rig, rig.still(places), columns, progress)?
        .ok_or_else(|| degenerate("the cameras of this model do not see these points"))
}

/// Points that were used: all that a group holds of a board, one of a match.
fn points(rig: &Rig<'_>, places: &[Place]) -> usize {
    let cameras = rig.frames.len();
    let of = |(group, place): (&rows::Group, &Place)| match place {
        Place::Board(_) => (0..cameras)
            .map(|camera| group.seen.iter().filter(|seen| seen.camera == camera).count())
            .max()
            .unwrap_or(0),
        _ => 1,
    };
    rig.groups.iter().zip(places).map(of).sum()
}

fn change(
    rig: &Rig<'_>,
    found: &Solution,
    choice: &Choice,
    covariance: &DMatrix<f64>,
) -> CameraChange {
    /// Less likely cameras are not named.
    const LEAST: f64 = 0.05;
    let cameras = rig.frames.len();
    let share = |camera: Option<usize>| -> f64 {
        let own = choice.shares.iter().filter(|(candidate, _)| candidate.camera == camera);
        own.map(|(_, share)| share).sum()
    };
    let mut named: Vec<(usize, f64)> = match choice.best.camera {
        None => (0..cameras).map(|camera| (camera, share(None))).collect(),
        Some(_) => (0..cameras).map(|camera| (camera, share(Some(camera)))).collect(),
    };
    if choice.best.camera.is_some() {
        named.retain(|(camera, share)| *share >= LEAST || Some(*camera) == choice.best.camera);
        named.sort_by(|a, b| b.1.total_cmp(&a.1));
    }
    let first = COLUMNS * choice.best.camera.unwrap_or(cameras);
    let [turn_x, turn_y, turn_z, x, y, z, zoom] = found.state.values(choice.best.camera);
    let sigma = |column: usize| {
        let place = found.columns.iter().position(|free| *free == first + column);
        place.map_or(0.0, |place| covariance[(place, place)].max(0.0).sqrt())
    };
    let three = |start: usize| [0, 1, 2].map(|axis| sigma(start + axis));
    CameraChange {
        cameras: named.iter().map(|(camera, _)| *camera).collect(),
        confidence: named.iter().map(|(_, share)| *share).collect(),
        together: choice.best.camera.is_none(),
        change: choice.best.change,
        turn: [turn_x, turn_y, turn_z].map(f64::to_degrees),
        turn_sigma: three(0).map(f64::to_degrees),
        shift: [x, y, z],
        shift_sigma: three(3),
        focal_length: zoom,
        focal_length_sigma: sigma(ZOOM.start),
    }
}

/// By the chi-square that a motion of one unit adds to as many directions, a column.
fn noticeable(power: &[f64], rank: usize) -> Noticeable {
    /// One in twenty is missed.
    const MISSED: f64 = 0.05;
    let limit = chi_square_upper_quantile(RATE, rank);
    let needed = noncentrality(limit, rank, MISSED);
    let least = |column: usize| {
        let power = power[column];
        if power > 0.0 { (needed / power).sqrt() } else { f64::INFINITY }
    };
    Noticeable {
        turn: [0, 1, 2].map(|axis| least(axis).to_degrees()),
        shift: [3, 4, 5].map(least),
        focal_length: least(ZOOM.start),
    }
}

/// How much a chi-square variable has to be displaced to stay below `limit` with this probability, by two moments (Patnaik
/// 1949, doi:10.1093/biomet/36.1-2.202).
fn noncentrality(limit: f64, freedom: usize, below: f64) -> f64 {
    let freedom = freedom as f64;
    let is_seen = |by: f64| {
        let scale = (freedom + 2.0 * by) / (freedom + by);
        let own = ((freedom + by) / scale).round() as usize;
        chi_square_beyond(limit / scale, own) >= 1.0 - below
    };
    let (mut low, mut high) = (0.0, 1.0);
    while !is_seen(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if is_seen(middle) { high = middle } else { low = middle }
    }
    high
}
