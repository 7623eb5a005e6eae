//! Corners of the first picture found again in the second one: off the curve too, which tells whether
//! the calibration still holds.

use super::{
    corners::{Aligned, Corner, Look, aligned, likeness},
    epipolar_curve::EpipolarCurve,
    gradient::Gradient,
};
use nalgebra::Vector2;
use rayon::prelude::*;
use wheatstone_core::geometry::Pixel;

/// A corner seen by both cameras.
#[derive(Clone, Copy, Debug)]
pub struct CornerMatch {
    /// In the first picture.
    pub first: Pixel,
    /// In the second.
    pub second: Pixel,
    /// Its window in the first picture.
    pub look: Look,
    /// How far aside of the curve it was found, in pixels; positive to the right of someone who goes
    /// along it from near to far.
    pub aside: f64,
    /// Unit vector from near to far along the curve.
    direction: Vector2<f64>,
}

impl CornerMatch {
    /// How far along its curve's direction a corner lies in the second picture, in pixels: what a turn of
    /// that picture moves it aside by, for each radian.
    #[must_use]
    pub fn lever(&self) -> f64 {
        self.second.coords.dot(&self.direction)
    }
}

/// How alike windows of the same corner are at least.
const LEAST_LIKENESS: f32 = 0.85;

/// How much less alike the next best must be.
const CLEARLY_LESS: f32 = 0.06;

/// Finds corners of one picture in the other, at most `aside` pixels from their curves; `curve` says where those of a
/// pixel of the first picture lie.
#[must_use]
pub fn match_corners(
    curve: &(impl Fn(Pixel) -> EpipolarCurve + Sync),
    first: &[Corner],
    (second, gradient): (&[Corner], &Gradient),
    aside: f64,
) -> Vec<CornerMatch> {
    // Both pixels are those nearest to where the corners are.
    let reach = aside + 1.5;
    let mut by_row: Vec<&Corner> = second.iter().collect();
    by_row.sort_by(|a, b| a.at.y.total_cmp(&b.at.y));
    let found = |corner: &Corner| {
        let curve = curve(corner.at);
        let [top, bottom] = curve.rows();
        let first = by_row.partition_point(|other| other.at.y < top - reach);
        let mut scored: Vec<(f32, &Corner)> = by_row[first..]
            .iter()
            .take_while(|other| other.at.y <= bottom + reach)
            .filter(|other| curve.aside(other.at).is_some_and(|off| off.abs() < reach))
            .map(|other| (likeness(&corner.look, &other.look), *other))
            .collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let ((rough, best), next) = (*scored.first()?, scored.get(1).map_or(-1.0, |next| next.0));
        // Corners found a pixel aside look less alike than they will when they are aligned.
        if rough < LEAST_LIKENESS - 0.3 {
            return None;
        }
        let Aligned { at, likeness: alike, .. } = aligned(&corner.look, gradient, best.at)?;
        let rival = scored
            .iter()
            .skip(1)
            .take_while(|(other, _)| *other > alike - 0.35)
            .filter_map(|(_, other)| aligned(&corner.look, gradient, other.at))
            .filter(|other| (other.at - at).norm() > 3.0)
            .fold(next - 1.0, |worst, other| worst.max(other.likeness));
        let off = curve.aside(at)?;
        let direction = curve.direction()?;
        (alike > LEAST_LIKENESS && alike - rival > CLEARLY_LESS && off.abs() < aside).then_some(
            CornerMatch { first: corner.at, second: at, look: corner.look, aside: off, direction },
        )
    };
    first.par_iter().filter_map(found).collect()
}
