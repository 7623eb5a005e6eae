//! Corners laid on landmarks: the pose under which pairs of them meet, and how surely.

use crate::{Ground, PlanarPose, wrapped};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// A corner and the landmark that it is laid on, both on the ground.
pub(super) struct Pair {
    pub(super) landmark: usize,
    pub(super) corner: usize,
    pub(super) own: Ground,
    pub(super) world: Ground,
    pub(super) own_covariance: Matrix2<f64>,
    pub(super) world_covariance: Matrix2<f64>,
}

/// A squared distance that pairs of the same point exceed once in a hundred: chi-square of two.
const SAME: f64 = 9.2;

/// What places err by beside what their covariances say: windows of corners that are no points, in
/// square centimetres.
const ROUGHNESS: f64 = 0.02;

/// Standard deviation of what wheels do otherwise than told, likewise.
const USUALLY_AMISS: f64 = 0.15;
const USUALLY_AMISS_AT_REST: [f64; 2] = [0.1, 0.004];

/// Standard deviations of a place on the ground and of a heading.
pub(super) fn unsure(covariance: &Matrix3<f64>) -> [f64; 2] {
    [(covariance[(0, 0)] + covariance[(1, 1)]).sqrt(), covariance[(2, 2)].sqrt()]
}

/// The covariance of where a command leads, on the ground and in heading.
pub(super) fn amiss(told: &PlanarPose, heading: f64) -> Matrix3<f64> {
    let distance = USUALLY_AMISS * told.place().coords.norm() + USUALLY_AMISS_AT_REST[0];
    let turn = USUALLY_AMISS * told.heading.abs() + USUALLY_AMISS_AT_REST[1];
    // Aside it goes only as far as its heading errs over the way.
    let aside = turn * told.place().coords.norm() + USUALLY_AMISS_AT_REST[0];
    let own = Matrix2::new(aside * aside, 0.0, 0.0, distance * distance);
    let place = turned(&own, heading);
    let mut covariance = Matrix3::zeros();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&place);
    covariance[(2, 2)] = turn * turn;
    covariance
}

pub(super) fn on_ground(covariance: &Matrix3<f64>) -> Matrix2<f64> {
    Matrix2::new(covariance[(0, 0)], covariance[(0, 2)], covariance[(2, 0)], covariance[(2, 2)])
        + Matrix2::identity() * ROUGHNESS
}

/// A covariance on the ground, in the frame in which its own frame has this heading.
pub(super) fn turned(covariance: &Matrix2<f64>, heading: f64) -> Matrix2<f64> {
    let (sine, cosine) = (libm::sin(heading), libm::cos(heading));
    let rotation = Matrix2::new(cosine, sine, -sine, cosine);
    rotation * covariance * rotation.transpose()
}

/// The pose that brings two pairs together, as far as their lengths allow.
pub(super) fn through(first: &Pair, second: &Pair) -> Option<PlanarPose> {
    let (own, world) = (second.own - first.own, second.world - first.world);
    // Points close together tell no direction.
    if own.norm() < 15.0 || (own.norm() - world.norm()).abs() > 0.1 * own.norm() {
        return None;
    }
    let heading = libm::atan2(world.x, world.y) - libm::atan2(own.x, own.y);
    let turned = PlanarPose { x: 0.0, z: 0.0, heading };
    let middle = (first.own.coords + second.own.coords) / 2.0;
    let at = turned.transform(middle.into());
    let to = (first.world.coords + second.world.coords) / 2.0;
    Some(PlanarPose { x: to.x - at.x, z: to.y - at.y, heading: wrapped(heading) })
}

/// The squared Mahalanobis distance of a pair under a pose.
pub(super) fn distance2(pair: &Pair, pose: &PlanarPose) -> f64 {
    let off = pose.transform(pair.own) - pair.world;
    let spread = turned(&pair.own_covariance, pose.heading) + pair.world_covariance;
    spread.try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
}

/// How many corners meet a landmark under a pose. Pairs stand in the order of corners.
pub(super) fn count(pairs: &[Pair], pose: &PlanarPose) -> usize {
    pairs
        .chunk_by(|a, b| a.corner == b.corner)
        .filter(|rivals| rivals.iter().any(|pair| distance2(pair, pose) < SAME))
        .count()
}

/// Corners that have any pair.
pub(super) fn distinct(pairs: &[Pair]) -> usize {
    pairs.chunk_by(|a, b| a.corner == b.corner).count()
}

/// Of each corner the pair that meets best under a pose, if it meets.
pub(super) fn nearest(pairs: Vec<Pair>, pose: &PlanarPose) -> Vec<Pair> {
    let mut kept: Vec<Pair> = Vec::new();
    for pair in pairs {
        let distance = distance2(&pair, pose);
        if distance >= SAME {
            continue;
        }
        match kept.last_mut() {
            Some(last) if last.corner == pair.corner => {
                if distance < distance2(last, pose) {
                    *last = pair;
                }
            }
            _ => kept.push(pair),
        }
    }
    kept
}

/// One step of weighted least squares over the pairs that agree; far ones count little (Huber).
pub(super) fn refined(
    pairs: &[Pair],
    pose: &PlanarPose,
    (guess, information): &(PlanarPose, Matrix3<f64>),
) -> Option<(PlanarPose, Matrix3<f64>)> {
    // Wheels that slip do far otherwise: what they were told counts little then.
    let heading = wrapped(guess.heading - pose.heading);
    let off = Vector3::new(guess.x - pose.x, guess.z - pose.z, heading);
    let share = 1.5 / off.dot(&(information * off)).max(0.0).sqrt().max(1.5);
    let (mut normal, mut right) = (information * share, information * off * share);
    for pair in pairs {
        let distance2 = distance2(pair, pose);
        if distance2 > 2.0 * SAME {
            continue;
        }
        let spread = turned(&pair.own_covariance, pose.heading) + pair.world_covariance;
        // One and a half standard deviations.
        let weight = spread.try_inverse()? * (1.5 / distance2.sqrt().max(1.5));
        let at = pose.transform(pair.own);
        let off: Vector2<f64> = pair.world - at;
        // A turn to the right moves what lies ahead to the right, and what lies right back.
        let arm = at - pose.place();
        let slopes = Matrix2x3::new(1.0, 0.0, arm.y, 0.0, 1.0, -arm.x);
        normal += slopes.transpose() * weight * slopes;
        right += slopes.transpose() * weight * off;
    }
    let covariance = normal.try_inverse()?;
    let by = covariance * right;
    let moved =
        PlanarPose { x: pose.x + by.x, z: pose.z + by.y, heading: wrapped(pose.heading + by.z) };
    Some((moved, covariance))
}
