//! The network over many points: its outputs in single precision, for they are small corrections, or as
//! coarse as the paper's; all else in double.

use super::{NetworkReconstructor, Noise, Scale, SetNetwork, Targets};
use crate::{
    geometry::PixelColumns,
    method::{Learned, PlacedCamera},
};
use nalgebra::Matrix3;
use wheatstone_numeric::{
    aligned::ask_ahead,
    perceptron::{Forward, Samples, TOGETHER},
};

impl NetworkReconstructor {
    /// The network of all cameras, for who locates many points; `None` where there is none, or its base cannot be made
    /// ready.
    pub(super) fn learned(&self) -> Option<Learned<'_>> {
        let network = self.sets.first().filter(|set| set.cameras.len() == self.cameras)?;
        let base: Vec<PlacedCamera> = match &network.base {
            Some(base) => base.placed()?,
            None => Vec::new(),
        };
        let forward = Forward::<f32>::new(&network.perceptron);
        let epipolar_check = self
            .epipolar_check
            .as_ref()
            .map(|epipolar_check| epipolar_check.placed())
            .unwrap_or_default();
        Some(Learned {
            base,
            correct: Box::new(move |pixels, points| network.correct(&forward, pixels, points)),
            epipolar_check,
            covariance: network.even_covariance(),
        })
    }
}

impl SetNetwork {
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
    map: &'a SetNetwork,
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
        let targets = &self.map.targets;
        if *targets == (Targets::World {}) && self.map.base.is_none() {
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
            into_targets(targets, &mut base);
            for (own, base) in own.as_flattened_mut().iter_mut().zip(base.as_flattened()) {
                *own += base;
            }
        }
        out_of_targets(targets, &mut own);
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

/// World points to targets.
#[inline(always)]
fn into_targets(targets: &Targets, points: &mut [Together; 3]) {
    let (pose, is_stereographic) = match targets {
        Targets::World {} => return,
        Targets::InverseDepth { frame_from_world } => (frame_from_world, false),
        Targets::InverseDistance { frame_from_world } => (frame_from_world, true),
    };
    let (r, t) = (&pose.rotation, &pose.translation);
    let [x, y, z] = points;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let mut turned = [0.0; 3];
        for (row, turned) in turned.iter_mut().enumerate() {
            *turned = r[(row, 0)] * *x + r[(row, 1)] * *y + r[(row, 2)] * *z + t[row];
        }
        let [a, b, depth] = turned;
        let (by, far) = if is_stereographic {
            let distance = (a * a + b * b + depth * depth).sqrt();
            (2.0 / (distance + depth), distance)
        } else {
            (1.0 / depth, depth)
        };
        (*x, *y, *z) = (a * by, b * by, 1.0 / far);
    }
}

/// Targets to world points; what lies behind the cameras or infinitely far is no point.
#[inline(always)]
fn out_of_targets(targets: &Targets, points: &mut [Together; 3]) {
    let (pose, is_stereographic) = match targets {
        Targets::World {} => return,
        Targets::InverseDepth { frame_from_world } => (frame_from_world, false),
        Targets::InverseDistance { frame_from_world } => (frame_from_world, true),
    };
    let (r, t) = (&pose.rotation, &pose.translation);
    let [x, y, z] = points;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let far = if *z > 0.0 { 1.0 / *z } else { f64::NAN };
        let square = if is_stereographic { 0.25 * (*x * *x + *y * *y) } else { 0.0 };
        let by = far / (1.0 + square);
        let moved = [*x * by - t[0], *y * by - t[1], (1.0 - square) * by - t[2]];
        let mut turned = [0.0; 3];
        for (axis, turned) in turned.iter_mut().enumerate() {
            *turned = r[(0, axis)] * moved[0] + r[(1, axis)] * moved[1] + r[(2, axis)] * moved[2];
        }
        (*x, *y, *z) = (turned[0], turned[1], turned[2]);
    }
}
