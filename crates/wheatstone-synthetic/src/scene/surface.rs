//! Surfaces that rays meet: a wall, a wavy floor, ellipsoids and boxes, in the scene's own frame.

use nalgebra::Matrix3;
use wheatstone_core::geometry::{Point3, Vector3};

/// A half line in the scene's frame. Its direction has any length: distances along it are those along
/// the ray in the world, of which this is an affine image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) origin: Point3,
    pub(super) direction: Vector3,
}

impl Line {
    fn at(&self, distance: f64) -> Point3 {
        self.origin + self.direction * distance
    }
}

/// One body. Lengths are in the scene's frame: x right, y down, z away from the cameras.
#[derive(Clone, Debug)]
pub(super) enum Surface {
    Wall(Wall),
    Floor(Floor),
    Ellipsoid(Ellipsoid),
    Block(Block),
}

impl Surface {
    /// The distance along the line at which it first meets the surface from before it, above 0.
    pub(super) fn meets(&self, line: &Line) -> Option<f64> {
        match self {
            Self::Wall(wall) => wall.meets(line),
            Self::Floor(floor) => floor.meets(line),
            Self::Ellipsoid(ellipsoid) => ellipsoid.meets(line),
            Self::Block(block) => block.meets(line),
        }
    }

    /// The normal at a place of the surface, of any length and sign.
    pub(super) fn normal(&self, place: Point3) -> Vector3 {
        match self {
            Self::Wall(wall) => Vector3::new(wall.slope[0], wall.slope[1], -1.0),
            Self::Floor(floor) => {
                let [by_x, by_z] = floor.slopes(place.x, place.z);
                Vector3::new(by_x, -1.0, by_z)
            }
            Self::Ellipsoid(ellipsoid) => (place - ellipsoid.centre)
                .zip_map(&ellipsoid.radii, |part, radius| part / (radius * radius)),
            Self::Block(block) => block.normal(place),
        }
    }
}

/// A part of a plane: z = `distance` + slope · (x, y), for |x| and |y| within `half`.
#[derive(Clone, Debug)]
pub(super) struct Wall {
    pub(super) distance: f64,
    pub(super) slope: [f64; 2],
    pub(super) half: [f64; 2],
}

impl Wall {
    /// How deep a place of this x and y lies on the wall.
    pub(super) fn depth(&self, x: f64, y: f64) -> f64 {
        self.distance + self.slope[0] * x + self.slope[1] * y
    }

    /// The depth of its farthest corner.
    fn farthest(&self) -> f64 {
        self.distance + self.slope[0].abs() * self.half[0] + self.slope[1].abs() * self.half[1]
    }

    fn meets(&self, line: &Line) -> Option<f64> {
        let (origin, direction) = (line.origin, line.direction);
        let before = self.depth(origin.x, origin.y) - origin.z;
        let speed = direction.z - self.slope[0] * direction.x - self.slope[1] * direction.y;
        let distance = before / speed;
        let place = line.at(distance);
        let on = place.x.abs() <= self.half[0] && place.y.abs() <= self.half[1];
        (distance > 0.0 && on).then_some(distance)
    }
}

/// A wavy height field under the cameras, as wide as the wall and up to it: y = `level` less waves. It
/// is met from above alone.
#[derive(Clone, Debug)]
pub(super) struct Floor {
    pub(super) level: f64,
    /// Of the highest waves above the level.
    pub(super) height: f64,
    /// Wave numbers along x and z in radians a unit, and phases, of two crossed waves of half the
    /// height each.
    pub(super) waves: [[f64; 3]; 2],
    /// Where it begins.
    pub(super) near: f64,
    /// Where it ends.
    pub(super) wall: Wall,
}

impl Floor {
    fn phases(&self, x: f64, z: f64) -> [f64; 2] {
        self.waves.map(|[by_x, by_z, phase]| by_x * x + by_z * z + phase)
    }

    /// The field's y at x and z.
    fn surface(&self, x: f64, z: f64) -> f64 {
        let waves: f64 = self.phases(x, z).into_iter().map(libm::sin).sum();
        self.level - self.height / 2.0 * waves
    }

    /// The field's derivatives by x and z.
    fn slopes(&self, x: f64, z: f64) -> [f64; 2] {
        let cosines = self.phases(x, z).map(libm::cos);
        [0, 1].map(|axis| {
            let wave = |(wave, cosine): (&[f64; 3], f64)| wave[axis] * cosine;
            -self.height / 2.0 * self.waves.iter().zip(cosines).map(wave).sum::<f64>()
        })
    }

    /// How far a place of the line lies above the field, and how that changes with the distance.
    fn above(&self, line: &Line, distance: f64) -> (f64, f64) {
        let (place, direction) = (line.at(distance), line.direction);
        let [by_x, by_z] = self.slopes(place.x, place.z);
        let change = by_x * direction.x + by_z * direction.z - direction.y;
        (self.surface(place.x, place.z) - place.y, change)
    }

    fn meets(&self, line: &Line) -> Option<f64> {
        let direction = line.direction;
        // Only lines that go down and away from above the waves meet their upper side first.
        let top = self.level - self.height;
        if direction.y <= 0.0 || direction.z <= 0.0 || line.origin.y >= top {
            return None;
        }
        let to_y = |y: f64| (y - line.origin.y) / direction.y;
        let to_z = |z: f64| (z - line.origin.z) / direction.z;
        // Nearly level lines come down to the waves far behind the wall: those are not followed.
        let enters = to_y(top).max(to_z(self.near));
        let leaves = to_y(self.level + self.height).min(to_z(self.wall.farthest()));
        // The height above the field cannot fall faster than this with the distance.
        let steepest: f64 = self.waves.iter().map(|wave| libm::hypot(wave[0], wave[1])).sum();
        let sideways = libm::hypot(direction.x, direction.z);
        let fastest = direction.y + self.height / 2.0 * steepest * sideways;
        // Steps of less than a thousandth of the waves' height would come near and never through.
        let least = 1e-3 * self.height;
        let (mut low, mut above) = (enters, self.above(line, enters).0);
        while above >= 0.0 && low <= leaves {
            let high = low + above.max(least) / fastest;
            let next = self.above(line, high).0;
            if next <= 0.0 {
                let distance = self.crossing(line, low, high);
                return self.has(line.at(distance)).then_some(distance);
            }
            (low, above) = (high, next);
        }
        None
    }

    /// Where the line goes through the field between two distances, one above and one below it: Newton's
    /// method, by bisection where it leaves them.
    fn crossing(&self, line: &Line, mut low: f64, mut high: f64) -> f64 {
        let mut distance = (low + high) / 2.0;
        for _ in 0..60 {
            let (above, change) = self.above(line, distance);
            if above > 0.0 {
                low = distance;
            } else {
                high = distance;
            }
            let newton = distance - above / change;
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            let step = (next - distance).abs();
            distance = next;
            if step <= 1e-13 * distance {
                break;
            }
        }
        distance
    }

    fn has(&self, place: Point3) -> bool {
        place.x.abs() <= self.wall.half[0]
            && place.z >= self.near
            && place.z <= self.wall.depth(place.x, place.y)
    }
}

/// An ellipsoid along the axes.
#[derive(Clone, Debug)]
pub(super) struct Ellipsoid {
    pub(super) centre: Point3,
    pub(super) radii: Vector3,
}

impl Ellipsoid {
    fn meets(&self, line: &Line) -> Option<f64> {
        // In units of the radii it is a sphere of radius 1.
        let origin = (line.origin - self.centre).component_div(&self.radii);
        let direction = line.direction.component_div(&self.radii);
        let square = direction.norm_squared();
        let nearest = -origin.dot(&direction) / square;
        // The square of half the chord, without the difference of large squares.
        let rest = 1.0 - (origin + direction * nearest).norm_squared();
        (rest >= 0.0).then(|| nearest - (rest / square).sqrt()).filter(|distance| *distance > 0.0)
    }
}

/// A turned box.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) centre: Point3,
    /// Half of its edges, in its own frame.
    pub(super) half: Vector3,
    /// Scene to own frame.
    pub(super) own_from_scene: Matrix3<f64>,
}

impl Block {
    fn meets(&self, line: &Line) -> Option<f64> {
        let origin = self.own_from_scene * (line.origin - self.centre);
        let direction = self.own_from_scene * line.direction;
        let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let ends = [-self.half[axis], self.half[axis]]
                .map(|end| (end - origin[axis]) / direction[axis]);
            enters = enters.max(ends[0].min(ends[1]));
            leaves = leaves.min(ends[0].max(ends[1]));
        }
        (enters <= leaves && enters > 0.0).then_some(enters)
    }

    /// That of the face which the place is nearest to.
    fn normal(&self, place: Point3) -> Vector3 {
        let shares = (self.own_from_scene * (place - self.centre)).component_div(&self.half);
        let axis = shares.iamax();
        self.own_from_scene.row(axis).transpose()
    }
}
