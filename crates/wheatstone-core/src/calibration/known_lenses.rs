//! Lenses of earlier calibrations, for fits that find only where the cameras stand.

use super::Calibration;
use crate::{
    Error, Result,
    method::{AnyMethod, AnyReconstructor, KnownLens, brown::Brown, kannala_brandt::KannalaBrandt},
};

/// Lenses to be kept: one for all cameras, or one for each, in their order.
#[derive(Clone, Debug, Default)]
pub struct KnownLenses {
    /// The method with lenses of Brown's model.
    pub brown: Brown,
    /// The method with fisheyes.
    pub fisheye: KannalaBrandt,
}

impl KnownLenses {
    /// Adds the lenses of a model, with what is uncertain of them. Those of another program's calibration, which does not
    /// say how uncertain they are, are taken for exact.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for a model that has no lenses apart from where its cameras stand.
    pub fn add(&mut self, model: &Calibration) -> Result<()> {
        let (method, train) = (model.fitted()?.0, model.data.restored());
        let numbers = method.lens_numbers();
        let exact = model.imported.is_some();
        match &model.reconstructor {
            AnyReconstructor::Brown(fitted) if exact => {
                let lenses = fitted.cameras.iter().map(|camera| KnownLens::exact(camera.model));
                self.brown.lenses.extend(lenses);
            }
            AnyReconstructor::KannalaBrandt(fitted) if exact => {
                let lenses = fitted.cameras.iter().map(|camera| KnownLens::exact(camera.model));
                self.fisheye.lenses.extend(lenses);
            }
            AnyReconstructor::Brown(fitted) => {
                self.brown.lenses.extend(fitted.lenses_among(&numbers, &train));
            }
            AnyReconstructor::KannalaBrandt(fitted) => {
                self.fisheye.lenses.extend(fitted.lenses_among(&numbers, &train));
            }
            _ => {
                let name = method.name();
                return Err(refused(format!(
                    "a `{name}` model, which has no lens apart from its cameras' poses"
                )));
            }
        }
        Ok(())
    }

    /// The method that keeps them.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for lenses of two kinds, or none.
    pub fn method(self) -> Result<AnyMethod> {
        match (self.brown.lenses.is_empty(), self.fisheye.lenses.is_empty()) {
            (false, true) => Ok(self.brown.into()),
            (true, false) => Ok(self.fisheye.into()),
            _ => Err(refused("lenses of two kinds, or none".into())),
        }
    }
}

fn refused(what: String) -> Error {
    Error::Unsupported {
        format: "intrinsics".into(),
        what,
        hint: "give lenses of Brown's model (OpenCV's), or fisheyes of Kannala's and Brandt's"
            .into(),
    }
}
