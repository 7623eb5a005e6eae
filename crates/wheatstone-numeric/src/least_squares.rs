//! Linear least squares by orthogonal factorisations.

use nalgebra::{DMatrix, DVector, DVectorView};

/// The direction that a matrix maps nearest to nothing.
#[derive(Clone, Debug)]
pub struct NullVector {
    /// Unit vector.
    pub vector: DVector<f64>,
    /// Smallest singular value over the largest: how far from nothing it is mapped.
    pub least: f64,
    /// Second smallest singular value over the largest: near `least`, or near 0, the direction is
    /// one of many.
    pub second: f64,
}

impl NullVector {
    /// Whether no other direction would do as well.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        // Rounding leaves singular values of 1e-16; normalised rows keep true ones above 1e-7.
        self.second > 1e-7 && self.second > 1.1 * self.least
    }
}

/// The unit vector `x` that makes `|A x|` least. `rows` holds A row by row, `width` numbers a row;
/// needs at least `width - 1` rows.
///
/// A is first reduced by a QR factorisation, so that the singular values of a tall matrix cost
/// little and nothing is squared.
#[must_use]
pub fn null_vector(rows: &[f64], width: usize) -> Option<NullVector> {
    let r = reduced(rows, width)?;
    // A square matrix has all its right singular vectors; one row short, the last is missing.
    let svd = r.resize(width, width, 0.0).svd(false, true);
    let right = svd.v_t?;
    let mut order: Vec<usize> = (0..width).collect();
    order.sort_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]));
    let largest = svd.singular_values[order[width - 1]];
    let share = |rank: usize| svd.singular_values[order[rank]] / largest;
    Some(NullVector { vector: right.row(order[0]).transpose(), least: share(0), second: share(1) })
}

/// The matrix, or the triangle of as many singular values that a taller one is reduced to; `None` where more
/// than one direction is mapped to nothing.
fn reduced(rows: &[f64], width: usize) -> Option<DMatrix<f64>> {
    let height = rows.len() / width;
    if height + 1 < width || rows.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let a = DMatrix::from_row_slice(height, width, rows);
    Some(if height > width { a.qr().r() } else { a })
}

/// The vector of [`null_vector`] by inverse iteration, at a quarter of the cost: as good where one direction
/// is mapped far nearer to nothing than all others, and without telling whether one is. Needs more than
/// `width` rows.
#[must_use]
pub fn null_direction(rows: &[f64], width: usize) -> Option<DVector<f64>> {
    /// Each brings what stands beside the direction down by the square of the ratio of singular values.
    const ROUNDS: usize = 5;
    if rows.len() <= width * width {
        return None;
    }
    let mut r = reduced(rows, width)?;
    // What is mapped to nothing at all must not be divided by it.
    let least = 1e-15 * r.diagonal().amax();
    for index in 0..width {
        r[(index, index)] = if r[(index, index)].abs() < least { least } else { r[(index, index)] };
    }
    let mut vector = DVector::from_element(width, 1.0);
    for _ in 0..ROUNDS {
        r.tr_solve_upper_triangular_mut(&mut vector).then_some(())?;
        r.solve_upper_triangular_mut(&mut vector).then_some(())?;
        vector /= vector.norm();
    }
    vector.iter().all(|v| v.is_finite()).then_some(vector)
}

/// A matrix made ready for many right-hand sides.
#[derive(Clone, Debug)]
pub struct Factored {
    /// A = Q R, with as many columns as unknowns.
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl Factored {
    /// `a` holds A row by row, `width` numbers a row; `None` where it is short of rank.
    #[must_use]
    pub fn new(a: &[f64], width: usize) -> Option<Self> {
        let height = a.len() / width;
        if height < width || a.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let qr = DMatrix::from_row_slice(height, width, a).qr();
        let r = qr.r();
        is_of_rank(&r).then(|| Self { q: qr.q(), r })
    }

    /// The `x` that makes `|A x - b|` least; `None` where `b` is not finite.
    #[must_use]
    pub fn solve(&self, b: &[f64]) -> Option<DVector<f64>> {
        let right = self.q.tr_mul(&DVectorView::from_slice(b, self.q.nrows()));
        right.iter().all(|v| v.is_finite()).then(|| self.r.solve_upper_triangular(&right))?
    }
}

/// Whether no column of a triangle is told by the others.
fn is_of_rank(r: &DMatrix<f64>) -> bool {
    let diagonal = r.diagonal();
    diagonal.amin() > 1e-13 * diagonal.amax()
}

/// The `x` that makes `|A x - B|` least, one column a right-hand side; `None` where A is short of
/// rank. Both hold their numbers row by row.
#[must_use]
pub fn solve(a: &[f64], width: usize, b: &[f64], sides: usize) -> Option<DMatrix<f64>> {
    let height = a.len() / width;
    if height < width || a.iter().chain(b).any(|v| !v.is_finite()) {
        return None;
    }
    let qr = DMatrix::from_row_slice(height, width, a).qr();
    let mut right = DMatrix::from_row_slice(height, sides, b);
    qr.q_tr_mul(&mut right);
    let r = qr.r();
    if !is_of_rank(&r) {
        return None;
    }
    r.solve_upper_triangular(&right.rows(0, width).into_owned())
}
