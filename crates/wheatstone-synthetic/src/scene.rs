//! Textured scenes with exact depth, to judge dense reconstruction by: a slanted wall, a wavy floor, two
//! ellipsoids, a ball and a box before any rig.

mod picture;
mod surface;
mod texture;

use super::Rig;
use nalgebra::Matrix3;
use rayon::prelude::*;
use surface::{Block, Ellipsoid, Floor, Line, Surface, Wall};
use texture::Texture;
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Point3, Pose, Ray, Vector3},
};
use wheatstone_numeric::random::Random;

/// Bodies with a texture, in the world of a [`Rig`]: centimetres, x right, y down, z away from the
/// cameras.
#[derive(Clone, Debug)]
pub struct Scene {
    /// How much wider and higher the scene is in the world than in its own frame; z is the same.
    stretch: f64,
    bodies: Vec<Body>,
    texture: Texture,
    /// Left, top, right and bottom of the part of the wall that has no texture, in the scene's frame.
    blank: Option<[f64; 4]>,
}

#[derive(Clone, Debug)]
struct Body {
    surface: Surface,
    /// Mean share of the light that it returns.
    brightness: f64,
}

/// What a ray meets.
#[derive(Clone, Copy)]
struct Hit {
    /// Along the ray, in lengths of its direction.
    distance: f64,
    /// Index of the body.
    body: usize,
}

/// Chart pitch of the rig that the scene's own frame is made for, in centimetres: that of most rigs.
const PITCH: f64 = 5.0;

/// Standard deviation of the reflectance where the texture has its full contrast.
const CONTRAST: f64 = 0.2;

/// Share of the light that comes from everywhere; the rest comes from one side.
const AMBIENT: f64 = 0.75;

/// Where the rest comes from, in the world: above, left, and behind the cameras.
const LIGHT: [f64; 3] = [-0.45, -0.65, -0.6];

/// The part of the wall that is left blank: right and above, where nothing stands before it.
const BLANK: [f64; 4] = [20.0, -34.0, 42.0, -14.0];

impl Scene {
    /// Nothing of a scene is nearer or farther than this, as z in centimetres: within the distances of
    /// the charts of [`super::Stage::default`].
    pub const RANGE: [f64; 2] = [55.0, 135.0];

    /// The scene of a seed before a rig: as wide as the rig sees, with detail down to about four pixels
    /// in the middle of its range.
    #[must_use]
    pub fn before(rig: &Rig, seed: u64) -> Self {
        let mut random = Random::stream(seed, SCENE_STREAM);
        let surfaces = surfaces(&mut random);
        let body = |surface: Surface| Body { surface, brightness: random.uniform(0.5, 0.7) };
        let bodies = surfaces.into_iter().map(body).collect();
        let texture = Texture::new(pixel_width(rig), &mut random);
        Self { stretch: rig.chart_pitch() / PITCH, bodies, texture, blank: None }
    }

    /// The same scene with a part of the wall, in the upper right, of one brightness: where nothing can
    /// be matched.
    #[must_use]
    pub fn with_blank_patch(self) -> Self {
        Self { blank: Some(BLANK), ..self }
    }

    /// The place that a pixel shows, in the world; `None` where the camera sees nothing there.
    #[must_use]
    pub fn place(&self, camera: &PosedCamera, pixel: Pixel) -> Option<Point3> {
        let ray = camera.ray(pixel)?;
        self.hit(&ray).map(|hit| ray.at(hit.distance))
    }

    /// The places that the centres of all pixels show, in the world, row by row; NaN where the camera
    /// sees nothing.
    #[must_use]
    pub fn places(&self, camera: &PosedCamera) -> Vec<[f64; 3]> {
        let place = |index: usize| {
            let pixel = [index % camera.width, index / camera.width].map(|number| number as f64);
            self.place(camera, Pixel::from(pixel)).map_or([f64::NAN; 3], |place| place.into())
        };
        (0..camera.width * camera.height).into_par_iter().map(place).collect()
    }

    /// Whether a place of the wall, in the world, belongs to the blank patch.
    #[must_use]
    pub fn is_blank(&self, place: Point3) -> bool {
        let own = self.own(place.coords);
        let inside = |[left, top, right, bottom]: [f64; 4]| {
            own.x >= left && own.x <= right && own.y >= top && own.y <= bottom
        };
        let on_wall = |body: &Body| match &body.surface {
            Surface::Wall(wall) => (wall.depth(own.x, own.y) - own.z).abs() < 1e-6,
            _ => false,
        };
        self.blank.is_some_and(inside) && self.bodies.iter().any(on_wall)
    }

    /// World to the scene's own frame, of directions and of places (the origins are one).
    fn own(&self, world: Vector3) -> Vector3 {
        Vector3::new(world.x / self.stretch, world.y / self.stretch, world.z)
    }

    /// The first body that a ray meets, whatever the length of its direction.
    fn hit(&self, ray: &Ray) -> Option<Hit> {
        let origin = Point3::from(self.own(ray.origin.coords));
        let line = Line { origin, direction: self.own(ray.direction) };
        let hits = self.bodies.iter().enumerate().filter_map(|(body, Body { surface, .. })| {
            Some(Hit { distance: surface.meets(&line)?, body })
        });
        hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The share of the light that returns to the eye along a ray, 0 to 1; the same for all cameras that
    /// see a place. Nothing returns none.
    fn returned(&self, ray: &Ray) -> f64 {
        let Some(hit) = self.hit(ray) else { return 0.0 };
        let body = &self.bodies[hit.body];
        let place = ray.at(hit.distance);
        let own = self.own(place.coords);
        let normal = self.own(body.surface.normal(Point3::from(own))).normalize();
        let outward = if normal.dot(&ray.direction) > 0.0 { -normal } else { normal };
        let lit = outward.dot(&Vector3::from(LIGHT).normalize()).max(0.0);
        let texture = if self.is_blank(place) { 0.0 } else { self.texture.at(place) };
        let reflectance = (body.brightness + CONTRAST * texture).clamp(0.0, 1.0);
        reflectance * (AMBIENT + (1.0 - AMBIENT) * lit)
    }
}

/// The random stream that scenes are drawn from: pictures of charts have the first ones.
pub(super) const SCENE_STREAM: u64 = 1 << 32;

/// Width of a pixel of the first camera in the middle of the range, in centimetres.
fn pixel_width(rig: &Rig) -> f64 {
    let middle = Point3::new(0.0, 0.0, (Scene::RANGE[0] + Scene::RANGE[1]) / 2.0);
    let slopes = rig.cameras.first().and_then(|camera| camera.project_with_jacobian(middle));
    // Where the camera does not see the middle: that of the paper's, 695 pixels at 95 cm.
    slopes.map_or(95.0 / 695.0, |(_, slopes)| {
        1.0 / slopes.fixed_columns::<2>(0).determinant().abs().sqrt()
    })
}

/// What stands before a rig with a chart pitch of [`PITCH`], in the scene's frame.
fn surfaces(random: &mut Random) -> Vec<Surface> {
    let wall = Wall {
        distance: random.uniform(116.0, 120.0),
        slope: [random.uniform(0.07, 0.11), random.uniform(-0.05, 0.02)],
        half: [80.0, 65.0],
    };
    let wave = |angle: f64, random: &mut Random| {
        let number = std::f64::consts::TAU / random.uniform(16.0, 24.0);
        let phase = random.uniform(0.0, std::f64::consts::TAU);
        [number * libm::cos(angle), number * libm::sin(angle), phase]
    };
    let floor = Floor {
        level: random.uniform(21.0, 23.0),
        height: 1.6,
        waves: [0.3, 1.2].map(|angle| wave(angle, random)),
        near: 58.0,
        wall: wall.clone(),
    };
    let mut near = |centre: [f64; 3]| Point3::from(centre.map(|at| at + random.uniform(-1.5, 1.5)));
    let ellipsoids = [
        ([-13.0, 1.0, 72.0], [8.0, 10.0, 7.0]),
        ([3.0, -15.0, 101.0], [9.0, 7.0, 9.0]),
        ([8.0, -8.0, 64.0], [3.5, 3.5, 3.5]),
    ]
    .map(|(centre, radii)| Ellipsoid { centre: near(centre), radii: radii.into() });
    let turn = Vector3::new(0.1, 0.6, 0.05);
    let own_from_scene: Matrix3<f64> = Pose::from_rotation_vector(Vector3::zeros(), turn).rotation;
    let block = Block {
        centre: near([15.0, 11.0, 86.0]),
        half: Vector3::new(7.0, 12.0, 6.0),
        own_from_scene,
    };
    let [first, second, third] = ellipsoids.map(Surface::Ellipsoid);
    vec![Surface::Wall(wall), Surface::Floor(floor), first, second, third, Surface::Block(block)]
}
