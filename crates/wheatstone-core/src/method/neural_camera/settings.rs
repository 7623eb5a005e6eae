//! The priors of a camera's numbers and of its correction, and the noise: what the evidence chooses.

use super::{
    correction_basis::Field,
    lens::{FIRST_EXPECTED, FIRST_OF_PRINCIPAL, FIRST_RADIAL, FIRST_TANGENTIAL, OF_PUPIL},
};
use serde::{Deserialize, Deserializer, Serialize, de::Error};
use std::ops::Range;

/// A function's prior variance in squared pixels, and the derivatives of its logarithm by the
/// settings' logarithms: (setting, derivative).
pub(super) type Variance = (f64, [(usize, f64); 2]);

/// What the priors and the noise are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    /// Natural logarithms of, in this order: the pixel noise (px); the standard deviations of a
    /// pixel's shape, of the principal point (focal lengths), of the radial and the tangential terms; the waves' (px)
    /// and their length (units of the field); the parallax' (px) and the share of it that each degree keeps; the
    /// distortion's (px), of which each degree keeps as much as half the field of view has radians; the pupil's.
    #[serde(deserialize_with = "of_any_program")]
    pub(super) logs: [f64; SETTINGS],
}

/// Settings of cameras before there were polynomials of the picture end with those of the parallax, and those of cameras before
/// pupils moved with the distortion's.
fn of_any_program<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; SETTINGS], D::Error> {
    let mut logs = Vec::deserialize(from)?;
    if logs.len() == DISTORTION {
        logs.push(libm::log(NO_DISTORTION));
    }
    if logs.len() == PUPIL {
        logs.push(libm::log(NO_PUPIL));
    }
    let count = logs.len();
    logs.try_into().map_err(|_| D::Error::invalid_length(count, &"the settings of a camera"))
}

pub(super) const SETTINGS: usize = 11;
pub(super) const NOISE: usize = 0;
const SHAPE: usize = 1;
const PRINCIPAL: usize = 2;
const RADIAL: usize = 3;
const TANGENTIAL: usize = 4;
pub(super) const WAVES: usize = 5;
pub(super) const LENGTH: usize = 6;
pub(super) const PARALLAX: usize = 7;
const DECAY: usize = 8;
pub(super) const DISTORTION: usize = 9;
pub(super) const PUPIL: usize = 10;

/// Amplitude of the distortion, in pixels, of a camera that has none.
const NO_DISTORTION: f64 = 1e-6;
/// Standard deviation of the movement of a pupil that stays.
const NO_PUPIL: f64 = 1e-6;

/// The settings that only the field has.
pub(super) const OF_FIELD: Range<usize> = WAVES..PUPIL;

impl Settings {
    /// Lowest and highest values of the settings (not their logarithms). Noise: a thousandth of a
    /// pixel is better than any detector. Lengths: beyond twice the picture a wave is a constant. Distortion of the
    /// lowest amplitude has no freedom, and stays there.
    const BOUNDS: [[f64; 2]; SETTINGS] = [
        [1e-3, 100.0],
        [1e-4, 1.0],
        [1e-3, 3.0],
        [1e-5, 3.0],
        [1e-6, 0.3],
        [1e-4, 100.0],
        [0.05, 4.0],
        [1e-4, 100.0],
        [0.03, 1.0],
        [NO_DISTORTION, 100.0],
        [NO_PUPIL, 0.3],
    ];

    /// Scales of exponential hyperpriors on the amplitudes, which prefer none where points are too
    /// few to tell (Simpson et al. 2017, doi:10.1214/16-STS576): lenses bend by tenths, tangentially
    /// by hundredths; corrections are of the order of a pixel to ten, and what distortion is left beside them is of
    /// about a pixel; pupils that move change the first radial term by thousandths to hundredths.
    const SCALES: [f64; SETTINGS] =
        [f64::INFINITY, 0.02, 0.2, 0.3, 0.01, 3.0, f64::INFINITY, 3.0, f64::INFINITY, 1.0, 0.02];

    /// Where a search begins, for points that the bare camera misses by `noise` pixels.
    pub(super) fn start(noise: f64) -> Self {
        let values = [noise, 0.02, 0.2, 0.1, 0.01, noise, 0.4, noise, 0.4, NO_DISTORTION, NO_PUPIL];
        Self { logs: values.map(libm::log) }
    }

    pub(super) fn value(&self, index: usize) -> f64 {
        libm::exp(self.logs[index])
    }

    pub(super) fn bounded(mut self, field: &Field, hyperprior: Hyperprior) -> Self {
        // Waves shorter than these are missing, so that a shorter length would ring.
        let shortest = field.waves.last().map_or(0.0, |wave| RESOLVED / field.frequency(*wave));
        self.logs[LENGTH] = self.logs[LENGTH].max(libm::log(shortest.max(f64::MIN_POSITIVE)));
        for (log, [low, high]) in self.logs.iter_mut().zip(Self::BOUNDS) {
            *log = log.clamp(libm::log(low), libm::log(high));
        }
        self.logs[DECAY] = self.logs[DECAY].min(libm::log(hyperprior.most_decay * field.view));
        self
    }

    /// Prior variances of the field's functions.
    pub(super) fn field_variances(&self, field: &Field) -> Vec<Variance> {
        let (length, area) = (self.value(LENGTH), field.area());
        let waves = field.waves.iter().map(|wave| {
            let turns = (length * field.frequency(*wave)).powi(2);
            // The squared exponential kernel's spectral density, over the box's area.
            let density = 2.0 * std::f64::consts::PI * length * length * libm::exp(-0.5 * turns);
            let variance = self.value(WAVES).powi(2) * density / area;
            (variance, [(WAVES, 2.0), (LENGTH, 2.0 - turns)])
        });
        let distortion = field.distortion.iter().map(|[x, y]| {
            let degree = (x + y) as f64 - 2.0;
            let log = 2.0 * self.logs[DISTORTION] + 2.0 * degree * libm::log(field.view);
            (libm::exp(log), [(DISTORTION, 2.0), (DISTORTION, 0.0)])
        });
        let parallax = field.parallax.iter().map(|[x, y]| {
            let degree = 2.0 * (x + y) as f64 - 2.0;
            let log = 2.0 * self.logs[PARALLAX] + degree * self.logs[DECAY];
            (libm::exp(log), [(PARALLAX, 2.0), (DECAY, degree)])
        });
        waves.chain(distortion).chain(parallax).collect()
    }

    /// Precision of a number that is expected near 0, and the setting that gives it. What follows
    /// the lens's own numbers comes in units of its standard deviation, which no setting changes.
    pub(super) fn lens_precision(&self, index: usize) -> (f64, Option<usize>) {
        let setting = match index {
            0..FIRST_OF_PRINCIPAL => SHAPE,
            FIRST_OF_PRINCIPAL..FIRST_RADIAL => PRINCIPAL,
            FIRST_RADIAL..FIRST_TANGENTIAL => RADIAL,
            FIRST_TANGENTIAL..OF_PUPIL => TANGENTIAL,
            OF_PUPIL => PUPIL,
            _ => return (1.0, None),
        };
        (1.0 / self.value(setting).powi(2), Some(setting))
    }

    /// Minus twice the logarithm of the prior of a lens and its correction, less a constant.
    pub(super) fn penalty(&self, field: &Field, weights: &[[f64; 2]], numbers: &[f64]) -> f64 {
        let lens = (FIRST_EXPECTED..numbers.len())
            .map(|index| self.lens_precision(index).0 * numbers[index].powi(2));
        let variances = self.field_variances(field);
        let field = weights.iter().zip(&variances).map(|(weight, (variance, _))| {
            let square = weight[0].powi(2) + weight[1].powi(2);
            if square > 0.0 { square / variance } else { 0.0 }
        });
        lens.sum::<f64>() + field.sum::<f64>()
    }
}

/// What is held of the settings before a point is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hyperprior {
    /// The density of the logarithm of the waves' amplitude has this power of the amplitude, besides the exponential that
    /// ends it. With 0, as for the other amplitudes, it is greatest at no amplitude at all.
    power_of_waves: f64,
    /// What a port does to a ray at an angle is a series in the angle's powers: the most that each degree
    /// more brings, as a share of the widest angle.
    most_decay: f64,
}

impl Hyperprior {
    /// Prefers no correction where points do not ask for one.
    pub(super) const OF_FIT: Self = Self { power_of_waves: 0.0, most_decay: 1.0 };

    /// Waves that points do not tell are not taken for none: half way from an amplitude of which every size is as likely,
    /// whose logarithm's density has the power 1, to one of which every order of magnitude is (0). A ray is bent more
    /// inside water than a camera's field of view shows. Both numbers are those by which the error bars of the
    /// synthetic rigs hold beyond their charts: with a power of 1 those of a mirror are too wide, with the decay
    /// of a fit those behind a port too small.
    pub(super) const OF_ERROR_BARS: Self = Self { power_of_waves: 0.5, most_decay: 2.0 };

    fn power(self, index: usize) -> f64 {
        if index == WAVES { self.power_of_waves } else { 0.0 }
    }

    /// Logarithm of the density, less a constant.
    pub(super) fn log_density(self, settings: &Settings) -> f64 {
        let of = |index: usize| {
            self.power(index) * settings.logs[index]
                - settings.value(index) / Settings::SCALES[index]
        };
        (0..SETTINGS).map(of).sum()
    }

    /// Its derivative by a setting's logarithm.
    pub(super) fn slope(self, settings: &Settings, index: usize) -> f64 {
        self.power(index) - settings.value(index) / Settings::SCALES[index]
    }
}

/// Length times highest frequency at which the spectral density has fallen to a hundredth.
const RESOLVED: f64 = 3.0;
