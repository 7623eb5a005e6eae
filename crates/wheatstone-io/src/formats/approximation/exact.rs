//! A model's cameras where another program holds them as they are.

use crate::formats::{Optics, Rig, RigCamera};
use wheatstone_core::{Calibration, method::AnyReconstructor};

/// The cameras of a model, where they are of a kind that a rig has.
#[must_use]
pub fn exact(model: &Calibration) -> Option<Rig> {
    let optics: Vec<Optics> = match &model.reconstructor {
        AnyReconstructor::Brown(fitted) => {
            fitted.cameras.iter().cloned().map(Optics::Brown).collect()
        }
        AnyReconstructor::KannalaBrandt(fitted) => {
            fitted.cameras.iter().cloned().map(Optics::KannalaBrandt).collect()
        }
        AnyReconstructor::Dlt(fitted) => {
            fitted.matrices().iter().copied().map(Optics::Linear).collect()
        }
        _ => return None,
    };
    Some(named(model, optics))
}

/// Cameras with the names and sizes that the model knows.
pub(super) fn named(model: &Calibration, optics: Vec<Optics>) -> Rig {
    let imported = model.imported.as_ref();
    let camera = |(index, optics): (usize, Optics)| {
        let name = imported.and_then(|imported| imported.cameras.get(index).cloned());
        RigCamera {
            name: name.unwrap_or_else(|| format!("camera{}", index + 1)),
            size: model.picture_size(index),
            optics,
        }
    };
    let cameras = optics.into_iter().enumerate().map(camera).collect();
    Rig { unit: Some(model.unit.clone()), cameras }
}
