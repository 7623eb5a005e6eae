//! What is known of one camera: fitted to the views on which most agree, and for each view to the others.

use super::{
    consensus::consensus,
    pairs::{Pair, thinned},
    projection_sigma::ProjectionSigma,
    robust_camera::RobustCamera,
    views::LEAST,
};
use wheatstone_numeric::{random::Random, statistics::median};

/// What is known of one camera.
#[derive(Clone, Debug)]
pub(super) struct CameraEvidence {
    /// Fitted to the sound views.
    pub(super) camera: RobustCamera,
    /// For each view, fitted to the sound views without it.
    pub(super) without: Vec<RobustCamera>,
    /// For each view, how uncertain it is where the camera of the others sees its points, in pixels.
    pub(super) uncertainty: Vec<f64>,
    /// Median over sound views of the cells' errors, in pixels.
    pub(super) typical: f64,
}

/// Points of a cell that a fit uses, and of all cells: more add time only.
const FITTED: usize = 30;
const FITTED_OF_ALL: usize = 900;

/// Views are left out one by one up to so many; beyond, every so-manieth goes with them.
const GROUPS: usize = 24;

/// Of how many rounds of groups one is fitted: all views where there are few.
fn rounds(views: usize) -> usize {
    (views * LEAST).div_ceil(4 * FITTED_OF_ALL).max(1)
}

/// In pixels: what is left of exact pixels.
pub(super) const EXACT: f64 = 0.02;

/// Points of a cell that decide which views agree.
pub(super) const SCOUTED: usize = 14;

impl CameraEvidence {
    /// By view, and whether the charts' poses were estimated. Then the lens has tangential terms: boards in the hand reach
    /// corners of the picture where others do not, while on a stage such terms take up what is wrong with places.
    pub(super) fn of(pairs: &[Vec<Pair>], by_hand: bool) -> Option<Self> {
        let scouted: Vec<Vec<Pair>> = pairs.iter().map(|view| thinned(view, SCOUTED)).collect();
        let most = (FITTED_OF_ALL / pairs.len().max(1)).clamp(LEAST, FITTED);
        let fitted: Vec<Vec<Pair>> = pairs.iter().map(|view| thinned(view, most)).collect();
        let found = consensus(&scouted, &mut Random::new(3))?;
        let camera = if by_hand { found.camera.decentred() } else { found.camera };
        let mut seen = Self::among(&camera, &fitted, &found.agrees);
        // Views that stand out from the sound ones are left out of the fit, and it is done again.
        for _ in 0..2 {
            let good = seen.good();
            let errors: Vec<f64> = (0..fitted.len())
                .map(|view| seen.without[view].median_error(&fitted[view]))
                .collect();
            let agrees: Vec<bool> = errors
                .iter()
                .zip(&fitted)
                .map(|(e, view)| view.len() >= LEAST && *e <= good)
                .collect();
            let count = agrees.iter().filter(|agrees| **agrees).count();
            if count < 3 || 3 * count < fitted.len() {
                break;
            }
            let next = Self::among(&seen.camera.without_field(), &fitted, &agrees);
            let settled = (next.typical / seen.typical - 1.0).abs() < 0.02;
            seen = next;
            if settled {
                break;
            }
        }
        Some(seen)
    }

    /// From the views that agree.
    fn among(camera: &RobustCamera, views: &[Vec<Pair>], agrees: &[bool]) -> Self {
        let rounds = rounds(views.len());
        let is_fitted = |view: usize| agrees[view] && (view / GROUPS).is_multiple_of(rounds);
        let without_group = |out: usize| -> Vec<Pair> {
            let kept = |view: usize| is_fitted(view) && view % GROUPS != out;
            let views = views.iter().enumerate().filter(|(view, _)| kept(*view));
            views.flat_map(|(_, pairs)| pairs.iter().copied()).collect()
        };
        let all = without_group(usize::MAX);
        let camera = camera.refined(&all, 12);
        let sound = (0..views.len()).filter(|view| is_fitted(*view)).count();
        let taught = |mut camera: RobustCamera, pairs: &[Pair]| {
            camera.learn_field(pairs);
            let sigma = ProjectionSigma::new(&camera.formula, pairs);
            (camera, sigma)
        };
        let whole = taught(camera.clone(), &all);
        let without_group: Vec<(RobustCamera, ProjectionSigma)> = (0..views.len().min(GROUPS))
            .map(|group| {
                let pairs = without_group(group);
                taught(camera.refined(&pairs, 3), &pairs)
            })
            .collect();
        // Two views are needed to tell a camera.
        let left_out = |view: usize| is_fitted(view) && sound > 2;
        let of_others = |view: usize| {
            if left_out(view) { &without_group[view % GROUPS] } else { &whole }
        };
        let without: Vec<RobustCamera> =
            (0..views.len()).map(|view| of_others(view).0.clone()).collect();
        let uncertainty =
            (0..views.len()).map(|view| of_others(view).1.over(&views[view])).collect();
        let errors: Vec<f64> = (0..views.len())
            .filter(|view| agrees[*view])
            .map(|view| without[view].median_error(&views[view]))
            .collect();
        Self { camera: whole.0, without, uncertainty, typical: median(&errors) }
    }

    /// A median error up to which a cell is as good as the sound ones.
    pub(super) fn good(&self) -> f64 {
        2.0 * self.typical + EXACT
    }
}
