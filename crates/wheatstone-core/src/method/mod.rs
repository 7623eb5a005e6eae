//! Ways from matched pixels to a point in the world.
//!
//! A method is settings that fit, and the reconstructor that they fit. To add one here: write
//! `method/<name>.rs` with both, then add its `mod` line and its rows below. To add one in another
//! crate: implement [`Method`] and [`Reconstructor`] there, and hand them over as
//! [`AnyMethod::custom`] and [`AnyReconstructor::custom`].

pub mod auto;
pub mod brown;
mod calibrated_map;
mod resection;
mod resection_start;
mod camera_uncertainty;
mod checks;
mod choice;
mod covariance_scale;
pub mod dlt;
mod fitted_camera;
mod fitted_cameras;
mod chart_pose_uncertainty;
pub mod interpolation;
mod intrinsics;
mod fit_errors;
mod given_noise;
mod lens_numbers;
pub mod kannala_brandt;
mod known_lens;
mod known_lens_fit;
mod located;
mod locator;
mod matrix_uncertainty;
pub mod mismatch;
pub mod network;
pub mod neural_camera;
mod pixel_noise;
mod point_noise;
mod projection;
mod pose_error;
mod relative_pose;
mod radial_alignment;
mod point_covariance;
pub mod soloff;
pub mod tsai;

pub use calibrated_map::CalibratedMap;
pub use camera_uncertainty::CameraUncertainty;
pub use checks::depth_is_observable;
pub use choice::Choice;
pub use covariance_scale::CovarianceScale;
pub use fit_errors::FitErrors;
pub use fitted_camera::FittedCamera;
pub use fitted_cameras::FittedCameras;
pub use given_noise::{PIXEL_STEP, PixelShare, PixelSigmas, without_pixel_noise};
pub use intrinsics::{IntrinsicParameter, Intrinsics};
pub use known_lens::KnownLens;
pub use located::{Located, Residual};
use locator::Formulas;
pub use locator::{
    FormulaCameras, Learned, LocatedBatch, Locator, PlacedCamera, Plan, SettledLocator,
};
pub use pixel_noise::PixelNoise;
pub use point_noise::PointNoise;
pub use relative_pose::RelativePose;
pub(crate) use resection::information;
pub(crate) use resection_start::Lens;

use crate::{
    Error, Result,
    dataset::Dataset,
    error::{Hint, Remedy},
    geometry::{Pixel, Point3, Ray},
    registry,
};
use nalgebra::Matrix2x3;
use rayon::prelude::*;
use wheatstone_numeric::{backpropagation::CurvePoint, progress::Progress};

/// Settings that can be fitted.
///
/// Only [`Method::fit`] and [`Method::summary`] are needed. `crates/wheatstone/examples/custom_method.rs`
/// implements one outside of this library.
pub trait Method: Sync + Send {
    /// Fits to every point whose place in the world is known. The same `seed` gives the same bits.
    ///
    /// # Errors
    ///
    /// [`Error::TooFew`] or [`Error::Degenerate`] where the data do not determine the unknowns,
    /// [`Error::Cancelled`].
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit>;

    /// As [`Method::fit`], for who asks of the map only where points are and how sure that is, such as of
    /// points left out of `train`: what else a map can say may be missing. Where the fit to all points
    /// is given, the one of several starts that was best there may be taken without trying the others.
    ///
    /// # Errors
    ///
    /// As [`Method::fit`].
    fn fit_fold(
        &self,
        train: &Dataset,
        _whole: Option<&Fit>,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Fit> {
        self.fit(train, seed, progress)
    }

    /// Whether error bars include the uncertainty of chart poses that were estimated from the same pixels. Where they do
    /// not, `auto` does not choose it for such data.
    fn includes_pose_uncertainty(&self) -> bool {
        false
    }

    /// In one line, what it is.
    fn summary(&self) -> &'static str;

    /// The names of its ready-made settings, the default first.
    fn presets(&self) -> &'static [&'static str] {
        &["default"]
    }

    /// Itself with the settings called `name`. A method of another crate has only those that it was
    /// made with, unless it says otherwise.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    fn preset(&self, name: &str) -> Result<AnyMethod> {
        Err(unknown("preset", name, &[]))
    }
}

/// What a fit leaves.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fit {
    /// The fitted map.
    pub reconstructor: AnyReconstructor,
    /// How the error fell, for methods that learn in steps.
    pub curve: Vec<CurvePoint>,
    /// Which method was chosen and why, where there was a choice.
    pub choice: Option<Choice>,
    /// Which of several starts was best, for methods that try some.
    pub start: Option<u64>,
}

impl Fit {
    /// A fit that leaves nothing but the map, such as [`AnyReconstructor::custom`].
    pub fn of(reconstructor: impl Into<AnyReconstructor>) -> Self {
        Self { reconstructor: reconstructor.into(), curve: Vec::new(), choice: None, start: None }
    }
}

/// A fitted map from pixels to points.
///
/// Only [`Reconstructor::cameras`] and [`Reconstructor::locate`] are needed.
pub trait Reconstructor: Sync + Send {
    /// The cameras whose pixels it takes.
    fn cameras(&self) -> usize;

    /// The point that the cameras saw at `pixels` (one entry a camera); `None` where too few cameras
    /// saw it or the pixels mean no point.
    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located>;

    /// Standard deviation of one coordinate that its error bars assume of a pixel of this camera
    /// (counted from 0) that shows a world point, in pixels, without what the fit is uncertain by.
    /// `None` for no such camera, and for methods that assume nothing of pixels.
    fn pixel_sigma(&self, _camera: usize, _pixel: Pixel, _world: Point3) -> Option<f64> {
        None
    }

    /// Where a camera (counted from 0) observes a world point, with derivatives by its coordinates; `None`
    /// where it cannot, and for maps that are no cameras.
    fn project(&self, _camera: usize, _world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        None
    }

    /// Where a camera's pixel looks, about the middle of the depths that the fit was shown; `None`
    /// likewise.
    fn unproject(&self, _camera: usize, _pixel: Pixel) -> Option<Ray> {
        None
    }

    /// The point that [`Reconstructor::locate`] finds, for who asks nothing else of it.
    fn locate_point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        Some(self.locate(pixels)?.point)
    }

    /// How many numbers the fit adjusted to its points, effectively, for each coordinate that a point
    /// gives it (two a camera that observes it, or three of its place): over the number of points, the
    /// share of the noise that the errors at the fit's own points lack. `None` for a map that passes
    /// through its points, or does not know.
    fn effective_parameters(&self) -> Option<f64> {
        None
    }

    /// What is uncertain of the pixels that [`Reconstructor::project`] says, of all cameras together; `None` for
    /// maps that do not know.
    fn fit_errors(&self) -> Option<FitErrors<'_>> {
        None
    }

    /// How [`Locator`] makes it ready for many points.
    fn plan(&self) -> Plan<'_> {
        Plan::PointByPoint
    }

    /// Whether the parts of a reconstructor read from a file fit together.
    fn is_consistent(&self) -> bool {
        true
    }
}

registry! {
    /// A method: one of this library, or [`AnyMethod::custom`].
    pub enum AnyMethod: Method, all {
        "auto" => Auto(auto::Auto),
        "network" => Network(network::Network),
        "dlt" => Dlt(dlt::Dlt),
        "brown" => Brown(brown::Brown),
        "kannala-brandt" => KannalaBrandt(kannala_brandt::KannalaBrandt),
        "tsai" => Tsai(tsai::Tsai),
        "soloff" => Soloff(soloff::Soloff),
        "interpolation" => Interpolation(interpolation::Interpolation),
        "neural-camera" => NeuralCamera(neural_camera::NeuralCamera),
    }
}

registry! {
    /// A fitted map: one of this library, which can be saved and loaded, or
    /// [`AnyReconstructor::custom`], which cannot.
    pub enum AnyReconstructor: Reconstructor {
        "network" => Network(network::NetworkReconstructor),
        "dlt" => Dlt(dlt::DltReconstructor),
        "brown" => Brown(brown::BrownReconstructor),
        "kannala-brandt" => KannalaBrandt(kannala_brandt::KannalaBrandtReconstructor),
        "tsai" => Tsai(tsai::TsaiReconstructor),
        "soloff" => Soloff(soloff::SoloffReconstructor),
        "interpolation" => Interpolation(interpolation::InterpolationReconstructor),
        "neural-camera" => NeuralCamera(neural_camera::NeuralCameraReconstructor),
    }
}

/// Locates many points, in parallel; the order is kept.
#[must_use]
pub fn locate_all(
    reconstructor: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
) -> Vec<Option<Located>> {
    // Points a task: large enough to pay for handing it over, small enough to balance.
    const TASK: usize = 256;
    pixels
        .par_chunks(TASK)
        .flat_map_iter(|chunk| chunk.iter().map(|pixels| reconstructor.locate(pixels)))
        .collect()
}

impl AnyMethod {
    /// The method called `name`, with its default settings.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        Self::NAMES
            .iter()
            .position(|known| *known == name)
            .and_then(|place| Self::all().into_iter().nth(place))
            .ok_or_else(|| unknown("method", name, Self::NAMES))
    }

    /// Its name: [`AnyMethod::kind`].
    #[must_use]
    pub fn name(&self) -> &str {
        self.kind()
    }

    /// Itself with the settings called `name`: [`Method::preset`], where `default` are those that it
    /// has, for a method of another crate that has no presets.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn preset(&self, name: &str) -> Result<Self> {
        match (self, (**self).preset(name)) {
            (Self::Custom(_), Err(Error::UnknownName { .. })) if name == "default" => {
                Ok(self.clone())
            }
            (_, preset) => preset,
        }
    }

    /// The same, trained for so many epochs.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for a method that is not trained by epochs.
    pub fn with_epochs(&self, epochs: u64) -> Result<Self> {
        let mut trained = self.clone();
        if let Self::Network(network) = &mut trained
            && let network::Training::Backpropagation(training) = &mut network.training
        {
            training.epochs = epochs;
            return Ok(trained);
        }
        Err(Error::Setting {
            setting: "epochs".into(),
            value: format!("set for `{}`", self.name()),
            need: "it to the method `network` with preset `paper` only".into(),
        })
    }

    /// Whether it can be fitted to so many cameras: one alone locates no point, but can be calibrated.
    /// A method of another crate is asked when it is fitted.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] for one camera and a method that is not made of cameras.
    pub fn takes(&self, cameras: usize) -> Result<()> {
        let is_camera = matches!(
            self,
            Self::Brown(_)
                | Self::KannalaBrandt(_)
                | Self::Tsai(_)
                | Self::NeuralCamera(_)
                | Self::Custom(_)
        );
        if cameras > 1 || is_camera {
            return Ok(());
        }
        Err(Error::Degenerate {
            problem: format!(
                "these points are from one camera, and a single camera cannot triangulate: `{}` needs two or more",
                self.name()
            ),
            hint: Hint::new(
                "one camera can be calibrated by `neural-camera`, `brown` or `kannala-brandt`",
                Remedy::Method,
            ),
        })
    }

    /// Checks what every method needs of its data; cameras whose lenses are known can do with one plane.
    fn check(&self, train: &Dataset) -> Result<()> {
        self.takes(train.cameras)?;
        if self.known_lenses().is_empty() { depth_is_observable(train) } else { Ok(()) }
    }

    /// Checks what every method needs of its data, then fits.
    ///
    /// # Errors
    ///
    /// Those of [`Method::fit`], and [`Error::Degenerate`] where no method could.
    pub fn fit_checked(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        self.check(train)?;
        self.fit(train, seed, progress)
    }

    /// [`AnyMethod::fit_checked`] by [`Method::fit_fold`].
    ///
    /// # Errors
    ///
    /// As [`AnyMethod::fit_checked`].
    pub fn fit_fold_checked(
        &self,
        train: &Dataset,
        whole: Option<&Fit>,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Fit> {
        self.check(train)?;
        self.fit_fold(train, whole, seed, progress)
    }
}

fn unknown(kind: &'static str, name: &str, known: &[&str]) -> Error {
    let known = known.iter().map(|name| (*name).to_owned()).collect();
    Error::UnknownName { kind, name: name.into(), known }
}

/// The settings of a method that has only its default ones.
fn only_default(method: &(impl Into<AnyMethod> + Clone), name: &str) -> Result<AnyMethod> {
    if name == "default" {
        Ok(method.clone().into())
    } else {
        Err(unknown("preset", name, &["default"]))
    }
}

#[cfg(test)]
mod staged;
