//! What a model is worth on data that it was not fitted to.

use super::Calibration;
use crate::{
    Result,
    dataset::Dataset,
    evaluate::{
        BoardEvaluation, Budget, Coverage, Ellipsoids, Evaluation, LinearError, aligned, coverage,
        evaluate, evaluate_boards, evaluate_one_camera, refuse_mistaken_unit,
    },
    fit::bundle,
    method::Reconstructor,
};
use serde::Serialize;
use wheatstone_numeric::progress::Progress;

/// The figures of an evaluation, by what the data can tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Judgement {
    /// One camera locates no point: its error is one of pixels.
    Pixels(Evaluation),
    /// Boards whose poses nobody knows: lengths and flatness.
    Boards(BoardEvaluation),
    /// Points whose places are known.
    Points(PointJudgement),
}

/// How well points with known places are located, and how well error bars tell it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointJudgement {
    /// The errors.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// What the errors are made of; `None` where the data of the fit do not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// The part of the errors that is linear in the coordinates; `None` where that is not most of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linear: Option<LinearError>,
    /// Share of the points within their 68 % and 95 % ellipsoids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<Coverage>,
    /// Squared Mahalanobis radii of those ellipsoids.
    pub ellipsoids: Ellipsoids,
}

impl Calibration {
    /// Measures the model's error on `data`; first moves their places as a whole to where the model puts them if they
    /// are to be aligned.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`](crate::Error::Mismatch) for a unit that does not convert,
    /// [`Error::Faulty`](crate::Error::Faulty) for places in another unit than was said; those of
    /// [`evaluate`](crate::evaluate::evaluate()), [`evaluate_boards`] and [`evaluate_one_camera`];
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn judge(&self, data: Dataset, align: bool, progress: &dyn Progress) -> Result<Judgement> {
        let map: &dyn Reconstructor = &*self.reconstructor;
        if map.cameras() == 1 {
            return Ok(Judgement::Pixels(evaluate_one_camera(map, &data)?));
        }
        if data.known().next().is_none() && bundle::needed(&data) {
            let data = data.in_unit(&self.unit)?;
            let found = evaluate_boards(&self.map(), &data, &self.ellipsoids)?;
            return Ok(Judgement::Boards(found));
        }
        let given = data.unit.clone();
        let mut data = data.in_unit(&self.unit)?;
        if align {
            data = aligned(map, &data).unwrap_or(data);
        }
        refuse_mistaken_unit(map, &data, &given)?;
        let coverage = coverage(&self.map(), &data, &self.ellipsoids);
        Ok(Judgement::Points(PointJudgement {
            evaluation: evaluate(map, &data, self.viewpoint)?,
            budget: self.budget(&data, progress)?,
            linear: LinearError::fit(map, &data, coverage),
            coverage,
            ellipsoids: self.ellipsoids,
        }))
    }
}
