//! Whether the pictures still agree with the calibration: a camera that was knocked or covered is
//! noticed by what both see of the same corners, and by where the floor seems to be.

use super::{EpipolarCurves, SeenCorner};
use crate::{Ground, scene::Trust};
use std::fmt;
use wheatstone_core::{Calibration, geometry::Point3};
use wheatstone_numeric::statistics::{median, percentile};
use wheatstone_reconstruction::features::CornerMatch;

/// What is wrong with a pair of pictures.
#[derive(Clone, Debug, PartialEq)]
pub enum HealthWarning {
    /// A camera, counted from 1, shows nothing.
    Blind {
        /// Which.
        camera: usize,
    },
    /// Corners are not where the calibration's curves lead.
    Moved {
        /// How far beside them, in pixels.
        aside: f64,
    },
    /// The floor is not where it was.
    Tilted {
        /// How high it seems a metre off, in centimetres.
        height: f64,
    },
    /// Next to nothing is seen by both cameras.
    Unmatched {
        /// Corners that are.
        matched: usize,
    },
}

impl fmt::Display for HealthWarning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Blind { camera } => write!(f, "camera {camera} shows nothing"),
            Self::Moved { aside } => {
                write!(f, "matched corners are {aside:.1} px off their epipolar curves")
            }
            Self::Tilted { height } => {
                write!(f, "the floor at 1 m appears {height:.1} cm off its height")
            }
            Self::Unmatched { matched } => write!(f, "only {matched} corners are seen by both"),
        }
    }
}

/// What was seen in a pair of pictures.
pub(super) struct Observed<'a> {
    /// Corners in each picture.
    pub(super) corners: [usize; 2],
    /// Edges in each picture.
    pub(super) edges: [usize; 2],
    /// Mean grey of each picture.
    pub(super) greys: [f64; 2],
    pub(super) matched: &'a [SeenCorner],
    /// Places on edges, as far as both cameras saw them.
    pub(super) placed: &'a [Point3],
}

/// What is remembered of the pictures that agreed.
pub struct Health {
    /// Root mean square distance of the chart's points from their curves, in pixels.
    own_error: f64,
    /// Shares of corners that were found in the other picture.
    shares: Vec<f64>,
    /// Heights of the floor, by its slope aside, ahead and its level a metre off.
    floors: Vec<[f64; 3]>,
    /// How far what places the floor errs at the chart's points, in centimetres: so uneven the floor may seem.
    uneven: f64,
    /// Mean greys of the two pictures.
    greys: Vec<[f64; 2]>,
}

/// Pictures that are remembered: those of a calibration that holds scatter about their median.
const REMEMBERED: usize = 30;

/// Pictures from which on they say what is usual.
const ENOUGH: usize = 3;

/// Edges without which a picture shows nothing: a bare floor of tiles has thousands.
const LEAST_EDGES: usize = 60;

impl Health {
    /// What the chart's own points tell of a calibration; `uneven` is how far what places the floor errs at
    /// them, in centimetres.
    #[must_use]
    pub fn new(calibration: &Calibration, epipolar_curves: &EpipolarCurves, uneven: f64) -> Self {
        let mut squares = Vec::new();
        for row in &calibration.data.restored().correspondences {
            let [Some(first), Some(second)] = row.pixels[..] else { continue };
            squares.extend(epipolar_curves.curve(first).seen().aside(second).map(|off| off * off));
        }
        let own_error = percentile(&squares, 0.68).max(0.0).sqrt();
        let own_error = if own_error.is_finite() { own_error } else { 0.0 };
        Self { own_error, shares: Vec::new(), floors: Vec::new(), uneven, greys: Vec::new() }
    }

    /// How far from their curves the chart's points were, in pixels.
    #[must_use]
    pub fn own_error(&self) -> f64 {
        self.own_error
    }

    /// Whether a pair of pictures can be trusted; `look_aside` matches corners so far beside their
    /// curves.
    pub(super) fn judge(
        &mut self,
        seen: &Observed,
        look_aside: &dyn Fn(f64) -> Vec<CornerMatch>,
    ) -> (Trust, Option<HealthWarning>) {
        if let Some(camera) = (0..2).find(|camera| seen.edges[*camera] < LEAST_EDGES) {
            // A plain wall close by empties a picture; a covered lens darkens it too.
            let usual = median(&self.greys.iter().map(|grey| grey[camera]).collect::<Vec<f64>>());
            let dark = seen.greys[camera] < if self.greys.is_empty() { DARK } else { usual / 3.0 };
            let trust = if dark { Trust::Broken } else { Trust::Poor };
            return (trust, Some(HealthWarning::Blind { camera: camera + 1 }));
        }
        remember(&mut self.greys, seen.greys);
        if let Some(complaint) = self.aside(seen).or_else(|| self.tilt(seen)) {
            return (Trust::Broken, Some(complaint));
        }
        let matched = seen.matched.len();
        let share = matched as f64 / seen.corners[0].max(1) as f64;
        let usual = if self.shares.len() < ENOUGH { USUAL_SHARE } else { median(&self.shares) };
        if share < FEW * usual
            && seen.corners[0] > LEAST_CORNERS
            && let Some(aside) = moved(&look_aside(WIDE), (self.limit(), matched))
        {
            return (Trust::Broken, Some(HealthWarning::Moved { aside }));
        }
        if matched < LEAST_TO_GO_BY {
            return (Trust::Poor, Some(HealthWarning::Unmatched { matched }));
        }
        remember(&mut self.shares, share);
        (Trust::Sound, None)
    }

    /// How far corners may lie from their curves, in pixels: what a knock of a tenth of a degree makes,
    /// and three times what the chart's own points do.
    fn limit(&self) -> f64 {
        SLIGHT + 3.0 * self.own_error
    }

    /// Corners that were found, but all beside their curves.
    fn aside(&self, seen: &Observed) -> Option<HealthWarning> {
        if seen.matched.len() < LEAST_MATCHED {
            return None;
        }
        let off: Vec<f64> = seen.matched.iter().map(|corner| corner.matched.aside.abs()).collect();
        let aside = median(&off);
        (aside > self.limit()).then_some(HealthWarning::Moved { aside })
    }

    /// A floor that is not where it was in the pictures before.
    fn tilt(&mut self, seen: &Observed) -> Option<HealthWarning> {
        let floor = floor(seen.placed)?;
        if self.floors.len() >= ENOUGH {
            let usual = [0, 1, 2].map(|term| {
                median(&self.floors.iter().map(|floor| floor[term]).collect::<Vec<f64>>())
            });
            let height = floor[2] - usual[2];
            let slope = (floor[0] - usual[0]).abs().max((floor[1] - usual[1]).abs());
            let most = HEIGHT + self.uneven;
            if height.abs() > most || slope > SLOPE * most / HEIGHT {
                let at_a_metre = if height.abs() > most { height } else { 100.0 * slope };
                return Some(HealthWarning::Tilted { height: at_a_metre });
            }
        }
        remember(&mut self.floors, floor);
        None
    }
}

/// A tenth of a degree, in pixels of the robot's cameras.
const SLIGHT: f64 = 0.8;

/// The share of corners that are found in the other picture before it is known what is usual: of tiles and
/// boxes at least so many.
const USUAL_SHARE: f64 = 0.35;

/// Fewer than this share of what is usual may be a camera's turn: they are sought aside of their curves.
const FEW: f64 = 0.55;

/// Of fewer corners than these a share says nothing.
const LEAST_CORNERS: usize = 12;

/// A picture in which nothing is lit, in grey levels of 255.
const DARK: f64 = 12.0;

/// Corners fewer than these say nothing of the calibration.
const LEAST_MATCHED: usize = 8;

/// And fewer than these nothing of where the robot is.
const LEAST_TO_GO_BY: usize = 4;

/// How much farther aside corners lie for every pixel along the picture, at most: a turn of three degrees
/// about the optical axis.
const STEEPEST: f64 = 0.05;

/// How far beside the curves corners are sought that were not found near them: a knock of two degrees.
const WIDE: f64 = 25.0;

/// The floor a metre off is known to some millimetres; a degree moves it by 1.7 cm and more.
const HEIGHT: f64 = 1.2;

/// And so is its slope.
const SLOPE: f64 = 0.012;

fn remember<T>(known: &mut Vec<T>, new: T) {
    known.push(new);
    if known.len() > REMEMBERED {
        known.remove(0);
    }
}

/// How far beside their curves corners lie, where many more are found too far from them than the
/// `near` ones that are not, and agree on how a camera would have been turned: to first order that shifts
/// corners aside by an amount that grows straight along the curve's normal as the picture turns.
fn moved(matches: &[CornerMatch], (limit, near): (f64, usize)) -> Option<f64> {
    const AGREE: f64 = 1.2;
    let all: Vec<[f64; 2]> = matches.iter().map(|corner| [corner.lever(), corner.aside]).collect();
    let mut best: Vec<f64> = Vec::new();
    for (index, first) in all.iter().enumerate() {
        for second in &all[index + 1..] {
            let slope = (second[1] - first[1]) / (second[0] - first[0]);
            // A camera that was knocked turned by few degrees.
            if slope.abs() > STEEPEST {
                continue;
            }
            let line = |lever: f64| first[1] + slope * (lever - first[0]);
            let agreeing: Vec<f64> = all
                .iter()
                .filter(|[lever, aside]| (aside - line(*lever)).abs() < AGREE)
                .map(|[_, aside]| aside.abs())
                .collect();
            if agreeing.len() > best.len() {
                best = agreeing;
            }
        }
    }
    let off = best.iter().filter(|aside| **aside > limit).count();
    let enough = off >= LEAST_MATCHED.max(2 * near) && 2 * best.len() >= all.len();
    enough.then(|| median(&best))
}

/// The floor's slopes aside and ahead and its height a metre ahead, by least squares in which weights fall
/// with the square of a large residual, so that what stands on it counts next to nothing; `None` where
/// little of it is seen.
fn floor(places: &[Point3]) -> Option<[f64; 3]> {
    // Farther off, heights are less sure than what is asked of them.
    const REACH: f64 = 200.0;
    // Edges of a tile or two.
    const LEAST: usize = 60;
    // After so many the plane moves by less than its own error.
    const ROUNDS: usize = 6;
    // One and a half medians are a standard deviation; less than half a millimetre is a fault of scale.
    const SCALE: (f64, f64) = (1.5, 0.05);
    // Less floor than this, aside or ahead, tells no slope.
    const SPREAD: f64 = 40.0;
    // What is taken for the floor in the first place: all that is as low as the lowest obstacle's half.
    const LOW: f64 = 7.0;
    let points: Vec<[f64; 3]> = places
        .iter()
        .map(|point| [point.x, point.z - 100.0, -point.y])
        .filter(|[x, z, height]| {
            Ground::new(*x, z + 100.0).coords.norm() < REACH && height.abs() < LOW
        })
        .collect();
    let mut plane = nalgebra::Vector3::new(0.0, 0.0, 0.0);
    if points.len() < LEAST {
        return None;
    }
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
        let residual =
            |[x, z, height]: &[f64; 3]| height - plane.dot(&nalgebra::Vector3::new(*x, *z, 1.0));
        let sizes: Vec<f64> = points.iter().map(|point| residual(point).abs()).collect();
        let scale = (SCALE.0 * median(&sizes)).max(SCALE.1);
        for (point, size) in points.iter().zip(&sizes) {
            let weight = (scale / size.max(scale)).powi(2);
            let row = nalgebra::Vector3::new(point[0], point[1], 1.0);
            normal += row * row.transpose() * weight;
            right += row * (point[2] * weight);
        }
        plane = normal.try_inverse()? * right;
    }
    // Of a floor seen in one place the slopes are not known.
    let spread = |axis: usize| {
        let values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        percentile(&values, 0.9) - percentile(&values, 0.1)
    };
    (spread(0) > SPREAD && spread(1) > SPREAD).then_some(plane.into())
}
