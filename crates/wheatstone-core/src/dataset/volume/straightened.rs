//! A camera whose lens is straightened by a smooth table: enough to tell where its pixels look among
//! the points that it was shown, and straight beyond.
//!
//! A pixel's ray meets the projective camera (direct linear transformation) at
//! `pixel + across(pixel) + along(pixel) * nearness`: any bundle of straight rays, also one without a
//! common centre as behind a window, is of this form. Both are penalised tensor splines (Eilers &
//! Marx 1996, doi:10.1214/ss/1038425655), found by one linear least squares.

mod normal;

use crate::geometry::{
    Pixel, Point3, ProjectionMatrix,
    batch_triangulation::{RayPolynomial, StraightCamera},
};
use normal::{ALL, CELLS, FUNCTIONS, Normal, bending};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    number::Number,
    statistics::{median, percentile},
};

/// A projective camera with the table that makes it so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Straightened {
    projection: ProjectionMatrix,
    /// Middle and half the range of the inverse depths.
    nearness: [f64; 2],
    /// Where the table begins, and the size of its cells, in pixels.
    grid: [[f64; 2]; 2],
    /// A spline coefficient each: pixels across x and y, and along x and y.
    table: Vec<[f64; 4]>,
    /// In each of [`REGION`] directions, from where to where the pixels reach.
    region: Vec<[f64; 2]>,
}

/// The table goes on beyond the pixels by this share of their extent: a little more than is still
/// called the edge.
const MARGIN: f64 = 0.06;

/// Directions of half a turn in which the trained region of the picture is bounded, both ways.
const REGION: usize = 12;

/// How much a pixel of bending weighs against one of misfit: from what follows every point to what is
/// all but flat.
const STIFFNESSES: [f64; 7] = [1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0];

/// While gross errors are looked for: follows a lens, but no single point.
const STIFF: f64 = 10.0;

impl Straightened {
    /// From world points and pixels; `None` where they do not determine a projective camera.
    pub(super) fn fit(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        // The first rounds tell gross errors from a lens by a stiff table, which leaves out the corners of
        // a fisheye as well; a free one then takes in again what lies near it.
        const ROUNDS: [(usize, Option<f64>); 2] = [(20, Some(STIFF)), (8, None)];
        let mut kept: Vec<(Point3, Pixel)> = pairs.to_vec();
        let mut found = None;
        for (rounds, stiffness) in ROUNDS {
            let mut camera = Self::once(&kept, stiffness)?;
            for _ in 0..rounds {
                let next = camera.near(pairs);
                if next == kept {
                    break;
                }
                kept = next;
                camera = Self::once(&kept, stiffness)?;
            }
            found = Some(camera);
        }
        found
    }

    /// The pairs that are no gross errors: those that miss by no more than most do, or by less than a
    /// fiftieth of the picture. That much is what lenses do, and does little harm.
    fn near(&self, pairs: &[(Point3, Pixel)]) -> Vec<(Point3, Pixel)> {
        const MORE_THAN_MOST: f64 = 3.0;
        const GROSS: f64 = 0.02;
        let misses: Vec<f64> =
            pairs.iter().map(|(world, pixel)| self.miss(*world, *pixel)).collect();
        let extent = self.grid[0][1] * CELLS[0] as f64;
        let most = f64::max(MORE_THAN_MOST * median(&misses), GROSS * extent);
        let near = pairs.iter().zip(&misses).filter(|(_, miss)| **miss <= most);
        near.map(|(pair, _)| *pair).collect()
    }

    /// Fits to all pairs, with a table of this stiffness or of that which serves best.
    fn once(pairs: &[(Point3, Pixel)], stiffness: Option<f64>) -> Option<Self> {
        let projection = ProjectionMatrix::fit(pairs)?;
        let bounds = |axis: usize| {
            let values = pairs.iter().map(|(_, pixel)| pixel[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let grid = [0, 1].map(|axis| {
            let (low, high) = bounds(axis);
            let margin = MARGIN * (high - low);
            [low - margin, (high - low + 2.0 * margin) / CELLS[axis] as f64]
        });
        let near: Vec<f64> = pairs
            .iter()
            .map(|(world, _)| 1.0 / (projection.0 * world.to_homogeneous()).z)
            .filter(|near| *near > 0.0)
            .collect();
        let (low, high) =
            near.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let mut camera = Self {
            projection,
            nearness: [(low + high) / 2.0, (high - low) / 2.0],
            grid,
            table: vec![[0.0; 4]; ALL],
            region: region(pairs),
        };
        if !camera.is_consistent() {
            return None;
        }
        camera.learn(pairs, stiffness)?;
        camera.is_consistent().then_some(camera)
    }

    /// The first of the three spline functions along an axis that are not 0 at a place, counted from 0, and
    /// their values.
    #[inline(always)]
    pub(super) fn along_axis<N: Number>(&self, axis: usize, pixel: N) -> (N, [N; 3]) {
        // Added and taken away it rounds: 1.5 * 2^52.
        const ROUND: f64 = 6_755_399_441_055_744.0;
        let [start, cell] = self.grid[axis];
        let (half, one, round) = (pixel.all(0.5), pixel.all(1.0), pixel.all(ROUND));
        let place = ((pixel - pixel.all(start)) * pixel.all(1.0 / cell)).max_with(pixel.all(0.0));
        let place = place.or_smaller(pixel.all(CELLS[axis] as f64));
        let first = (place - half + round) - round;
        let first = first.or_smaller(pixel.all((CELLS[axis] - 1) as f64));
        let f = place - first;
        let (rest, square) = (one - f, half * f * f);
        (first, [half * rest * rest, half + f - (square + square), square])
    }

    /// The sums of the table's coefficients from a place on, by the functions along both axes.
    #[inline(always)]
    pub(super) fn sums(&self, begin: usize, [x, y]: [[f64; 3]; 2]) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for (row, y) in y.into_iter().enumerate() {
            let begin = begin + row * FUNCTIONS[0];
            let Some([a, b, c]) = self.table[begin..].first_chunk() else { return [f64::NAN; 4] };
            for (index, sum) in sums.iter_mut().enumerate() {
                *sum += y * (x[0] * a[index] + x[1] * b[index] + x[2] * c[index]);
            }
        }
        sums
    }

    /// Where the table's part begins that is for the functions that are first along both axes.
    #[inline(always)]
    pub(super) fn begin<N: Number>(column: N, row: N) -> N {
        row * row.all(FUNCTIONS[0] as f64) + column
    }

    fn lookup(&self, pixel: Pixel) -> [f64; 4] {
        let ((column, x), (row, y)) = (self.along_axis(0, pixel.x), self.along_axis(1, pixel.y));
        self.sums(Self::begin(column, row) as usize, [x, y])
    }

    /// The spline functions that are not 0 at a pixel, with their values.
    fn functions(&self, pixel: Pixel) -> [(usize, f64); 9] {
        let ((column, x), (row, y)) = (self.along_axis(0, pixel.x), self.along_axis(1, pixel.y));
        let begin = Self::begin(column, row) as usize;
        std::array::from_fn(|index| {
            let (i, j) = (index % 3, index / 3);
            (begin + j * FUNCTIONS[0] + i, x[i] * y[j])
        })
    }

    /// Where the projective camera observes a point, relative to the pixel; and the point's nearness in
    /// -1..1.
    fn target(&self, world: Point3, pixel: Pixel) -> Option<([f64; 2], f64)> {
        let h = self.projection.0 * world.to_homogeneous();
        let near = (1.0 / h.z - self.nearness[0]) / self.nearness[1];
        (h.z > 0.0).then(|| ([h.x / h.z - pixel.x, h.y / h.z - pixel.y], near))
    }

    /// By how many pixels the ray of a pixel misses a point.
    fn miss(&self, world: Point3, pixel: Pixel) -> f64 {
        let Some((target, near)) = self.target(world, pixel) else { return f64::INFINITY };
        let [x, y, along_x, along_y] = self.lookup(pixel);
        let (x, y) = (target[0] - x - along_x * near, target[1] - y - along_y * near);
        (x * x + y * y).sqrt()
    }

    /// Fills the table. How stiff it is, unless told, every other point decides about the rest.
    fn learn(&mut self, pairs: &[(Point3, Pixel)], stiffness: Option<f64>) -> Option<()> {
        let mut halves = [Normal::new(), Normal::new()];
        for (index, (world, pixel)) in pairs.iter().enumerate() {
            if let Some((target, near)) = self.target(*world, *pixel) {
                halves[index % 2].add(&self.functions(*pixel), near, target);
            }
        }
        let bending = bending();
        let choices = match &stiffness {
            Some(one) => std::slice::from_ref(one),
            None => &STIFFNESSES[..],
        };
        let mut best: Option<(f64, f64)> = None;
        for stiffness in choices {
            if choices.len() == 1 {
                best = Some((0.0, *stiffness));
                break;
            }
            self.table = halves[0].solve(&bending, *stiffness)?;
            let judged = pairs.iter().skip(1).step_by(2);
            let misses: Vec<f64> = judged.map(|(world, pixel)| self.miss(*world, *pixel)).collect();
            // Three quarters of the points are not gross errors, and feel a local curvature of the lens.
            let error = percentile(&misses, 0.75);
            if best.is_none_or(|(least, _)| error < least) {
                best = Some((error, *stiffness));
            }
        }
        let [mut all, other] = halves;
        all.matrix += other.matrix;
        all.right += other.right;
        self.table = all.solve(&bending, best?.1)?;
        Some(())
    }

    /// The projective camera.
    pub(super) fn camera(&self) -> StraightCamera {
        let p = &self.projection.0;
        let row = |row: usize| [0, 1, 2, 3].map(|column| p[(row, column)]);
        StraightCamera {
            rows: [0, 1, 2].map(row),
            nearness: self.nearness[0],
            weight: 1.0,
            range: [0.0, f64::INFINITY],
        }
    }

    /// Where a pixel lies on the projective camera's plane, whose steps count as pixels.
    pub(super) fn see(&self, pixel: Pixel) -> RayPolynomial<f64> {
        self.ray_polynomial([pixel.x, pixel.y], self.lookup(pixel))
    }

    /// [`Straightened::see`] by the sums of a pixel.
    #[inline(always)]
    pub(super) fn ray_polynomial<N: Number>(
        &self,
        pixel: [N; 2],
        sums: [N; 4],
    ) -> RayPolynomial<N> {
        let (zero, one) = (pixel[0].all(0.0), pixel[0].all(1.0));
        let (middle, share) = (zero.all(self.nearness[0]), zero.all(1.0 / self.nearness[1]));
        let along = [sums[2] * share, sums[3] * share];
        let x = pixel[0] + sums[0] - along[0] * middle;
        let y = pixel[1] + sums[1] - along[1] * middle;
        RayPolynomial { at: [x, y], along, curvature: [zero; 2], scale: [one, zero, zero, one] }
    }

    /// The trained region of the picture.
    pub(super) fn trained(&self) -> Region {
        let mut bands = [[0.0; 3]; REGION];
        for (band, (direction, [low, high])) in
            bands.iter_mut().zip(DIRECTIONS.iter().zip(&self.region))
        {
            let by = 1.0 / (high - low);
            *band = [direction[0] * by, direction[1] * by, -0.5 * (low + high) * by];
        }
        Region(bands)
    }

    pub(super) fn is_consistent(&self) -> bool {
        let numbers =
            self.projection.0.iter().chain(&self.nearness).chain(self.grid.iter().flatten());
        numbers.chain(self.table.iter().flatten()).all(|value| value.is_finite())
            && self.nearness.iter().chain(self.grid.iter().map(|axis| &axis[1])).all(|v| *v > 0.0)
            && self.table.len() == ALL
            && self.region.len() == REGION
            && self.region.iter().all(|[low, high]| high > low && (high - low).is_finite())
    }
}

/// The trained region of a camera's picture. In each direction, so much by x, by y and always is how far a pixel lies
/// from the region's middle, as a share of its width.
pub(super) struct Region([[f64; 3]; REGION]);

impl Region {
    /// By how much a pixel lies beyond it, as a share of its width in the direction in which that is most; negative
    /// inside.
    #[inline(always)]
    pub(super) fn beyond<N: Number>(&self, [x, y]: [N; 2]) -> N {
        let mut most = x.all(0.0);
        for [by_x, by_y, always] in &self.0 {
            let off = x.all(*always).add_product(x.all(*by_x), x).add_product(x.all(*by_y), y);
            most = off.magnitude().max_with(most);
        }
        most - x.all(0.5)
    }
}

/// Cosine and sine of every 15 degrees.
const DIRECTIONS: [[f64; 2]; REGION] = {
    use std::f64::consts::FRAC_1_SQRT_2 as C45;
    const C15: f64 = 0.965_925_826_289_068_3;
    const C30: f64 = 0.866_025_403_784_438_6;
    const C75: f64 = 0.258_819_045_102_520_74;
    [
        [1.0, 0.0],
        [C15, C75],
        [C30, 0.5],
        [C45, C45],
        [0.5, C30],
        [C75, C15],
        [0.0, 1.0],
        [-C75, C15],
        [-0.5, C30],
        [-C45, C45],
        [-C30, 0.5],
        [-C15, C75],
    ]
};

fn along(direction: usize, pixel: Pixel) -> f64 {
    DIRECTIONS[direction][0] * pixel.x + DIRECTIONS[direction][1] * pixel.y
}

/// From where to where pixels reach in each direction.
fn region(pairs: &[(Point3, Pixel)]) -> Vec<[f64; 2]> {
    let reach = |direction: usize| {
        let values = pairs.iter().map(|(_, pixel)| along(direction, *pixel));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
    };
    (0..REGION).map(reach).collect()
}
