//! Products of matrices with the same bits on every machine: nalgebra hands those of more than five rows and
//! columns to kernels that are chosen by what the processor has, and fused multiplication rounds otherwise.
//! Large products of inner loops are those of a [`BlockedMatrix`](super::blocked_matrix::BlockedMatrix).

use nalgebra::{DMatrix, DMatrixView};

/// The product of two matrices, each sum in the order of its terms, each term and each sum rounded.
#[must_use]
pub fn product<'a, 'b>(
    left: impl Into<DMatrixView<'a, f64>>,
    right: impl Into<DMatrixView<'b, f64>>,
) -> DMatrix<f64> {
    let (left, right) = (left.into(), right.into());
    let mut product = DMatrix::zeros(left.nrows(), right.ncols());
    for (mut sums, factors) in product.column_iter_mut().zip(right.column_iter()) {
        for (terms, factor) in left.column_iter().zip(factors.iter()) {
            sums.iter_mut().zip(terms.iter()).for_each(|(sum, term)| *sum += term * factor);
        }
    }
    product
}

/// A matrix from both sides by diagonal ones: entry (i, j) times the scales of i and of j.
#[must_use]
pub fn scaled(scales: &[f64], mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    for (mut column, by_column) in matrix.column_iter_mut().zip(scales) {
        column
            .iter_mut()
            .zip(scales)
            .for_each(|(value, by_row)| *value = by_row * *value * by_column);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::{product, scaled};
    use nalgebra::DMatrix;

    fn whole(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |row, column| ((7 * row + 3 * column) % 11) as f64 - 5.0)
    }

    /// Whole numbers round nowhere: all ways to multiply agree.
    #[test]
    fn products_of_whole_numbers_are_exact() {
        for (rows, inner, columns) in [(1, 1, 1), (3, 8, 2), (9, 7, 12), (6, 0, 6)] {
            let (left, right) = (whole(rows, inner), whole(inner, columns));
            assert_eq!(product(&left, &right), &left * &right);
        }
    }

    #[test]
    fn terms_are_rounded_before_they_are_added() {
        // Fused, the sum would be the term's rounding error.
        let (left, right) = (DMatrix::from_element(7, 7, 0.1), DMatrix::from_element(7, 7, 0.3));
        let due = (0..7).fold(0.0, |sum, _| sum + 0.1 * 0.3);
        assert!(product(&left, &right).iter().all(|value| *value == due));
    }

    #[test]
    fn both_sides_are_scaled() {
        let scales = [2.0, 0.5, 4.0];
        let diagonal = DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&scales));
        assert_eq!(scaled(&scales, whole(3, 3)), &diagonal * whole(3, 3) * &diagonal);
    }
}
