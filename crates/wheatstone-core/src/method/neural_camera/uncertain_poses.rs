//! Cameras fitted to charts that may not stand where they are believed to: what the pixels of one
//! camera say about that, whatever the camera is.
//!
//! A chart's motion joins the lens's numbers with a prior of its own; field and lens are then
//! eliminated (the Schur complement of bundle adjustment, Triggs et al. 2000,
//! doi:10.1007/3-540-44480-7_21), and the evidence that sets noise and correction is that of pixels
//! whose charts are loose, so that it takes no chart's error for noise or for a bent lens.

use super::{
    super::checks::enough,
    chart_poses::{UncertainPose, UncertainPoses},
    evidence::{Posterior, Search},
    fit::{POINTS_NEEDED, State, fit_state, undetermined},
    lens::PARAMETERS,
    settings::Settings,
};
use crate::{
    Result,
    geometry::{Pixel, Point3, ProjectionMatrix},
};
use nalgebra::{DMatrix, DVector};
use wheatstone_numeric::progress::Progress;

/// What one camera says about all motions, in units of their standard deviations, its own numbers
/// eliminated: its logarithm of likelihood is `vector . m - m' matrix m / 2` of the motions `m`.
#[derive(Clone, Debug)]
pub(crate) struct Information {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) vector: DVector<f64>,
}

impl Information {
    pub(super) fn of(posterior: &Posterior, motions: &[f64]) -> Option<Self> {
        let count = motions.len();
        let covariance = posterior.lens_covariance.view((PARAMETERS, PARAMETERS), (count, count));
        let precision = covariance.into_owned().cholesky()?.inverse();
        let mean = DVector::from_fn(count, |index, _| {
            motions[index] + posterior.mode.step[PARAMETERS + index]
        });
        let vector = &precision * mean;
        // The posterior holds the prior, which is not the camera's to say.
        Some(Self { matrix: precision - DMatrix::identity(count, count), vector })
    }
}

/// A camera on its way to be fitted, with loose charts.
pub(crate) struct CameraNormalEquations<'a> {
    state: State<'a>,
    settings: Settings,
}

impl<'a> CameraNormalEquations<'a> {
    /// Fits a camera and, for itself alone, where the charts stand.
    pub(crate) fn fit(
        pairs: &'a [(Point3, Pixel)],
        charts: UncertainPoses,
        camera: usize,
        progress: &dyn Progress,
    ) -> Result<(Self, Information)> {
        enough("estimating chart poses", Some(camera), POINTS_NEEDED, pairs.len())?;
        let start = ProjectionMatrix::fit(pairs).ok_or_else(undetermined)?;
        let (state, posterior) = fit_state(pairs, &start, Some(charts), progress)?;
        let camera = Self { state, settings: posterior.settings };
        let information = camera.information(&posterior).ok_or_else(undetermined)?;
        Ok((camera, information))
    }

    fn information(&self, posterior: &Posterior) -> Option<Information> {
        let motions: Vec<f64> =
            self.state.charts.iter().flat_map(UncertainPoses::free_numbers).collect();
        Information::of(posterior, &motions)
    }

    fn hold(&mut self, held: bool) {
        if let Some(charts) = &mut self.state.charts {
            charts.held = held;
        }
    }

    /// Refits the camera to charts that stand as `charts` do, learns noise and priors anew if asked,
    /// and says again what it knows about the charts. `None` where a point no longer projects.
    pub(crate) fn refit(&mut self, charts: &[UncertainPose], learn: bool) -> Option<Information> {
        if let Some(loose) = &mut self.state.charts {
            loose.charts = charts.to_vec();
        }
        self.hold(true);
        let sums = self.state.sums()?;
        let held = sums.posterior(&self.state.field, self.settings)?;
        self.state.solve(sums, &held)?;
        self.hold(false);
        let sums = self.state.sums()?;
        let posterior = if learn {
            sums.climb(&self.state.field, self.settings, Search::ALL)?
        } else {
            sums.posterior(&self.state.field, self.settings)?
        };
        self.settings = posterior.settings;
        self.information(&posterior)
    }

    /// Standard deviation of one pixel coordinate that neither camera nor charts explain.
    pub(crate) fn noise(&self) -> f64 {
        self.settings.value(super::settings::NOISE)
    }
}
