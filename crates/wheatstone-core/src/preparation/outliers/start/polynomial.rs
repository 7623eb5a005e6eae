//! A camera's picture as a polynomial of where its points lie, fitted so that no bad point bends it.

use super::{differences, lengths, scale};
use crate::geometry::{Pixel, Point3};
use wheatstone_numeric::reweighted::Reweighted;

/// Powers of the polynomial's terms, low ones first: fifth degree over the picture, nearness counting
/// twice, which is what a thick pane at a slant asks for.
fn powers() -> Vec<[i32; 3]> {
    let mut powers: Vec<[i32; 3]> = (0..6 * 6 * 3)
        .map(|index| [index / 18, index / 3 % 6, index % 3])
        .filter(|[x, y, z]| x + y + 2 * z <= 5)
        .collect();
    powers.sort_by_key(|[x, y, z]| (x + y + 2 * z, *z, *y));
    powers
}

/// Residuals of the polynomial that most points agree on: the better of two, one fitted with all terms
/// from the errors `first`, one through cubics, whose edges a few bad points cannot lift.
pub(super) fn robust(
    pairs: &[(Point3, Pixel)],
    places: &[[f64; 3]],
    first: &[f64],
) -> Option<Vec<Pixel>> {
    let powers = powers();
    // Six points a term: with half of them bad there are still three.
    let most = (pairs.len() / 6).clamp(4, powers.len());
    let cubic = powers.iter().filter(|[x, y, z]| x + y + 2 * z <= 3).count().min(most);
    let at = |place: &[f64; 3], powers: &[i32; 3]| -> f64 {
        (0..3).map(|axis| place[axis].powi(powers[axis])).product()
    };
    let terms = places.iter().flat_map(|p| powers[..most].iter().map(move |powers| at(p, powers)));
    let terms: Vec<f64> = terms.collect();
    let problem = Reweighted::new(&terms, most, RIDGE, MOST_ROWS)?;
    let sides = pairs.iter().map(|(_, pixel)| [pixel.x, pixel.y]).collect();
    let mut polynomial = Polynomial { pairs, sides, problem };
    let direct = polynomial.robust(&[(most, ABSOLUTE, 15), (most, DESCENDING, 12)], first);
    let cubic_first = [
        (cubic, ABSOLUTE, 15),
        (cubic, DESCENDING, 8),
        (most, ABSOLUTE, 2),
        (most, DESCENDING, 12),
    ];
    let through_cubics = polynomial.robust(&cubic_first, first);
    let misfit = |residuals: &Vec<Pixel>| scale(&lengths(residuals));
    direct.into_iter().chain(through_cubics).min_by(|a, b| misfit(a).total_cmp(&misfit(b)))
}

/// Weights of a robust fit, from an error in standard deviations.
type Weight = fn(f64) -> f64;

/// Of least absolute deviations.
const ABSOLUTE: Weight = |error| 1.0 / error.max(0.05);

/// Geman & McClure's: half of a good point's at two and a half deviations.
const DESCENDING: Weight = |error| (1.0 + error * error / 16.0).powi(-2);

struct Polynomial<'a> {
    pairs: &'a [(Point3, Pixel)],
    /// Their pixels.
    sides: Vec<[f64; 2]>,
    problem: Reweighted,
}

impl Polynomial<'_> {
    /// Residuals after stages of so many terms, a weight, and rounds.
    fn robust(&mut self, stages: &[(usize, Weight, usize)], first: &[f64]) -> Option<Vec<Pixel>> {
        let mut errors = first.to_vec();
        let mut residuals = Vec::new();
        for (terms, weight, rounds) in stages {
            for _ in 0..*rounds {
                let sigma = scale(&errors).max(1e-9);
                let weights: Vec<f64> = errors.iter().map(|error| weight(error / sigma)).collect();
                let fitted = self.problem.fitted(*terms, &weights, &self.sides)?;
                residuals = differences(self.pairs, |index| Some(Pixel::from(fitted[index])));
                errors = lengths(&residuals);
            }
        }
        Some(residuals)
    }
}

/// Points to which the polynomial is fitted, at most: a hundred a term.
const MOST_ROWS: usize = 4000;

/// Size of the rows that keep undetermined terms small, as a share of a point's: a thousandth of
/// a point's weight moves no determined term by a noticeable share of a pixel.
const RIDGE: f64 = 1e-5;
