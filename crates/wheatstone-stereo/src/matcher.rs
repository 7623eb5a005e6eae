//! The steps from two pictures to a map.

use crate::{
    aggregation::Penalties,
    agreement,
    bands::{self, Candidates},
    buffers::Pools,
    candidates::RightCodes,
    census::Codes,
    confidence,
    cost::CodedPair,
    curves::EpipolarCurves,
    error::MatchError,
    error_bars,
    evidence::{BAND, Evidence, Found},
    field::Field,
    filling,
    least_squares::Round,
    left_right,
    map::DisparityMap,
    median, noise_correlation,
    pair::Pair,
    picture::Picture,
    repetition, saturation,
    search_range::SearchRange,
    speckles,
    warp::Warped,
    window::RADIUS,
};
use rayon::prelude::*;
use std::ops::Range;

/// Pixels from the centre to the side of windows in the first round of refinement, which leaves less than a tenth of a
/// pixel to the second.
const FIRST_RADIUS: usize = 3;

/// How to match pairs of pictures.
///
/// A matcher keeps memory for the next pair, a quarter of a gigabyte at most, which spares small pictures a tenth of the time. Its clones
/// share it, in other threads too.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Matcher {
    /// Disparities to search, in pixels: x on the left less x on the right. They may be negative. Time and memory grow with their number.
    pub range: Range<i32>,
    /// What changes of disparity cost. The defaults were chosen on Middlebury's pairs.
    pub penalties: Penalties,
    /// Surfaces of fewer pixels are taken away. Default: 60.
    pub least_surface: usize,
    /// Whether disparities are refined by least squares, which halves their errors on textured surfaces and costs about as much
    /// time as the search of 80 disparities. Default: yes.
    pub refines: bool,
    /// Whether gaps are filled with the disparities of what is behind. Default: no.
    pub fills: bool,
    pools: Pools,
}

impl Matcher {
    /// Searches a range of disparities, with the defaults.
    #[must_use]
    pub fn new(range: Range<i32>) -> Self {
        let penalties = Penalties::default();
        let pools = Pools::default();
        Self { range, penalties, least_surface: 60, refines: true, fills: false, pools }
    }

    /// Sets [`Matcher::range`].
    #[must_use]
    pub fn range(self, range: Range<i32>) -> Self {
        Self { range, ..self }
    }

    /// Sets [`Matcher::penalties`].
    #[must_use]
    pub fn penalties(self, penalties: Penalties) -> Self {
        Self { penalties, ..self }
    }

    /// Sets [`Matcher::least_surface`].
    #[must_use]
    pub fn least_surface(self, least_surface: usize) -> Self {
        Self { least_surface, ..self }
    }

    /// Sets [`Matcher::refines`].
    #[must_use]
    pub fn refining(self, refines: bool) -> Self {
        Self { refines, ..self }
    }

    /// Sets [`Matcher::fills`].
    #[must_use]
    pub fn filling(self, fills: bool) -> Self {
        Self { fills, ..self }
    }

    /// Matches every pixel of the left picture. Both must be rectified: what both see lies in one row, to
    /// a quarter of a pixel; farther off, [`Matcher::compute_along`] is for them.
    ///
    /// Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// Where pictures have two sizes, the range is empty, too large or leads out of the picture everywhere, or penalties do not grow.
    pub fn compute(
        &self,
        left: &Picture<'_>,
        right: &Picture<'_>,
    ) -> Result<DisparityMap, MatchError> {
        self.map(&Pair { left, right, curves: None })
    }

    /// As [`Matcher::compute`], where the right picture shows things as much lower as curves say. Curves of zero give
    /// the same map. It takes half as much time again, and twelve bytes a pixel more.
    ///
    /// # Errors
    ///
    /// As there, and where the curves are for pictures of another size, or not for all disparities of the range.
    pub fn compute_along(
        &self,
        left: &Picture<'_>,
        right: &Picture<'_>,
        curves: &EpipolarCurves,
    ) -> Result<DisparityMap, MatchError> {
        self.map(&Pair { left, right, curves: Some(curves) })
    }

    fn map(&self, pair: &Pair<'_>) -> Result<DisparityMap, MatchError> {
        let checked = self.check(pair)?;
        let (width, height) = (pair.left.width(), pair.left.height());
        let mut confidence = vec![0.0; width * height];
        let mut scatter = self.pools.floats.any(width * height);
        let residual = checked.evaluate(&mut confidence, &mut scatter);
        let Checked { candidates, left_right, surface, mut disparity, mut warped, range } = checked;
        drop((candidates, left_right, surface));
        let sigma = if self.refines {
            let (gradient, residual) = (&warped.gradient, &residual);
            let round = Round { disparity: &disparity, gradient, residual, radius: FIRST_RADIUS };
            let (first, _) = round.refine();
            warped.move_right(&first, pair);
            let (gradient, residual) = (&warped.gradient, &agreement::residuals(&first, &warped));
            let round = Round { disparity: &first, gradient, residual, radius: RADIUS };
            let (second, from_residuals) = round.refine();
            disparity = second;
            let excess = noise_correlation::excess(residual, &confidence);
            error_bars::refined(&from_residuals, &confidence, excess)
        } else {
            error_bars::unrefined(&scatter, &confidence)
        };
        let mut disparity = disparity.to_pixels();
        let (least, most) = range.bounds();
        disparity.iter_mut().for_each(|value| *value = value.clamp(least, most));
        if self.fills {
            filling::fill(&mut disparity, width);
        }
        let mut map = DisparityMap { width, height, disparity, confidence, sigma };
        saturation::doubt(&mut map, [pair.left, pair.right]);
        repetition::doubt(&mut map, pair.left, range);
        Ok(map)
    }

    /// What the confidences of [`Matcher::compute`] are computed from.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn evidence(
        &self,
        left: &Picture<'_>,
        right: &Picture<'_>,
    ) -> Result<Evidence, MatchError> {
        let checked = self.check(&Pair { left, right, curves: None })?;
        Ok(Evidence::of(&checked.found(&checked.candidates.lead(left.width()))))
    }

    /// Searches, and takes away what does not pass.
    fn check(&self, pair: &Pair<'_>) -> Result<Checked, MatchError> {
        self.penalties.check()?;
        let range = pair.check(&self.range)?;
        let (width, height) = (pair.left.width(), pair.left.height());
        let candidates = {
            let pool = &self.pools.bytes;
            let (left, right) = (&Codes::new(pair.left, pool), &RightCodes::new(pair, pool));
            let coded = CodedPair { left, right, width, height, range };
            bands::search(coded, pair.left, &self.penalties, &self.pools)
        };
        let [mut passed, left_right] = left_right::check(&candidates, width, range);
        if let Some(curves) = pair.curves {
            left_right::forget_outside(&mut passed, curves);
        }
        let mut disparity = median::of_five(&passed);
        drop(passed);
        let surface = speckles::remove(&mut disparity, self.least_surface);
        let warped = Warped::new(&disparity, pair);
        Ok(Checked { candidates, left_right, disparity, surface, warped, range })
    }
}

/// Disparities that passed the checks.
struct Checked {
    candidates: Candidates,
    left_right: Field,
    disparity: Field,
    /// Logarithms of surfaces' pixels.
    surface: Field,
    warped: Warped,
    range: SearchRange,
}

impl Checked {
    fn found<'a>(&'a self, lead: &'a Field) -> Found<'a> {
        let Self { candidates, left_right, disparity, surface, warped, .. } = self;
        Found { disparity, left_right, surface, warped, candidates, lead }
    }

    /// Writes the confidence of every pixel and how much its neighbours scatter, and returns the residuals.
    fn evaluate(&self, confidence: &mut [f32], scatter: &mut [f32]) -> Field {
        let width = self.disparity.width;
        let lead = &self.candidates.lead(width);
        let bands =
            confidence.par_chunks_mut(BAND * width).zip(scatter.par_chunks_mut(BAND * width));
        self.found(lead).for_each_band(bands, |evidence, (confidence, scatter)| {
            confidence::write(evidence, confidence);
            scatter.copy_from_slice(&evidence.scatter[..scatter.len()]);
        })
    }
}
