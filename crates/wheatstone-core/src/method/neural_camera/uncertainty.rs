//! What is not known of a fitted camera: its covariance under settings that are chosen for error bars.
//!
//! A fit takes the settings of greatest evidence, and with them no correction where points do not ask for
//! one. That is best for its numbers, but says of what points cannot tell that it is not there, so that error
//! bars beyond the points would be too small. So the settings are chosen again about the fitted camera, by a
//! hyperprior that does not prefer a camera without waves, with more functions. The camera itself stays as it is.

use super::{
    correction_basis::Field,
    evidence::{Posterior, Search},
    fit::State,
    settings::{Hyperprior, LENGTH, NOISE, SETTINGS, Settings, WAVES},
};
use crate::geometry::Pixel;
use serde::{Deserialize, Serialize};

/// The least amplitude of waves that a search begins with, in standard deviations of the noise: from
/// none it would not come away.
const LEAST: f64 = 0.5;

/// The functions whose weights are uncertain, and how far waves may change where no points are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UncertainFunctions {
    field: Field,
    /// Standard deviation of the kernel whose part the waves are, in pixels.
    amplitude: f64,
    /// And its length, in units of the field.
    length: f64,
}

impl UncertainFunctions {
    pub(super) fn new(field: Field, settings: &Settings) -> Self {
        let [amplitude, length] = [WAVES, LENGTH].map(|setting| settings.value(setting));
        Self { field, amplitude, length }
    }

    /// Those of `field` that have freedom.
    pub(super) fn of(field: &Field, Posterior { settings, active, .. }: &Posterior) -> Self {
        Self::new(field.pruned(active), settings)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.field.len()
    }

    /// Their values at a place; and the standard deviation, in pixels along either axis, of what waves do
    /// beyond the points, where their weights say that they stay as they are.
    pub(super) fn at(&self, pixel: Pixel, nearness: f64) -> (Vec<f64>, f64) {
        let distance = self.field.beyond(pixel) / self.length;
        let alike = libm::exp(-0.5 * distance.powi(2));
        let change = self.amplitude * (2.0 * (1.0 - alike)).sqrt();
        (self.field.uncertain_values(pixel, nearness), change)
    }

    pub(super) fn is_consistent(&self) -> bool {
        let is_size = |value: f64| value.is_finite() && value > 0.0;
        self.field.is_consistent() && is_size(self.amplitude) && is_size(self.length)
    }
}

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
