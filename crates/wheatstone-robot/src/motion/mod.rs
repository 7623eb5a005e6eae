//! Where the robot is, from nothing but the corners it observes: each is laid on the landmarks seen before,
//! and the pose under which most of them meet is the robot's.

mod registration;
mod heading;

use super::{
    Estimated, Ground, PlanarPose,
    seeing::{FloorDirection, SeenCorner},
    wrapped,
};
use heading::Heading;
use nalgebra::{Matrix2, Matrix3};
use registration::{
    Pair, amiss, count, distinct, nearest, on_ground, refined, through, turned, unsure,
};
use wheatstone_core::geometry::Point3;
use wheatstone_numeric::random::Random;
use wheatstone_reconstruction::features::{Look, likeness};

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
    believed: Estimated,
    /// Which way the floor's edges run, once it was seen.
    heading: Option<Heading>,
    /// What it was told to do since it last knew where it was.
    told: PlanarPose,
    looks: u64,
    /// What the wheels may have done otherwise since landmarks last told where it was.
    since: Matrix3<f64>,
    /// Whether the floor's direction counts before the landmarks.
    compass_first: bool,
    random: Random,
}

/// What a command may do otherwise than told, as shares of it, and what may happen without one: slip and
/// wheels that are not alike. In centimetres and radians.
const AMISS: f64 = 0.35;
const AMISS_AT_REST: [f64; 2] = [1.0, 0.02];

/// How unsure of its place (in centimetres) and its heading (in radians) a robot may be that goes by what
/// its wheels were told: a few steps, or half a turn on the spot before a bare wall.
const BLIND: [f64; 2] = [2.5, 0.3];

/// Beyond this a point's place is too uncertain to lay others on it, in centimetres.
const FARTHEST: f64 = 320.0;

/// Landmarks whose windows are less alike are not the same.
const LEAST_LIKENESS: f32 = 0.55;

/// Tiles' corners look alike: a corner may be any of the nearest few.
const RIVALS: usize = 6;

/// A heading less sure than this, in radians, is worth a search for landmarks of surer times; and so many
/// of them must agree.
const UNSURE: f64 = 0.025;
const CLOSING: usize = 6;

/// Much surer is a heading whose standard deviation is less than this share of another's: a sixth of its
/// variance.
const SURER: f64 = 0.4;

/// Pairs that must agree, at least, and as a share of all that could be laid; of fewer two thirds must.
const ENOUGH_PAIRS: usize = 5;
const LEAST_SHARE: f64 = 0.4;
const LEAST_PAIRS: usize = 2;

/// Landmarks that were seen once and not again for so many looks are forgotten.
const PATIENCE: u64 = 12;

impl OwnMotion {
    /// At the start frame's origin.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            landmarks: Vec::new(),
            believed: Estimated::default(),
            heading: None,
            told: PlanarPose::default(),
            looks: 0,
            since: Matrix3::zeros(),
            compass_first: false,
            random: Random::stream(seed, 0x6d6f_7469),
        }
    }

    /// Looks for landmarks from the heading that the floor's edges tell, where they tell one: few landmarks
    /// of a map that errs by centimetres agree on many headings.
    #[must_use]
    pub fn with_compass_first(self) -> Self {
        Self { compass_first: true, ..self }
    }

    /// Where the robot last found itself, and how surely.
    #[must_use]
    pub fn believed(&self) -> &Estimated {
        &self.believed
    }

    /// The landmarks.
    #[must_use]
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// Where the robot is after a command that was to move it by `told`, as the corners say and the floor's
    /// direction; `None` where they do not.
    pub fn update(
        &mut self,
        (corners, floor): (&[SeenCorner], Option<FloorDirection>),
        told: &PlanarPose,
    ) -> Option<Estimated> {
        self.looks += 1;
        self.told = self.told.then(told);
        let mut guess = self.believed.pose.then(&self.told);
        let compass = self.heading.filter(|_| self.compass_first).zip(floor);
        if let Some((heading, floor)) = compass {
            guess.heading = heading.nearest(guess.heading, &floor);
        }
        let found = if self.looks == 1 {
            Some((Estimated::default(), Vec::new()))
        } else {
            self.found(corners, &guess, compass.is_some())
        };
        if let Some((believed, pairs)) = found {
            self.believed = believed;
            (self.told, self.since) = (PlanarPose::default(), Matrix3::zeros());
            self.learn(corners, &pairs);
            self.close_loop(corners);
            self.steer(floor);
            return Some(self.believed);
        }
        // Without landmarks to go by the wheels are believed for a while: they cannot do much otherwise.
        // What is seen then is laid down where they say, so that the next look finds it again.
        let more = amiss(&self.told, guess.heading);
        let [place, heading] = unsure(&(self.since + more));
        if place > BLIND[0] || heading > BLIND[1] {
            return None;
        }
        self.since += more;
        self.believed = Estimated { pose: guess, covariance: self.believed.covariance + more };
        self.told = PlanarPose::default();
        self.learn(corners, &[]);
        self.steer(floor);
        Some(self.believed)
    }

    /// Lays the corners on landmarks of a time when the robot knew much better where it was: what it has seen
    /// since moves with it.
    fn close_loop(&mut self, corners: &[SeenCorner]) {
        let [place, heading] = unsure(&self.believed.covariance);
        if heading < UNSURE {
            return;
        }
        let (shift, turn) = (1.0 + 2.5 * place, 2.5 * heading);
        let (now, guess) = (self.believed, self.believed.pose);
        let mut pairs = self.laid(corners, &guess, (shift, turn));
        pairs.retain(|pair| is_surer(&self.landmarks[pair.landmark], &now));
        let doubt = self.believed.covariance;
        let Some((believed, kept)) = self.agreed(pairs, &guess, (shift, turn), &doubt) else {
            return;
        };
        if kept.len() < CLOSING {
            return;
        }
        self.move_to(believed);
    }

    /// Turns to where the floor's edges say that it looks.
    fn steer(&mut self, floor: Option<FloorDirection>) {
        let Some(floor) = floor else { return };
        let heading = self.heading.get_or_insert_with(|| Heading::new(&self.believed, &floor));
        if let Some(believed) = heading.corrected(&self.believed, &floor) {
            self.move_to(believed);
        }
    }

    /// Corrects the robot's pose, and with it the landmarks of the time since it was about as unsure.
    fn move_to(&mut self, believed: Estimated) {
        let from = self.believed;
        let back = |point: Point3| {
            let own = from.pose.inverse_transform(Ground::new(point.x, point.z));
            let moved = believed.pose.transform(own);
            Point3::new(moved.x, point.y, moved.y)
        };
        for landmark in &mut self.landmarks {
            if !is_surer(landmark, &from) {
                landmark.point = back(landmark.point);
                landmark.founded = believed.covariance;
            }
        }
        self.believed = believed;
    }

    /// Pose and agreeing pairs: by one narrow search, or a wider one. The heading of the guess may be known
    /// better than the command tells it.
    fn found(
        &mut self,
        corners: &[SeenCorner],
        guess: &PlanarPose,
        heading_known: bool,
    ) -> Option<(Estimated, Vec<Pair>)> {
        let turned = if heading_known { 0.0 } else { self.told.heading };
        let told = PlanarPose { heading: turned, ..self.told };
        let [place, heading] = unsure(&self.since);
        let doubt = self.since + amiss(&told, guess.heading);
        for widening in [1.0, 2.0] {
            let shift =
                (told.place().coords.norm() * AMISS + AMISS_AT_REST[0] + 2.0 * place) * widening;
            let turn = (told.heading.abs() * AMISS + AMISS_AT_REST[1] + 2.0 * heading) * widening;
            let pairs = self.laid(corners, guess, (shift, turn));
            if let Some(found) = self.agreed(pairs, guess, (shift, turn), &doubt) {
                return Some(found);
            }
        }
        // Where the command was not carried out at all.
        let near = (AMISS_AT_REST[0] + 2.0 * place, AMISS_AT_REST[1] + 2.0 * heading);
        let mut stay = self.believed.pose;
        if heading_known {
            stay.heading = guess.heading;
        }
        let pairs = self.laid(corners, &stay, near);
        self.agreed(pairs, &stay, near, &doubt)
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
        doubt: &Matrix3<f64>,
    ) -> Option<(Estimated, Vec<Pair>)> {
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
        Some((Estimated { pose, covariance }, kept))
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

/// Whether a landmark is of a time when the robot knew its heading much better than it does now.
fn is_surer(landmark: &Landmark, now: &Estimated) -> bool {
    unsure(&landmark.founded)[1] < SURER * unsure(&now.covariance)[1]
}
