//! The normal equations of a camera, from points of which some may be wrong.

use super::{
    decentred_camera::{DecentredCamera, Row, UNKNOWNS},
    field::Field,
    pairs::Pair,
};
use nalgebra::{SMatrix, SVector, Vector2};
use wheatstone_numeric::{
    simd::{Simd, WithSimd, on_widest},
    statistics::median,
};

/// Of these unknowns, those of the pose.
pub(super) const POSE: usize = 6;

/// Cauchy's weight.
pub(super) fn cauchy(error: f64, scale: f64) -> f64 {
    1.0 / (1.0 + (error / scale).powi(2)) / (scale * scale)
}

/// A camera's errors at the pairs that it observes, and how they change with its numbers.
pub(super) struct Linearised {
    rows: Vec<(Row, Vector2<f64>)>,
    /// Pairs that it does not see.
    unseen: usize,
}

impl Linearised {
    /// The field counts in a pose's refit, not while the lens itself is fitted: it is nothing then.
    pub(super) fn by(camera: &DecentredCamera, field: &Field, pairs: &[Pair]) -> Self {
        let row = |(world, pixel): &Pair| {
            let row = camera.row(*world)?;
            let error = pixel - (row.pixel + field.at(row.pixel));
            Some((row, error))
        };
        let rows: Vec<(Row, Vector2<f64>)> = pairs.iter().filter_map(row).collect();
        Self { unseen: pairs.len() - rows.len(), rows }
    }

    /// 1.2 medians of the errors' length, about a standard deviation and a half; nothing is exact.
    pub(super) fn scale(&self) -> f64 {
        let errors: Vec<f64> = self.rows.iter().map(|(_, error)| error.norm()).collect();
        (1.2 * median(&errors)).max(1e-3)
    }

    /// What Cauchy's weight makes least.
    pub(super) fn cost(&self, scale: f64) -> f64 {
        let of = |(_, error): &(Row, Vector2<f64>)| {
            0.5 * libm::log1p(error.norm_squared() / (scale * scale))
        };
        self.unseen as f64 * 1e3 + self.rows.iter().map(of).sum::<f64>()
    }
}

/// Normal equations, under Cauchy's weight unless said otherwise.
#[derive(Default)]
pub(super) struct Normal {
    pub(super) matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    pub(super) gradient: SVector<f64, UNKNOWNS>,
    /// Half of what Cauchy's weight makes least, and what an unlikely lens costs.
    pub(super) cost: f64,
    pub(super) held: f64,
    pub(super) scale: f64,
}

impl Normal {
    /// Of all unknowns, with a weight by an error's length and the errors' scale, both in pixels.
    pub(super) fn weighed(
        camera: &DecentredCamera,
        pairs: &[Pair],
        weigh: fn(f64, f64) -> f64,
    ) -> Self {
        let seen = Linearised::by(camera, &Field::nothing(), pairs);
        Self::of(&seen, (camera, camera.unknowns()), seen.scale(), weigh)
    }

    pub(super) fn of(
        seen: &Linearised,
        (camera, unknowns): (&DecentredCamera, usize),
        scale: f64,
        weigh: fn(f64, f64) -> f64,
    ) -> Self {
        let mut normal = Self { scale, ..Self::default() };
        on_widest(Added { normal: &mut normal, rows: &seen.rows, unknowns, weigh });
        if unknowns > POSE {
            normal.held = normal.hold_lens(camera);
        }
        normal.cost = seen.cost(scale) + normal.held;
        normal
    }

    /// Coefficients beyond what lenses have are unlikely: standard deviation 1 about nothing, and of the decentring a
    /// hundredth. What it costs.
    fn hold_lens(&mut self, camera: &DecentredCamera) -> f64 {
        const DECENTRED: f64 = 0.01;
        let mut cost = 0.0;
        let radial = camera.posed.lens.coefficients.iter().map(|value| (value, 1.0));
        let decentring = camera.decentring.unwrap_or_default();
        let decentring = decentring.iter().map(|value| (value, DECENTRED));
        for (index, (value, sigma)) in radial.chain(decentring).enumerate() {
            let weight = 1.0 / (sigma * sigma);
            self.matrix[(10 + index, 10 + index)] += weight;
            self.gradient[10 + index] -= weight * value;
            cost += weight * value * value / 2.0;
        }
        // Pixels are nearly square: the logarithm of their aspect is known to 0.1 beforehand.
        let [fx, fy] = camera.posed.lens.pinhole.focal;
        let gap = libm::log((fx / fy).abs().max(1e-9)) / 0.1;
        let (by_x, by_y) = (10.0 / fx, -10.0 / fy);
        self.matrix[(6, 6)] += by_x * by_x;
        self.matrix[(7, 7)] += by_y * by_y;
        self.matrix[(6, 7)] += by_x * by_y;
        self.matrix[(7, 6)] += by_x * by_y;
        self.gradient[6] -= by_x * gap;
        self.gradient[7] -= by_y * gap;
        cost + gap * gap / 2.0
    }

    /// A damped step, and by how much it lowers the cost if these equations hold for it.
    pub(super) fn step(&self, damping: f64) -> Option<(SVector<f64, UNKNOWNS>, f64)> {
        let mut matrix = self.matrix;
        for index in 0..UNKNOWNS {
            let value = matrix[(index, index)];
            matrix[(index, index)] = if value > 0.0 { value * (1.0 + damping) } else { 1.0 };
        }
        let step = matrix.cholesky()?.solve(&self.gradient);
        let held = self.matrix.diagonal().component_mul(&step);
        Some((step, 0.5 * (step.dot(&self.gradient) + damping * step.dot(&held))))
    }
}

/// Adds what the first unknowns make of each row.
struct Added<'a> {
    normal: &'a mut Normal,
    rows: &'a [(Row, Vector2<f64>)],
    unknowns: usize,
    weigh: fn(f64, f64) -> f64,
}

impl WithSimd for Added<'_> {
    type Output = ();

    /// Written number by number: the compiler makes registers of columns, as wide as there are.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { normal, rows, unknowns, weigh } = self;
        for (Row { by_turn, by_point, by_lens, .. }, error) in rows {
            let weight = weigh(error.norm(), normal.scale);
            let [x, y]: [[f64; UNKNOWNS]; 2] = std::array::from_fn(|axis| {
                std::array::from_fn(|index| match index {
                    0..3 => by_turn[(axis, index)],
                    3..6 => by_point[(axis, index - 3)],
                    _ if index < unknowns => by_lens[index - 6][axis],
                    _ => 0.0,
                })
            });
            for column in 0..unknowns {
                let (by_x, by_y) = (weight * x[column], weight * y[column]);
                normal.gradient[column] += by_x * error.x + by_y * error.y;
                // Whole columns, which are quicker than what is below the diagonal.
                let mut column = normal.matrix.column_mut(column);
                for (sum, (x, y)) in column.iter_mut().zip(x.iter().zip(&y)) {
                    *sum += by_x * x + by_y * y;
                }
            }
        }
    }
}
