//! What the network is uncertain by where charts' places were found from the same pixels: how weights and
//! base follow their motions.
//!
//! Both are fits that are linear in small changes of the places: the weights follow by their covariance
//! times what the changed targets pull at them, the base's cameras by being fitted again. The motions
//! are those of the neural cameras that watch over the network.

use super::{
    mode::Mode,
    set_network::{Query, SetNetwork},
};
use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix},
    method::{dlt::DltReconstructor, neural_camera::Motions},
};
use nalgebra::{DMatrix, DVector, Matrix3x4, Vector3};
use wheatstone_numeric::{evidence::Trained, matrix_product::product};

/// By how much each camera's matrix changes when its points do; each list is one motion.
fn base_modes(
    (base, cameras): (&DltReconstructor, &[usize]),
    (train, motions): (&Dataset, &Motions),
) -> Option<Vec<Vec<Matrix3x4<f64>>>> {
    let mut modes = vec![Vec::new(); motions.len()];
    for (camera, matrix) in cameras.iter().zip(base.matrices()) {
        let seen: Vec<(Point3, Pixel, Vec<Vector3<f64>>)> = train
            .known()
            .filter_map(|(world, row)| {
                Some((world, (*row.pixels.get(*camera)?)?, motions.of_point(row.view, world)))
            })
            .collect();
        for (index, mode) in modes.iter_mut().enumerate() {
            let moved: Vec<(Point3, Pixel)> =
                seen.iter().map(|(world, pixel, by)| (world + by[index], *pixel)).collect();
            let again = ProjectionMatrix::fit(&moved)?.0;
            // Of the same length and sign: a projection matrix has neither.
            let scale = matrix.0.dot(&matrix.0) / matrix.0.dot(&again);
            mode.push(again * scale - matrix.0);
        }
    }
    Some(modes)
}

/// A base at a point.
pub(super) struct SlopedBase<'a> {
    base: &'a DltReconstructor,
    point: Point3,
    /// Derivatives of the point's targets by the pixels, three rows.
    pub(super) slopes: DMatrix<f64>,
}

impl SlopedBase<'_> {
    /// By how much the targets of the point change with the base's cameras.
    fn shifted(&self, by: &[Matrix3x4<f64>]) -> Vector3<f64> {
        let point = self.point.to_homogeneous();
        let mut sum = Vector3::zeros();
        for (camera, (matrix, by)) in self.base.matrices().iter().zip(by).enumerate() {
            let (whole, change) = (matrix.0 * point, by * point);
            for axis in 0..2 {
                let pixel = (change[axis] - change.z * whole[axis] / whole.z) / whole.z;
                sum -= self.slopes.column(2 * camera + axis) * pixel;
            }
        }
        sum
    }
}

impl SetNetwork {
    /// The base at the point that it locates at these pixels.
    pub(super) fn sloped_base<'a>(
        &self,
        (base, point): (&'a DltReconstructor, Point3),
        pixels: &[Option<Pixel>],
    ) -> Option<SlopedBase<'a>> {
        let by_pixel = base.slopes(point, pixels)?;
        let (_, by_target) = self.targets.point(self.targets.of(point))?;
        let slopes = by_target.try_inverse()? * by_pixel;
        let slopes = DMatrix::from_column_slice(3, slopes.ncols(), slopes.as_slice());
        Some(SlopedBase { base, point, slopes })
    }

    /// By how much the targets of a point err with each of the charts' motions, a column each.
    pub(super) fn motions_of_places(&self, query: &Query) -> Option<DMatrix<f64>> {
        let mut all = DMatrix::zeros(3, self.modes.len());
        if self.modes.is_empty() {
            return Some(all);
        }
        let count = self.perceptron.weights().len();
        let mut rows = vec![0.0; 3 * count];
        self.perceptron.jacobian(&query.unit, &mut rows);
        let base = match self.base.as_ref().zip(query.base) {
            Some(base) => Some(self.sloped_base(base, &query.pixels)?),
            None => None,
        };
        for (mode, mut column) in self.modes.iter().zip(all.column_iter_mut()) {
            let mut by = Vector3::from_fn(|output, _| {
                let slopes = rows[output * count..][..count].iter().zip(&mode.weights);
                let change: f64 = slopes.map(|(slope, weight)| slope * weight).sum();
                change * (self.outputs[output].high - self.outputs[output].low)
            });
            if let Some(base) = &base {
                by += base.shifted(&mode.base);
            }
            column.copy_from(&by);
        }
        Some(all)
    }

    /// Works out how the map follows charts that move; nothing where it cannot.
    pub(super) fn follow(&mut self, train: &Dataset, motions: &Motions, trained: &Trained) {
        self.modes = self.followed((train, motions), trained).unwrap_or_default();
    }

    fn followed(
        &self,
        (train, motions): (&Dataset, &Motions),
        trained: &Trained,
    ) -> Option<Vec<Mode>> {
        let base = match &self.base {
            Some(base) => base_modes((base, &self.cameras), (train, motions))?,
            None => vec![Vec::new(); motions.len()],
        };
        let count = self.perceptron.weights().len();
        let mut pulls = DMatrix::zeros(count, motions.len());
        let mut rows = vec![0.0; 3 * count];
        for (world, row) in train.known() {
            if self.cameras.iter().any(|camera| row.pixels[*camera].is_none()) {
                continue;
            }
            let query = self.query(&row.pixels)?;
            self.perceptron.jacobian(&query.unit, &mut rows);
            let own = match self.base.as_ref().zip(query.base) {
                Some(own) => Some(self.sloped_base(own, &query.pixels)?),
                None => None,
            };
            let here = Vector3::from(self.targets.of(world));
            for (index, by) in motions.of_point(row.view, world).into_iter().enumerate() {
                let mut moved = Vector3::from(self.targets.of(world + by)) - here;
                if let Some(own) = &own {
                    moved -= own.shifted(&base[index]);
                }
                for output in 0..3 {
                    let scale = self.outputs[output].high - self.outputs[output].low;
                    let weight = moved[output] / (scale * trained.noise[output]);
                    let slopes = DVector::from_column_slice(&rows[output * count..][..count]);
                    pulls.column_mut(index).axpy(weight, &slopes, 1.0);
                }
            }
        }
        let weights = product(&trained.covariance, &pulls);
        let mode = |(index, base): (usize, Vec<Matrix3x4<f64>>)| Mode {
            weights: weights.column(index).iter().copied().collect(),
            base,
        };
        let modes: Vec<Mode> = base.into_iter().enumerate().map(mode).collect();
        let cameras = self.base.as_ref().map_or(0, |base| base.matrices().len());
        modes.iter().all(|mode| mode.is_consistent(count, cameras)).then_some(modes)
    }
}
