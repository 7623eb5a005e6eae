//! What a camera on the robot sees of its world: rays against floor, walls, boxes, cylinders and a chart.

use super::{
    Footprint, Obstacle, World,
    surfaces::{Frame, Hit, Placed, on_board},
};
use crate::{
    camera::PosedCamera,
    chart::AnyChart,
    geometry::{Pixel, Point3, Pose, Ray, Vector3},
    imaging::{GrayImage, filter::gaussian_blur},
    numeric::random::Random,
    robot::{Ground, PlanarPose},
    synthetic::{Light, Sensor, exposed},
};
use rayon::prelude::*;

/// Grey levels of black and of white in full light, as of printed charts.
const BLACK: f64 = 30.0;
const WHITE: f64 = 195.0;

/// What is seen over the walls.
const ABOVE: f64 = 0.5;

/// A camera on the robot, with the ray of every pixel's corner in the robot's frame.
pub struct Eye {
    /// The camera; its world is the robot's frame.
    camera: PosedCamera,
    sensor: Sensor,
    light: Light,
    /// Row by row, one more than there are pixels.
    rays: Vec<Option<Ray>>,
}

/// A chart before the robot.
pub struct Board<'a> {
    /// What is printed on it.
    pub chart: &'a AnyChart,
    /// Where it stands.
    pub robot_from_chart: Pose,
}

/// A face with a picture on it.
const PRINTED: u32 = u32::MAX;

/// The world from where the robot stands.
struct View<'a> {
    world: &'a World,
    start_from_robot: Frame,
    tiles_from_start: Frame,
    obstacles: Vec<Placed<'a>>,
    board: Option<(&'a AnyChart, Pose)>,
}

impl Eye {
    /// A camera that stands so in the robot's frame. `random` draws how the room is lit.
    #[must_use]
    pub fn new(camera: PosedCamera, sensor: Sensor, random: &mut Random) -> Self {
        let light = Light::new(camera.width, camera.height, sensor, random);
        Self::lit(camera, sensor, light)
    }

    /// The same eye with its camera elsewhere.
    #[must_use]
    pub fn moved(&self, camera: PosedCamera) -> Self {
        Self::lit(camera, self.sensor, self.light.clone())
    }

    fn lit(camera: PosedCamera, sensor: Sensor, light: Light) -> Self {
        let width = camera.width + 1;
        let ray = |index: usize| {
            let corner = [index % width, index / width].map(|corner| corner as f64 - 0.5);
            camera.ray(Pixel::from(corner))
        };
        let count = width * (camera.height + 1);
        let rays = (0..count).into_par_iter().map(ray).collect();
        Self { camera, sensor, light, rays }
    }

    /// Takes a picture of the world, from a robot that stands there.
    #[must_use]
    pub fn look(
        &self,
        world: &World,
        pose: PlanarPose,
        board: Option<&Board>,
        random: &mut Random,
    ) -> GrayImage {
        let view = self.view(world, pose, board);
        let (width, height) = (self.camera.width, self.camera.height);
        let corners: Vec<Vec<Option<Hit>>> = (0..=height)
            .into_par_iter()
            .map(|y| {
                let row = &self.rays[y * (width + 1)..][..=width];
                let hit = |(x, ray): (usize, &Option<Ray>)| {
                    ray.map(|ray| view.hit(&ray, [x as f64 - 0.5, y as f64 - 0.5]))
                };
                row.iter().enumerate().map(hit).collect()
            })
            .collect();
        let rows: Vec<Vec<f32>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let value = |x: usize| {
                    let around = [
                        corners[y][x],
                        corners[y][x + 1],
                        corners[y + 1][x],
                        corners[y + 1][x + 1],
                    ];
                    let returned = self.returned(&view, [x, y], around);
                    let lit = BLACK + (WHITE - BLACK) * returned;
                    (lit * self.light.at(x as f64, y as f64)) as f32
                };
                (0..width).map(value).collect()
            })
            .collect();
        let sharp = GrayImage::from_fn(width, height, |x, y| rows[y][x]);
        exposed(gaussian_blur(&sharp, self.sensor.blur), self.sensor, random)
    }

    fn view<'a>(&self, world: &'a World, pose: PlanarPose, board: Option<&Board<'a>>) -> View<'a> {
        let placed = world.obstacles.iter().enumerate().map(|(number, obstacle)| {
            let own = obstacle.own(pose.place());
            let heading = pose.heading - obstacle.turn;
            let own_from_robot = PlanarPose { x: own.x, z: own.y, heading };
            let bounds = self.bounds(obstacle, &own_from_robot);
            let own_from_robot = Frame::new(own_from_robot);
            Placed { obstacle, number: number as u32, own_from_robot, bounds }
        });
        let board = board.map(|board| (board.chart, board.robot_from_chart.inverse()));
        let tiles = &world.tiles;
        let tiles_in_start =
            PlanarPose { x: tiles.corner[0], z: tiles.corner[1], heading: tiles.turn };
        let tiles_from_start = Frame::new(tiles_in_start.motion_to(&PlanarPose::default()));
        View {
            world,
            start_from_robot: Frame::new(pose),
            tiles_from_start,
            obstacles: placed.collect(),
            board,
        }
    }

    /// The part of the picture that an obstacle can be in; all of it where it is near or aside.
    fn bounds(&self, obstacle: &Obstacle, own_from_robot: &PlanarPose) -> [f64; 4] {
        // Straight edges bend by some pixels between their ends.
        const MARGIN: f64 = 15.0;
        const ALL: [f64; 4] = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
        let half = match obstacle.footprint {
            Footprint::Box(half) => half,
            Footprint::Cylinder(radius) => [radius; 2],
        };
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for corner in 0..8 {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let ground = Ground::new(sign(0) * half[0], sign(1) * half[1]);
            let ground = own_from_robot.inverse_transform(ground);
            let height = if corner < 4 { 0.0 } else { -obstacle.height };
            let point = Point3::new(ground.x, height, ground.y);
            let before = self.camera.camera_from_world.transform(point);
            // Beyond twice the field of view a lens model may fold.
            if before.z < 5.0 || before.x.abs() > 0.9 * before.z || before.y.abs() > 0.9 * before.z
            {
                return ALL;
            }
            let Some(at) = self.camera.project(point) else { return ALL };
            bounds = [
                bounds[0].min(at.x - MARGIN),
                bounds[1].min(at.y - MARGIN),
                bounds[2].max(at.x + MARGIN),
                bounds[3].max(at.y + MARGIN),
            ];
        }
        bounds
    }

    /// How much light a pixel gets, 0 to 1: plain where its corners show one face, averaged where they
    /// do not.
    fn returned(&self, view: &View, [x, y]: [usize; 2], around: [Option<Hit>; 4]) -> f64 {
        // Edges between plain faces are placed to an eighth of a pixel at worst, and noise rounds that;
        // a chart averages over each sample by itself.
        const PLAIN: usize = 4;
        const ON_CHART: usize = 2;
        let [Some(first), Some(second), Some(third), Some(fourth)] = around else { return 0.0 };
        let plain = [second, third, fourth].iter().all(|hit| hit.face == first.face);
        if plain && first.face != PRINTED {
            return first.shade;
        }
        let width = self.camera.width + 1;
        let ray = |dx: usize, dy: usize| self.rays[(y + dy) * width + x + dx];
        let (Some(a), Some(b), Some(c), Some(d)) = (ray(0, 0), ray(1, 0), ray(0, 1), ray(1, 1))
        else {
            return first.shade;
        };
        let samples = if plain { ON_CHART } else { PLAIN };
        let mut sum = 0.0;
        for sample in 0..samples * samples {
            let share = |index: usize| (index as f64 + 0.5) / samples as f64;
            let (u, v) = (share(sample % samples), share(sample / samples));
            let mix = |a: Vector3, b: Vector3, c: Vector3, d: Vector3| {
                (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
            };
            let origin = mix(a.origin.coords, b.origin.coords, c.origin.coords, d.origin.coords);
            let direction = mix(a.direction, b.direction, c.direction, d.direction);
            let ray = Ray { origin: Point3::from(origin), direction };
            let hit = view.hit(&ray, [x as f64 - 0.5 + u, y as f64 - 0.5 + v]);
            sum += if hit.face == PRINTED {
                // A sample's share of the pixel, as wide as it is on the chart.
                view.printed(&ray, (b.direction - a.direction).norm() / samples as f64)
            } else {
                hit.shade
            };
        }
        sum / (samples * samples) as f64
    }
}

impl View<'_> {
    /// What a ray that starts at this place of the picture meets.
    fn hit(&self, ray: &Ray, [x, y]: [f64; 2]) -> Hit {
        let mut nearest = self.room(ray);
        for placed in &self.obstacles {
            let [left, top, right, bottom] = placed.bounds;
            if x < left || x > right || y < top || y > bottom {
                continue;
            }
            if let Some(hit) = placed.hit(ray)
                && hit.distance < nearest.distance
            {
                nearest = hit;
            }
        }
        if let Some((chart, chart_from_robot)) = &self.board
            && let Some((distance, place)) = on_board(ray, chart_from_robot)
        {
            let [left, top, right, bottom] = chart.board();
            let on = place[0] >= left && place[0] <= right && place[1] >= top && place[1] <= bottom;
            if on && distance < nearest.distance {
                nearest = Hit { distance, face: PRINTED, shade: 1.0 };
            }
        }
        nearest
    }

    /// How much light the chart returns along a ray whose sample is so wide at unit distance.
    fn printed(&self, ray: &Ray, width: f64) -> f64 {
        let Some((chart, chart_from_robot)) = &self.board else { return 1.0 };
        let Some((distance, place)) = on_board(ray, chart_from_robot) else { return 1.0 };
        let size = distance * ray.direction.norm() * width;
        chart.reflectance(place, [size, size]).unwrap_or(1.0)
    }

    /// Floor and walls.
    fn room(&self, ray: &Ray) -> Hit {
        let Ray { origin: start, direction: ahead } = self.start_from_robot.ray(ray);
        let [left, right, behind, front] = self.world.walls;
        let mut hit = Hit { distance: f64::INFINITY, face: 0, shade: ABOVE };
        let walls = [(0, left, -1.0), (0, right, 1.0), (2, behind, -1.0), (2, front, 1.0)];
        for (number, (axis, at, side)) in walls.into_iter().enumerate() {
            let distance = (at - start[axis]) / ahead[axis];
            if ahead[axis] * side > 0.0 && distance > 0.0 && distance < hit.distance {
                let along = start[2 - axis] + distance * ahead[2 - axis];
                hit = self.wall(number as u32, along, start.y + distance * ahead.y, distance);
            }
        }
        let distance = -start.y / ahead.y;
        if ahead.y > 0.0 && distance < hit.distance {
            hit = self.tile(start + ahead * distance, distance);
        }
        hit
    }

    fn wall(&self, number: u32, along: f64, height: f64, distance: f64) -> Hit {
        if -height > self.world.wall_height {
            return Hit { distance, face: 0, shade: ABOVE };
        }
        let (shades, wide) = self.world.panels;
        let panel = (along / wide).floor() as i64;
        let shade = shades[panel.rem_euclid(2) as usize];
        // Panels that do not touch may share a number.
        Hit { distance, face: 16 + 8 * number + panel.rem_euclid(8) as u32, shade }
    }

    fn tile(&self, ground: Point3, distance: f64) -> Hit {
        let tiles = &self.world.tiles;
        let own = self.tiles_from_start.ray(&Ray { origin: ground, direction: Vector3::zeros() });
        let row = (own.origin.x / tiles.side).floor() as i64;
        let column = (own.origin.z / tiles.side).floor() as i64;
        let parity = (row + column).rem_euclid(2) as usize;
        let face = 4 + (row.rem_euclid(2) + 2 * column.rem_euclid(2)) as u32;
        Hit { distance, face, shade: tiles.shades[parity] }
    }
}
