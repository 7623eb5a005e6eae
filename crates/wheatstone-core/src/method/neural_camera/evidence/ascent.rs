//! The search for the settings of greatest evidence.

use super::{Posterior, Sums};
use crate::method::neural_camera::{
    correction_basis::Field,
    settings::{Hyperprior, SETTINGS, Settings},
};
use nalgebra::{DMatrix, DVector};

/// What is searched.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Search {
    /// Settings that change.
    pub(in super::super) free: [bool; SETTINGS],
    pub(in super::super) hyperprior: Hyperprior,
}

impl Search {
    /// All settings of a fit.
    pub(in super::super) const ALL: Self =
        Self { free: [true; SETTINGS], hyperprior: Hyperprior::OF_FIT };
}

impl Sums {
    /// The settings of greatest evidence, from `start`, by the method of Broyden, Fletcher, Goldfarb
    /// & Shanno on those that are free.
    pub(in super::super) fn climb(
        &self,
        field: &Field,
        start: Settings,
        Search { free, hyperprior }: Search,
    ) -> Option<Posterior> {
        let trial = |settings: Settings| {
            self.trial(field, (settings.bounded(field, hyperprior), hyperprior))
        };
        let mut best = trial(start)?.posterior();
        let mut inverse = DMatrix::<f64>::identity(SETTINGS, SETTINGS);
        let slope = |posterior: &Posterior| {
            let value = |index: usize| if free[index] { posterior.gradient[index] } else { 0.0 };
            DVector::from_fn(SETTINGS, |index, _| value(index))
        };
        // The first step changes no setting by more than a factor of exp(1/2).
        inverse *= 0.5 / slope(&best).norm().max(0.5);
        for _ in 0..MOST_CLIMBS {
            let gradient = slope(&best);
            // What points and hyperpriors leave to be gained, were the settings independent.
            let promised = gradient.iter().zip(&best.information);
            let promised = promised.map(|(g, information)| g * g / (1.0 + information));
            if 0.5 * promised.sum::<f64>() < ENOUGH {
                break;
            }
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
                let tried = trial(settings)?;
                (tried.evidence > best.evidence).then(|| tried.posterior())
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
