//! What one look says of each cell: points and feet of obstacles, and floor that was seen.

use super::grid::{CELL, Grid};
use crate::{
    Estimated, Ground,
    scene::{Scene, ScenePoint, Stretch},
};
use nalgebra::{Matrix2, Matrix2x3, Vector2};

/// Log odds stay between these. Floor that was seen free becomes an obstacle by two looks that agree,
/// and the surest obstacle becomes free floor by six.
pub(super) const SUREST: [f32; 2] = [-2.4, 4.0];

/// Above this something stands there: more than one lone point tells.
pub(super) const OCCUPIED: f32 = 1.0;

/// What a look adds to a cell that enough points fall into.
const STANDS: f32 = 1.8;

/// What one point adds of that: two that agree are enough to take a cell for occupied, one is not.
const POINT: f32 = 0.45;

/// What the foot at the end of a stretch adds: the stretches lie closer than cells, and a foot that is
/// seen at all is seen in several.
const FOOT: f32 = 0.35;

/// What a look takes from a cell that was seen to be free.
const SEEN: f32 = -0.8;

/// Less than this share of an obstacle does not keep a cell from being seen free.
const TRACE: f32 = 0.15;

/// Where an ellipse is sampled along its axes, in standard deviations, and what each sample weighs: a
/// normal distribution's density, cut off where it has fallen to a third.
const SAMPLES: [(f64, f32); 5] =
    [(-1.5, 0.10), (-0.75, 0.23), (0.0, 0.34), (0.75, 0.23), (1.5, 0.10)];

/// A pose's uncertainty smears a point by no more than this standard deviation, in centimetres: what
/// counts is where things stand from the robot, and most of its error it shares with its map.
const MOST_SMEAR: f64 = 1.5;

/// A stretch that leads through what the map or the same look takes for an obstacle weakens what the
/// map holds, so deep, in centimetres, and tells nothing of what lies behind: a foot is missed more often
/// than an obstacle is invented. Else what is behind would count as seen, though the face were restored.
const THROUGH: f64 = 6.0;

/// Stretches whose directions differ by less than this have no unseen floor between, in radians: three
/// of the sectors that stretches stand for.
const NEIGHBOURS: f64 = 0.02;

/// What lower things would have hidden lies beyond this share of the way from the eye to the nearest
/// floor seen: an obstacle's least height over the eye's is a half; the rest covers that the way is
/// counted from the middle between the wheels instead of from the eye.
const SEEN_OVER: f64 = 0.6;

/// A scene of fewer stretches does not tell where sight begins: the nearest may be hidden.
const ENOUGH: usize = 20;

/// The evidence of one look.
#[derive(Clone, Debug, Default)]
pub(super) struct Look {
    /// How much of an obstacle falls into each cell.
    stands: Vec<f32>,
    /// Whether it was seen to be free.
    clear: Vec<bool>,
    /// The cells of which the look says anything.
    touched: Vec<usize>,
}

impl Look {
    pub(super) fn new(cells: usize) -> Self {
        Self { stands: vec![0.0; cells], clear: vec![false; cells], touched: Vec::new() }
    }

    /// Takes up everything that a scene says.
    pub(super) fn read(&mut self, map: (&Grid, &[f32]), scene: &Scene, believed: &Estimated) {
        for point in &scene.obstacles {
            self.point(map.0, believed, point, POINT);
        }
        for stretch in scene.clear.iter().filter(|stretch| stretch.blocked) {
            let along = (stretch.to - stretch.from)
                .try_normalize(1e-9)
                .unwrap_or_else(|| stretch.to.coords.normalize());
            let covariance = along * along.transpose() * stretch.sigma.powi(2);
            let foot = ScenePoint { place: stretch.to, covariance, height: 0.0 };
            self.point(map.0, believed, &foot, FOOT);
        }
        let stretches: Vec<Stretch> = scene.clear.iter().filter_map(within_sigma).collect();
        for (at, stretch) in stretches.iter().enumerate() {
            let next = stretches.get(at + 1).filter(|next| gap(stretch, next) < NEIGHBOURS);
            self.sweep(map, believed, (stretch, next.unwrap_or(stretch)));
        }
    }

    /// Adds the look to the map's log odds and forgets it.
    pub(super) fn tell(&mut self, odds: &mut [f32], weight: f32) {
        for index in self.touched.drain(..) {
            let stands = std::mem::take(&mut self.stands[index]);
            let clear = std::mem::take(&mut self.clear[index]);
            let change = if stands >= TRACE {
                STANDS * stands.min(1.0)
            } else if clear {
                SEEN
            } else {
                0.0
            };
            odds[index] = (odds[index] + weight * change).clamp(SUREST[0], SUREST[1]);
        }
    }

    /// Marks the floor between two neighbouring stretches, as far as both were seen.
    fn sweep(
        &mut self,
        (grid, odds): (&Grid, &[f32]),
        believed: &Estimated,
        (left, right): (&Stretch, &Stretch),
    ) {
        let ends = |stretch: &Stretch| {
            let direction = stretch.to - stretch.from;
            let length = direction.norm();
            let near = SEEN_OVER * stretch.from.coords.norm() - stretch.from.coords.norm();
            (stretch.from, direction / length, near, length)
        };
        let (from, along, near, far) = ends(left);
        let (other_from, other_along, other_near, other_far) = ends(right);
        let (near, far) = (near.max(other_near), far.min(other_far));
        let (mut at, mut wall) = (near, f64::INFINITY);
        while at <= far.min(wall + THROUGH) {
            let (here, there) = (from + along * at, other_from + other_along * at);
            let across = there - here;
            let parts = (across.norm() / (0.5 * CELL)).ceil().max(1.0) as usize;
            for part in 0..parts {
                let place = here + across * (part as f64 / parts as f64);
                if let Some(index) = grid.index_at(believed.pose.transform(place)) {
                    let stands = odds[index] > OCCUPIED || self.stands[index] >= TRACE;
                    wall = if stands { wall.min(at) } else { wall };
                    if stands || at < wall {
                        self.touched.push(index);
                        self.clear[index] = true;
                    }
                }
            }
            at += 0.5 * CELL;
        }
    }

    /// Spreads a point over its ellipse.
    fn point(&mut self, grid: &Grid, believed: &Estimated, point: &ScenePoint, weight: f32) {
        let axes = axes(&(turned(believed, &point.covariance) + smear(believed, point.place)));
        let centre = believed.pose.transform(point.place);
        // An axis much shorter than a cell need not be sampled.
        let short = if axes[1].norm() > 0.5 * CELL { &SAMPLES[..] } else { &[(0.0, 1.0)][..] };
        for (long, share) in SAMPLES {
            for (aside, part) in short {
                let place = centre + axes[0] * long + axes[1] * *aside;
                if let Some(index) = grid.index_at(place) {
                    self.touched.push(index);
                    self.stands[index] += weight * share * part;
                }
            }
        }
    }
}

/// From where on a scene shows floor, in centimetres from the robot's middle, as far as it shows enough
/// of it: what all but the nearest tenth of its stretches begin beyond, with what that tells of floor
/// yet nearer, and two cells for the raster.
pub(super) fn sight(scene: &Scene) -> Option<f64> {
    let mut begins: Vec<f64> = scene.clear.iter().map(|s| s.from.coords.norm()).collect();
    begins.sort_by(f64::total_cmp);
    (begins.len() >= ENOUGH).then(|| SEEN_OVER * begins[begins.len() / 10] + 2.0 * CELL)
}

/// A stretch as far as it is sure to reach, if that is any way at all.
fn within_sigma(stretch: &Stretch) -> Option<Stretch> {
    let short = if stretch.blocked { stretch.sigma + 0.5 * CELL } else { 0.0 };
    let direction = stretch.to - stretch.from;
    let length = direction.norm() - short;
    (length > 0.0)
        .then(|| Stretch { to: stretch.from + direction.normalize() * length, ..*stretch })
}

/// The angle between two stretches, in radians.
fn gap(one: &Stretch, other: &Stretch) -> f64 {
    let (one, other) = (one.to - one.from, other.to - other.from);
    libm::atan2(one.perp(&other).abs(), one.dot(&other))
}

/// A covariance in the robot's frame, in the start frame.
fn turned(believed: &Estimated, covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let (sine, cosine) = (libm::sin(believed.pose.heading), libm::cos(believed.pose.heading));
    let turn = Matrix2::new(cosine, sine, -sine, cosine);
    turn * covariance * turn.transpose()
}

/// The covariance that a place has from the pose's, bounded.
fn smear(believed: &Estimated, own: Ground) -> Matrix2<f64> {
    let arm = believed.pose.transform(own) - believed.pose.place();
    let by_pose = Matrix2x3::new(1.0, 0.0, arm.y, 0.0, 1.0, -arm.x);
    let covariance = by_pose * believed.covariance * by_pose.transpose();
    let most = MOST_SMEAR * MOST_SMEAR;
    covariance * (most / covariance.trace().max(most))
}

/// The half axes of the ellipse of one standard deviation, the longer first.
fn axes(covariance: &Matrix2<f64>) -> [Vector2<f64>; 2] {
    let (a, b, c) = (covariance.m11, covariance.m12, covariance.m22);
    let (mean, half) = (0.5 * (a + c), (0.25 * (a - c).powi(2) + b * b).sqrt());
    let (long, short) = ((mean + half).max(0.0).sqrt(), (mean - half).max(0.0).sqrt());
    let angle = 0.5 * libm::atan2(2.0 * b, a - c);
    let direction = Vector2::new(libm::cos(angle), libm::sin(angle));
    [direction * long, Vector2::new(-direction.y, direction.x) * short]
}
