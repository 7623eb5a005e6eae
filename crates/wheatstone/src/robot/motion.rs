//! Where the robot is, from nothing but the corners it sees: each is laid on the landmarks seen before,
//! and the pose under which most of them meet is the robot's.

use super::{
    Believed, Ground, PlanarPose,
    seeing::{Look, SeenCorner, likeness},
    wrapped,
};
use crate::{geometry::Point3, numeric::random::Random};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// A corner of something that stands still, in the start frame.
#[derive(Clone, Debug)]
pub struct Landmark {
    /// Where it is, in centimetres.
    pub point: Point3,
    /// The covariance of its place on the ground by what was measured, in square centimetres.
    covariance: Matrix2<f64>,
    /// How sure the robot was of its own pose when it first saw it.
    founded: Matrix3<f64>,
    /// What it looked like when it was last seen.
    look: Look,
    /// When it was last seen, in looks.
    last: u64,
    /// How often.
    times: u32,
}

/// Keeps the landmarks, and the pose.
#[derive(Clone, Debug)]
pub struct OwnMotion {
    landmarks: Vec<Landmark>,
    believed: Believed,
    /// What it was told to do since it last knew where it was.
    told: PlanarPose,
    looks: u64,
    /// What the wheels may have done otherwise since landmarks last told where it was.
    since: Matrix3<f64>,
    random: Random,
}

/// A corner and the landmark that it is laid on, both on the ground.
struct Pair {
    landmark: usize,
    corner: usize,
    own: Ground,
    world: Ground,
    own_covariance: Matrix2<f64>,
    world_covariance: Matrix2<f64>,
}

/// What a command may do otherwise than told, as shares of it, and what may happen without one: slip and
/// wheels that are not alike. In centimetres and radians.
const AMISS: f64 = 0.35;
const AMISS_AT_REST: [f64; 2] = [1.0, 0.02];

/// Standard deviation of what wheels do otherwise than told, likewise.
const USUALLY_AMISS: f64 = 0.15;
const USUALLY_AMISS_AT_REST: [f64; 2] = [0.1, 0.004];

/// How unsure of its place (in centimetres) and its heading (in radians) a robot may be that goes by what
/// its wheels were told: a few steps, or half a turn on the spot before a bare wall.
const BLIND: [f64; 2] = [2.5, 0.3];

/// Beyond this a point's place is too uncertain to lay others on it, in centimetres.
const FARTHEST: f64 = 320.0;

/// Landmarks whose windows are less alike are not the same.
const LEAST_LIKENESS: f32 = 0.55;

/// Tiles' corners look alike: a corner may be any of the nearest few.
const RIVALS: usize = 6;

/// Pairs that must agree, at least, and as a share of all that could be laid; of fewer two thirds must.
const ENOUGH_PAIRS: usize = 5;
const LEAST_SHARE: f64 = 0.4;
const LEAST_PAIRS: usize = 2;

/// A squared distance that pairs of the same point exceed once in a hundred: chi-square of two.
const SAME: f64 = 9.2;

/// What places err by beside what their covariances say: windows of corners that are no points, in
/// square centimetres.
const ROUGHNESS: f64 = 0.02;

/// Landmarks that were seen once and not again for so many looks are forgotten.
const PATIENCE: u64 = 12;

impl OwnMotion {
    /// At the start frame's origin.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            landmarks: Vec::new(),
            believed: Believed::default(),
            told: PlanarPose::default(),
            looks: 0,
            since: Matrix3::zeros(),
            random: Random::stream(seed, 0x6d6f_7469),
        }
    }

    /// The landmarks.
    #[must_use]
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// Where the robot is after a command that was to move it by `told`, as the corners say; `None` where
    /// they do not.
    pub fn update(&mut self, corners: &[SeenCorner], told: &PlanarPose) -> Option<Believed> {
        self.looks += 1;
        self.told = self.told.then(told);
        let guess = self.believed.pose.then(&self.told);
        let found = if self.looks == 1 {
            Some((Believed::default(), Vec::new()))
        } else {
            let told = self.told;
            self.found(corners, &guess, &told)
        };
        if let Some((believed, pairs)) = found {
            self.believed = believed;
            (self.told, self.since) = (PlanarPose::default(), Matrix3::zeros());
            self.learn(corners, &pairs);
            return Some(believed);
        }
        // Without landmarks to go by the wheels are believed for a while: they cannot do much otherwise.
        // What is seen then is laid down where they say, so that the next look finds it again.
        let more = amiss(&self.told, guess.heading);
        let [place, heading] = unsure(&(self.since + more));
        if place > BLIND[0] || heading > BLIND[1] {
            return None;
        }
        self.since += more;
        self.believed = Believed { pose: guess, covariance: self.believed.covariance + more };
        self.told = PlanarPose::default();
        self.learn(corners, &[]);
        Some(self.believed)
    }

    /// Pose and agreeing pairs: by one narrow search, or a wider one.
    fn found(
        &mut self,
        corners: &[SeenCorner],
        guess: &PlanarPose,
        told: &PlanarPose,
    ) -> Option<(Believed, Vec<Pair>)> {
        let [place, heading] = unsure(&self.since);
        for widening in [1.0, 2.0] {
            let shift = (told.place().coords.norm() * AMISS + AMISS_AT_REST[0] + 2.0 * place) * widening;
            let turn = (told.heading.abs() * AMISS + AMISS_AT_REST[1] + 2.0 * heading) * widening;
            let pairs = self.laid(corners, guess, (shift, turn));
            if let Some(found) = self.agreed(pairs, guess, (shift, turn)) {
                return Some(found);
            }
        }
        // Where the command was not carried out at all.
        let near = (AMISS_AT_REST[0] + 2.0 * place, AMISS_AT_REST[1] + 2.0 * heading);
        let stay = self.believed.pose;
        let pairs = self.laid(corners, &stay, near);
        self.agreed(pairs, &stay, near)
    }

    /// Corners on the landmarks that they may be.
    fn laid(
        &self,
        corners: &[SeenCorner],
        guess: &PlanarPose,
        (shift, turn): (f64, f64),
    ) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (index, corner) in corners.iter().enumerate() {
            let own = Ground::new(corner.point.x, corner.point.z);
            if own.coords.norm() > FARTHEST {
                continue;
            }
            let at = guess.transform(own);
            let own_covariance = on_ground(&corner.covariance);
            let reach = shift + turn * own.coords.norm();
            let mut near: Vec<(f64, usize)> = self
                .landmarks
                .iter()
                .enumerate()
                .filter_map(|(number, landmark)| {
                    let sigma = (own_covariance + landmark.covariance).trace().sqrt();
                    let off = (Ground::new(landmark.point.x, landmark.point.z) - at).norm();
                    let height = (landmark.point.y - corner.point.y).abs();
                    let possible = off < reach + 3.0 * sigma
                        && height < 1.5 + 0.5 * sigma
                        && likeness(&landmark.look, &corner.matched.look) > LEAST_LIKENESS;
                    possible.then_some((off, number))
                })
                .collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs.extend(near.into_iter().take(RIVALS).map(|(_, landmark)| {
                let known = &self.landmarks[landmark];
                Pair {
                    landmark,
                    corner: index,
                    own,
                    world: Ground::new(known.point.x, known.point.z),
                    own_covariance,
                    world_covariance: known.covariance,
                }
            }));
        }
        pairs
    }

    /// The pose under which most pairs meet (Fischler & Bolles 1981, doi:10.1145/358669.358692), refined
    /// over these.
    fn agreed(
        &mut self,
        pairs: Vec<Pair>,
        guess: &PlanarPose,
        (shift, turn): (f64, f64),
    ) -> Option<(Believed, Vec<Pair>)> {
        const DRAWS: usize = 250;
        let total = distinct(&pairs);
        if total < LEAST_PAIRS {
            return None;
        }
        let possible = |pose: &PlanarPose| {
            (pose.place() - guess.place()).norm() < 2.0 * shift + 1.0
                && wrapped(pose.heading - guess.heading).abs() < 2.0 * turn
        };
        let mut best = (count(&pairs, guess), *guess);
        for _ in 0..DRAWS {
            let (a, b) = (self.random.below(pairs.len()), self.random.below(pairs.len()));
            let Some(pose) = through(&pairs[a], &pairs[b]) else { continue };
            let agreeing = if possible(&pose) { count(&pairs, &pose) } else { 0 };
            if agreeing > best.0 {
                best = (agreeing, pose);
            }
        }
        let mut pose = best.1;
        let mut covariance = Matrix3::zeros();
        let doubt = self.since + amiss(&self.told, guess.heading);
        let prior = (*guess, doubt.try_inverse()?);
        for _ in 0..5 {
            (pose, covariance) = refined(&pairs, &pose, &prior)?;
        }
        let kept = nearest(pairs, &pose);
        let most = kept.len() as f64 >= LEAST_SHARE * total as f64;
        let enough = if kept.len() >= ENOUGH_PAIRS { most } else { 3 * kept.len() >= 2 * total };
        if !enough || !possible(&pose) {
            return None;
        }
        // What the landmarks share of the robot's own doubt when it first saw them.
        let founded: Matrix3<f64> =
            kept.iter().map(|pair| self.landmarks[pair.landmark].founded).sum();
        let covariance = covariance + founded / kept.len() as f64;
        Some((Believed { pose, covariance }, kept))
    }

    /// Moves landmarks to where all looks at them say, and founds new ones.
    fn learn(&mut self, corners: &[SeenCorner], pairs: &[Pair]) {
        let pose = self.believed.pose;
        let mut used = vec![false; corners.len()];
        for pair in pairs {
            used[pair.corner] = true;
            let (seen, corner) = (pose.transform(pair.own), &corners[pair.corner]);
            let spread = turned(&pair.own_covariance, pose.heading);
            let landmark = &mut self.landmarks[pair.landmark];
            landmark.last = self.looks;
            landmark.times += 1;
            landmark.look = corner.matched.look;
            let sum = spread + landmark.covariance;
            let Some(inverse) = sum.try_inverse() else { continue };
            let gain = landmark.covariance * inverse;
            let by = gain * (seen - pair.world);
            landmark.point.x += by.x;
            landmark.point.z += by.y;
            landmark.covariance -= gain * landmark.covariance;
        }
        for (corner, used) in corners.iter().zip(used) {
            let own = Ground::new(corner.point.x, corner.point.z);
            let point = pose.transform_point(corner.point);
            let taken = self.landmarks.iter().any(|known| (known.point - point).norm() < 1.5);
            if used || taken || own.coords.norm() > FARTHEST {
                continue;
            }
            self.landmarks.push(Landmark {
                point,
                covariance: turned(&on_ground(&corner.covariance), pose.heading),
                founded: self.believed.covariance,
                look: corner.matched.look,
                last: self.looks,
                times: 1,
            });
        }
        let now = self.looks;
        self.landmarks.retain(|known| known.times > 1 || now - known.last < PATIENCE);
    }
}

/// Standard deviations of a place on the ground and of a heading.
fn unsure(covariance: &Matrix3<f64>) -> [f64; 2] {
    [(covariance[(0, 0)] + covariance[(1, 1)]).sqrt(), covariance[(2, 2)].sqrt()]
}

/// The covariance of where a command leads, on the ground and in heading.
fn amiss(told: &PlanarPose, heading: f64) -> Matrix3<f64> {
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

fn on_ground(covariance: &Matrix3<f64>) -> Matrix2<f64> {
    Matrix2::new(covariance[(0, 0)], covariance[(0, 2)], covariance[(2, 0)], covariance[(2, 2)])
        + Matrix2::identity() * ROUGHNESS
}

/// A covariance on the ground, in the frame in which its own frame has this heading.
fn turned(covariance: &Matrix2<f64>, heading: f64) -> Matrix2<f64> {
    let (sine, cosine) = (libm::sin(heading), libm::cos(heading));
    let rotation = Matrix2::new(cosine, sine, -sine, cosine);
    rotation * covariance * rotation.transpose()
}

/// The pose that brings two pairs together, as far as their lengths allow.
fn through(first: &Pair, second: &Pair) -> Option<PlanarPose> {
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
fn distance2(pair: &Pair, pose: &PlanarPose) -> f64 {
    let off = pose.transform(pair.own) - pair.world;
    let spread = turned(&pair.own_covariance, pose.heading) + pair.world_covariance;
    spread.try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
}

/// How many corners meet a landmark under a pose. Pairs stand in the order of corners.
fn count(pairs: &[Pair], pose: &PlanarPose) -> usize {
    pairs
        .chunk_by(|a, b| a.corner == b.corner)
        .filter(|rivals| rivals.iter().any(|pair| distance2(pair, pose) < SAME))
        .count()
}

/// Corners that have any pair.
fn distinct(pairs: &[Pair]) -> usize {
    pairs.chunk_by(|a, b| a.corner == b.corner).count()
}

/// Of each corner the pair that meets best under a pose, if it meets.
fn nearest(pairs: Vec<Pair>, pose: &PlanarPose) -> Vec<Pair> {
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
fn refined(
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
