//! A fitted camera: where a point falls, and how sure that is.

use super::{
    correction_basis::{Field, chained, plain_values},
    evidence::Posterior,
    fit::{State, displaced, refit_state, undetermined},
    jacobian::{ByNumbers, Sloped},
    lens::{Lens, PARAMETERS},
    settings::{NOISE, Settings},
    uncertainty::UncertainFunctions,
};
use crate::{
    Result,
    camera::pinhole::Pinhole,
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Ray},
    method::{PlacedCamera, lens_numbers::LensNumbers},
};
use nalgebra::{DMatrix, DVectorView, Matrix2, Matrix2x3, Matrix3x4, SMatrix, SVector, Vector2};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    covariance::{Covariance, square_root},
    progress::Progress,
};

/// Lens and correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Optics {
    pub(super) lens: Lens,
    field: Field,
    /// Displacement in pixels along x and y, a function of the field each.
    weights: Vec<[f64; 2]>,
}

impl Optics {
    /// Where a world point falls, with derivatives.
    pub(super) fn project(&self, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let seen = self.lens.project(world)?;
        let [x, y] = self.field.sum(&self.field.values(seen.pixel, seen.nearness), &self.weights);
        let pixel = Pixel::new(seen.pixel.x + x[0], seen.pixel.y + y[0]);
        let mut slopes = seen.slopes;
        slopes.set_row(0, &(seen.slopes.row(0) + chained(&x, &seen).transpose()));
        slopes.set_row(1, &(seen.slopes.row(1) + chained(&y, &seen).transpose()));
        Some((pixel, slopes))
    }

    /// Where a pixel looks if what it shows is near `world`; without a place, at the middle of the
    /// depths.
    pub(super) fn ray(&self, pixel: Pixel, world: Option<Point3>) -> Option<Ray> {
        let (place, nearness) = match world.and_then(|world| self.lens.project(world)) {
            Some(seen) => (seen.pixel, seen.nearness),
            None => (pixel, self.field.nearness()),
        };
        let [x, y] = self.field.sum(&self.field.values(place, nearness), &self.weights);
        self.lens.ray(Pixel::new(pixel.x - x[0], pixel.y - y[0]), nearness)
    }

    /// Made ready for many points, a squared pixel of error counting `weight`; `None` for a lens that does
    /// not see along its axis.
    pub(super) fn placed(&self, weight: f64) -> Option<PlacedCamera<'_>> {
        // Nearness counts from a fixed viewpoint, not along the axis, and points to be located may lie a
        // little beyond those fitted.
        const LEAST: f64 = 0.95;
        const MOST: f64 = 1.15;
        let ([far, near], pose) = (self.field.depths(), self.lens.camera_from_world);
        let (far, near) = (LEAST * far.max(0.1 * near), MOST * near);
        let middle = 0.5 * (far + near);
        let mut rows = Matrix3x4::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&pose.rotation);
        rows.set_column(3, &pose.translation);
        PlacedCamera::new(
            ProjectionMatrix(rows),
            ([middle, 0.5 * (near - far)], false),
            weight,
            Box::new(|world| self.project(world)),
            Box::new(move |pixel| Some(self.ray(pixel, None)?.at(1.0 / middle))),
        )
    }

    pub(super) fn is_consistent(&self) -> bool {
        self.lens.is_consistent()
            && self.field.is_consistent()
            && self.weights.len() == self.field.len()
            && self.weights.iter().flatten().all(|value| value.is_finite())
    }
}

/// What a camera does with one of the independent motions of charts whose places were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Mode {
    /// By how much the lens's numbers change.
    pub(super) lens: Vec<f64>,
    /// And the weights along x and y.
    pub(super) weights: [Vec<f64>; 2],
}

impl Mode {
    /// By how much it displaces a pixel.
    fn displaces(&self, plain: &[f64], slopes: &ByNumbers) -> Vector2<f64> {
        let by_lens = slopes * SVector::<f64, PARAMETERS>::from_column_slice(&self.lens);
        let by_field = self.weights.each_ref().map(|weights| {
            plain.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>()
        });
        by_lens + Vector2::from(by_field)
    }

    fn is_consistent(&self, functions: usize) -> bool {
        self.lens.len() == PARAMETERS
            && self.weights.iter().all(|weights| weights.len() == functions)
            && self.lens.iter().chain(self.weights.iter().flatten()).all(|v| v.is_finite())
    }
}

/// How a point's pixel depends on a camera's numbers.
struct PixelSlopes {
    /// By each weight, along either axis.
    plain: Vec<f64>,
    /// By the lens's numbers with the weights held fixed.
    lens: ByNumbers,
    /// And with the weights following them, an axis.
    free: [SVector<f64, PARAMETERS>; 2],
    /// Standard deviation, in pixels along either axis, of what waves do beyond the points, where the mean
    /// of waves stays as it is.
    beyond: f64,
}

/// How far a camera's pixels of one point may be off.
pub(super) struct PixelCovariance {
    /// Covariance by the detector and by the fit to charts as they were believed to stand.
    pub(super) covariance: Matrix2<f64>,
    /// By how much it is displaced in each of the charts' independent motions: those of all cameras
    /// together.
    pub(super) displaced: Vec<Vector2<f64>>,
}

/// Lens and correction, with the covariance of their numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored")]
pub(super) struct NeuralCameraModel {
    pub(super) optics: Optics,
    settings: Settings,
    /// Effective number of parameters.
    effective: f64,
    /// Those whose weights are uncertain: in models without them, those of the optics.
    #[serde(skip_serializing_if = "Option::is_none")]
    uncertain_functions: Option<UncertainFunctions>,
    /// Of the uncertain functions' weights along x (as along y) with the lens held fixed, its lower triangle row by row.
    weight_covariance: Covariance,
    /// By how much those weights along x and y fall when the lens's numbers rise, weight by weight.
    follow: [Vec<f64>; 2],
    /// Of the lens's numbers, row by row.
    lens_covariance: Vec<f64>,
    /// What it does with the motions of charts whose places were found; none where they were known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    modes: Vec<Mode>,
}

/// A camera as files have it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    optics: Optics,
    settings: Settings,
    effective: f64,
    uncertain_functions: Option<UncertainFunctions>,
    /// Where files were written when error bars had settings of their own, but the functions of the optics.
    error_bar_settings: Option<Settings>,
    weight_covariance: Covariance,
    follow: [Vec<f64>; 2],
    lens_covariance: Vec<f64>,
    #[serde(default)]
    modes: Vec<Mode>,
}

impl From<Stored> for NeuralCameraModel {
    fn from(stored: Stored) -> Self {
        let of_optics = |settings| UncertainFunctions::new(stored.optics.field.clone(), &settings);
        let uncertain_functions =
            stored.uncertain_functions.or_else(|| stored.error_bar_settings.map(of_optics));
        Self {
            uncertain_functions,
            optics: stored.optics,
            settings: stored.settings,
            effective: stored.effective,
            weight_covariance: stored.weight_covariance,
            follow: stored.follow,
            lens_covariance: stored.lens_covariance,
            modes: stored.modes,
        }
        .with_a_pupil()
    }
}

impl NeuralCameraModel {
    /// A camera of files from when no lens had a pupil that moves: it stays, with certainty. What does not have the lengths of
    /// such files stays as it is, for [`Self::is_consistent`] to refuse.
    fn with_a_pupil(mut self) -> Self {
        const BEFORE: usize = PARAMETERS - 1;
        if self.lens_covariance.len() != BEFORE * BEFORE {
            return self;
        }
        let own = DMatrix::from_column_slice(BEFORE, BEFORE, &self.lens_covariance);
        self.lens_covariance = own.resize(PARAMETERS, PARAMETERS, 0.0).as_slice().to_vec();
        for follow in &mut self.follow {
            if let (rows, []) = follow.as_chunks::<BEFORE>() {
                let all = rows.iter().flat_map(|row| row.iter().copied().chain([0.0]));
                *follow = all.collect();
            }
        }
        let modes = self.modes.iter_mut().filter(|mode| mode.lens.len() == BEFORE);
        modes.for_each(|mode| mode.lens.push(0.0));
        self
    }

    /// The camera at the mode of `fitted`, as uncertain as the other posterior says, each without functions
    /// that have no freedom. `state` has the functions of both.
    pub(super) fn new(
        state: &State<'_>,
        fitted: &Posterior,
        uncertainty: &Posterior,
    ) -> Option<Self> {
        let weights = fitted.active.iter().map(|index| fitted.mode.weights[*index]).collect();
        let optics =
            Optics { lens: state.lens.clone(), field: state.field.pruned(&fitted.active), weights };
        let camera = Self {
            optics,
            settings: fitted.settings,
            effective: fitted.effective,
            uncertain_functions: Some(UncertainFunctions::of(&state.field, uncertainty)),
            weight_covariance: Covariance::of(&uncertainty.covariance()),
            follow: [0, 1]
                .map(|axis: usize| uncertainty.follow[axis].transpose().as_slice().to_vec()),
            lens_covariance: uncertainty.lens_covariance.as_slice().to_vec(),
            modes: Vec::new(),
        };
        camera.is_consistent().then_some(camera)
    }

    /// Fitted anew, from here, to points that are nearly those it was fitted to.
    pub(super) fn refit(&self, pairs: &[(Point3, Pixel)], progress: &dyn Progress) -> Result<Self> {
        let (state, posterior) = refit_state(pairs, (&self.optics.lens, self.settings), progress)?;
        let (state, uncertainty) = state.uncertainty(&posterior).ok_or_else(undetermined)?;
        Self::new(&state, &posterior, &uncertainty).ok_or_else(undetermined)
    }

    /// Standard deviation of one pixel coordinate that the fit could not explain.
    pub(super) fn noise(&self) -> f64 {
        self.settings.value(NOISE)
    }

    /// Effective number of parameters of lens and correction.
    pub(super) fn effective(&self) -> f64 {
        self.effective
    }

    /// Where a world point falls, with derivatives.
    pub(super) fn project(&self, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.optics.project(world)
    }

    /// Takes over what it does with the motions of charts.
    pub(super) fn follow(&mut self, modes: Vec<Mode>) {
        self.modes = modes;
    }

    /// Pose and pinhole of its lens.
    pub(super) fn pinhole(&self) -> Option<(Pose, Pinhole)> {
        self.optics.lens.pinhole()
    }

    /// The numbers of its lens, with what is not known of them, by the charts' places too.
    pub(super) fn lens_numbers(&self) -> LensNumbers<9> {
        let lens = &self.optics.lens;
        let (values, slopes) = lens.opencv();
        let own = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_column_slice(&self.lens_covariance);
        let modes = self.modes.iter().map(|mode| {
            let by = slopes * SVector::<f64, PARAMETERS>::from_column_slice(&mode.lens);
            by * by.transpose()
        });
        let all = slopes * own * slopes.transpose() + modes.sum::<SMatrix<f64, 9, 9>>();
        let pose = lens.camera_from_world;
        LensNumbers {
            names: lens.names(),
            values,
            covariance: std::array::from_fn(|a| std::array::from_fn(|b| all[(a, b)])),
            centre: Point3::from(pose.inverse().translation),
            axis: pose.rotation.row(2).transpose(),
        }
    }

    /// What it does with each motion of charts.
    pub(super) fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// Covariance of a pixel of this point about its prediction: that of the detector and that of
    /// the fit.
    pub(super) fn pixel_covariance(&self, world: Point3) -> Option<Matrix2<f64>> {
        let PixelCovariance { covariance, displaced } = self.pixel_uncertainty(world)?;
        Some(displaced.iter().fold(covariance, |sum, by| sum + by * by.transpose()))
    }

    /// How a point's pixel depends on the numbers of lens and correction.
    fn slopes(&self, world: Point3) -> Option<PixelSlopes> {
        let Optics { lens, field, weights } = &self.optics;
        let (seen, slopes) = Sloped::new(lens).project(world)?;
        let values = field.values(seen.pixel, seen.nearness);
        let lens = displaced(&slopes, &field.sum(&values, weights));
        let (plain, beyond) = match &self.uncertain_functions {
            Some(functions) => functions.at(seen.pixel, seen.nearness),
            None => (plain_values(&values), 0.0),
        };
        let free = std::array::from_fn(|axis| {
            let mut free = lens.row(axis).transpose();
            for (value, follow) in plain.iter().zip(self.follow[axis].as_chunks::<PARAMETERS>().0) {
                for (slope, by) in free.iter_mut().zip(follow) {
                    *slope -= value * by;
                }
            }
            free
        });
        Some(PixelSlopes { plain, lens, free, beyond })
    }

    /// How far a pixel of this point may be from its prediction.
    pub(super) fn pixel_uncertainty(&self, world: Point3) -> Option<PixelCovariance> {
        let PixelSlopes { plain, lens: slopes, free, beyond } = self.slopes(world)?;
        let own = self.weight_covariance.of_one(&plain) + beyond.powi(2);
        let lens = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_column_slice(&self.lens_covariance);
        let along = |a: usize, b: usize| free[a].dot(&(lens * free[b]));
        let level = self.noise().powi(2) + own;
        let covariance =
            Matrix2::new(level + along(0, 0), along(0, 1), along(0, 1), level + along(1, 1));
        let displaced = self.modes.iter().map(|mode| mode.displaces(&plain, &slopes)).collect();
        Some(PixelCovariance { covariance, displaced })
    }

    /// Number of uncertain functions.
    fn uncertain(&self) -> usize {
        self.uncertain_functions.as_ref().map_or(self.optics.weights.len(), UncertainFunctions::len)
    }

    /// Square roots of the covariances of the weights along one axis and of the lens's numbers: a column an error.
    pub(super) fn errors(&self) -> [DMatrix<f64>; 2] {
        let lens = DMatrix::from_column_slice(PARAMETERS, PARAMETERS, &self.lens_covariance);
        let weights = self.weight_covariance.matrix(self.uncertain());
        [square_root(&weights), square_root(&lens)]
    }

    /// By how much each of its own errors displaces a point's pixel (the weights' along x, those along y, the lens's), then
    /// each motion of the charts.
    pub(super) fn displacements(
        &self,
        [weights, lens]: &[DMatrix<f64>; 2],
        world: Point3,
    ) -> Option<[Vec<Vector2<f64>>; 2]> {
        let PixelSlopes { plain, lens: slopes, free, beyond } = self.slopes(world)?;
        let of = |column: DVectorView<f64>, by: &[f64]| -> f64 {
            column.iter().zip(by).map(|(value, slope)| value * slope).sum()
        };
        let by_weights: Vec<f64> = weights.column_iter().map(|error| of(error, &plain)).collect();
        let along_x = by_weights.iter().map(|by| Vector2::new(*by, 0.0));
        let along_y = by_weights.iter().map(|by| Vector2::new(0.0, *by));
        let by_lens = lens.column_iter().map(|error| {
            Vector2::new(of(error, free[0].as_slice()), of(error, free[1].as_slice()))
        });
        let by_distance = [Vector2::new(beyond, 0.0), Vector2::new(0.0, beyond)];
        let own = along_x.chain(along_y).chain(by_lens).chain(by_distance).collect();
        Some([own, self.modes.iter().map(|mode| mode.displaces(&plain, &slopes)).collect()])
    }

    pub(super) fn is_consistent(&self) -> bool {
        let functions = self.uncertain();
        self.optics.is_consistent()
            && self.uncertain_functions.iter().all(UncertainFunctions::is_consistent)
            && self.weight_covariance.is_sound(functions)
            && self.follow.iter().all(|follow| follow.len() == functions * PARAMETERS)
            && self.lens_covariance.len() == PARAMETERS * PARAMETERS
            && self
                .lens_covariance
                .iter()
                .chain(&self.settings.logs)
                .chain(self.follow.iter().flatten())
                .all(|value| value.is_finite())
            && self.effective.is_finite()
            && self.modes.iter().all(|mode| mode.is_consistent(functions))
    }
}
