//! The linear least squares that fill a camera's table, with a penalty on its bending.

use nalgebra::DMatrix;
use wheatstone_numeric::cholesky::Cholesky;

/// Cells along x and y. A lens's errors are smooth over tenths of the picture.
pub(super) const CELLS: [usize; 2] = [8, 6];

/// A quadratic spline has two functions more than cells.
pub(super) const FUNCTIONS: [usize; 2] = [CELLS[0] + 2, CELLS[1] + 2];
pub(super) const ALL: usize = FUNCTIONS[0] * FUNCTIONS[1];

/// Bending is penalised this many times more along the ray than across: camera centres move less
/// over the picture than rays turn.
const STIFFER_ALONG: f64 = 100.0;

/// Normal equations of the table: the coefficients across, then those along the ray.
pub(super) struct Normal {
    pub(super) matrix: DMatrix<f64>,
    pub(super) right: DMatrix<f64>,
}

impl Normal {
    pub(super) fn new() -> Self {
        Self { matrix: DMatrix::zeros(2 * ALL, 2 * ALL), right: DMatrix::zeros(2 * ALL, 2) }
    }

    pub(super) fn add(&mut self, functions: &[(usize, f64); 9], near: f64, target: [f64; 2]) {
        let both = |offset: usize, factor: f64| {
            functions.iter().map(move |(index, value)| (index + offset, value * factor))
        };
        let unknowns = || both(0, 1.0).chain(both(ALL, near));
        for (row, a) in unknowns() {
            for (column, b) in unknowns() {
                self.matrix[(row, column)] += a * b;
            }
            for (axis, value) in target.iter().enumerate() {
                self.right[(row, axis)] += a * value;
            }
        }
    }

    pub(super) fn solve(&self, bending: &DMatrix<f64>, stiffness: f64) -> Option<Vec<[f64; 4]>> {
        let matrix = &self.matrix + bending * stiffness;
        // Keeps what neither points nor bending determine at nothing; too little to matter else.
        let ridge = 1e-9 * matrix.trace();
        let factors = Cholesky::new(&matrix, |_| ridge)?;
        let [x, y] = [0, 1].map(|axis| factors.solve(self.right.column(axis).as_slice()));
        Some((0..ALL).map(|k| [x[k], y[k], x[ALL + k], y[ALL + k]]).collect())
    }
}

/// The sum of squared second differences of both tables, as a quadratic form.
pub(super) fn bending() -> DMatrix<f64> {
    let [columns, rows] = FUNCTIONS;
    let mut form = DMatrix::zeros(2 * ALL, 2 * ALL);
    let mut add = |terms: &[(usize, f64)]| {
        for (i, a) in terms {
            for (j, b) in terms {
                form[(*i, *j)] += a * b;
                form[(ALL + i, ALL + j)] += STIFFER_ALONG * a * b;
            }
        }
    };
    let at = |row: usize, column: usize| row * columns + column;
    for row in 0..rows {
        for column in 0..columns {
            if column + 2 < columns {
                let k = at(row, column);
                add(&[(k, 1.0), (k + 1, -2.0), (k + 2, 1.0)]);
            }
            if row + 2 < rows {
                let k = at(row, column);
                add(&[(k, 1.0), (k + columns, -2.0), (k + 2 * columns, 1.0)]);
            }
            if row + 1 < rows && column + 1 < columns {
                let (k, twist) = (at(row, column), 2.0_f64.sqrt());
                add(&[
                    (k, twist),
                    (k + 1, -twist),
                    (k + columns, -twist),
                    (k + columns + 1, twist),
                ]);
            }
        }
    }
    form
}
