//! What a camera on the robot observes of its world: rays against floor, walls, boxes, cylinders and a chart.

use super::{
    Footprint, Obstacle, World,
    surfaces::{Frame, Hit, Placed, on_board},
};
use crate::{Ground, PlanarPose};
use rayon::prelude::*;
use wheatstone_charts::{
    chart::AnyChart,
    imaging::{GrayImage, filter::gaussian_blur},
};
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Point3, Pose, Ray, Vector3},
};
use wheatstone_numeric::random::Random;
use wheatstone_synthetic::{Light, Sensor, exposed};

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
        // Rows of which one thread makes the light: corners between bands are met twice.
        const BAND: usize = 16;
        let view = self.view(world, pose, board);
        let (width, height) = (self.camera.width, self.camera.height);
        let mut light = vec![0.0; width * height];
        light
            .par_chunks_mut(BAND * width)
            .enumerate()
            .for_each(|(band, rows)| self.light_band(&view, band * BAND, rows));
        let sharp = GrayImage::from_fn(width, height, |x, y| light[y * width + x]);
        exposed(gaussian_blur(&sharp, self.sensor.blur), self.sensor, random)
    }

    /// The light in whole rows of pixels from `top` on.
    fn light_band(&self, view: &View, top: usize, rows: &mut [f32]) {
        let width = self.camera.width;
        let hits = |y: usize| -> Vec<Option<Hit>> {
            let rays = &self.rays[y * (width + 1)..][..=width];
            let hit = |(x, ray): (usize, &Option<Ray>)| {
                ray.map(|ray| view.hit(&ray, [x as f64 - 0.5, y as f64 - 0.5]))
            };
            rays.iter().enumerate().map(hit).collect()
        };
        let mut above = hits(top);
        for (row, y) in rows.chunks_mut(width).zip(top..) {
            let below = hits(y + 1);
            for (x, light) in row.iter_mut().enumerate() {
                let around = [above[x], above[x + 1], below[x], below[x + 1]];
                let returned = self.returned(view, [x, y], around);
                let lit = BLACK + (WHITE - BLACK) * returned;
                *light = (lit * self.light.at(x as f64, y as f64)) as f32;
            }
            above = below;
        }
    }

    fn view<'a>(&self, world: &'a World, pose: PlanarPose, board: Option<&Board<'a>>) -> View<'a> {
        let placed = world.obstacles.iter().enumerate().filter_map(|(number, obstacle)| {
            let own = obstacle.own(pose.place());
            let heading = pose.heading - obstacle.turn;
            let own_from_robot = PlanarPose { x: own.x, z: own.y, heading };
            let bounds = self.bounds(obstacle, &own_from_robot)?;
            let own_from_robot = Frame::new(own_from_robot);
            Some(Placed { obstacle, number: number as u32, own_from_robot, bounds })
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

    /// The part of the picture that an obstacle can be in: all of it where it is near or partly aside, none
    /// where it is behind or aside.
    fn bounds(&self, obstacle: &Obstacle, own_from_robot: &PlanarPose) -> Option<[f64; 4]> {
        // Straight edges bend by some pixels between their ends.
        const MARGIN: f64 = 15.0;
        // Twice the tangent of the field's half: beyond, a lens model may fold.
        const ASIDE: f64 = 0.9;
        const NEAR: f64 = 5.0;
        const ALL: [f64; 4] = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
        let corners = corners(obstacle, own_from_robot);
        let before = corners.map(|corner| self.camera.camera_from_world.transform(corner));
        let beyond = [
            |at: &Point3| at.z < 0.0,
            |at: &Point3| at.x < -ASIDE * at.z,
            |at: &Point3| at.x > ASIDE * at.z,
            |at: &Point3| at.y < -ASIDE * at.z,
            |at: &Point3| at.y > ASIDE * at.z,
        ];
        if beyond.iter().any(|side| before.iter().all(side)) {
            return None;
        }
        if before.iter().any(|at| at.z < NEAR || beyond[1..].iter().any(|side| side(at))) {
            return Some(ALL);
        }
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for corner in corners {
            let Some(at) = self.camera.project(corner) else { return Some(ALL) };
            bounds = [
                bounds[0].min(at.x - MARGIN),
                bounds[1].min(at.y - MARGIN),
                bounds[2].max(at.x + MARGIN),
                bounds[3].max(at.y + MARGIN),
            ];
        }
        Some(bounds)
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

/// The corners of the box about an obstacle, in the robot's frame.
fn corners(obstacle: &Obstacle, own_from_robot: &PlanarPose) -> [Point3; 8] {
    let half = match obstacle.footprint {
        Footprint::Box(half) => half,
        Footprint::Cylinder(radius) => [radius; 2],
    };
    [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
        let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let ground = Ground::new(sign(0) * half[0], sign(1) * half[1]);
        let ground = own_from_robot.inverse_transform(ground);
        let height = if corner < 4 { 0.0 } else { -obstacle.height };
        Point3::new(ground.x, height, ground.y)
    })
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
        if ahead.y > 0.0 {
            let distance = -start.y / ahead.y;
            let ground = start + ahead * distance;
            if ground.x > left && ground.x < right && ground.z > behind && ground.z < front {
                return self.tile(ground, distance);
            }
        }
        let mut hit = Hit { distance: f64::INFINITY, face: 0, shade: ABOVE };
        for (number, axis, walls) in [(0, 0, [left, right]), (2, 2, [behind, front])] {
            let onward = ahead[axis] > 0.0;
            let distance = (walls[usize::from(onward)] - start[axis]) / ahead[axis];
            if distance > 0.0 && distance < hit.distance {
                let along = start[2 - axis] + distance * ahead[2 - axis];
                let height = start.y + distance * ahead.y;
                hit = self.wall(number + u32::from(onward), along, height, distance);
            }
        }
        hit
    }

    fn wall(&self, number: u32, along: f64, height: f64, distance: f64) -> Hit {
        if -height > self.world.wall_height {
            return Hit { distance, face: 0, shade: ABOVE };
        }
        let (shades, wide) = self.world.panels;
        let panel = below(along / wide);
        let shade = shades[panel.rem_euclid(2) as usize];
        // Panels that do not touch may share a number.
        Hit { distance, face: 16 + 8 * number + panel.rem_euclid(8) as u32, shade }
    }

    fn tile(&self, ground: Point3, distance: f64) -> Hit {
        let tiles = &self.world.tiles;
        let own = self.tiles_from_start.ray(&Ray { origin: ground, direction: Vector3::zeros() });
        let row = below(own.origin.x / tiles.side);
        let column = below(own.origin.z / tiles.side);
        let parity = (row + column).rem_euclid(2) as usize;
        let face = 4 + (row.rem_euclid(2) + 2 * column.rem_euclid(2)) as u32;
        Hit { distance, face, shade: tiles.shades[parity] }
    }
}

/// The whole number below: without the call that `floor` costs on processors of old, for every ray.
fn below(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from((whole as f64) > value)
}
