//! Many points at once: columns of pixels in, columns of places out.

use super::Reconstructor;
use crate::{
    dataset::volume::{Trust, Volume},
    geometry::PixelColumns,
};
use rayon::prelude::*;

/// Where points are, column by column, in the order of their pixels. NaN stands where a point was not
/// located, and for figures that do not exist.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// X, Y and Z, in world units.
    pub point: [Vec<f64>; 3],
    /// Covariance XX, XY, XZ, YY, YZ, ZZ, in squared world units; empty where it was not asked for.
    pub covariance: [Vec<f64>; 6],
    /// How badly the rays miss each other: root mean square over pixel coordinates.
    pub residual: Vec<f64>,
    /// What noise and uncertainty of the fit let expect of it; empty where the covariance is.
    pub residual_sigma: Vec<f64>,
    /// Whether the pixels show what the fit was shown; empty where no volume was given.
    pub trust: Vec<Trust>,
}

/// A fitted map made ready for many points.
pub struct Locator<'a> {
    reconstructor: &'a dyn Reconstructor,
    volume: Option<&'a Volume>,
    with_covariance: bool,
}

/// Points a task: large enough to pay for handing it over, small enough to balance.
const TASK: usize = 2048;

impl<'a> Locator<'a> {
    /// Of a map, and the volume by which trust is judged.
    #[must_use]
    pub fn new(reconstructor: &'a dyn Reconstructor, volume: Option<&'a Volume>) -> Self {
        Self { reconstructor, volume, with_covariance: true }
    }

    /// Without covariances and what residuals to expect, which take most of the time.
    #[must_use]
    pub fn without_covariance(mut self) -> Self {
        self.with_covariance = false;
        self
    }

    /// Locates points, in parallel. What a point gives depends on its pixels alone, not on the others.
    #[must_use]
    pub fn locate(&mut self, pixels: &PixelColumns) -> Places {
        let count = pixels.points();
        let parts: Vec<Places> = (0..count.div_ceil(TASK))
            .into_par_iter()
            .map(|part| self.part(&pixels.part(part * TASK..count.min((part + 1) * TASK))))
            .collect();
        let mut places = Places::default();
        for part in parts {
            places.extend(part);
        }
        places
    }

    fn part(&self, pixels: &PixelColumns) -> Places {
        const LOWER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let mut places = Places::default();
        for index in 0..pixels.points() {
            let row: Vec<_> = pixels.point(index).collect();
            let found = self.reconstructor.locate(&row);
            let figure = |of: &dyn Fn(&super::Located) -> f64| found.as_ref().map_or(f64::NAN, of);
            for (axis, column) in places.point.iter_mut().enumerate() {
                column.push(figure(&|found| found.point[axis]));
            }
            places.residual.push(figure(&|found| found.residual));
            if self.with_covariance {
                for (place, column) in LOWER.into_iter().zip(&mut places.covariance) {
                    column.push(figure(&|found| found.covariance[place]));
                }
                places.residual_sigma.push(figure(&|found| found.residual_sigma));
            }
            places.trust.extend(self.volume.map(|volume| volume.trust(&row)));
        }
        places
    }
}

impl Places {
    fn extend(&mut self, other: Self) {
        let own = self.point.iter_mut().chain(&mut self.covariance);
        let own = own.chain([&mut self.residual, &mut self.residual_sigma]);
        let others = other.point.iter().chain(&other.covariance);
        let others = others.chain([&other.residual, &other.residual_sigma]);
        own.zip(others).for_each(|(own, other)| own.extend_from_slice(other));
        self.trust.extend_from_slice(&other.trust);
    }
}
