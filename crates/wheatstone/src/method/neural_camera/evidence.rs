//! How much correction the points ask for: the evidence (marginal likelihood) of a linear model with
//! Gaussian priors, and the settings of the priors that make it greatest.
//!
//! Source: MacKay 1992, "Bayesian interpolation" (doi:10.1162/neco.1992.4.3.415), as Foresee & Hagan
//! 1997 (doi:10.1109/ICNN.1997.614194) use it for networks. Everything is computed with the weights
//! in units of their prior standard deviation, so that functions without any freedom cost nothing
//! and overflow nothing. The x and the y displacement share one prior, hence one factorisation.

use super::{
    field::Field,
    lens::FIRST_EXPECTED,
    settings::{NOISE, SETTINGS, Settings, Variance},
};
use crate::numeric::{cholesky::Cholesky, panels::Panels};
use nalgebra::{DMatrix, DVector, Dyn};

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
    /// What the fit makes least, at its least, were the camera linear.
    pub(super) least: f64,
    /// The lens's numbers, and those of charts, change by this.
    pub(super) step: DVector<f64>,
    /// Of the field's functions, for x and y.
    pub(super) weights: Vec<[f64; 2]>,
    /// Effective number of parameters.
    pub(super) effective: f64,
    /// The functions that have any freedom.
    pub(super) active: Vec<usize>,
    /// What active functions are free to do with the lens held fixed.
    freedom: Freedom,
    /// How active weights in x and y follow the lens's numbers (to be subtracted).
    pub(super) follow: [DMatrix<f64>; 2],
    /// Covariance of the lens's numbers.
    pub(super) lens_covariance: DMatrix<f64>,
}

/// What the active functions' weights in x (or in y) may be with the lens held fixed.
#[derive(Clone, Debug)]
struct Freedom {
    /// Of their precision, in units of their prior standard deviations.
    factors: Cholesky,
    /// Those.
    scale: Vec<f64>,
}

/// A function whose prior leaves it less than this share of what noise would is left out.
const NO_FREEDOM: f64 = 1e-5;

impl Sums {
    fn active(&self, variances: &[Variance], precision: f64) -> Vec<usize> {
        let free = |index: &usize| {
            variances[*index].0 * self.field[(*index, *index)] * precision > NO_FREEDOM
        };
        (0..variances.len()).filter(free).collect()
    }

    /// The active functions' precision by the points, in units of their prior standard deviations: its lower
    /// triangle.
    fn whitened(&self, (active, scale): (&[usize], &[f64]), precision: f64) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(active.len(), active.len());
        for column in 0..active.len() {
            for row in column..active.len() {
                let product = self.field[(active[row], active[column])];
                matrix[(row, column)] = precision * scale[row] * scale[column] * product;
            }
        }
        matrix
    }

    /// Of x, then of y: what of the active functions mixes with each of the lens's numbers, then the
    /// errors; in the same units.
    fn sides(&self, (active, scale): (&[usize], &[f64]), precision: f64) -> Panels {
        let numbers = self.numbers.len();
        let mut sides = Panels::zeros(2 * (numbers + 1), active.len());
        for (axis, (mixed, errors)) in self.mixed.iter().zip(&self.field_errors).enumerate() {
            let first = axis * (numbers + 1);
            for (place, (index, scale)) in active.iter().zip(scale).enumerate() {
                let factor = precision * scale;
                for (number, value) in mixed.row(*index).iter().enumerate() {
                    sides.set(first + number, place, factor * value);
                }
                sides.set(first + numbers, place, factor * errors[*index]);
            }
        }
        sides
    }

    /// The posterior under `settings`; `None` where the points do not determine the camera.
    pub(super) fn posterior(&self, field: &Field, settings: Settings) -> Option<Posterior> {
        let precision = 1.0 / settings.value(NOISE).powi(2);
        let variances = settings.field_variances(field);
        let active = self.active(&variances, precision);
        let count = active.len();
        let scale: Vec<f64> = active.iter().map(|i| variances[*i].0.sqrt()).collect();
        let factors = Cholesky::new(&self.whitened((&active, &scale), precision), |_| 1.0)?;
        let numbers = self.numbers.len();
        let mut sides = self.sides((&active, &scale), precision);
        factors.take_lower(&mut sides);
        let taken = sides.square();
        factors.take_upper(&mut sides);
        // What is left of the lens's equations when the field has taken its part.
        let mut lens = &self.lens * precision;
        let mut lens_errors = &self.lens_errors * precision;
        let mut squares = self.squares * precision;
        for index in FIRST_EXPECTED..numbers {
            let (precision, _) = settings.lens_precision(index);
            lens[(index, index)] += precision;
            lens_errors[index] -= precision * self.numbers[index];
            squares += precision * self.numbers[index].powi(2);
        }
        for first in [0, numbers + 1] {
            lens -= taken.view((first, first), (numbers, numbers));
            lens_errors -= taken.view((first, first + numbers), (numbers, 1));
            squares -= taken[(first + numbers, first + numbers)];
        }
        let lens_factors = lens.cholesky()?;
        let step = lens_factors.solve(&lens_errors);
        squares -= step.dot(&lens_errors);
        let follow = [0, numbers + 1].map(|first| {
            DMatrix::from_fn(count, numbers, |place, number| sides.get(first + number, place))
        });
        let white = [0, 1].map(|axis: usize| {
            let errors = axis * (numbers + 1) + numbers;
            DVector::from_fn(count, |place, _| sides.get(errors, place)) - &follow[axis] * &step
        });
        let mut posterior = Posterior {
            settings,
            evidence: 0.0,
            gradient: [0.0; SETTINGS],
            least: squares,
            step,
            weights: vec![[0.0; 2]; variances.len()],
            effective: 0.0,
            freedom: Freedom { factors, scale },
            follow,
            lens_covariance: lens_factors.inverse(),
            active,
        };
        posterior.judge(self, &variances, (&white, squares), &lens_factors);
        posterior.colour(&white);
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
        lens_factors: &nalgebra::Cholesky<f64, Dyn>,
    ) {
        let of_lens = lens_factors.l_dirty().diagonal();
        let rows = 2.0 * sums.points as f64;
        let settings = self.settings;
        let mut evidence = -rows * settings.logs[NOISE] - 0.5 * squares + settings.log_hyperprior();
        evidence -= self.freedom.factors.log_determinant();
        evidence -= of_lens.iter().map(|value| libm::log(*value)).sum::<f64>();
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
        let own = self.freedom.factors.diagonal_of_inverse();
        for (place, index) in self.active.iter().enumerate() {
            let square = white[0][place].powi(2) + white[1][place].powi(2);
            let spread = 2.0 * own[place] + lens_part[0][place] + lens_part[1][place];
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
    fn colour(&mut self, white: &[DVector<f64>; 2]) {
        for (place, (index, scale)) in self.active.iter().zip(&self.freedom.scale).enumerate() {
            self.weights[*index] = [0, 1].map(|axis| white[axis][place] * scale);
            self.follow.iter_mut().for_each(|follow| follow.row_mut(place).scale_mut(*scale));
        }
    }

    /// Covariance of the active functions' weights in x (or in y) with the lens held fixed.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let Freedom { factors, scale } = &self.freedom;
        let mut covariance = factors.inverse();
        for (place, scale) in scale.iter().enumerate() {
            covariance.row_mut(place).scale_mut(*scale);
            covariance.column_mut(place).scale_mut(*scale);
        }
        covariance
    }
}
