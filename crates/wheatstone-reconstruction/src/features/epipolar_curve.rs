//! Where the second camera may see what the first one sees at a pixel: from near to far along its line of sight.

use nalgebra::Vector2;
use wheatstone_core::geometry::Pixel;

/// Pixels of the second picture, from near to far, so near each other that the curve is straight between them.
#[derive(Clone, Debug)]
pub struct EpipolarCurve {
    /// The number of the first place.
    first: usize,
    places: Vec<Pixel>,
    direction: Option<Vector2<f64>>,
}

/// The place of a curve that is nearest to a pixel.
#[derive(Clone, Copy, Debug)]
pub struct CurvePlace {
    /// The number of the piece of the curve: that of its near end.
    pub piece: usize,
    /// How far along it, 0 to 1.
    pub share: f64,
    /// How far aside of it the pixel lies, positive to the right of someone who goes along it from near to far.
    pub aside: f64,
}

impl EpipolarCurve {
    /// Through these pixels, the first of which has a number: curves of neighbours may begin nearer or farther.
    #[must_use]
    pub fn new(first: usize, places: Vec<Pixel>) -> Self {
        let ends = places.first().zip(places.last());
        let direction = ends.and_then(|(near, far)| (far - near).try_normalize(1e-9));
        Self { first, places, direction }
    }

    /// The near part of it, of so many places; its direction stays that of the whole.
    #[must_use]
    pub fn shortened(mut self, places: usize) -> Self {
        self.places.truncate(places);
        self
    }

    /// Unit vector in the second picture from its near to its far end.
    #[must_use]
    pub fn direction(&self) -> Option<Vector2<f64>> {
        self.direction
    }

    /// The highest and the lowest of its rows: the least y and the largest; the other way round of a curve without a place.
    #[must_use]
    pub fn rows(&self) -> [f64; 2] {
        self.places.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[top, bottom], place| {
            [top.min(place.y), bottom.max(place.y)]
        })
    }

    /// Unit vector along a piece, by its number, from near to far.
    #[must_use]
    pub fn way(&self, piece: usize) -> Option<Vector2<f64>> {
        let ends = self.places.get(piece.checked_sub(self.first)?..)?;
        (ends.get(1)? - ends[0]).try_normalize(0.0)
    }

    /// The straight pieces that it is made of, with their numbers.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, [Pixel; 2])> {
        let pieces = self.places.windows(2).map(|ends| [ends[0], ends[1]]);
        pieces.enumerate().map(|(index, ends)| (self.first + index, ends))
    }

    /// Its place nearest to a pixel of the second picture; `None` beyond its ends.
    #[must_use]
    pub fn nearest(&self, pixel: Pixel) -> Option<CurvePlace> {
        // Where it bends, a pixel may face neither of two pieces.
        const GAP: f64 = 0.01;
        let off = |(piece, [near, far]): (usize, [Pixel; 2])| {
            let (by, from) = (far - near, pixel - near);
            let share = from.dot(&by) / by.norm_squared();
            let aside = (by.x * from.y - by.y * from.x) / by.norm();
            (-GAP..1.0 + GAP).contains(&share).then_some(CurvePlace { piece, share, aside })
        };
        let places = self.pieces().filter_map(off);
        places.min_by(|a, b| a.aside.abs().total_cmp(&b.aside.abs()))
    }

    /// How far aside of it a pixel of the second picture lies, as [`CurvePlace::aside`]; `None` beyond its ends.
    #[must_use]
    pub fn aside(&self, pixel: Pixel) -> Option<f64> {
        Some(self.nearest(pixel)?.aside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_placed_along_and_aside() {
        let corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 5.0)];
        let curve = EpipolarCurve::new(3, corners.map(|(x, y)| Pixel::new(x, y)).to_vec());
        let at = curve.nearest(Pixel::new(4.0, 1.5)).unwrap();
        assert!(at.piece == 3 && (at.share - 0.4).abs() < 1e-12 && (at.aside - 1.5).abs() < 1e-12);
        let at = curve.nearest(Pixel::new(9.0, 2.5)).unwrap();
        assert!(at.piece == 4 && (at.share - 0.5).abs() < 1e-12 && (at.aside - 1.0).abs() < 1e-12);
        assert!(curve.aside(Pixel::new(20.0, 9.0)).is_none());
        assert_eq!(curve.rows(), [0.0, 5.0]);
        let short = curve.clone().shortened(2);
        assert!(short.pieces().count() == 1 && short.direction() == curve.direction());
    }
}
