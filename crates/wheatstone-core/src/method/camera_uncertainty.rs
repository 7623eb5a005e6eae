//! What a fit leaves open about a parametric camera, and what that means for its pixels.

use super::{
    fitted_camera::FittedCamera, known_lens::KnownLens, pixel_noise::PixelNoise,
    pose_error::PoseError,
};
use crate::{
    camera::{
        AdjustableCamera, CameraModel,
        posed_lens::{MOST_UNKNOWNS, POSE},
    },
    geometry::{Pixel, Point3, Vector3},
};
use nalgebra::{DMatrix, Matrix2, Matrix3, Matrix6};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    covariance::{Covariance, LeastSquaresCovariance},
    matrix_product::{product, scaled},
};

/// How far pixels lie from where a camera expects them, and how sure its adjusted numbers are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraUncertainty {
    /// About its predictions.
    pub noise: PixelNoise,
    /// What a squared pixel of its error counts beside those of other cameras.
    #[serde(default = "one")]
    pub weight: f64,
    /// The numbers that were adjusted: 0 to 2 a turn of the world about `about`, 3 to 5 a move, in
    /// the lens's frame; then the model's own.
    adjusted: Vec<usize>,
    /// The middle of the points fitted: about it turns and moves hardly depend on each other.
    about: Point3,
    /// Of the adjusted numbers.
    covariance: Covariance,
    /// With the numbers of all cameras before it, row by row, where charts whose places were found link
    /// them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    shared: Vec<f64>,
}

/// Of cameras fitted before they were weighed.
fn one() -> f64 {
    1.0
}

/// What a squared pixel of error counts, a camera: one over its noise's variance where the cameras clearly differ, else
/// all alike. Of each camera the sum of its squared errors and their degrees of freedom.
pub(super) fn weights(cameras: &[(f64, f64)]) -> Vec<f64> {
    /// Ratio of variances. What weights gain below it is less than a percent.
    const WORTH: f64 = 1.3;
    /// Standard deviations of the logarithm of the ratio of two variances that are the same.
    const CHANCE: f64 = 3.0;
    /// Squared pixels. Errors of rounding say nothing of a camera.
    const LEAST: f64 = 1e-8;
    let variances: Vec<f64> =
        cameras.iter().map(|(squares, freedom)| (squares / freedom.max(1.0)).max(LEAST)).collect();
    let least = variances.iter().copied().fold(f64::INFINITY, f64::min);
    let most = variances.iter().copied().fold(0.0, f64::max);
    let fewest = cameras.iter().map(|(_, freedom)| freedom.max(1.0)).fold(f64::INFINITY, f64::min);
    let by_chance = libm::exp(CHANCE * (4.0 / fewest).sqrt());
    let differ = most > least * WORTH.max(by_chance);
    variances.iter().map(|variance| if differ { 1.0 / variance } else { 1.0 }).collect()
}

/// The covariance of adjusted numbers, which are uncertain by noise, and known ones: the adjusted take up so much of the
/// errors of the known. Both with their places among all numbers.
pub(super) fn joined(
    (adjusted, noise): (&[usize], &DMatrix<f64>),
    (known, covariance): (&[usize], &DMatrix<f64>),
    taken_up: &DMatrix<f64>,
) -> DMatrix<f64> {
    let count = adjusted.len() + known.len();
    let mixed = product(taken_up, covariance);
    let own = noise + product(&mixed, &taken_up.transpose());
    let mut whole = DMatrix::zeros(count, count);
    for (row, to_row) in adjusted.iter().enumerate() {
        for (column, to_column) in adjusted.iter().enumerate() {
            whole[(*to_row, *to_column)] = own[(row, column)];
        }
        for (column, to_column) in known.iter().enumerate() {
            whole[(*to_row, *to_column)] = mixed[(row, column)];
            whole[(*to_column, *to_row)] = mixed[(row, column)];
        }
    }
    for (row, to_row) in known.iter().enumerate() {
        for (column, to_column) in known.iter().enumerate() {
            whole[(*to_row, *to_column)] = covariance[(row, column)];
        }
    }
    whole
}

/// Of a symmetric matrix of numbers in many units. Rows that have nothing on the diagonal are conditions.
pub(super) fn inverse(matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut scales = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
    // Conditions get the size of the numbers that they hold.
    let first = scaled(scales.as_slice(), matrix.clone());
    for row in (0..matrix.nrows()).filter(|row| matrix[(*row, *row)] <= 0.0) {
        scales[row] = 1.0 / first.row(row).norm();
    }
    let inverse = scaled(scales.as_slice(), matrix).try_inverse()?;
    Some(scaled(scales.as_slice(), inverse))
}

impl CameraUncertainty {
    /// Of a camera adjusted to `pairs`, the best fit for its `adjusted` numbers; `beside` them so many others were fitted
    /// to its pixels. Those of a known `lens` were not adjusted.
    pub(super) fn new<L: AdjustableCamera>(
        camera: &FittedCamera<L>,
        (adjusted, lens, beside): (&[usize], Option<&KnownLens<L>>, f64),
        pairs: &[(Point3, Pixel)],
    ) -> Option<Self> {
        let middle = pairs.iter().map(|(world, _)| world.coords).sum::<Vector3>();
        let seen = pairs.iter().filter_map(|(world, pixel)| {
            Some((*pixel, (camera.project(*world)? - pixel).norm_squared()))
        });
        let noise = PixelNoise::fit(&seen.collect::<Vec<_>>(), adjusted.len() as f64 + beside);
        let mut rising = adjusted.to_vec();
        rising.extend(lens.iter().flat_map(|lens| &lens.numbers).map(|number| POSE + number));
        rising.sort_unstable();
        let mut found = Self {
            noise,
            weight: 1.0,
            adjusted: rising,
            about: Point3::from(middle / pairs.len() as f64),
            covariance: Covariance::default(),
            shared: Vec::new(),
        };
        found.covariance = match lens {
            Some(lens) => found.with_lens(camera, lens, pairs)?,
            None => found.of_adjusted(camera, pairs)?,
        };
        Some(found)
    }

    /// The covariance of numbers that were all adjusted.
    fn of_adjusted<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        pairs: &[(Point3, Pixel)],
    ) -> Option<Covariance> {
        let count = self.numbers();
        let mut spread = LeastSquaresCovariance::new(count);
        for (world, pixel) in pairs {
            let slopes = self.slopes(camera, *world)?;
            let variance = self.noise.variance(*pixel);
            for axis in 0..2 {
                let row: Vec<f64> = slopes[..count].iter().map(|slope| slope[axis]).collect();
                spread.add(&row, variance);
            }
        }
        spread.covariance()
    }

    /// What the lens's numbers are more uncertain by if those of `numbers` that were not adjusted are not taken for 0: all of
    /// these numbers, and the covariance that is added to their own. `None` where there are none, or `pairs` do not tell.
    pub(super) fn of_omitted<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        numbers: &[usize],
        pairs: &[(Point3, Pixel)],
    ) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let all = numbers.iter().map(|number| POSE + number);
        let mut adjusted: Vec<usize> = self.adjusted.iter().copied().chain(all).collect();
        adjusted.sort_unstable();
        adjusted.dedup();
        if adjusted.len() == self.adjusted.len() || pairs.is_empty() {
            return None;
        }
        let wide = Self { adjusted, ..self.clone() };
        let (wider, own) = (wide.of_adjusted(camera, pairs)?, self.of_adjusted(camera, pairs)?);
        let place = |number: usize| self.adjusted.iter().position(|other| *other == number);
        let lens: Vec<usize> = wide.adjusted.iter().copied().filter(|n| *n >= POSE).collect();
        let added = |row: usize, column: usize| {
            let [first, second] =
                [row, column].map(|index| wide.adjusted.len() - lens.len() + index);
            let narrow = place(lens[row]).zip(place(lens[column]));
            let narrow = narrow.and_then(|(row, column)| own.between(row, column));
            Some(wider.between(first, second)? - narrow.unwrap_or(0.0))
        };
        let covariance = DMatrix::from_fn(lens.len(), lens.len(), |row, column| {
            added(row, column).unwrap_or(0.0)
        });
        Some((lens.iter().map(|number| number - POSE).collect(), covariance))
    }

    /// The covariance of an adjusted pose and a known lens.
    fn with_lens<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        lens: &KnownLens<L>,
        pairs: &[(Point3, Pixel)],
    ) -> Option<Covariance> {
        let count = self.numbers();
        let (mut normal, mut errors) = (DMatrix::zeros(count, count), DMatrix::zeros(POSE, POSE));
        for (world, pixel) in pairs {
            let slopes = self.slopes(camera, *world)?;
            let slopes = DMatrix::from_fn(count, 2, |number, axis| slopes[number][axis]);
            let pose = slopes.rows(0, POSE).into_owned();
            errors += product(&pose, &pose.transpose()) * self.noise.variance(*pixel);
            normal += product(&slopes, &slopes.transpose());
        }
        let adjusted: Vec<usize> = (0..POSE).collect();
        let inverse = inverse(normal.view((0, 0), (POSE, POSE)).into_owned())?;
        let noise = product(&product(&inverse, &errors), &inverse);
        let known: Vec<usize> = (POSE..count).collect();
        let taken_up =
            -product(&inverse, &normal.view((0, POSE), (POSE, count - POSE)).into_owned());
        let whole = joined((&adjusted, &noise), (&known, &lens.matrix()), &taken_up);
        Some(Covariance::of(&whole))
    }

    /// Of a camera whose numbers are taken for exact, with even noise of its pixels.
    #[must_use]
    pub fn known(pixel_sigma: f64) -> Self {
        Self {
            noise: PixelNoise::even(pixel_sigma * pixel_sigma),
            weight: 1.0,
            adjusted: Vec::new(),
            about: Point3::origin(),
            covariance: Covariance::default(),
            shared: Vec::new(),
        }
    }

    /// The middle of the points fitted, in the world.
    #[must_use]
    pub fn middle(&self) -> Point3 {
        self.about
    }

    /// Covariance of the pose: a turn (a rotation vector in radians, in the camera's frame) of the world about
    /// [`Self::middle`], then a move in the camera's frame. `None` for a pose that was taken for exact.
    #[must_use]
    pub fn pose_covariance(&self) -> Option<Matrix6<f64>> {
        let place = |number: usize| self.adjusted.iter().position(|own| *own == number);
        let mut matrix = Matrix6::zeros();
        for row in 0..POSE {
            for column in 0..POSE {
                matrix[(row, column)] = self.covariance.between(place(row)?, place(column)?)?;
            }
        }
        Some(matrix)
    }

    /// What an error of its adjusted numbers does to the camera's place and direction.
    pub(super) fn pose_error<L: CameraModel>(
        &self,
        camera: &FittedCamera<L>,
        error: &[f64],
    ) -> PoseError {
        let of = |number: usize| {
            let place = self.adjusted.iter().position(|own| *own == number);
            place.map_or(0.0, |place| error[place])
        };
        let [turn, shift] = [0, 3].map(|first| Vector3::from([0, 1, 2].map(|k| of(first + k))));
        let to_world = camera.lens_from_world().transpose();
        PoseError {
            centre: to_world * (turn.cross(&camera.before_lens(self.about).coords) - shift),
            axis: -(to_world * turn.cross(&Vector3::z())),
        }
    }

    /// Covariance of two of the model's own numbers; `None` where one was not adjusted.
    pub(super) fn of_model(&self, first: usize, second: usize) -> Option<f64> {
        let place = |number: usize| self.adjusted.iter().position(|own| *own == POSE + number);
        self.covariance.between(place(first)?, place(second)?)
    }

    /// Which of its numbers belong to the pose, among those that are uncertain.
    pub(super) fn is_of_pose(&self, place: usize) -> bool {
        self.adjusted.get(place).is_some_and(|number| *number < POSE)
    }

    /// How many numbers are uncertain.
    pub(super) fn numbers(&self) -> usize {
        self.adjusted.len()
    }

    /// Takes its part of the covariance of all cameras' numbers, which begins at `first`.
    pub(super) fn take(&mut self, all: &DMatrix<f64>, first: usize) {
        let count = self.numbers();
        self.covariance = Covariance::of(&all.view((first, first), (count, count)).into_owned());
        let row = |row: usize| (0..first).map(move |column| all[(row, column)]);
        self.shared = (first..first + count).flat_map(row).collect();
    }

    /// Writes its part of the covariance of all cameras' numbers, which begins at `first`.
    pub(super) fn put(&self, all: &mut DMatrix<f64>, first: usize) {
        let count = self.numbers();
        all.view_mut((first, first), (count, count)).copy_from(&self.covariance.matrix(count));
        for (row, shared) in self.shared.chunks_exact(first.max(1)).enumerate() {
            for (column, value) in shared.iter().enumerate() {
                all[(first + row, column)] = *value;
                all[(column, first + row)] = *value;
            }
        }
    }

    /// What it has in common with cameras before it, for right sides of a point's equations: of each
    /// camera the derivatives of the point's right side by its numbers.
    pub(super) fn shared_with(&self, own: &[Vector3], earlier: &[Vector3]) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        if self.shared.is_empty() {
            return sum;
        }
        for (own, row) in own.iter().zip(self.shared.chunks_exact(earlier.len().max(1))) {
            let other: Vector3 = earlier.iter().zip(row).map(|(other, value)| other * *value).sum();
            sum += own * other.transpose();
        }
        sum + sum.transpose()
    }

    /// Whether it is linked with other cameras.
    pub(super) fn is_linked(&self) -> bool {
        !self.shared.is_empty()
    }

    /// Derivatives of a world point's pixel by the adjusted numbers.
    pub(super) fn slopes<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        world: Point3,
    ) -> Option<[[f64; 2]; MOST_UNKNOWNS]> {
        let point = camera.before_lens(world);
        let turned = point - camera.before_lens(self.about);
        let count = self.adjusted.last().map_or(0, |last| (last + 1).saturating_sub(POSE));
        let mut own = [[0.0; 2]; MOST_UNKNOWNS];
        let (_, by_point) = camera.model.project_with_slopes(point, own.get_mut(..count)?)?;
        let by_turn = -(by_point * turned.cross_matrix());
        let mut slopes = [[0.0; 2]; MOST_UNKNOWNS];
        for (slope, index) in slopes.iter_mut().zip(&self.adjusted) {
            *slope = match index {
                0..3 => by_turn.column(*index).into_owned().into(),
                3..POSE => by_point.column(index - 3).into_owned().into(),
                _ => *own.get(index - POSE)?,
            };
        }
        Some(slopes)
    }

    /// Covariance of a pixel of this point about its prediction.
    pub(super) fn pixel_covariance<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        world: Point3,
        pixel: Pixel,
    ) -> Option<Matrix2<f64>> {
        let slopes = self.slopes(camera, world)?;
        let noise = Matrix2::from_diagonal_element(self.noise.variance(pixel));
        Some(noise + self.covariance.of_two(&slopes[..self.adjusted.len()]))
    }

    /// Whether it can be that of a camera whose model has so many numbers, after cameras with so many
    /// adjusted ones.
    pub(super) fn is_consistent(&self, numbers: usize, earlier: usize) -> bool {
        self.noise.is_consistent()
            && self.weight > 0.0
            && self.weight.is_finite()
            && self.adjusted.len() <= MOST_UNKNOWNS
            && self.adjusted.windows(2).all(|pair| pair[0] < pair[1])
            && self.adjusted.iter().all(|index| *index < POSE + numbers)
            && self.about.iter().all(|value| value.is_finite())
            && self.covariance.is_sound(self.adjusted.len())
            && (self.shared.is_empty() || self.shared.len() == self.numbers() * earlier)
            && self.shared.iter().all(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_are_weighed_where_their_noises_differ_by_more_than_chance() {
        assert_eq!(weights(&[(8.0, 800.0), (32.0, 800.0)]), [100.0, 25.0]);
        // A fifth more is not worth it, and twice as much of twenty is chance.
        assert_eq!(weights(&[(8.0, 800.0), (9.6, 800.0)]), [1.0, 1.0]);
        assert_eq!(weights(&[(0.2, 20.0), (0.4, 20.0)]), [1.0, 1.0]);
        // Errors of rounding.
        assert_eq!(weights(&[(1e-20, 800.0), (1e-24, 800.0)]), [1.0, 1.0]);
    }
}
