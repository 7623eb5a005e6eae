//! The network over many points: its outputs in single precision, for they are small corrections, or as
//! coarse as the paper's; all else in double.

use super::{NetworkReconstructor, Noise, Scale, Targets};
use crate::{
    geometry::{PixelColumns, Pose},
    method::{Learned, PlacedCamera},
    numeric::{
        perceptron::Forward,
        simd::{Simd, WithSimd, on_widest},
    },
};
use nalgebra::Matrix3;

impl NetworkReconstructor {
    /// The map, for who locates many points; `None` where its base cannot be made ready.
    pub(super) fn learned(&self) -> Option<Learned<'_>> {
        let base: Vec<PlacedCamera> = match &self.base {
            Some(base) => base.placed()?,
            None => Vec::new(),
        };
        let forward = Forward::<f32>::new(&self.perceptron);
        let witness = self.witness.as_ref().map(|witness| witness.placed()).unwrap_or_default();
        Some(Learned {
            base,
            correct: Box::new(move |pixels, points| self.correct(&forward, pixels, points)),
            witness,
            covariance: self.even_covariance(),
        })
    }

    /// The covariance of all points where it is the same for all.
    fn even_covariance(&self) -> Option<Matrix3<f64>> {
        let known = self.weight_covariance.is_empty() && self.modes.is_empty();
        match (&self.noise, &self.targets) {
            (Noise::Targets { variance }, Targets::World {}) if known => {
                let squared = |axis: usize| {
                    let scale = self.outputs[axis];
                    variance[axis] * (scale.high - scale.low).powi(2)
                };
                Some(Matrix3::from_diagonal(&[0, 1, 2].map(squared).into()))
            }
            _ => None,
        }
    }

    /// Puts the map's points in the place of its base's.
    fn correct(&self, forward: &Forward<f32>, pixels: &PixelColumns, points: &mut [Vec<f64>; 3]) {
        /// Points worked on at once: inputs and outputs stay in the nearest cache.
        const BLOCK: usize = 512;
        let mut inputs = vec![[0.0_f32; BLOCK]; self.inputs.len()];
        let mut outputs = [[0.0_f32; BLOCK]; 3];
        let count = pixels.points();
        for start in (0..count).step_by(BLOCK) {
            let length = BLOCK.min(count - start);
            let part = pixels.part(start..start + length);
            on_widest(Scaling { scales: &self.inputs, pixels: &part, inputs: &mut inputs });
            let columns: Vec<&[f32]> = inputs.iter().map(|column| &column[..length]).collect();
            forward.columns(&columns, &mut outputs.each_mut().map(|column| &mut column[..length]));
            let own = points.each_mut().map(|column| &mut column[start..start + length]);
            let outputs = outputs.each_ref().map(|column| &column[..length]);
            on_widest(Restoring { map: self, outputs, points: own });
        }
    }
}

/// Pixels to the network's inputs.
struct Scaling<'a, const B: usize> {
    scales: &'a [Scale],
    pixels: &'a PixelColumns<'a>,
    inputs: &'a mut [[f32; B]],
}

impl<const B: usize> WithSimd for Scaling<'_, B> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let columns = self.pixels.cameras().iter().flatten();
        for ((scale, column), input) in self.scales.iter().zip(columns).zip(self.inputs) {
            let by = 1.0 / (scale.high - scale.low);
            for (input, value) in input.iter_mut().zip(*column) {
                *input = ((value - scale.low) * by) as f32;
            }
        }
    }
}

/// The network's outputs to points.
struct Restoring<'a> {
    map: &'a NetworkReconstructor,
    outputs: [&'a [f32]; 3],
    points: [&'a mut [f64]; 3],
}

impl WithSimd for Restoring<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { map, outputs, points } = self;
        let scales = map.outputs.map(|scale| [scale.low, scale.high - scale.low]);
        let [x, y, z] = points;
        let [a, b, c] = outputs;
        let starts = if map.base.is_some() { 1.0 } else { 0.0 };
        let count = x.len().min(y.len()).min(z.len()).min(a.len()).min(b.len()).min(c.len());
        let (x, y, z) = (&mut x[..count], &mut y[..count], &mut z[..count]);
        let (a, b, c) = (&a[..count], &b[..count], &c[..count]);
        let restored =
            |axis: usize, value: f32| scales[axis][0] + f64::from(value) * scales[axis][1];
        match &map.targets {
            Targets::World {} => {
                for index in 0..count {
                    let base = |value: f64| if starts > 0.0 { value } else { 0.0 };
                    x[index] = base(x[index]) + restored(0, a[index]);
                    y[index] = base(y[index]) + restored(1, b[index]);
                    z[index] = base(z[index]) + restored(2, c[index]);
                }
            }
            Targets::InverseDepth { frame_from_world: Pose { rotation: r, translation: t } } => {
                for index in 0..count {
                    let base = [0, 1, 2].map(|row| {
                        let along = r[(row, 0)] * x[index] + r[(row, 1)] * y[index];
                        along + r[(row, 2)] * z[index] + t[row]
                    });
                    let near = 1.0 / base[2];
                    let base = [base[0] * near, base[1] * near, near];
                    let base = base.map(|value| if starts > 0.0 { value } else { 0.0 });
                    let inverse = base[2] + restored(2, c[index]);
                    // What lies behind the cameras is no point.
                    let depth = if inverse > 0.0 { 1.0 / inverse } else { f64::NAN };
                    let across = (base[0] + restored(0, a[index])) * depth;
                    let down = (base[1] + restored(1, b[index])) * depth;
                    let moved = [across - t[0], down - t[1], depth - t[2]];
                    let turned = |axis: usize| {
                        r[(0, axis)] * moved[0] + r[(1, axis)] * moved[1] + r[(2, axis)] * moved[2]
                    };
                    (x[index], y[index], z[index]) = (turned(0), turned(1), turned(2));
                }
            }
        }
    }
}
