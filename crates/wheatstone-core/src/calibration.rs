//! The file that a fit leaves behind: the fitted map, the data that it was fitted to, how it was
//! fitted, and how good it is. It carries its own evidence.

mod camera_motion;
mod file;
mod judgement;
mod known_lenses;
mod locators;
mod origin;

pub use file::{FORMAT, OLDEST_VERSION, VERSION};
pub use judgement::{Judgement, PointJudgement};
pub use known_lenses::KnownLenses;
pub use origin::{Imported, Source};

use crate::{
    Result,
    dataset::{
        Dataset, SavedDataset,
        volume::{Trust, Volume},
    },
    evaluate::{
        self, Budget, CrossValidation, Ellipsoids, Evaluation, HeldOut, PointError, Reference,
    },
    fit::stage::ViewOffset,
    geometry::{Point3, StageCovariance},
    method::{
        AnyMethod, AnyReconstructor, CalibratedMap, Choice, CovarianceScale, Fit, PointNoise,
        Reconstructor,
    },
    preparation::{EstimatedPoses, Prepared, SavedFinding, SetAside, checks},
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{backpropagation::CurvePoint, progress::Progress};

/// A fitted method and where it came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`], whatever the version of the file that it was read from.
    pub version: u32,
    /// The program that wrote it.
    pub program: String,
    /// The unit of world lengths.
    pub unit: String,
    /// The settings that were fitted.
    pub method: AnyMethod,
    /// The seed of every random choice in the fit.
    pub seed: u64,
    /// The fitted map.
    pub reconstructor: AnyReconstructor,
    /// Which method was chosen and why, where there was a choice.
    pub choice: Option<Choice>,
    /// The middle of the cameras in the world, by the linear (DLT) cameras of the points, whatever the method: errors in
    /// percent are of the distance from it.
    pub viewpoint: Option<Point3>,
    /// The space and the parts of the pictures that the fit was shown.
    pub volume: Volume,
    /// How it does on the points that it was fitted to: in pixels where it is one camera alone.
    pub training: Evaluation,
    /// How the same settings do on views that they were not fitted to.
    pub validation: Option<CrossValidation>,
    /// How large error ellipsoids must be drawn to hold what they say.
    pub ellipsoids: Ellipsoids,
    /// How the error fell during the fit, for methods that learn in steps.
    pub curve: Vec<CurvePoint>,
    /// Points that were set aside as gross outliers.
    pub outliers: Vec<SetAside>,
    /// Where the charts are believed to have stood, where that was solved for.
    pub stage: Vec<ViewOffset>,
    /// What points are uncertain by where the charts stood, where that was solved for: it adds to the
    /// covariances of `reconstructor`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage_covariance: Option<StageCovariance>,
    /// How much the pixel noise differs from point to point, where it does: it scales the covariances of
    /// `reconstructor`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_noise: Option<PointNoise>,
    /// By how much covariances of `reconstructor` are scaled where its camera model does not hold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_scale: Option<CovarianceScale>,
    /// Where charts of unknown place were found to have stood, where there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placed: Option<EstimatedPoses>,
    /// What was wrong with the data, in sentences.
    pub findings: Vec<SavedFinding>,
    /// Width and height of each camera's pictures in pixels, where they were known; empty where nothing
    /// was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sizes: Vec<Option<[u32; 2]>>,
    /// The points that it was fitted to.
    pub data: SavedDataset,
    /// Which of several starts was best, for methods that try some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<u64>,
    /// Where it comes from, where another program made it: then it has no points of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<Imported>,
    /// What it was fitted to, in the words of who fitted it; none where nobody said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<Source>,
}

impl Calibration {
    /// Fits a method to all points that were prepared, and judges it on those and, if told to, on
    /// views that are left out one after the other.
    ///
    /// # Errors
    ///
    /// Those of [`AnyMethod::fit_checked`].
    pub fn fit(
        method: &AnyMethod,
        prepared: &Prepared,
        seed: u64,
        validate: bool,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let data = &prepared.data;
        let fit = method.fit_checked(data, seed, progress)?;
        let viewpoint = evaluate::viewpoint(data).or_else(|| fit.reconstructor.viewpoint());
        let (training, validation, held_out) = if data.cameras == 1 {
            let training = evaluate::on_its_own_points(&*fit.reconstructor, data)?;
            let judge = || evaluate::hold_out_one_camera(method, data, seed, progress);
            (training, if validate { judge()? } else { None }, Vec::new())
        } else {
            let training = evaluate::evaluate(&*fit.reconstructor, data, viewpoint)?;
            let judge = || evaluate::hold_out_of(method, data, (seed, Some(&fit)), progress);
            let (validation, held_out) = if validate { judge()? } else { None }.unzip();
            (training, validation, held_out.unwrap_or_default())
        };
        let map = CalibratedMap::new(&*fit.reconstructor).with_noise_of(data).with_scale_of(data);
        let ellipsoids = Ellipsoids::estimate(&map, data, &held_out);
        let (point_noise, covariance_scale) = (map.noise(), map.scale());
        let of_fit = checks::of_fit(&fit.reconstructor, data, fit.choice.is_some());
        let of_fit = of_fit.iter().map(|finding| SavedFinding::new(finding, false));
        let findings = prepared.findings().into_iter().chain(of_fit).collect();
        Ok(Self {
            format: FORMAT.into(),
            version: VERSION,
            program: concat!("wheatstone ", env!("CARGO_PKG_VERSION")).into(),
            unit: data.unit.clone(),
            method: method.clone(),
            seed,
            reconstructor: fit.reconstructor,
            choice: fit.choice,
            viewpoint,
            volume: Volume::of(data),
            training,
            validation,
            ellipsoids,
            curve: fit.curve,
            outliers: prepared.set_aside(),
            stage: prepared.stage.clone(),
            stage_covariance: prepared.stage_covariance.clone(),
            point_noise,
            covariance_scale,
            placed: prepared.placed.clone(),
            findings,
            sizes: Vec::new(),
            data: data.into(),
            start: fit.start,
            imported: None,
            source: None,
        })
    }

    /// The method whose fit this is, and that fit, as they were held against views left out.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`](crate::Error::UnknownName) where the method that was chosen is not known.
    pub fn fitted(&self) -> Result<(AnyMethod, Fit)> {
        let method = match &self.choice {
            Some(choice) => choice.method()?,
            None => self.method.clone(),
        };
        let mut fit = Fit::of(self.reconstructor.clone());
        fit.start = self.start;
        Ok((method, fit))
    }

    /// Why this model is worthless, if it is: where its error on held-out views (on the fitted points,
    /// where there are none) is a good part of the whole volume that they span, whatever it was fitted
    /// to was not what it takes them for.
    #[must_use]
    pub fn broken(&self) -> Option<String> {
        // The recipe of 2001, the worst that is of use, errs by a twelfth on its own kind of data.
        const MOST: f64 = 0.25;
        let (judged, on) = match &self.validation {
            Some(validation) => (&validation.all, "on held-out views"),
            None => (&self.training, "on the fitted points"),
        };
        // One camera errs in pixels.
        let spread = if self.reconstructor.cameras() == 1 { f64::MAX } else { self.data.spread() };
        if judged.rms.is_nan() || judged.rms > MOST * spread {
            return Some(format!(
                "the error {on} is {:.3e} {} rms, while the points themselves extend over {spread:.3e} {}",
                judged.rms, self.unit, self.unit
            ));
        }
        (2 * judged.located < judged.n).then(|| {
            format!("only {} of {} points {on} could be located", judged.located, judged.n)
        })
    }

    /// What the model's errors on an exam are made of; points that are not inside its volume count as
    /// beyond. `None` where the data that it was fitted to do not tell.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn budget(&self, exam: &Dataset, progress: &dyn Progress) -> Result<Option<Budget>> {
        let train = self.data.restored();
        let reference = match &self.reconstructor {
            AnyReconstructor::NeuralCamera(cameras) => Reference::of(cameras.clone(), &train),
            _ => match Reference::fit(&train, progress) {
                Ok(Some(reference)) => reference,
                _ => {
                    progress.check()?;
                    return Ok(None);
                }
            },
        };
        let errors = |of: &dyn Reconstructor| -> Vec<HeldOut> {
            let held_out = |error: PointError| HeldOut {
                row: error.row,
                difference: error.difference,
                beyond: self.volume.trust(&exam.correspondences[error.row].pixels) != Trust::Inside,
            };
            evaluate::point_errors(of, exam, None).into_iter().map(held_out).collect()
        };
        let (own, other) = (errors(&*self.reconstructor), errors(reference.cameras()));
        Ok(Budget::of(exam, &own, &other, &reference))
    }

    /// Width and height of a camera's pictures in pixels, counted from 0, where known.
    #[must_use]
    pub fn picture_size(&self, camera: usize) -> Option<[u32; 2]> {
        let imported = || self.imported.as_ref()?.sizes.get(camera).copied().flatten();
        self.sizes.get(camera).copied().flatten().or_else(imported)
    }

    /// Whether its parts fit together.
    fn is_whole(&self) -> bool {
        self.reconstructor.is_consistent()
            && self.volume.is_consistent()
            && self.stage_covariance.as_ref().is_none_or(StageCovariance::is_consistent)
            && self.point_noise.as_ref().is_none_or(PointNoise::is_consistent)
            && self.covariance_scale.as_ref().is_none_or(CovarianceScale::is_consistent)
            && self.volume.cameras() == self.reconstructor.cameras()
            && (self.sizes.is_empty() || self.sizes.len() == self.volume.cameras())
    }
}
