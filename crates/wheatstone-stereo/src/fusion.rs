//! Disparities of several frames that show the same.

use crate::{error::MatchError, map::DisparityMap};

/// Disparities of one scene, seen several times by cameras that stand still: those of a pixel that agree are averaged by
/// their variances.
///
/// A disparity that contradicts what was found before is left out, and takes its place when it was found more often.
#[derive(Clone, Debug)]
pub struct DisparityFusion {
    width: usize,
    height: usize,
    pixels: Vec<Option<Fused>>,
}

/// What frames agree on at a pixel.
#[derive(Clone, Copy, Debug)]
struct Fused {
    disparity: f32,
    /// The sum of the inverses of variances.
    information: f32,
    /// The most confident of the disparities.
    confidence: f32,
    agreeing: u16,
    contradicting: u16,
}

/// Disparities agree that are within so many standard deviations of their difference.
const MOST_SIGMAS: f32 = 3.0;
/// What is less confident is not used.
const LEAST_CONFIDENCE: f32 = 0.5;
/// The share of a disparity's variance that all frames have in common: how surfaces slant within a window, how pictures are
/// interpolated. Of a rendered scene, four frames have 0.64 of the variance of one, and twelve 0.55.
const COMMON: f32 = 0.5;

impl DisparityFusion {
    /// Of pictures of a size.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![None; width * height] }
    }

    /// Adds a frame's disparities.
    ///
    /// # Errors
    ///
    /// [`MatchError::Sizes`] for those of another size.
    pub fn add(&mut self, map: &DisparityMap) -> Result<(), MatchError> {
        let (left, right) = ((self.width, self.height), (map.width, map.height));
        if left != right {
            return Err(MatchError::Sizes { left, right });
        }
        let found = map.disparity.iter().zip(&map.sigma).zip(&map.confidence);
        for (pixel, ((disparity, sigma), confidence)) in self.pixels.iter_mut().zip(found) {
            if *confidence >= LEAST_CONFIDENCE && disparity.is_finite() && *sigma > 0.0 {
                let own = Fused {
                    disparity: *disparity,
                    information: 1.0 / (sigma * sigma),
                    confidence: *confidence,
                    agreeing: 1,
                    contradicting: 0,
                };
                *pixel = Some(pixel.map_or(own, |known| known.with(own)));
            }
        }
        Ok(())
    }

    /// What the frames agree on.
    #[must_use]
    pub fn map(&self) -> DisparityMap {
        let of = |value: &dyn Fn(&Fused) -> f32, nothing: f32| -> Vec<f32> {
            self.pixels.iter().map(|pixel| pixel.as_ref().map_or(nothing, value)).collect()
        };
        DisparityMap {
            width: self.width,
            height: self.height,
            disparity: of(&|pixel| pixel.disparity, f32::NAN),
            confidence: of(&Fused::confidence, 0.0),
            sigma: of(&Fused::sigma, f32::NAN),
        }
    }
}

impl Fused {
    fn with(self, own: Self) -> Self {
        let off = (self.disparity - own.disparity).abs();
        if off < MOST_SIGMAS * (1.0 / self.information + 1.0 / own.information).sqrt() {
            let information = self.information + own.information;
            return Self {
                disparity: self.disparity
                    + (own.disparity - self.disparity) * own.information / information,
                information,
                confidence: self.confidence.max(own.confidence),
                agreeing: self.agreeing.saturating_add(1),
                ..self
            };
        }
        if self.contradicting >= self.agreeing {
            return Self { contradicting: self.agreeing, ..own };
        }
        Self { contradicting: self.contradicting + 1, ..self }
    }

    fn confidence(&self) -> f32 {
        let agreeing = f32::from(self.agreeing);
        self.confidence * agreeing / (agreeing + f32::from(self.contradicting))
    }

    fn sigma(&self) -> f32 {
        // The mean variance of one frame.
        let count = f32::from(self.agreeing);
        let single = count / self.information;
        (single * (COMMON + (1.0 - COMMON) / count)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(disparity: f32, confidence: f32) -> DisparityMap {
        DisparityMap {
            width: 1,
            height: 1,
            disparity: vec![disparity],
            confidence: vec![confidence],
            sigma: vec![0.1],
        }
    }

    #[test]
    fn what_agrees_is_averaged_and_what_does_not_is_outvoted() {
        let mut fusion = DisparityFusion::new(1, 1);
        assert!(fusion.map().disparity[0].is_nan() && fusion.map().confidence[0] == 0.0);
        for disparity in [20.0, 5.0, 5.1, 5.05] {
            fusion.add(&frame(disparity, 0.9)).unwrap();
        }
        let found = fusion.map();
        assert!((found.disparity[0] - 5.05).abs() < 0.06, "{found:?}");
        assert!(found.sigma[0] < 0.1 && found.sigma[0] > 0.07, "{found:?}");
        assert!(found.confidence[0] < 0.9 && found.confidence[0] > 0.5, "{found:?}");
        // Nothing changes by what is not confident, and by another size.
        fusion.add(&frame(5.0, 0.1)).unwrap();
        assert_eq!(fusion.map(), found);
        assert!(fusion.add(&DisparityMap { height: 2, ..frame(5.0, 0.9) }).is_err());
    }
}
