//! Plane-to-plane projective maps.

use super::Pixel;
use nalgebra::Matrix3;
use wheatstone_numeric::least_squares::null_vector;

/// Maps one plane to another: a chart to its picture, say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography(pub Matrix3<f64>);

impl Homography {
    /// The map that takes each `from` nearest to its `to`, in the algebraic sense after
    /// normalisation; `None` for fewer than four pairs or degenerate ones.
    #[must_use]
    pub fn fit(pairs: &[(Pixel, Pixel)]) -> Option<Self> {
        if pairs.len() < 4 {
            return None;
        }
        let from = normaliser(pairs.iter().map(|p| p.0))?;
        let to = normaliser(pairs.iter().map(|p| p.1))?;
        let mut rows = Vec::with_capacity(pairs.len() * 18);
        for (a, b) in pairs {
            let (a, b) = (from.transform_point(a), to.transform_point(b));
            rows.extend([a.x, a.y, 1.0, 0.0, 0.0, 0.0, -b.x * a.x, -b.x * a.y, -b.x]);
            rows.extend([0.0, 0.0, 0.0, a.x, a.y, 1.0, -b.y * a.x, -b.y * a.y, -b.y]);
        }
        let solution = null_vector(&rows, 9)?;
        if !solution.is_determined() {
            return None;
        }
        let normalised = Matrix3::from_row_slice(solution.vector.as_slice());
        Some(Self(to.try_inverse()? * normalised * from))
    }

    /// Where `point` goes; `None` at the horizon.
    #[must_use]
    pub fn map(&self, point: Pixel) -> Option<Pixel> {
        let h = self.0 * point.to_homogeneous();
        (h.z.abs() > f64::EPSILON * h.norm()).then(|| Pixel::new(h.x / h.z, h.y / h.z))
    }
}

/// The similarity that brings points to mean 0 and mean distance 1.
fn normaliser(points: impl Iterator<Item = Pixel> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let centre = points.clone().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords) / count;
    let scale = count / points.map(|p| (p.coords - centre).norm()).sum::<f64>();
    scale.is_finite().then(|| {
        Matrix3::new(scale, 0.0, -scale * centre.x, 0.0, scale, -scale * centre.y, 0.0, 0.0, 1.0)
    })
}
