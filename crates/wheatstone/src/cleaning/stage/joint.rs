//! All cameras and all charts together: each camera says what it knows about the charts, its own
//! numbers eliminated, and the charts go where all of them together say.

use super::charts::Placement;
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
    method::neural_camera::loose::{Information, LooseCamera, LooseChart, LooseCharts, MOTION},
    progress::Progress,
};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// What a camera saw of the placements.
pub(super) struct Sight {
    pairs: Vec<(Point3, Pixel)>,
    /// Each point's placement.
    of_point: Vec<usize>,
}

impl Sight {
    /// Of every camera.
    pub(super) fn of_all(data: &Dataset, placements: &[Placement]) -> Vec<Self> {
        (0..data.cameras).map(|camera| Self::of(data, placements, camera)).collect()
    }

    fn of(data: &Dataset, placements: &[Placement], camera: usize) -> Self {
        let mut sight = Self { pairs: Vec::new(), of_point: Vec::new() };
        for (index, placement) in placements.iter().enumerate() {
            for row in placement.rows.iter().map(|row| &data.correspondences[*row]) {
                if let (Some(world), Some(Some(pixel))) = (row.world, row.pixels.get(camera)) {
                    sight.pairs.push((world, *pixel));
                    sight.of_point.push(index);
                }
            }
        }
        sight
    }
}

/// All cameras, and where all charts stand in units of their priors' standard deviations.
pub(super) struct Joint<'a> {
    charts: Vec<LooseChart>,
    cameras: Vec<LooseCamera<'a>>,
    /// Sum of what the cameras say.
    pub(super) information: Information,
    /// The most likely motions, [`MOTION`] a chart.
    motions: DVector<f64>,
    /// Their covariance.
    pub(super) covariance: DMatrix<f64>,
}

/// Most rounds; four to six are the rule.
const MOST_ROUNDS: usize = 20;

/// Rounds in which noise and priors are learnt anew, with the charts nearly where they stay.
const LEARNING: usize = 2;

/// A motion by less than this share of its standard deviation changes nothing that anybody could see.
const STILL: f64 = 0.02;

impl<'a> Joint<'a> {
    /// Cameras fitted each for itself, and where all of them together see the charts.
    pub(super) fn new(
        sights: &'a [Sight],
        charts: Vec<LooseChart>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let fit = |(camera, sight): (usize, &'a Sight)| {
            let of_point = sight.of_point.clone();
            let loose = LooseCharts { charts: charts.clone(), of_point, held: false };
            LooseCamera::fit(&sight.pairs, loose, camera, progress)
        };
        let fitted: Vec<Result<_>> = sights.par_iter().enumerate().map(fit).collect();
        let fitted: Vec<_> = fitted.into_iter().collect::<Result<_>>()?;
        let (cameras, said): (Vec<_>, Vec<_>) = fitted.into_iter().unzip();
        let information = sum(&said, MOTION * charts.len());
        let (motions, covariance) = most_likely(&information).ok_or_else(lost)?;
        Ok(Self { charts, cameras, information, motions, covariance })
    }

    /// Cameras and charts take turns until the charts stand still; in how many rounds. Each turn is a
    /// step of Gauss and Newton on charts and cameras at once, not an alternation.
    pub(super) fn settle(&mut self, progress: &dyn Progress) -> Result<usize> {
        for round in 1..=MOST_ROUNDS {
            progress.check()?;
            progress.report("placing charts", round as u64, MOST_ROUNDS as u64);
            let motions = &self.motions;
            let refit = |camera: &mut LooseCamera<'a>| camera.refit(motions, round <= LEARNING);
            let said: Option<Vec<Information>> = self.cameras.par_iter_mut().map(refit).collect();
            self.information = sum(&said.ok_or_else(lost)?, self.motions.len());
            let (motions, covariance) = most_likely(&self.information).ok_or_else(lost)?;
            let still = (0..motions.len()).all(|index| {
                let step = motions[index] - self.motions[index];
                step * step <= STILL * STILL * covariance[(index, index)]
            });
            (self.motions, self.covariance) = (motions, covariance);
            if still && round > LEARNING {
                return Ok(round);
            }
        }
        Ok(MOST_ROUNDS)
    }

    /// The charts where they stand.
    pub(super) fn charts(&self) -> Vec<LooseChart> {
        let mut charts = self.charts.clone();
        for (chart, numbers) in charts.iter_mut().zip(self.motions.as_slice().chunks_exact(MOTION)) {
            chart.motion.copy_from_slice(numbers);
        }
        charts
    }

    /// Standard deviation of one pixel coordinate, a camera each.
    pub(super) fn pixel_noise(&self) -> Vec<f64> {
        self.cameras.iter().map(LooseCamera::noise).collect()
    }
}

fn lost() -> Error {
    Error::Degenerate {
        problem: "cameras and charts could not be adjusted together".into(),
        hint: "check the points for gross errors, and the stage sigma's unit".into(),
    }
}

fn sum(said: &[Information], count: usize) -> Information {
    let mut all =
        Information { matrix: DMatrix::zeros(count, count), vector: DVector::zeros(count) };
    for one in said {
        all.matrix += &one.matrix;
        all.vector += &one.vector;
    }
    all
}

/// The most likely motions and their covariance, by what the cameras say and a prior of unit variance.
fn most_likely(information: &Information) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let count = information.vector.len();
    let factors = (&information.matrix + DMatrix::identity(count, count)).cholesky()?;
    Some((factors.solve(&information.vector), factors.inverse()))
}
