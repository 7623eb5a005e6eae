//! How much correction the points ask for: the evidence (marginal likelihood) of a linear model with
//! Gaussian priors, and the settings of the priors that make it greatest.
//!
//! Source: MacKay 1992, "Bayesian interpolation" (doi:10.1162/neco.1992.4.3.415), as Foresee & Hagan
//! 1997 (doi:10.1109/ICNN.1997.614194) use it for networks. Everything is computed with the weights
//! in units of their prior standard deviation, so that functions without any freedom cost nothing
//! and overflow nothing. The x and the y displacement share one prior, hence one factorisation.

use super::{
    field::Field,
    lens::{FIRST_EXPECTED, FIRST_OF_PRINCIPAL, FIRST_RADIAL, FIRST_TANGENTIAL, PARAMETERS},
};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A function's prior variance in squared pixels, and the derivatives of its logarithm by the
/// settings' logarithms: (setting, derivative).
type Variance = (f64, [(usize, f64); 2]);

/// What the priors and the noise are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    /// Natural logarithms of, in this order: the pixel noise (px); the standard deviations of a
    /// pixel's shape, of the principal point (focal lengths), of the radial and the tangential terms; the waves' (px) and their length (units
    /// of the field); the parallax' (px) and the share of it that each degree keeps.
    pub(super) logs: [f64; SETTINGS],
}

pub(super) const SETTINGS: usize = 9;
pub(super) const NOISE: usize = 0;
const SHAPE: usize = 1;
const PRINCIPAL: usize = 2;
const RADIAL: usize = 3;
const TANGENTIAL: usize = 4;
pub(super) const WAVES: usize = 5;
pub(super) const LENGTH: usize = 6;
pub(super) const PARALLAX: usize = 7;
const DECAY: usize = 8;

/// The settings that only the field has.
pub(super) const OF_FIELD: Range<usize> = WAVES..SETTINGS;

impl Settings {
    /// Lowest and highest values of the settings (not their logarithms). Noise: a thousandth of a
    /// pixel is better than any detector. Lengths: beyond twice the picture a wave is a constant.
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
    ];

    /// Scales of exponential hyperpriors on the amplitudes, which prefer none where points are too
    /// few to tell (Simpson et al. 2017, doi:10.1214/16-STS576): lenses bend by tenths, tangentially
    /// by hundredths; corrections are of the order of a pixel to ten.
    const SCALES: [f64; SETTINGS] =
        [f64::INFINITY, 0.02, 0.2, 0.3, 0.01, 3.0, f64::INFINITY, 3.0, f64::INFINITY];

    /// Where a search begins, for points that the bare camera misses by `noise` pixels.
    pub(super) fn start(noise: f64) -> Self {
        let values = [noise, 0.02, 0.2, 0.1, 0.01, noise, 0.4, noise, 0.4];
        Self { logs: values.map(libm::log) }
    }

    pub(super) fn value(&self, index: usize) -> f64 {
        libm::exp(self.logs[index])
    }

    fn bounded(mut self, field: &Field) -> Self {
        // Waves shorter than these are missing, so that a shorter length would ring.
        let shortest = field.waves.last().map_or(0.0, |wave| RESOLVED / field.frequency(*wave));
        self.logs[LENGTH] = self.logs[LENGTH].max(libm::log(shortest.max(f64::MIN_POSITIVE)));
        for (log, [low, high]) in self.logs.iter_mut().zip(Self::BOUNDS) {
            *log = log.clamp(libm::log(low), libm::log(high));
        }
        // What a port does to a ray at an angle is a series in the angle's powers: each degree more
        // brings at most a factor of the widest angle.
        self.logs[DECAY] = self.logs[DECAY].min(libm::log(field.view));
        self
    }

    /// Prior variances of the field's functions.
    fn field_variances(&self, field: &Field) -> Vec<Variance> {
        let (length, area) = (self.value(LENGTH), field.area());
        let waves = field.waves.iter().map(|wave| {
            let turns = (length * field.frequency(*wave)).powi(2);
            // The squared exponential kernel's spectral density, over the box's area.
            let density = 2.0 * std::f64::consts::PI * length * length * libm::exp(-0.5 * turns);
            let variance = self.value(WAVES).powi(2) * density / area;
            (variance, [(WAVES, 2.0), (LENGTH, 2.0 - turns)])
        });
        let parallax = field.parallax.iter().map(|[x, y]| {
            let degree = 2.0 * (x + y) as f64 - 2.0;
            let log = 2.0 * self.logs[PARALLAX] + degree * self.logs[DECAY];
            (libm::exp(log), [(PARALLAX, 2.0), (DECAY, degree)])
        });
        waves.chain(parallax).collect()
    }

    /// Precision of a number that is expected near 0, and the setting that gives it. What follows
    /// the lens's own numbers comes in units of its standard deviation, which no setting changes.
    fn lens_precision(&self, index: usize) -> (f64, Option<usize>) {
        let setting = match index {
            0..FIRST_OF_PRINCIPAL => SHAPE,
            FIRST_OF_PRINCIPAL..FIRST_RADIAL => PRINCIPAL,
            FIRST_RADIAL..FIRST_TANGENTIAL => RADIAL,
            FIRST_TANGENTIAL..PARAMETERS => TANGENTIAL,
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

    fn log_hyperprior(&self) -> f64 {
        (0..SETTINGS).map(|index| -self.value(index) / Self::SCALES[index]).sum()
    }
}

/// Sums over the points of a camera, linearised about its present state: products of the field's
/// functions F, the slopes J by the lens's numbers, and the errors e without any correction.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    /// F'F.
    pub(super) field: DMatrix<f64>,
    /// F'J for x and y.
    pub(super) mixed: [DMatrix<f64>; 2],
    /// F'e for x and y.
    pub(super) field_errors: [DVector<f64>; 2],
    /// J'J over both coordinates.
    pub(super) lens: DMatrix<f64>,
    /// J'e over both coordinates.
    pub(super) lens_errors: DVector<f64>,
    /// e'e over both coordinates.
    pub(super) squares: f64,
    /// Points.
    pub(super) points: usize,
    /// The lens's present numbers, of which those of the lens itself are expected near 0; then those
    /// of charts that may have moved, if any.
    pub(super) numbers: Vec<f64>,
}

/// The most likely step and weights under some settings, and how good the settings are.
#[derive(Clone, Debug)]
pub(super) struct Posterior {
    pub(super) settings: Settings,
    /// Logarithm of evidence and hyperprior, less a constant.
    pub(super) evidence: f64,
    /// By the settings' logarithms.
    gradient: [f64; SETTINGS],
    /// The lens's numbers, and those of charts, change by this.
    pub(super) step: DVector<f64>,
    /// Of the field's functions, for x and y.
    pub(super) weights: Vec<[f64; 2]>,
    /// Effective number of parameters.
    pub(super) effective: f64,
    /// The functions that have any freedom.
    pub(super) active: Vec<usize>,
    /// Covariance of an active function's weight in x (or in y) with the lens held fixed.
    pub(super) covariance: DMatrix<f64>,
    /// How active weights in x and y follow the lens's numbers (to be subtracted).
    pub(super) follow: [DMatrix<f64>; 2],
    /// Covariance of the lens's numbers.
    pub(super) lens_covariance: DMatrix<f64>,
}

/// Length times highest frequency at which the spectral density has fallen to a hundredth.
const RESOLVED: f64 = 3.0;

/// A function whose prior leaves it less than this share of what noise would is left out.
const NO_FREEDOM: f64 = 1e-5;

impl Sums {
    fn active(&self, variances: &[Variance], precision: f64) -> Vec<usize> {
        let free = |index: &usize| {
            variances[*index].0 * self.field[(*index, *index)] * precision > NO_FREEDOM
        };
        (0..variances.len()).filter(free).collect()
    }

    /// The posterior under `settings`; `None` where the points do not determine the camera.
    pub(super) fn posterior(&self, field: &Field, settings: Settings) -> Option<Posterior> {
        let precision = 1.0 / settings.value(NOISE).powi(2);
        let variances = settings.field_variances(field);
        let active = self.active(&variances, precision);
        let count = active.len();
        let scale: Vec<f64> = active.iter().map(|i| variances[*i].0.sqrt()).collect();
        let whitened = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { 1.0 } else { 0.0 };
            own + precision * scale[i] * scale[j] * self.field[(active[i], active[j])]
        });
        let factors = whitened.cholesky()?;
        let sides = |axis: usize| {
            let mixed = DMatrix::from_fn(count, self.numbers.len(), |i, j| {
                precision * scale[i] * self.mixed[axis][(active[i], j)]
            });
            let errors = DVector::from_fn(count, |i, _| {
                precision * scale[i] * self.field_errors[axis][active[i]]
            });
            (factors.solve(&mixed), factors.solve(&errors), mixed, errors)
        };
        let sides = [sides(0), sides(1)];
        // What is left of the lens's equations when the field has taken its part.
        let mut lens = &self.lens * precision;
        let mut lens_errors = &self.lens_errors * precision;
        let mut squares = self.squares * precision;
        for index in FIRST_EXPECTED..self.numbers.len() {
            let (precision, _) = settings.lens_precision(index);
            lens[(index, index)] += precision;
            lens_errors[index] -= precision * self.numbers[index];
            squares += precision * self.numbers[index].powi(2);
        }
        for (solved, solved_errors, mixed, errors) in &sides {
            lens -= mixed.tr_mul(solved);
            lens_errors -= mixed.tr_mul(solved_errors);
            squares -= errors.dot(solved_errors);
        }
        let lens_factors = lens.cholesky()?;
        let step = lens_factors.solve(&lens_errors);
        squares -= step.dot(&lens_errors);
        let [x, y] = sides;
        let white = [&x.1 - &x.0 * &step, &y.1 - &y.0 * &step];
        let mut posterior = Posterior {
            settings,
            evidence: 0.0,
            gradient: [0.0; SETTINGS],
            step,
            weights: vec![[0.0; 2]; variances.len()],
            effective: 0.0,
            covariance: factors.inverse(),
            follow: [x.0, y.0],
            lens_covariance: lens_factors.inverse(),
            active,
        };
        posterior.judge(self, &variances, (&white, squares), (&factors, &lens_factors));
        posterior.colour(&scale, &white);
        Some(posterior)
    }

    /// The settings of greatest evidence, from `start`, by the method of Broyden, Fletcher, Goldfarb
    /// & Shanno on those that `free` names.
    pub(super) fn climb(
        &self,
        field: &Field,
        start: Settings,
        free: [bool; SETTINGS],
    ) -> Option<Posterior> {
        let mut best = self.posterior(field, start.bounded(field))?;
        let mut inverse = DMatrix::<f64>::identity(SETTINGS, SETTINGS);
        let slope = |posterior: &Posterior| {
            let value = |index: usize| if free[index] { posterior.gradient[index] } else { 0.0 };
            DVector::from_fn(SETTINGS, |index, _| value(index))
        };
        // The first step changes no setting by more than a factor of exp(1/2).
        inverse *= 0.5 / slope(&best).norm().max(0.5);
        for _ in 0..MOST_CLIMBS {
            let gradient = slope(&best);
            let mut direction = &inverse * &gradient;
            if direction.dot(&gradient) <= 0.0 {
                direction = gradient.clone();
            }
            // More than a factor of e a step leaves where the model of the evidence holds.
            direction *= 1.0 / direction.amax().max(1.0);
            let reached = (0..8).find_map(|halvings| {
                let share = 0.5_f64.powi(halvings);
                let mut settings = best.settings;
                (0..SETTINGS).for_each(|index| settings.logs[index] += share * direction[index]);
                let tried = self.posterior(field, settings.bounded(field))?;
                (tried.evidence > best.evidence).then_some(tried)
            });
            let Some(reached) = reached else { break };
            let moved = DVector::from_fn(SETTINGS, |index, _| {
                reached.settings.logs[index] - best.settings.logs[index]
            });
            let bent = gradient - slope(&reached);
            let curvature = moved.dot(&bent);
            if curvature > 1e-12 {
                let product = &inverse * &bent;
                let factor = (1.0 + bent.dot(&product) / curvature) / curvature;
                inverse += &moved * moved.transpose() * factor
                    - (&product * moved.transpose() + &moved * product.transpose()) / curvature;
            }
            let gain = reached.evidence - best.evidence;
            best = reached;
            if gain < ENOUGH {
                break;
            }
        }
        Some(best)
    }
}

/// Most steps of the search for settings; ten to twenty are the rule.
const MOST_CLIMBS: usize = 40;

/// A gain in log evidence that would convince nobody (Kass & Raftery 1995,
/// doi:10.1080/01621459.1995.10476572, begin at 1).
const ENOUGH: f64 = 0.02;

impl Posterior {
    /// Evidence, its gradient, and the effective number of parameters.
    fn judge(
        &mut self,
        sums: &Sums,
        variances: &[Variance],
        (white, squares): (&[DVector<f64>; 2], f64),
        (factors, lens_factors): (&Cholesky<f64, Dyn>, &Cholesky<f64, Dyn>),
    ) {
        let half_determinant = |factors: &Cholesky<f64, Dyn>| {
            factors.l_dirty().diagonal().iter().map(|value| libm::log(*value)).sum::<f64>()
        };
        let rows = 2.0 * sums.points as f64;
        let settings = self.settings;
        let mut evidence = -rows * settings.logs[NOISE] - 0.5 * squares + settings.log_hyperprior();
        evidence -= 2.0 * half_determinant(factors) + half_determinant(lens_factors);
        let mut effective = sums.numbers.len() as f64;
        let mut prior_squares = 0.0;
        for index in FIRST_EXPECTED..sums.numbers.len() {
            let (precision, setting) = settings.lens_precision(index);
            evidence += 0.5 * libm::log(precision);
            let square = precision * (sums.numbers[index] + self.step[index]).powi(2);
            let spread = precision * self.lens_covariance[(index, index)];
            effective -= spread;
            prior_squares += square;
            if let Some(setting) = setting {
                self.gradient[setting] -= 1.0 - square - spread;
            }
        }
        let follow = [&self.follow[0], &self.follow[1]];
        let lens_part = follow.map(|f| (f * &self.lens_covariance).component_mul(f).column_sum());
        for (place, index) in self.active.iter().enumerate() {
            let square = white[0][place].powi(2) + white[1][place].powi(2);
            let spread =
                2.0 * self.covariance[(place, place)] + lens_part[0][place] + lens_part[1][place];
            effective += 2.0 - spread;
            prior_squares += square;
            for (setting, slope) in variances[*index].1 {
                self.gradient[setting] -= 0.5 * slope * (2.0 - square - spread);
            }
        }
        self.gradient[NOISE] -= rows - (squares - prior_squares) - effective;
        for index in 0..SETTINGS {
            self.gradient[index] -= settings.value(index) / Settings::SCALES[index];
        }
        self.effective = effective;
        self.evidence = evidence;
    }

    /// From weights in prior standard deviations to weights in pixels.
    fn colour(&mut self, scale: &[f64], white: &[DVector<f64>; 2]) {
        for (place, index) in self.active.iter().enumerate() {
            self.weights[*index] = [0, 1].map(|axis| white[axis][place] * scale[place]);
        }
        for (place, scale) in scale.iter().enumerate() {
            self.covariance.row_mut(place).scale_mut(*scale);
            self.covariance.column_mut(place).scale_mut(*scale);
            self.follow.iter_mut().for_each(|follow| follow.row_mut(place).scale_mut(*scale));
        }
    }
}
