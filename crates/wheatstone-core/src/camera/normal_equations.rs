//! What seen points say of a camera and its place: the products of all slopes and errors with each
//! other, a register of points at a time. Sums run over eight points, in their order, whatever the registers' width.

use super::batch_projection::{BatchProjection, LANES, MOST_NUMBERS};
use super::posed_lens::PosedLens;
use crate::geometry::{Pixel, Point3, Pose};
use nalgebra::Matrix3;
use wheatstone_numeric::{
    loss::Loss,
    number::{Doubles, Number, registers, registers_mut},
    simd::{Simd, WithSimd, on_widest},
};

/// A turn and a move.
const POSE: usize = 6;

/// Room for a pose, a lens and the error, in whole groups of rows.
pub(crate) const WIDTH: usize = (POSE + MOST_NUMBERS + 1).next_multiple_of(ROWS);

/// Products are summed of so many rows with so many others at once: as many as registers hold.
const ROWS: usize = 4;
const OTHERS: usize = 2;

/// Blocks of points whose rows stay in the nearest cache.
const CHUNK: usize = 12;

/// Points with the pixels at which a camera saw them, by eights; what is missing to the last eight is not a
/// number.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedObservations {
    count: usize,
    /// X, Y, Z, then x, y.
    blocks: Vec<[[f64; LANES]; 5]>,
}

impl PosedObservations {
    /// Of points in any frame.
    pub(crate) fn new(pairs: impl ExactSizeIterator<Item = (Point3, Pixel)>) -> Self {
        let count = pairs.len();
        let mut blocks = vec![[[f64::NAN; LANES]; 5]; count.div_ceil(LANES)];
        for (index, (point, pixel)) in pairs.enumerate() {
            let block = &mut blocks[index / LANES];
            for (values, value) in block.iter_mut().zip(point.iter().chain(pixel.iter())) {
                values[index % LANES] = *value;
            }
        }
        Self { count, blocks }
    }

    /// How many.
    pub(crate) fn len(&self) -> usize {
        self.count
    }
}

/// Sums over points by the unknowns: a turn about the points' origin in the camera's axes, a move, then
/// those numbers of the lens that were asked for; last the error.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    /// Half the weighted squares of what was seen.
    pub(crate) cost: f64,
    /// Points that the camera cannot see.
    pub(crate) unseen: usize,
    /// Unknowns; the error is the row after them.
    pub(crate) unknowns: usize,
    /// Weighted products, symmetric.
    pub(crate) products: [[f64; WIDTH]; WIDTH],
    room: Room,
}

/// Values of eight points, by their x coordinates and by their y coordinates.
type Row = [[f64; LANES]; 2];

/// What the sums are made in.
#[derive(Clone, Debug, Default)]
struct Room {
    /// Row by row, of each block of points.
    rows: Vec<Row>,
    /// Of each group of rows with each group of others, by eight points.
    sums: Vec<[[f64; LANES]; ROWS * OTHERS]>,
}

impl Default for Sums {
    fn default() -> Self {
        let room = Room { rows: vec![[[0.0; LANES]; 2]; WIDTH * CHUNK], sums: Vec::new() };
        Self { cost: 0.0, unseen: 0, unknowns: 0, products: [[0.0; WIDTH]; WIDTH], room }
    }
}

/// Groups of rows, each with the groups of others up to the diagonal.
fn groups(rows: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..rows.div_ceil(ROWS)).flat_map(|group| {
        (0..=group * ROWS / OTHERS + ROWS / OTHERS - 1).map(move |other| (group, other))
    })
}

impl Sums {
    /// Takes the sums of other points.
    pub(crate) fn take<L: BatchProjection>(
        &mut self,
        posed: &PosedLens<&L>,
        (seen, terms): (&PosedObservations, &[usize]),
        loss: Loss,
    ) {
        self.unknowns = POSE + terms.len().min(MOST_NUMBERS);
        self.cost = 0.0;
        let rows = self.unknowns + 1;
        self.room.sums.clear();
        self.room.sums.resize(groups(rows).count(), [[0.0; LANES]; ROWS * OTHERS]);
        let asked = terms.iter().max().map_or(0, |last| last + 1);
        let terms = (terms, asked);
        let lost = on_widest(Taken { posed, seen, terms, loss, sums: self });
        self.unseen = lost - (seen.blocks.len() * LANES - seen.count);
        for (sums, (group, other)) in self.room.sums.iter().zip(groups(rows)) {
            for (index, lanes) in sums.iter().enumerate() {
                let (row, column) =
                    (group * ROWS + index / OTHERS, other * OTHERS + index % OTHERS);
                let sum = across(lanes, |a, b| a + b);
                self.products[row][column] = sum;
                self.products[column][row] = sum;
            }
        }
        if let Loss::Squares = loss {
            self.cost = 0.5 * self.products[self.unknowns][self.unknowns];
        }
    }

    /// From a turn to what turns by `left` times it.
    pub(crate) fn turn(&mut self, left: &Matrix3<f64>) {
        for values in &mut self.products {
            let old = [values[0], values[1], values[2]];
            for k in 0..3 {
                values[k] = old[0] * left[(0, k)] + old[1] * left[(1, k)] + old[2] * left[(2, k)];
            }
        }
        let [first, second, third, ..] = self.products;
        for k in 0..3 {
            for (column, value) in self.products[k].iter_mut().enumerate() {
                *value = left[(0, k)] * first[column]
                    + left[(1, k)] * second[column]
                    + left[(2, k)] * third[column];
            }
        }
    }
}

/// Of eight numbers, always in the same order.
#[inline(always)]
fn across(lanes: &[f64; LANES], join: impl Fn(f64, f64) -> f64) -> f64 {
    let four: [f64; 4] = std::array::from_fn(|lane| join(lanes[lane], lanes[lane + 4]));
    join(join(four[0], four[2]), join(four[1], four[3]))
}

/// Fills the sums; its output is how many points, also of those that there are not, were not seen.
struct Taken<'a, L> {
    posed: &'a PosedLens<&'a L>,
    seen: &'a PosedObservations,
    /// The numbers of the lens whose slopes are wanted; they are among the first so many.
    terms: (&'a [usize], usize),
    loss: Loss,
    sums: &'a mut Sums,
}

impl<L: BatchProjection> WithSimd for Taken<'_, L> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let Self { posed, seen, terms, loss, sums } = self;
        let strips = LANES / (size_of::<S::f64s>() / size_of::<f64>());
        let Sums { cost, unknowns, room, .. } = sums;
        let mut lost = [0.0; LANES];
        for chunk in seen.blocks.chunks(CHUNK) {
            for (index, block) in chunk.iter().enumerate() {
                let mut growth = [1.0; LANES];
                for strip in 0..strips {
                    let row = Place { block: index, strip };
                    let growth = &mut registers_mut::<S>(&mut growth)[strip];
                    let lost = &mut registers_mut::<S>(&mut lost)[strip];
                    fill(
                        simd,
                        (posed, terms),
                        (block, loss),
                        (&mut room.rows, row),
                        (growth, lost),
                    );
                }
                if let Loss::Cauchy(scale) = loss {
                    let product = across(&growth, |a, b| a * b);
                    *cost += 0.5 * scale * scale * libm::log(product);
                }
            }
            let all = room.sums.iter_mut().zip(groups(*unknowns + 1));
            for (sums, (group, other)) in all {
                let rows = &room.rows[group * ROWS * CHUNK..];
                let others = &room.rows[other * OTHERS * CHUNK..];
                add_products(simd, (rows, others), (chunk.len(), strips), sums);
            }
        }
        lost.iter().sum::<f64>() as usize
    }
}

/// Where a register of points stands in the rows.
#[derive(Clone, Copy)]
struct Place {
    block: usize,
    strip: usize,
}

/// Rows of one register of points; what Cauchy's loss of each grows by, and which are not seen.
#[inline(always)]
fn fill<S: Simd, L: BatchProjection>(
    simd: S,
    (posed, (terms, asked)): (&PosedLens<&L>, (&[usize], usize)),
    (block, loss): (&[[f64; LANES]; 5], Loss),
    (rows, place): (&mut [Row], Place),
    (growth, lost): (&mut S::f64s, &mut S::f64s),
) {
    let number = |value: f64| Doubles(simd, simd.splat_f64s(value));
    let (zero, one) = (number(0.0), number(1.0));
    let mut seen = [zero; 5];
    for (value, numbers) in seen.iter_mut().zip(block) {
        value.1 = registers::<S>(numbers)[place.strip];
    }
    let [x, y, z, right, down] = seen;
    // In loops: a closure would be compiled for the narrowest registers, and called.
    let Pose { rotation, translation } = &posed.camera_from_world;
    let (mut turned, mut point) = ([zero; 3], [zero; 3]);
    for axis in 0..3 {
        let [a, b, c] = [rotation[(axis, 0)], rotation[(axis, 1)], rotation[(axis, 2)]];
        turned[axis] = number(a) * x + number(b) * y + number(c) * z;
        point[axis] = turned[axis] + number(translation[axis]);
    }
    let mut slopes = [[zero; 2]; MOST_NUMBERS];
    let trace = posed.lens.trace(point, (&mut slopes, asked));
    let error = [trace.pixel[0] - right, trace.pixel[1] - down];
    let square = error[0] * error[0] + error[1] * error[1] + trace.seen;
    let seen = simd.greater_than_or_equal_f64s(square.1, zero.1);
    *lost = simd.add_f64s(*lost, simd.select_f64s(seen, zero.1, one.1));
    let root = match loss {
        Loss::Squares => one,
        Loss::Cauchy(scale) => {
            let grown = one + square * number(1.0 / (scale * scale));
            *growth = simd.select_f64s(seen, grown.1, one.1);
            (one / grown).root()
        }
    };
    let mut put = |row: usize, axis: usize, value: Doubles<S>| {
        let to = &mut rows[row * CHUNK + place.block][axis];
        let weighed = simd.select_f64s(seen, (value * root).1, zero.1);
        registers_mut::<S>(to)[place.strip] = weighed;
    };
    for axis in 0..2 {
        let along = trace.by_point[axis];
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            put(k, axis, turned[next] * along[last] - turned[last] * along[next]);
            put(3 + k, axis, along[k]);
        }
        for (row, term) in terms.iter().take(MOST_NUMBERS).enumerate() {
            put(POSE + row, axis, slopes[*term][axis]);
        }
        put(POSE + terms.len().min(MOST_NUMBERS), axis, error[axis]);
    }
}

/// Adds the products of some rows with some others, by eight points.
#[inline(always)]
fn add_products<S: Simd>(
    simd: S,
    (rows, others): (&[Row], &[Row]),
    (blocks, strips): (usize, usize),
    sums: &mut [[f64; LANES]; ROWS * OTHERS],
) {
    for strip in 0..strips {
        let mut own: [S::f64s; ROWS * OTHERS] =
            std::array::from_fn(|index| registers::<S>(&sums[index])[strip]);
        let a: [&[S::f64s]; ROWS] = std::array::from_fn(|row| {
            registers::<S>(rows[row * CHUNK..][..blocks].as_flattened().as_flattened())
        });
        let b: [&[S::f64s]; OTHERS] = std::array::from_fn(|row| {
            registers::<S>(others[row * CHUNK..][..blocks].as_flattened().as_flattened())
        });
        for at in (strip..2 * blocks * strips).step_by(strips) {
            for row in 0..ROWS {
                for other in 0..OTHERS {
                    let sum = &mut own[row * OTHERS + other];
                    *sum = simd.mul_add_f64s(a[row][at], b[other][at], *sum);
                }
            }
        }
        for (lanes, own) in sums.iter_mut().zip(own) {
            registers_mut::<S>(lanes)[strip] = own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{AdjustableCamera, CameraModel, brown_conrady::BrownConrady},
        geometry::Vector3,
    };
    use nalgebra::{DMatrix, DVector, Vector2};
    use wheatstone_numeric::{random::Random, simd::on_each};

    const TERMS: [usize; 7] = [0, 1, 2, 3, 4, 7, 6];

    fn seen(count: usize) -> (Pose, Vec<(Point3, Pixel)>) {
        let pose =
            Pose::from_rotation_vector(Vector3::new(1.0, -2.0, 60.0), Vector3::new(0.2, -0.1, 0.3));
        let mut random = Random::new(4);
        let mut draw = |_| {
            let mut any = || random.uniform(-15.0, 15.0);
            let point = Point3::new(any(), any(), any());
            let at = BrownConrady::default().project(pose.transform(point)).unwrap();
            (point, at + Vector2::new(any(), any()) / 10.0)
        };
        let mut pairs: Vec<(Point3, Pixel)> = (0..count).map(&mut draw).collect();
        // One that is behind the camera.
        pairs[count / 2].0 = Point3::new(0.0, 0.0, -200.0);
        (pose, pairs)
    }

    fn plain(pose: &Pose, pairs: &[(Point3, Pixel)], loss: Loss) -> (f64, DMatrix<f64>) {
        let (count, mut cost) = (POSE + TERMS.len() + 1, 0.0);
        let mut sum = DMatrix::zeros(count, count);
        for (point, pixel) in pairs {
            let turned = pose.rotation * point.coords;
            let mut slopes = [[0.0; 2]; MOST_NUMBERS];
            let before = Point3::from(turned + pose.translation);
            let lens = BrownConrady::default();
            let Some((at, by_point)) = lens.project_with_slopes(before, &mut slopes) else {
                continue;
            };
            let error = at - pixel;
            let (own, weight) = loss.of(error.norm_squared());
            cost += own;
            let by_turn = -(by_point * turned.cross_matrix());
            for axis in 0..2 {
                let turn = (0..3).map(|k| by_turn[(axis, k)]);
                let along = (0..3).map(|k| by_point[(axis, k)]);
                let lens = TERMS.iter().map(|term| slopes[*term][axis]);
                let row = turn.chain(along).chain(lens).chain([error[axis]]);
                let row = DVector::from_iterator(count, row);
                sum += &row * row.transpose() * weight;
            }
        }
        (cost, sum)
    }

    #[test]
    fn sums_are_those_of_the_points_one_by_one() {
        // More than one chunk, and an end that fills no register.
        for (count, loss) in [(9, Loss::Squares), (203, Loss::Squares), (203, Loss::Cauchy(0.7))] {
            let (pose, pairs) = seen(count);
            let (cost, wanted) = plain(&pose, &pairs, loss);
            let lens = BrownConrady::default();
            let posed = PosedLens { lens: &lens, camera_from_world: pose };
            let (seen, mut sums) = (PosedObservations::new(pairs.iter().copied()), Sums::default());
            // Twice: nothing of the first may be left.
            sums.take(&posed, (&seen, &TERMS), Loss::Squares);
            sums.take(&posed, (&seen, &TERMS), loss);
            assert_eq!((sums.unseen, sums.unknowns), (1, POSE + TERMS.len()));
            assert!((sums.cost / cost - 1.0).abs() < 1e-12, "{} {cost}", sums.cost);
            let found = |sums: &Sums| {
                DMatrix::from_fn(wanted.nrows(), wanted.ncols(), |r, c| sums.products[r][c])
            };
            assert!((found(&sums) - &wanted).norm() < 1e-12 * wanted.norm());
            let left = Matrix3::new(1.0, 0.2, -0.1, 0.0, 0.9, 0.3, 0.1, -0.2, 1.1);
            let mut turn = DMatrix::identity(wanted.nrows(), wanted.ncols());
            turn.view_mut((0, 0), (3, 3)).copy_from(&left);
            sums.turn(&left);
            let turned = turn.transpose() * &wanted * turn;
            assert!((found(&sums) - &turned).norm() < 1e-12 * turned.norm());
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let (camera_from_world, pairs) = seen(203);
        let (lens, loss) = (BrownConrady::default(), Loss::Cauchy(0.7));
        let posed = PosedLens { lens: &lens, camera_from_world };
        let seen = PosedObservations::new(pairs.iter().copied());
        let mut ready = Sums { unknowns: POSE + TERMS.len(), ..Sums::default() };
        let count = groups(ready.unknowns + 1).count();
        ready.room.sums.resize(count, [[0.0; LANES]; ROWS * OTHERS]);
        let mut all = vec![ready; 4];
        let mut next = all.iter_mut();
        let widths = on_each(|| {
            let sums = next.next().unwrap();
            Taken { posed: &posed, seen: &seen, terms: (&TERMS, MOST_NUMBERS), loss, sums }
        });
        let of = |sums: &Sums| (sums.cost, sums.room.sums.clone());
        assert!(all[..widths.len()].iter().all(|other| of(other) == of(&all[0])));
    }
}
