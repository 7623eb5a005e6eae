//! The equations of reprojection errors: how pixels depend on motions of the cameras, freed of where points and boards
//! are that nobody measured.

use super::frame::CameraFrame;
use crate::{
    geometry::{Pixel, Point3, Pose, Vector3},
    method::{FitErrors, Reconstructor},
};
use nalgebra::{DMatrix, DVector, Matrix2x3};
use wheatstone_numeric::{levenberg_marquardt::Problem, matrix_product::product};

/// Columns of a camera: a turn about its axes (in radians), a shift along them, and the share by which its pictures grew.
pub(super) const COLUMNS: usize = 7;
/// Columns of the turn.
pub(super) const TURN: std::ops::Range<usize> = 0..3;
/// Columns of the shift.
pub(super) const SHIFT: std::ops::Range<usize> = 3..6;
/// Columns of the growth.
pub(super) const ZOOM: std::ops::Range<usize> = 6..7;

/// Where what was seen stands.
#[derive(Clone)]
pub(super) enum Place {
    /// Where the data say.
    Given,
    /// A point somewhere.
    Point(Point3),
    /// A board somewhere: its pose in the world.
    Board(Pose),
}

impl Place {
    /// Pixels that tell something of the cameras, at least.
    pub(super) fn least(&self) -> usize {
        match self {
            Self::Given => 1,
            Self::Point(_) => 2,
            Self::Board(_) => LEAST_ON_BOARD,
        }
    }
}

/// Points of a board that give it a pose and leave something to judge.
pub(super) const LEAST_ON_BOARD: usize = 6;

/// A pixel.
pub(super) struct Seen {
    pub(super) camera: usize,
    pub(super) pixel: Pixel,
    pub(super) sigma: f64,
    /// In the world, or on the board; of no meaning for a point somewhere.
    pub(super) at: Point3,
}

/// Pixels that share a place.
pub(super) struct Group {
    pub(super) seen: Vec<Seen>,
}

/// How cameras moved and where things are.
#[derive(Clone)]
pub(super) struct State {
    /// Of each camera its frame of old from its frame now.
    pub(super) motions: Vec<Pose>,
    /// The share by which its pictures grew.
    pub(super) zooms: Vec<f64>,
    /// How the given places moved, about their middle.
    pub(super) world: Pose,
    /// A place a group.
    pub(super) places: Vec<Place>,
}

impl State {
    /// How a camera moved, in the order of its columns; without a camera, how the given places did.
    pub(super) fn values(&self, camera: Option<usize>) -> [f64; COLUMNS] {
        let (pose, zoom) = match camera {
            Some(camera) => (&self.motions[camera], self.zooms[camera]),
            None => (&self.world, 0.0),
        };
        let (turn, shift) = (pose.rotation_vector(), pose.translation);
        [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, zoom]
    }
}

/// One group, linearised.
pub(super) struct Rows {
    /// By the motions, as they are, and freed of the group's place.
    slopes: DMatrix<f64>,
    pub(super) freed: DMatrix<f64>,
    /// What was observed less what is expected, in standard deviations, likewise.
    errors: DVector<f64>,
    pub(super) left: DVector<f64>,
    /// An orthonormal base of what the place can do, and the place's step from it.
    base: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

impl Rows {
    /// How many numbers the group's place has.
    pub(super) fn places(&self) -> usize {
        self.base.as_ref().map_or(0, |(base, _)| base.ncols())
    }
}

/// All groups, linearised and summed.
pub(super) struct Equations {
    pub(super) groups: Vec<Rows>,
    pub(super) normal: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) squares: f64,
}

/// Cameras that may have moved, and what they saw.
pub(super) struct Rig<'a> {
    pub(super) map: &'a dyn Reconstructor,
    pub(super) frames: Vec<CameraFrame>,
    pub(super) groups: Vec<Group>,
    /// The middle of the given places; none where no place is given.
    pub(super) middle: Option<Point3>,
}

/// Where a pixel of a moved camera is expected.
struct Expected {
    pixel: Pixel,
    /// The point that it would show to the camera as it was.
    world: Point3,
    /// By the camera's columns.
    by_camera: [[f64; 2]; COLUMNS],
    /// By the point's place.
    by_point: Matrix2x3<f64>,
}

impl Rig<'_> {
    /// Columns in all: those of the cameras, then a turn and a shift of the given places.
    pub(super) fn columns(&self) -> usize {
        COLUMNS * self.frames.len() + if self.middle.is_some() { 6 } else { 0 }
    }

    /// Nothing moved.
    pub(super) fn still(&self, places: Vec<Place>) -> State {
        let cameras = self.frames.len();
        State {
            motions: vec![Pose::default(); cameras],
            zooms: vec![0.0; cameras],
            world: Pose::default(),
            places,
        }
    }

    /// Where a point is that was seen.
    fn world(&self, state: &State, place: &Place, seen: &Seen) -> Point3 {
        match place {
            Place::Point(point) => *point,
            Place::Board(pose) => pose.transform(seen.at),
            Place::Given => {
                let middle = self.middle.unwrap_or_default().coords;
                state.world.transform(seen.at - middle) + middle
            }
        }
    }

    fn expected(&self, state: &State, camera: usize, point: Point3) -> Option<Expected> {
        let CameraFrame { camera_from_world, middle } = self.frames.get(camera)?;
        let (motion, zoom) = (state.motions.get(camera)?, state.zooms.get(camera)?);
        let now = motion.inverse().transform(camera_from_world.transform(point));
        let world = camera_from_world.inverse().transform(now);
        let (plain, slopes) = self.map.project(camera, world)?;
        let pixel = middle + (plain - middle) * (1.0 + zoom);
        let by_now = slopes * camera_from_world.rotation.transpose() * (1.0 + zoom);
        let by_turn = by_now * now.coords.cross_matrix();
        let off = plain - middle;
        let by_camera = std::array::from_fn(|column| match column {
            0..3 => by_turn.column(column).into_owned().into(),
            3..6 => (-by_now.column(column - 3)).into(),
            _ => [off.x, off.y],
        });
        let by_point = by_now * motion.rotation.transpose() * camera_from_world.rotation;
        Some(Expected { pixel, world, by_camera, by_point })
    }

    /// `None` where a camera does not see a point.
    fn rows(&self, state: &State, group: &Group, place: &Place) -> Option<Rows> {
        let count = 2 * group.seen.len();
        let own = match place {
            Place::Given => 0,
            Place::Point(_) => 3,
            Place::Board(_) => 6,
        };
        let mut slopes = DMatrix::zeros(count, self.columns());
        let mut by_place = DMatrix::zeros(count, own);
        let mut errors = DVector::zeros(count);
        for (index, seen) in group.seen.iter().enumerate() {
            let world = self.world(state, place, seen);
            let expected = self.expected(state, seen.camera, world)?;
            let error = (seen.pixel - expected.pixel) / seen.sigma;
            let by_point = expected.by_point / seen.sigma;
            let turned = match place {
                Place::Board(pose) => world - pose.translation,
                _ => world - self.middle.unwrap_or_default().coords - state.world.translation,
            };
            let by_turn = -(by_point * turned.coords.cross_matrix());
            for axis in 0..2 {
                let row = 2 * index + axis;
                errors[row] = error[axis];
                for (column, by) in expected.by_camera.iter().enumerate() {
                    slopes[(row, COLUMNS * seen.camera + column)] = by[axis] / seen.sigma;
                }
                let six = |matrix: &mut DMatrix<f64>, first: usize| {
                    for column in 0..3 {
                        matrix[(row, first + column)] = by_turn[(axis, column)];
                        matrix[(row, first + 3 + column)] = by_point[(axis, column)];
                    }
                };
                match place {
                    Place::Given => six(&mut slopes, COLUMNS * self.frames.len()),
                    Place::Board(_) => six(&mut by_place, 0),
                    Place::Point(_) => {
                        for column in 0..3 {
                            by_place[(row, column)] = by_point[(axis, column)];
                        }
                    }
                }
            }
        }
        let base = (own > 0).then(|| by_place.qr().unpack());
        let (mut freed, mut left) = (slopes.clone(), errors.clone());
        if let Some((base, _)) = &base {
            let across = base.transpose();
            freed -= product(base, &product(&across, &slopes));
            left -= base * (across * &errors);
        }
        Some(Rows { slopes, freed, errors, left, base })
    }

    /// By how much each error of the fit moves what is left of a group, added up as products with the freed slopes: a
    /// row a column of the motions.
    pub(super) fn mixed(
        &self,
        state: &State,
        equations: &Equations,
        errors: &FitErrors<'_>,
    ) -> Option<DMatrix<f64>> {
        let mut sum = DMatrix::zeros(self.columns(), errors.count);
        let all = self.groups.iter().zip(&state.places).zip(&equations.groups);
        for ((group, place), rows) in all {
            let mut displaced = DMatrix::zeros(2 * group.seen.len(), errors.count);
            for (index, seen) in group.seen.iter().enumerate() {
                let point = self.world(state, place, seen);
                let world = self.expected(state, seen.camera, point)?.world;
                let by = (errors.displacements)(seen.camera, world)?;
                for (error, by) in by.iter().enumerate() {
                    displaced[(2 * index, error)] = by.x / seen.sigma;
                    displaced[(2 * index + 1, error)] = by.y / seen.sigma;
                }
            }
            sum += product(&rows.freed.transpose(), &displaced);
        }
        Some(sum)
    }
}

/// The least reprojection error where only some columns are free.
pub(super) struct Freed<'a, 'b> {
    pub(super) rig: &'a Rig<'b>,
    pub(super) columns: &'a [usize],
}

impl Problem for Freed<'_, '_> {
    type State = State;
    type Equations = Equations;
    /// Of all columns, then of each group's place.
    type Step = (DVector<f64>, Vec<DVector<f64>>);

    fn linearise(&self, state: &State) -> Option<Equations> {
        let count = self.rig.columns();
        let (mut normal, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let (mut squares, mut groups) = (0.0, Vec::with_capacity(self.rig.groups.len()));
        for (group, place) in self.rig.groups.iter().zip(&state.places) {
            let rows = self.rig.rows(state, group, place)?;
            let across = rows.freed.transpose();
            normal += product(&across, &rows.freed);
            gradient += across * &rows.left;
            // What the place can take up is still to be gained by its next step.
            squares += rows.errors.norm_squared();
            groups.push(rows);
        }
        Some(Equations { groups, normal, gradient, squares })
    }

    fn step(&self, equations: &Equations, damping: f64) -> Option<(Self::Step, f64)> {
        /// Relative to what is known of a column: directions that no pixel shows are left alone.
        const UNSEEN: f64 = 1e-9;
        let mut step = DVector::zeros(self.rig.columns());
        if !self.columns.is_empty() {
            let mut normal =
                equations.normal.select_rows(self.columns).select_columns(self.columns);
            let most = normal.diagonal().max();
            for place in 0..self.columns.len() {
                let own = normal[(place, place)];
                normal[(place, place)] +=
                    (damping + UNSEEN) * own + 1e-30 * most + f64::MIN_POSITIVE;
            }
            let found = normal.cholesky()?.solve(&equations.gradient.select_rows(self.columns));
            for (column, value) in self.columns.iter().zip(found.iter()) {
                step[*column] = *value;
            }
        }
        let mut promised = 0.5 * equations.gradient.dot(&step);
        let place = |rows: &Rows| {
            let Some((base, triangle)) = &rows.base else { return DVector::zeros(0) };
            let side = base.transpose() * (&rows.errors - &rows.slopes * &step);
            promised += 0.5 * side.norm_squared();
            triangle.solve_upper_triangular(&side).unwrap_or_else(|| DVector::zeros(side.len()))
        };
        let places = equations.groups.iter().map(place).collect();
        Some(((step, places), promised))
    }

    fn moved(&self, state: &State, (step, places): &Self::Step) -> State {
        let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let mut moved = state.clone();
        for (camera, motion) in moved.motions.iter_mut().enumerate() {
            let first = COLUMNS * camera;
            let by = Pose::from_rotation_vector(three(first + SHIFT.start), three(first));
            *motion = motion.after(&by);
            moved.zooms[camera] += step[first + ZOOM.start];
        }
        if self.rig.middle.is_some() {
            let first = COLUMNS * self.rig.frames.len();
            moved.world = turned(&state.world, three(first), three(first + 3));
        }
        for (place, step) in moved.places.iter_mut().zip(places) {
            let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
            match place {
                Place::Given => {}
                Place::Point(point) => *point += three(0),
                Place::Board(pose) => *pose = turned(pose, three(0), three(3)),
            }
        }
        moved
    }

    fn cost(&self, equations: &Equations) -> f64 {
        0.5 * equations.squares
    }
}

/// A pose turned about its own origin in the world's axes, then shifted.
fn turned(pose: &Pose, turn: Vector3, shift: Vector3) -> Pose {
    let by = Pose::from_rotation_vector(Vector3::zeros(), turn);
    Pose { rotation: by.rotation * pose.rotation, translation: pose.translation + shift }
}
