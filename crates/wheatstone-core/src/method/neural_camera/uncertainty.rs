//! What is not known of a fitted camera: its covariance under settings that are chosen for error bars.
//!
//! A fit takes the settings of greatest evidence, and with them no correction where points do not ask for
//! one. That is best for its numbers, but says of what points cannot tell that it is not there, so that error
//! bars beyond the points would be too small. So the settings are chosen again about the fitted camera, by a
//! hyperprior that does not prefer a camera without waves, with more functions. The camera itself stays as it is.

use super::{
    evidence::{Posterior, Search},
    fit::State,
    settings::{Hyperprior, NOISE, SETTINGS, WAVES},
};

/// The least amplitude of waves that a search begins with, in standard deviations of the noise: from
/// none it would not come away.
const LEAST: f64 = 0.5;

impl State<'_> {
    /// With the functions of error bars, and the posterior under their settings, to be read as a covariance
    /// about the mode of `fitted`.
    pub(super) fn uncertainty(mut self, fitted: &Posterior) -> Option<(Self, Posterior)> {
        self.field = self.field.with_more_polynomials();
        self.weights.resize(self.field.len(), [0.0; 2]);
        let mut start = fitted.settings;
        let least = start.logs[NOISE] + libm::log(LEAST);
        start.logs[WAVES] = start.logs[WAVES].max(least);
        // The noise is what it is.
        let free = std::array::from_fn::<bool, SETTINGS, _>(|setting| setting != NOISE);
        let search = Search { free, hyperprior: Hyperprior::OF_ERROR_BARS };
        let posterior = self.sums()?.climb(&self.field, start, search)?;
        Some((self, posterior))
    }
}
