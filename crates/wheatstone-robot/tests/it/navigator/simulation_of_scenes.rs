//! A robot in a world without pictures: from where it truly stands, what a pair of cameras would show,
//! with the noise, the gaps and the mistakes of matching; and wheels that slip.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use wheatstone_numeric::random::Random;
use wheatstone_robot::{
    Estimated, Ground, PlanarPose, Velocity,
    scene::{Scene, ScenePoint, Stretch, Trust},
    world::{Footprint, Obstacle, World},
};

/// The eye: so high, so far ahead of the wheels, in centimetres.
const EYE: [f64; 2] = [30.0, 6.0];

/// Half the horizontal field is 24 degrees: columns of four pixels each.
const COLUMNS: usize = 160;
const WIDEST: f64 = 0.4452;

/// The picture's lower and upper rim look so far down, as tangents: 20 degrees and 18.5 about it.
const STEEPEST: f64 = 0.795;
const FLATTEST: f64 = 0.026;

/// How wrong the pictures are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faults {
    /// Share of points that are somewhere along their ray.
    pub(super) wrong_points: f64,
    /// Share of columns whose stretch ends anywhere.
    pub(super) wrong_stretches: f64,
    /// Share of columns of which nothing is known.
    pub(super) missed_columns: f64,
    /// How often an obstacle's foot is not seen, so that stretches end before it.
    pub(super) missed_feet: f64,
    /// How often stretches run on to its upper edge.
    pub(super) overrun_feet: f64,
    /// Share of columns in which a foot or an upper edge shows a point.
    pub(super) edge_points: f64,
    /// Floor nearer than this ahead of the eye is not seen, nor farther than that, in centimetres.
    pub(super) floor: [f64; 2],
    /// Share of looks whose motion is not found.
    pub(super) lost: f64,
    /// Standard deviations that a step adds to where the robot believes itself: centimetres, radians.
    pub(super) drift: [f64; 2],
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            wrong_points: 0.01,
            wrong_stretches: 0.005,
            missed_columns: 0.05,
            missed_feet: 0.15,
            overrun_feet: 0.015,
            edge_points: 0.1,
            floor: [EYE[0] / STEEPEST, 320.0],
            lost: 0.005,
            drift: [0.1, 0.1_f64.to_radians()],
        }
    }
}

/// A simulated robot.
#[derive(Clone, Debug)]
pub(super) struct Simulated {
    pub(super) world: World,
    pub(super) truth: PlanarPose,
    pub(super) believed: Estimated,
    pub(super) faults: Faults,
    /// The least clearance that it ever had, in centimetres.
    pub(super) least: f64,
    random: Random,
    /// The wheels' lasting error, as shares of forward and turn.
    bias: [f64; 2],
}

/// What a ray along the floor meets: which obstacle and face, where it enters and leaves, how high.
#[derive(Clone, Copy, Debug)]
struct Hit {
    body: usize,
    face: usize,
    enter: f64,
    exit: f64,
    height: f64,
}

impl Simulated {
    pub(super) fn new(world: World, faults: Faults) -> Self {
        let mut random = Random::stream(world.seed, 0x5ce_0e5);
        let bias = [0.05 * random.normal(), 0.05 * random.normal()];
        Self {
            world,
            truth: PlanarPose::default(),
            believed: Estimated::default(),
            faults,
            least: f64::INFINITY,
            random,
            bias,
        }
    }

    /// Drives, and moves the belief along with its drift.
    pub(super) fn drive(&mut self, velocity: Velocity, period: f64) {
        for bias in &mut self.bias {
            *bias = (*bias + 0.005 * self.random.normal()).clamp(-0.08, 0.08);
        }
        // Wheels slip in one step of twelve.
        let grip = if self.random.below(12) == 0 { self.random.uniform(0.6, 1.0) } else { 1.0 };
        let noisy = |bias: f64, random: &mut Random| (1.0 + bias + 0.1 * random.normal()) * grip;
        let done = Velocity {
            forward: velocity.forward * noisy(self.bias[0], &mut self.random),
            turn: velocity.turn * noisy(self.bias[1], &mut self.random),
        };
        for part in 0..=8 {
            let place = self.truth.then(&done.motion(period * f64::from(part) / 8.0)).place();
            self.least = self.least.min(self.world.clearance(place));
        }
        let motion = done.motion(period);
        self.truth = self.truth.then(&motion);
        self.believe(motion);
    }

    fn believe(&mut self, motion: PlanarPose) {
        let [along, turn] = self.faults.drift;
        let seen = PlanarPose {
            x: motion.x + along * self.random.normal(),
            z: motion.z + along * self.random.normal(),
            heading: motion.heading + turn * self.random.normal(),
        };
        let old = self.believed.pose;
        let new = old.then(&seen);
        let step = new.place() - old.place();
        let carried = Matrix3::new(1.0, 0.0, step.y, 0.0, 1.0, -step.x, 0.0, 0.0, 1.0);
        let noise = Vector3::new(along * along, along * along, turn * turn);
        let covariance = carried * self.believed.covariance * carried.transpose()
            + Matrix3::from_diagonal(&noise);
        self.believed = Estimated { pose: new, covariance };
    }

    /// What is seen, and where the robot believes itself to be.
    pub(super) fn look(&mut self) -> (Scene, Option<Estimated>) {
        let lost = self.random.uniform(0.0, 1.0) < self.faults.lost;
        let rays: Vec<Vec<Hit>> = (0..COLUMNS).map(|column| self.hits(column)).collect();
        let clear = self.stretches(&rays);
        let obstacles = self.points(&rays);
        let poor = obstacles.len() < 15 && clear.len() < 20;
        let trust = if poor { Trust::Poor } else { Trust::Sound };
        (Scene { obstacles, clear, trust }, (!lost).then_some(self.believed))
    }

    fn chance(&mut self, share: f64) -> bool {
        self.random.uniform(0.0, 1.0) < share
    }

    /// Everything along a column's ray, nearest first; distances from the eye along the floor.
    fn hits(&self, column: usize) -> Vec<Hit> {
        let eye = self.truth.transform(Ground::new(0.0, EYE[1]));
        let direction = self.truth.transform(Ground::origin() + direction(column))
            - self.truth.transform(Ground::origin());
        let mut hits: Vec<Hit> = self
            .world
            .obstacles
            .iter()
            .enumerate()
            .filter_map(|(body, obstacle)| {
                let (enter, exit, face) = crossing(obstacle, eye, direction)?;
                Some(Hit { body, face, enter, exit, height: obstacle.height })
            })
            .collect();
        let [left, right, behind, ahead] = self.world.walls;
        let to = |wall: f64, from: f64, along: f64| (wall - from) / along;
        let (x, z) = if direction.x > 0.0 { (right, 1) } else { (left, 0) };
        let across = (to(x, eye.x, direction.x), z);
        let (z, face) = if direction.y > 0.0 { (ahead, 3) } else { (behind, 2) };
        let along = (to(z, eye.y, direction.y), face);
        let (enter, wall) = if across.0 < along.0 { across } else { along };
        let aside = eye + direction * enter;
        let along_wall = if wall < 2 { aside.y } else { aside.x };
        let panel = along_wall / self.world.panels.1;
        let face = 100 + panel.floor() as i64 as usize % 1000;
        let height = self.world.wall_height;
        hits.push(Hit { body: 1000 + wall, face, enter, exit: f64::INFINITY, height });
        hits.sort_by(|one, other| one.enter.total_cmp(&other.enter));
        hits
    }

    fn stretches(&mut self, rays: &[Vec<Hit>]) -> Vec<Stretch> {
        // What of each obstacle is seen in this look.
        let feet: Vec<f64> = (0..1004).map(|_| self.random.uniform(0.0, 1.0)).collect();
        let short = self.random.uniform(2.0, 25.0);
        let mut stretches = Vec::new();
        for (column, hits) in rays.iter().enumerate() {
            let slant = direction_slant(column);
            let near = self.faults.floor[0] * slant;
            let hidden = hits.iter().any(|hit| {
                hit.enter < near
                    && (hit.exit.min(near) == near || hit.height > EYE[0] * (1.0 - hit.exit / near))
            });
            if hidden || self.chance(self.faults.missed_columns) {
                continue;
            }
            let Some(hit) = hits.iter().find(|hit| hit.enter >= near) else {
                continue;
            };
            let sigma = depth_sigma(hit.enter / slant) * slant;
            let draw = feet[hit.body];
            let mut end = hit.enter + sigma * self.random.normal();
            let mut blocked = true;
            if draw < self.faults.missed_feet {
                (end, blocked) = (end - short, false);
            } else if draw > 1.0 - self.faults.overrun_feet && hit.height < 29.0 {
                let over = (hit.exit * EYE[0] / (EYE[0] - hit.height)).min(400.0);
                (end, blocked) = (over, false);
            }
            if self.chance(self.faults.wrong_stretches) {
                (end, blocked) = (self.random.uniform(near, 300.0), self.chance(0.5));
            }
            if end > self.faults.floor[1] {
                (end, blocked) = (self.faults.floor[1], false);
            }
            if end > near + 1.0 {
                let at = |distance: f64| Ground::new(0.0, EYE[1]) + direction(column) * distance;
                stretches.push(Stretch {
                    from: at(near),
                    to: at(end),
                    sigma: sigma + 0.2,
                    blocked,
                });
            }
        }
        stretches
    }

    fn points(&mut self, rays: &[Vec<Hit>]) -> Vec<ScenePoint> {
        let mut points = Vec::new();
        for column in 0..COLUMNS {
            let hit = rays[column][0];
            let other = rays[(column + 1).min(COLUMNS - 1)][0];
            let before = rays[column.saturating_sub(1)][0];
            let edge = |next: Hit| {
                (next.body != hit.body && next.enter > hit.enter)
                    || (next.body == hit.body && next.face != hit.face)
            };
            if edge(other) || edge(before) {
                let count = (hit.height / 2.0) as usize;
                for level in 0..=count {
                    self.point(&mut points, column, hit.enter, level as f64 * 2.0);
                }
            }
            for height in [0.0, hit.height] {
                if self.chance(self.faults.edge_points) {
                    self.point(&mut points, column, hit.enter, height);
                }
            }
        }
        points
    }

    fn point(&mut self, points: &mut Vec<ScenePoint>, column: usize, at: f64, height: f64) {
        let slant = direction_slant(column);
        let depth = at / slant;
        let steep = (EYE[0] - height) / depth;
        if !(FLATTEST..=STEEPEST).contains(&steep) {
            return;
        }
        let (mut distance, mut sigma) = (at, depth_sigma(depth) * slant);
        if self.chance(self.faults.wrong_points) {
            distance = self.random.uniform(20.0, 300.0);
            sigma = depth_sigma(distance) * slant;
        }
        distance += sigma * self.random.normal();
        let along = direction(column);
        let aside = Vector2::new(along.y, -along.x);
        let place = Ground::new(0.0, EYE[1])
            + along * distance
            + aside * (0.0006 * distance * self.random.normal());
        let covariance = along * along.transpose() * (sigma * sigma)
            + aside * aside.transpose() * (0.0006 * distance).powi(2);
        points.push(ScenePoint { place, covariance: symmetric(covariance), height });
    }
}

fn symmetric(matrix: Matrix2<f64>) -> Matrix2<f64> {
    0.5 * (matrix + matrix.transpose())
}

/// Standard deviation of depth: 0.3 pixels of disparity.
fn depth_sigma(depth: f64) -> f64 {
    depth * depth / 4865.0 * 0.3
}

/// The direction of a column's ray along the floor, in the robot's frame, of length one.
fn direction(column: usize) -> Vector2<f64> {
    let across = WIDEST * ((column as f64 + 0.5) / COLUMNS as f64 * 2.0 - 1.0);
    Vector2::new(across, 1.0).normalize()
}

/// How much longer a ray is than its depth.
fn direction_slant(column: usize) -> f64 {
    1.0 / direction(column).y
}

/// Where a ray enters and leaves an obstacle, and by which face.
fn crossing(
    obstacle: &Obstacle,
    eye: Ground,
    direction: Vector2<f64>,
) -> Option<(f64, f64, usize)> {
    let origin = obstacle.own(eye);
    let along = obstacle.own(eye + direction) - origin;
    match obstacle.footprint {
        Footprint::Cylinder(radius) => {
            let half = along.dot(&origin.coords);
            let root = half * half - origin.coords.norm_squared() + radius * radius;
            (root > 0.0 && -half > root.sqrt())
                .then(|| (-half - root.sqrt(), -half + root.sqrt(), 0))
        }
        Footprint::Box(half) => {
            let slab = |from: f64, step: f64, half: f64| {
                let (one, other) = ((-half - from) / step, (half - from) / step);
                (one.min(other), one.max(other))
            };
            let (x, z) = (slab(origin.x, along.x, half[0]), slab(origin.y, along.y, half[1]));
            let (enter, exit) = (x.0.max(z.0), x.1.min(z.1));
            (enter < exit && enter > 0.0).then(|| (enter, exit, usize::from(x.0 > z.0)))
        }
    }
}
