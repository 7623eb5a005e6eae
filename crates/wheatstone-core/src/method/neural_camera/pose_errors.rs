//! What a fit leaves uncertain of where cameras stand and look.

use super::{NeuralCameraReconstructor, lens::Lens, model::NeuralCameraModel};
use crate::{geometry::Vector3, method::pose_error::PoseError};

impl NeuralCameraReconstructor {
    /// What each independent error of the fit does to each camera: those of each camera's lens, then the motions of charts,
    /// which all cameras follow.
    pub(in crate::method) fn pose_errors(&self) -> Vec<Vec<PoseError>> {
        let still = PoseError { centre: Vector3::zeros(), axis: Vector3::zeros() };
        let roots: Vec<_> = self.cameras.iter().map(NeuralCameraModel::errors).collect();
        let of = |index: usize| {
            let camera = &self.cameras[index];
            let lens = &camera.optics.lens;
            let lenses = roots.iter().enumerate().flat_map(|(other, [_, root])| {
                root.column_iter().map(move |step| match other == index {
                    true => of_step(lens, step.clone_owned().as_slice()),
                    false => still,
                })
            });
            lenses.chain(camera.modes().iter().map(|mode| of_step(lens, &mode.lens))).collect()
        };
        (0..self.cameras.len()).map(of).collect()
    }
}

/// Of a step of the lens's numbers, to first order.
fn of_step(lens: &Lens, step: &[f64]) -> PoseError {
    let units = lens.units();
    let by = |first: usize| Vector3::from([0, 1, 2].map(|k| step[first + k] * units[first + k]));
    let to_world = lens.camera_from_world.rotation.transpose();
    PoseError { centre: -(to_world * by(3)), axis: -(to_world * by(0).cross(&Vector3::z())) }
}
