//! How much correction the points ask for: the evidence (marginal likelihood) of a linear model with
//! Gaussian priors, and the settings of the priors that make it greatest.
//!
//! Source: MacKay 1992, "Bayesian interpolation" (doi:10.1162/neco.1992.4.3.415), as Foresee & Hagan
//! 1997 (doi:10.1109/ICNN.1997.614194) use it for networks. Everything is computed with the weights
//! in units of their prior standard deviation, so that functions without any freedom cost nothing
//! and overflow nothing. The x and the y displacement share one prior, hence one factorisation.

mod ascent;

pub(super) use ascent::Search;

use super::{
    correction_basis::Field,
    lens::{FIRST_EXPECTED, PARAMETERS},
    settings::{Hyperprior, NOISE, SETTINGS, Settings, Variance},
};
use nalgebra::{DMatrix, DVector, Dyn};
use wheatstone_numeric::{
    blocked_matrix::BlockedMatrix,
    cholesky::{Cholesky, Lower},
    matrix_product::product,
};

/// Of each coordinate: its slopes by the lens's numbers, and its error.
pub(super) const SIDE: usize = PARAMETERS + 1;

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
    /// The same of what the present weights leave of e.
    pub(super) left: f64,
    /// Points.
    pub(super) points: usize,
    /// The lens's present numbers, of which those of the lens itself are expected near 0; then those
    /// of charts that may have moved, if any.
    pub(super) numbers: Vec<f64>,
}

/// Where a fit under some settings goes.
#[derive(Clone, Debug)]
pub(super) struct Mode {
    /// What the fit makes least, at its least, were the camera linear.
    pub(super) least: f64,
    /// The lens's numbers, and those of charts, change by this.
    pub(super) step: DVector<f64>,
    /// Of the field's functions, for x and y.
    pub(super) weights: Vec<[f64; 2]>,
}

/// The most likely step and weights under some settings, and how good the settings are.
#[derive(Clone, Debug)]
pub(super) struct Posterior {
    pub(super) settings: Settings,
    /// Logarithm of evidence and hyperprior, less a constant.
    pub(super) evidence: f64,
    /// By the settings' logarithms.
    gradient: [f64; SETTINGS],
    /// What the points tell of each setting's logarithm: Fisher's information, its own entry.
    information: [f64; SETTINGS],
    pub(super) mode: Mode,
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

/// How good some settings are, with what had to be found for that of their posterior: half of it.
pub(super) struct Trial<'a> {
    sums: &'a Sums,
    settings: Settings,
    hyperprior: Hyperprior,
    evidence: f64,
    variances: Vec<Variance>,
    active: Vec<usize>,
    freedom: Freedom,
    /// Of x, then of y, what mixes with the lens's numbers and the errors, L taken from it.
    sides: BlockedMatrix,
    /// Of the lens's precision when the field has taken its part.
    lens_factors: nalgebra::Cholesky<f64, Dyn>,
    step: DVector<f64>,
    least: f64,
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

    /// The active functions' precision by the points, in units of their prior standard deviations.
    fn whitened(&self, (active, scale): (&[usize], &[f64]), precision: f64) -> Lower {
        let functions = self.field.nrows();
        let mut matrix = Lower::zeros(active.len());
        for (column, (function, by)) in active.iter().zip(scale).enumerate() {
            let products = &self.field.as_slice()[function * functions..][..functions];
            for (row, (other, own)) in active.iter().zip(scale).enumerate().skip(column) {
                let value = precision * own * by * products[*other];
                matrix.values_mut()[Lower::place(row, column)] = value;
            }
        }
        matrix
    }

    /// Of x, then of y: what of the active functions mixes with each of the lens's numbers, then the
    /// errors; in the same units.
    fn sides(&self, (active, scale): (&[usize], &[f64]), precision: f64) -> BlockedMatrix {
        let mut sides = BlockedMatrix::zeros(2 * (self.numbers.len() + 1), active.len());
        let mut side = Vec::new();
        for (place, (index, scale)) in active.iter().zip(scale).enumerate() {
            let factor = precision * scale;
            side.clear();
            for (mixed, errors) in self.mixed.iter().zip(&self.field_errors) {
                side.extend(mixed.row(*index).iter().map(|value| factor * value));
                side.push(factor * errors[*index]);
            }
            sides.fill_column(place, &side);
        }
        sides
    }

    /// How good `settings` are; `None` where the points do not determine the camera.
    fn trial(
        &self,
        field: &Field,
        (settings, hyperprior): (Settings, Hyperprior),
    ) -> Option<Trial<'_>> {
        let precision = 1.0 / settings.value(NOISE).powi(2);
        let variances = settings.field_variances(field);
        let active = self.active(&variances, precision);
        let scale: Vec<f64> = active.iter().map(|i| variances[*i].0.sqrt()).collect();
        let factors = Cholesky::of(self.whitened((&active, &scale), precision), |_| 1.0)?;
        let numbers = self.numbers.len();
        let mut sides = self.sides((&active, &scale), precision);
        factors.take_lower(&mut sides);
        let taken = sides.square();
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
        let mut trial = Trial {
            sums: self,
            settings,
            hyperprior,
            evidence: 0.0,
            variances,
            active,
            freedom: Freedom { factors, scale },
            sides,
            lens_factors,
            step,
            least: squares,
        };
        trial.evidence = trial.judged();
        Some(trial)
    }

    /// The posterior under `settings`; `None` where the points do not determine the camera.
    pub(super) fn posterior(&self, field: &Field, settings: Settings) -> Option<Posterior> {
        self.trial(field, (settings, Hyperprior::OF_FIT)).map(Trial::posterior)
    }

    /// Where a fit under `settings` goes; `None` where the points do not determine the camera.
    pub(super) fn mode(&self, field: &Field, settings: Settings) -> Option<Mode> {
        let trial = self.trial(field, (settings, Hyperprior::OF_FIT))?;
        let (_, white) = trial.solved();
        Some(trial.at(&white))
    }
}

impl Trial<'_> {
    fn judged(&self) -> f64 {
        let Self { sums, settings, .. } = self;
        let of_lens = self.lens_factors.l_dirty().diagonal();
        let rows = 2.0 * sums.points as f64;
        let hyperprior = self.hyperprior.log_density(settings);
        let mut evidence = -rows * settings.logs[NOISE] - 0.5 * self.least + hyperprior;
        evidence -= self.freedom.factors.log_determinant();
        evidence -= of_lens.iter().map(|value| libm::log(*value)).sum::<f64>();
        for index in FIRST_EXPECTED..sums.numbers.len() {
            evidence += 0.5 * libm::log(settings.lens_precision(index).0);
        }
        evidence
    }

    /// How active weights follow the lens's numbers, and what they are, in units of their prior standard
    /// deviations.
    fn solved(&self) -> ([DMatrix<f64>; 2], [DVector<f64>; 2]) {
        let (numbers, count) = (self.sums.numbers.len(), self.active.len());
        let mut sides = self.sides.clone();
        self.freedom.factors.take_upper(&mut sides);
        let follow = [0, numbers + 1].map(|first| {
            DMatrix::from_fn(count, numbers, |place, number| sides.get(first + number, place))
        });
        let white = [0, 1].map(|axis: usize| {
            let errors = axis * (numbers + 1) + numbers;
            DVector::from_fn(count, |place, _| sides.get(errors, place))
                - &follow[axis] * &self.step
        });
        (follow, white)
    }

    /// With these weights, in units of their prior standard deviations.
    fn at(&self, white: &[DVector<f64>; 2]) -> Mode {
        let mut weights = vec![[0.0; 2]; self.variances.len()];
        for (place, (index, scale)) in self.active.iter().zip(&self.freedom.scale).enumerate() {
            weights[*index] = [0, 1].map(|axis| white[axis][place] * scale);
        }
        Mode { least: self.least, step: self.step.clone(), weights }
    }

    fn posterior(self) -> Posterior {
        let (mut follow, white) = self.solved();
        let lens_covariance = self.lens_factors.inverse();
        let Slopes { gradient, information, effective } =
            self.slopes((&follow, &white), &lens_covariance);
        for follow in &mut follow {
            for (place, scale) in self.freedom.scale.iter().enumerate() {
                follow.row_mut(place).scale_mut(*scale);
            }
        }
        Posterior {
            settings: self.settings,
            evidence: self.evidence,
            gradient,
            information,
            mode: self.at(&white),
            effective,
            active: self.active,
            freedom: self.freedom,
            follow,
            lens_covariance,
        }
    }

    /// How the evidence changes with the settings, and the effective number of parameters.
    fn slopes(
        &self,
        (follow, white): (&[DMatrix<f64>; 2], &[DVector<f64>; 2]),
        lens_covariance: &DMatrix<f64>,
    ) -> Slopes {
        let Self { sums, settings, .. } = self;
        let (mut gradient, mut information) = ([0.0; SETTINGS], [0.0; SETTINGS]);
        let mut effective = sums.numbers.len() as f64;
        let mut prior_squares = 0.0;
        for index in FIRST_EXPECTED..sums.numbers.len() {
            let (precision, setting) = settings.lens_precision(index);
            let square = precision * (sums.numbers[index] + self.step[index]).powi(2);
            let spread = precision * lens_covariance[(index, index)];
            effective -= spread;
            prior_squares += square;
            if let Some(setting) = setting {
                gradient[setting] -= 1.0 - square - spread;
                information[setting] += 2.0 * (1.0 - spread).powi(2);
            }
        }
        let lens_part =
            follow.each_ref().map(|f| product(f, lens_covariance).component_mul(f).column_sum());
        let own = self.freedom.factors.diagonal_of_inverse();
        for (place, index) in self.active.iter().enumerate() {
            let square = white[0][place].powi(2) + white[1][place].powi(2);
            let spread = 2.0 * own[place] + lens_part[0][place] + lens_part[1][place];
            effective += 2.0 - spread;
            prior_squares += square;
            for (setting, slope) in self.variances[*index].1 {
                gradient[setting] -= 0.5 * slope * (2.0 - square - spread);
                information[setting] += (slope * (1.0 - 0.5 * spread)).powi(2);
            }
        }
        let rows = 2.0 * sums.points as f64;
        gradient[NOISE] -= rows - (self.least - prior_squares) - effective;
        information[NOISE] += 2.0 * (rows - effective);
        for (index, slope) in gradient.iter_mut().enumerate() {
            *slope += self.hyperprior.slope(settings, index);
        }
        Slopes { gradient, information, effective }
    }
}

/// How the evidence changes with the settings' logarithms.
struct Slopes {
    gradient: [f64; SETTINGS],
    information: [f64; SETTINGS],
    effective: f64,
}

impl Posterior {
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
