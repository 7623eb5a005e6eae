//! The network over many points: its outputs in single precision, for they are small corrections, or as
//! coarse as the paper's; all else in double.

use super::{NetworkReconstructor, Noise, Scale, Targets};
use crate::{
    geometry::{PixelColumns, Pose},
    method::{Learned, PlacedCamera},
};
use nalgebra::Matrix3;
use wheatstone_numeric::{
    aligned::ask_ahead,
    perceptron::{Forward, Samples, TOGETHER},
};

impl NetworkReconstructor {
    /// The map, for who locates many points; `None` where its base cannot be made ready.
    pub(super) fn learned(&self) -> Option<Learned<'_>> {
        let base: Vec<PlacedCamera> = match &self.base {
            Some(base) => base.placed()?,
            None => Vec::new(),
        };
        let forward = Forward::<f32>::new(&self.perceptron);
        let epipolar_check = self
            .epipolar_check
            .as_ref()
            .map(|epipolar_check| epipolar_check.placed())
            .unwrap_or_default();
        Some(Learned {
            base,
            correct: Box::new(move |pixels, points| self.correct(&forward, pixels, points)),
            epipolar_check,
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
    fn correct(&self, forward: &Forward<f32>, pixels: &PixelColumns, points: &mut [&mut [f64]; 3]) {
        let scale = |scale: &Scale| [scale.low, 1.0 / (scale.high - scale.low)];
        let columns = pixels.cameras().iter().flatten();
        let inputs = columns.copied().zip(self.inputs.iter().map(scale)).collect();
        let outputs = self.outputs.map(|scale| [scale.low, scale.high - scale.low]);
        forward.samples(pixels.points(), Points { map: self, inputs, outputs, points });
    }
}

/// Points on their way through the network.
struct Points<'a, 'p> {
    map: &'a NetworkReconstructor,
    /// Pixels, the least of them, and one over their range.
    inputs: Vec<(&'a [f64], [f64; 2])>,
    /// The least of each output and its range.
    outputs: [[f64; 2]; 3],
    points: &'a mut [&'p mut [f64]; 3],
}

/// One number of each point that is worked on at once.
type Together = [f64; TOGETHER];

impl Samples<f32> for Points<'_, '_> {
    #[inline(always)]
    fn read(&self, first: usize, inputs: &mut [[f32; TOGETHER]]) {
        for (input, (column, [low, by])) in inputs.iter_mut().zip(&self.inputs) {
            let values = &column[first..];
            // Of a known length where there are enough: the loop then is a few registers.
            if let Some(values) = values.first_chunk::<TOGETHER>() {
                ask_ahead(values);
                for (input, value) in input.iter_mut().zip(values) {
                    *input = ((value - low) * by) as f32;
                }
            } else {
                for (input, value) in input.iter_mut().zip(values) {
                    *input = ((value - low) * by) as f32;
                }
            }
        }
    }

    #[inline(always)]
    fn write(&mut self, first: usize, outputs: &[[f32; TOGETHER]]) {
        let [a, b, c] = outputs else { return };
        let frame = match &self.map.targets {
            Targets::World {} => None,
            Targets::InverseDepth { frame_from_world } => Some(frame_from_world),
        };
        if frame.is_none() && self.map.base.is_none() {
            for ((points, output), scale) in self.points.iter_mut().zip([a, b, c]).zip(self.outputs)
            {
                let points = &mut points[first..];
                match points.first_chunk_mut::<TOGETHER>() {
                    Some(points) => {
                        ask_ahead(points);
                        unscaled(output, scale, points);
                    }
                    None => unscaled(output, scale, points),
                }
            }
            return;
        }
        let mut own = [[0.0; TOGETHER]; 3];
        let all = own.iter_mut().zip([a, b, c]).zip(self.outputs);
        for ((own, output), scale) in all {
            unscaled(output, scale, own);
        }
        if self.map.base.is_some() {
            let mut base = [[0.0; TOGETHER]; 3];
            for (base, points) in base.iter_mut().zip(&*self.points) {
                let mut part = [0.0; TOGETHER];
                *base = *part_of(points, first, &mut part);
            }
            if let Some(frame) = frame {
                into_frame(frame, &mut base);
            }
            for (own, base) in own.as_flattened_mut().iter_mut().zip(base.as_flattened()) {
                *own += base;
            }
        }
        if let Some(frame) = frame {
            out_of_frame(frame, &mut own);
        }
        for (points, own) in self.points.iter_mut().zip(&own) {
            let last = points.len().min(first + TOGETHER);
            points[first..last].copy_from_slice(&own[..last - first]);
        }
    }
}

/// From what the network says to targets: the least of them and their range.
#[inline(always)]
fn unscaled(outputs: &[f32; TOGETHER], [low, range]: [f64; 2], targets: &mut [f64]) {
    for (target, output) in targets.iter_mut().zip(outputs) {
        *target = low + f64::from(*output) * range;
    }
}

/// A column's numbers from `first` on; the last few by way of `part`.
#[inline(always)]
fn part_of<'c>(column: &'c [f64], first: usize, part: &'c mut Together) -> &'c Together {
    match column[first..].first_chunk() {
        Some(whole) => whole,
        None => {
            let rest = &column[first..];
            part[..rest.len()].copy_from_slice(rest);
            part
        }
    }
}

/// World points to X / Z, Y / Z and 1 / Z of the frame.
#[inline(always)]
fn into_frame(frame_from_world: &Pose, points: &mut [Together; 3]) {
    let Pose { rotation: r, translation: t } = frame_from_world;
    let [x, y, z] = points;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let mut turned = [0.0; 3];
        for (row, turned) in turned.iter_mut().enumerate() {
            *turned = r[(row, 0)] * *x + r[(row, 1)] * *y + r[(row, 2)] * *z + t[row];
        }
        let near = 1.0 / turned[2];
        (*x, *y, *z) = (turned[0] * near, turned[1] * near, near);
    }
}

/// X / Z, Y / Z and 1 / Z of the frame to world points; what lies behind it is no point.
#[inline(always)]
fn out_of_frame(frame_from_world: &Pose, points: &mut [Together; 3]) {
    let Pose { rotation: r, translation: t } = frame_from_world;
    let [x, y, z] = points;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let depth = if *z > 0.0 { 1.0 / *z } else { f64::NAN };
        let moved = [*x * depth - t[0], *y * depth - t[1], depth - t[2]];
        let mut turned = [0.0; 3];
        for (axis, turned) in turned.iter_mut().enumerate() {
            *turned = r[(0, axis)] * moved[0] + r[(1, axis)] * moved[1] + r[(2, axis)] * moved[2];
        }
        (*x, *y, *z) = (turned[0], turned[1], turned[2]);
    }
}
