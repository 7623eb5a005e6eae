//! All cameras and all charts together: each camera says what it knows about the charts, its own
//! numbers eliminated, and the charts go where all of them together say.

use super::{
    affine::AffineMaps,
    charts::ChartPosition,
    observable::{Part, Significance, directions, most_likely_scale},
};
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
    method::neural_camera::{
        chart_poses::{MOTION, UncertainPose, UncertainPoses},
        uncertain_poses::{CameraNormalEquations, Information},
    },
};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use wheatstone_numeric::progress::Progress;

/// What a camera saw of the placements.
pub(super) struct CameraObservations {
    pairs: Vec<(Point3, Pixel)>,
    /// Each point's placement.
    of_point: Vec<usize>,
}

impl CameraObservations {
    /// Of every camera.
    pub(super) fn of_all(data: &Dataset, placements: &[ChartPosition]) -> Vec<Self> {
        (0..data.cameras).map(|camera| Self::of(data, placements, camera)).collect()
    }

    fn of(data: &Dataset, placements: &[ChartPosition], camera: usize) -> Self {
        let mut observation = Self { pairs: Vec::new(), of_point: Vec::new() };
        for (index, placement) in placements.iter().enumerate() {
            for row in placement.rows.iter().map(|row| &data.correspondences[*row]) {
                if let (Some(world), Some(Some(pixel))) = (row.world, row.pixels.get(camera)) {
                    observation.pairs.push((world, *pixel));
                    observation.of_point.push(index);
                }
            }
        }
        observation
    }
}

/// All cameras, and where all charts stand in units of their priors' standard deviations.
pub(super) struct JointAdjustment<'a> {
    /// At their most likely places.
    pub(super) charts: Vec<UncertainPose>,
    cameras: Vec<CameraNormalEquations<'a>>,
    /// Sum of what the cameras say.
    information: Information,
    /// Chi-square a degree of freedom of what the cameras say of the charts against each other.
    pub(super) disagreement: f64,
}

/// Most rounds; four to six are the rule.
const MOST_ROUNDS: usize = 20;

/// Rounds in which noise and priors are learnt anew, with the charts nearly where they stay.
const LEARNING: usize = 3;

/// Bounds of what is learnt of the rotations' prior, as multiples of the guess that it begins with: a
/// hundredth holds them; a guess that is ten times too small was made of a wrong stage sigma.
const LEAST_ROTATION: f64 = 0.01;
const MOST_ROTATION: f64 = 10.0;

/// A motion by less than this share of its standard deviation changes nothing that anybody could see.
const STILL: f64 = 0.02;

impl<'a> JointAdjustment<'a> {
    /// Cameras fitted each for itself, and where all of them together see the charts.
    pub(super) fn new(
        observations: &'a [CameraObservations],
        charts: Vec<UncertainPose>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let fit = |(camera, observation): (usize, &'a CameraObservations)| {
            let of_point = observation.of_point.clone();
            let loose = UncertainPoses { charts: charts.clone(), of_point, held: false };
            CameraNormalEquations::fit(&observation.pairs, loose, camera, progress)
        };
        let fitted: Vec<Result<_>> = observations.par_iter().enumerate().map(fit).collect();
        let fitted: Vec<_> = fitted.into_iter().collect::<Result<_>>()?;
        let (cameras, said): (Vec<_>, Vec<_>) = fitted.into_iter().unzip();
        let count = MOTION * charts.len();
        let information =
            Information { matrix: DMatrix::zeros(count, count), vector: DVector::zeros(count) };
        let mut joint = Self { charts, cameras, information, disagreement: 1.0 };
        joint.accumulate(&said).ok_or_else(lost)?;
        joint.advance().ok_or_else(lost)?;
        Ok(joint)
    }

    /// Sums up what the cameras say, and how much they contradict each other: what each would still
    /// change where all together put the charts.
    fn accumulate(&mut self, said: &[Information]) -> Option<()> {
        let count = MOTION * self.charts.len();
        let (mut matrix, mut vector) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for one in said {
            matrix += &one.matrix;
            vector += &one.vector;
        }
        self.information = Information { matrix, vector };
        let (motions, _) = most_likely(&self.information)?;
        let (mut squares, mut degrees) = (0.0, -score(&self.information, &motions).1);
        for one in said {
            let (own, along) = score(one, &motions);
            squares += own;
            degrees += along;
        }
        self.disagreement = if degrees > 0.0 { squares / degrees } else { 1.0 };
        Some(())
    }

    /// Covariance of the motions. Where the cameras contradict each other by more than their noise
    /// allows (one was touched between two views, say, or a detector errs with the light), what they
    /// say is worth less by as much: the ratio of Birge 1932 (doi:10.1103/PhysRev.40.207).
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        let weight = 1.0 / self.disagreement.max(1.0);
        let count = self.information.vector.len();
        let precision = &self.information.matrix * weight + DMatrix::identity(count, count);
        Some(precision.cholesky()?.inverse())
    }

    /// Puts the charts where all cameras together see them; by how much they moved at most, in
    /// standard deviations of what is then known.
    fn advance(&mut self) -> Option<f64> {
        let (motions, covariance) = most_likely(&self.information)?;
        let mut most: f64 = 0.0;
        let numbers = self.charts.iter_mut().flat_map(|chart| &mut chart.motion);
        for (index, number) in numbers.enumerate() {
            let step = (motions[index] - *number).abs();
            most = most.max(step / covariance[(index, index)].sqrt());
            *number = motions[index];
        }
        Some(most)
    }

    /// Makes the prior of the rotations as wide as the pixels say that it is. Rotations that grow with
    /// the nearness look nearly like a port before the camera: where there is none to speak of the
    /// charts, a prior that is too wide would let them turn for it.
    fn learn_rotations(&mut self, first: &[UncertainPose]) {
        let learnt = most_likely_scale(&directions(&self.information, Part::Rotation));
        let now =
            self.charts.iter().zip(first).map(|(chart, first)| chart.sigma[3] / first.sigma[3]);
        let now = now.filter(|ratio| ratio.is_finite()).fold(0.0, f64::max);
        if now <= 0.0 {
            return;
        }
        let scale = (now * learnt).clamp(LEAST_ROTATION, MOST_ROTATION) / now;
        let of = |index: usize| if Part::Rotation.holds(index) { scale } else { 1.0 };
        for index in 0..self.information.vector.len() {
            self.information.vector[index] *= of(index);
            self.information.matrix.row_mut(index).scale_mut(of(index));
            self.information.matrix.column_mut(index).scale_mut(of(index));
        }
        for chart in &mut self.charts {
            chart.sigma[3..].iter_mut().for_each(|sigma| *sigma *= scale);
            chart.motion[3..].iter_mut().for_each(|number| *number /= scale);
        }
    }

    /// Cameras and charts take turns until the charts stand still; in how many rounds. Each turn is a
    /// step of Gauss and Newton on charts and cameras at once, not an alternation. Without a word on
    /// rotations, how wide their prior is is learnt too.
    pub(super) fn solve(&mut self, free_rotations: bool, progress: &dyn Progress) -> Result<usize> {
        let first = self.charts.clone();
        for round in 1..=MOST_ROUNDS {
            progress.check()?;
            progress.report("estimating chart poses", round as u64, MOST_ROUNDS as u64);
            let learning = round <= LEARNING;
            if learning && free_rotations {
                self.learn_rotations(&first);
                self.advance().ok_or_else(lost)?;
            }
            let charts = &self.charts;
            let refit = |camera: &mut CameraNormalEquations<'a>| camera.refit(charts, learning);
            let said: Option<Vec<Information>> = self.cameras.par_iter_mut().map(refit).collect();
            self.accumulate(&said.ok_or_else(lost)?).ok_or_else(lost)?;
            let moved = self.advance().ok_or_else(lost)?;
            if moved < STILL && !learning {
                return Ok(round);
            }
        }
        Ok(MOST_ROUNDS)
    }

    /// Takes out of the charts' motions what no camera can see.
    pub(super) fn keep_nominal(&mut self, maps: &AffineMaps) -> Option<()> {
        let motions: Vec<f64> = self.charts.iter().flat_map(|chart| chart.motion).collect();
        let left = maps.taken_out(&DMatrix::from_vec(motions.len(), 1, motions))?;
        let numbers = self.charts.iter_mut().flat_map(|chart| &mut chart.motion);
        numbers.zip(left.iter()).for_each(|(number, left)| *number = *left);
        Some(())
    }

    /// Whether the charts stood elsewhere, by directions of which the pixels say more than the prior;
    /// `sigma` is that of the prior.
    pub(super) fn significance(&self, sigma: f64) -> Significance {
        let mut directions = directions(&self.information, Part::Offset);
        directions.retain(|(information, _)| *information > 1.0);
        Significance {
            chi_square: directions.iter().map(|direction| direction.1).sum::<f64>()
                / self.disagreement.max(1.0),
            degrees: directions.len(),
            estimated_sigma: sigma * most_likely_scale(&directions),
        }
    }

    /// Standard deviation of one pixel coordinate, a camera each.
    pub(super) fn pixel_noise(&self) -> Vec<f64> {
        self.cameras.iter().map(CameraNormalEquations::noise).collect()
    }
}

pub(super) fn lost() -> Error {
    Error::Degenerate {
        problem: "the joint adjustment of cameras and chart poses failed".into(),
        hint: "check the points for gross errors, and the stage sigma's unit".into(),
    }
}

/// The most likely motions and their covariance, by what the cameras say and a prior of unit variance.
fn most_likely(information: &Information) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let count = information.vector.len();
    let factors = (&information.matrix + DMatrix::identity(count, count)).cholesky()?;
    Some((factors.solve(&information.vector), factors.inverse()))
}

/// The score (gradient of the log likelihood) that is left at charts moved by `motions`, as a sum of squares of standard
/// deviations, and in how many directions they can: each counts by how much more of it the pixels say
/// than the prior does.
fn score(information: &Information, motions: &DVector<f64>) -> (f64, f64) {
    let left = &information.vector - &information.matrix * motions;
    let eigen = information.matrix.clone().symmetric_eigen();
    let (mut squares, mut degrees) = (0.0, 0.0);
    for (index, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let score = eigen.eigenvectors.column(index).dot(&left);
        squares += score * score / (1.0 + value);
        degrees += value / (1.0 + value);
    }
    (squares, degrees)
}
