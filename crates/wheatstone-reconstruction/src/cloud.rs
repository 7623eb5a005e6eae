//! Points in the world, with what is known of each.

use wheatstone_core::dataset::volume::Trust;
use wheatstone_numeric::statistics::median;

/// Points in the world, column by column: entry `i` of every column belongs to one point.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Cloud {
    /// X, Y and Z in the world, in the model's unit.
    pub points: Vec<[f64; 3]>,
    /// Standard deviations of X, Y and Z, in the model's unit: of the match and of the calibration.
    pub sigmas: Vec<[f32; 3]>,
    /// The probability that the disparity is less than a pixel off, 0 to 1; of several pairs, that those that agree are
    /// right.
    pub confidence: Vec<f32>,
    /// Red, green and blue of the reference camera's picture.
    pub colours: Vec<[u8; 3]>,
    /// The matched pixels in each camera's own picture, in the order of the settings; NaN where a camera has none.
    pub pixels: Vec<Vec<[f32; 2]>>,
    /// Whether the pixels show what the calibration was shown.
    pub trust: Vec<Trust>,
    /// The pixel of the left rectified picture, row by row.
    pub places: Vec<u32>,
}

impl Cloud {
    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Adds the points of another, after these.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.points.append(&mut other.points);
        self.sigmas.append(&mut other.sigmas);
        self.confidence.append(&mut other.confidence);
        self.colours.append(&mut other.colours);
        self.trust.append(&mut other.trust);
        self.places.append(&mut other.places);
        self.pixels.iter_mut().zip(&mut other.pixels).for_each(|(own, other)| own.append(other));
    }

    /// Drops all points but those that are to be kept; `keep` has as many values.
    pub(crate) fn retain(&mut self, keep: &[bool]) {
        fn kept<T: Copy>(column: &mut Vec<T>, keep: &[bool]) {
            let both = column.iter().zip(keep).filter(|(_, keep)| **keep);
            *column = both.map(|(value, _)| *value).collect();
        }
        kept(&mut self.points, keep);
        kept(&mut self.sigmas, keep);
        kept(&mut self.confidence, keep);
        kept(&mut self.colours, keep);
        kept(&mut self.trust, keep);
        kept(&mut self.places, keep);
        self.pixels.iter_mut().for_each(|camera| kept(camera, keep));
    }

    /// Least and largest X, Y and Z; none of no points.
    #[must_use]
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let first = *self.points.first()?;
        Some(self.points.iter().fold([first; 2], |[low, high], point| {
            let by = |of: fn(f64, f64) -> f64, bound: [f64; 3]| {
                std::array::from_fn(|axis| of(bound[axis], point[axis]))
            };
            [by(f64::min, low), by(f64::max, high)]
        }))
    }

    /// By how much single precision rounds coordinates at most, where that is no longer small against error bars: more than a
    /// tenth of the median standard deviation along the same axis. So it is far from the origin, as in the frame of a survey.
    #[must_use]
    pub fn float_rounding(&self) -> Option<f64> {
        const MOST_SHARE: f64 = 0.1;
        let farthest = self.bounds()?.map(|bound| bound.map(f64::abs));
        let coarse = (0..3).filter_map(|axis| {
            let farthest = farthest[0][axis].max(farthest[1][axis]) as f32;
            let rounding = 0.5 * (f64::from(farthest.next_up()) - f64::from(farthest));
            let sigmas: Vec<f64> = self.sigmas.iter().map(|own| f64::from(own[axis])).collect();
            let sigma = median(&sigmas);
            (sigma > 0.0 && rounding > MOST_SHARE * sigma).then_some(rounding)
        });
        coarse.reduce(f64::max)
    }

    /// The share of the points that lie where the calibration had data, 0 to 1.
    #[must_use]
    pub fn trusted(&self) -> f64 {
        let trusted = self.trust.iter().filter(|trust| **trust != Trust::Outside).count();
        trusted as f64 / self.trust.len().max(1) as f64
    }
}
