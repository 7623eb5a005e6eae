//! What the error is made of, as the report shows it.

use super::{
    Validation,
    sections::{BudgetShare, PointFigures},
};
use wheatstone_core::{
    Calibration, Result,
    dataset::{
        Dataset,
        split::{FoldKind, folds},
    },
    evaluate::{Budget, HeldOut, divide},
    geometry::Point3,
    method::AnyMethod,
};
use wheatstone_numeric::progress::Progress;

/// Points that are asked at most; shares of four thousand are certain to two percent, and more take
/// minutes.
const MOST_POINTS: usize = 4000;

/// Divides the errors of points that were held out; nothing where none were, since a fit bends to the
/// noise of its own points and hides it.
///
/// # Errors
///
/// [`wheatstone_core::Error::Cancelled`].
pub(super) fn of_model(
    model: &Calibration,
    (data, points): (&Dataset, &[PointFigures]),
    judgement: Validation,
    progress: &dyn Progress,
) -> Result<Option<Budget>> {
    if judgement != Validation::HeldOut {
        return Ok(None);
    }
    let every = data.correspondences.len().div_ceil(MOST_POINTS).max(1);
    let mut errors = Vec::new();
    for fold in folds(data) {
        let beyond = fold.kind == FoldKind::Extrapolation;
        let mut rows = fold.held_out;
        rows.sort_unstable();
        let error = |row: usize| {
            let (world, found) = (points[row].world?, points[row].located.as_ref()?.point);
            let difference = Point3::from(found) - Point3::from(world);
            row.is_multiple_of(every).then_some(HeldOut { row: row / every, difference, beyond })
        };
        errors.extend(rows.into_iter().filter_map(error));
    }
    // The neural camera is what others are divided by: where it is the model, it is held out already.
    let is_reference = model.fitted()?.0 == AnyMethod::named("neural-camera")?;
    let reference = is_reference.then_some(&errors[..]);
    let some = data.subset(|row, _| row.is_multiple_of(every));
    divide(&some, &errors, reference, (model.seed, progress))
}

/// A share a cause.
pub(super) fn shares(budget: &Budget) -> Vec<BudgetShare> {
    let noise = format!(
        "pixel noise of {} px, as estimated by the most flexible fit, propagated through this camera geometry",
        super::text::figure(budget.pixel_noise)
    );
    [
        ("pixel noise", budget.detector, noise.as_str()),
        (
            "lens model",
            budget.lens_model,
            "error of the lens model: neither noise nor common to a whole view",
        ),
        (
            "chart poses",
            budget.stage,
            "errors common to a whole view, for this method and for the most flexible one",
        ),
        (
            "extrapolation",
            budget.extrapolation,
            "additional error of the outermost views, beyond their greater noise",
        ),
    ]
    .map(|(source, part, explanation)| BudgetShare {
        source: source.into(),
        share: part.share,
        rms: part.rms,
        explanation: explanation.into(),
    })
    .into()
}
