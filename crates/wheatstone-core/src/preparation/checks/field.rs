//! What a lens formula leaves over, as a smooth field over the picture.

use crate::geometry::Pixel;
use nalgebra::Vector2;
use std::sync::Arc;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Places side by side.
const LANES: usize = 8;

/// Of eight places: x, y, and what is left over there along each.
type Eight = [[f64; LANES]; 4];

/// What is left over at places of the picture. Copies share it.
#[derive(Clone, Debug)]
pub(super) struct Field {
    eights: Arc<[Eight]>,
    reach: f64,
}

impl Field {
    /// Nothing is left over anywhere.
    pub(super) fn nothing() -> Self {
        Self { eights: Arc::new([]), reach: 1.0 }
    }

    /// What is left over at these places says something of what lies within `reach`, in pixels.
    pub(super) fn of(places: &[(Pixel, Vector2<f64>)], reach: f64) -> Self {
        let eight = |places: &[(Pixel, Vector2<f64>)]| {
            // What fills up the last is too far away to count.
            let mut eight =
                [[f64::INFINITY; LANES], [f64::INFINITY; LANES], [0.0; LANES], [0.0; LANES]];
            for (lane, (place, rest)) in places.iter().enumerate() {
                let values = [place.x, place.y, rest.x, rest.y];
                eight.iter_mut().zip(values).for_each(|(all, value)| all[lane] = value);
            }
            eight
        };
        Self { eights: places.chunks(LANES).map(eight).collect(), reach }
    }

    fn is_nothing(&self) -> bool {
        self.eights.is_empty()
    }

    /// The mean of what lies near, drawn towards nothing where little does.
    pub(super) fn at(&self, pixel: Pixel) -> Vector2<f64> {
        if self.is_nothing() {
            return Vector2::zeros();
        }
        let [x, y, weight] = on_widest(Near { field: self, pixel });
        // As much as half a neighbour at the very place.
        Vector2::new(x, y) / (0.5 + weight)
    }
}

/// What is left over near a pixel, weighed and summed up, and the sum of the weights.
struct Near<'a> {
    field: &'a Field,
    pixel: Pixel,
}

impl WithSimd for Near<'_> {
    type Output = [f64; 3];

    /// Written number by number: the compiler makes registers of eight, as wide as there are.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 3] {
        let Self { field, pixel } = self;
        let inverse = 1.0 / (9.0 * field.reach * field.reach);
        let mut sums = [[0.0; LANES]; 3];
        for [x, y, rest_x, rest_y] in &*field.eights {
            for lane in 0..LANES {
                let (by_x, by_y) = (pixel.x - x[lane], pixel.y - y[lane]);
                // A bell that needs no exponential: (1 - s/9)^4 up to three times the reach.
                let bell = (1.0 - (by_x * by_x + by_y * by_y) * inverse).max(0.0);
                let weight = (bell * bell) * (bell * bell);
                sums[0][lane] += weight * rest_x[lane];
                sums[1][lane] += weight * rest_y[lane];
                sums[2][lane] += weight;
            }
        }
        sums.map(|[a, b, c, d, e, f, g, h]| ((a + b) + (c + d)) + ((e + f) + (g + h)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::{random::Random, simd::on_each};

    fn places() -> Vec<(Pixel, Vector2<f64>)> {
        let mut random = Random::new(4);
        let mut coordinate = |size: f64| random.uniform(0.0, size);
        let place = |_| {
            let pixel = Pixel::new(coordinate(640.0), coordinate(480.0));
            (pixel, Vector2::new(coordinate(1.0), coordinate(2.0)))
        };
        (0..77).map(place).collect()
    }

    #[test]
    fn is_the_weighted_mean_of_what_lies_near() {
        let (places, reach) = (places(), 60.0);
        let field = Field::of(&places, reach);
        for pixel in [Pixel::new(100.0, 90.0), Pixel::new(320.0, 240.0), Pixel::new(-500.0, 0.0)] {
            let (mut sum, mut weights) = (Vector2::zeros(), 0.5);
            for (place, rest) in &places {
                let square = (pixel - place).norm_squared() / (reach * reach);
                let weight = if square < 9.0 { (1.0 - square / 9.0).powi(4) } else { 0.0 };
                sum += rest * weight;
                weights += weight;
            }
            assert!((field.at(pixel) - sum / weights).norm() < 1e-12);
        }
        assert_eq!(field.at(Pixel::new(-500.0, 0.0)), Vector2::zeros());
        assert_eq!(Field::nothing().at(Pixel::origin()), Vector2::zeros());
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let field = Field::of(&places(), 60.0);
        let sums = on_each(|| Near { field: &field, pixel: Pixel::new(300.0, 200.0) });
        assert!(sums.iter().all(|other| *other == sums[0]));
    }
}
