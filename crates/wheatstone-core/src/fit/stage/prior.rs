//! What is known of the charts' places before the pixels are asked.

use crate::{Error, Result, dataset::Dataset};

/// How well the charts' places are known before the pixels are asked.
#[derive(Clone, Debug, PartialEq)]
pub struct StagePrior {
    /// Standard deviation of a chart's place along each axis, in world units.
    pub offset_sigma: f64,
    /// Standard deviation of its rotation about each axis, in radians. Without one, the view's offset
    /// sigma over half the chart's extent (a chart held at its ends) is a first guess, and what the
    /// pixels say of it is learnt.
    pub rotation_sigma: Option<f64>,
    /// Views (by name) whose place is known better or worse than that: their own offset sigma. 0
    /// holds a view where it is.
    pub views: Vec<(String, f64)>,
}

impl StagePrior {
    /// The same for all views.
    #[must_use]
    pub fn of(offset_sigma: f64) -> Self {
        Self { offset_sigma, rotation_sigma: None, views: Vec::new() }
    }

    pub(super) fn check(&self, data: &Dataset) -> Result<()> {
        let sigmas = [("stage sigma", self.offset_sigma, false)].into_iter();
        let sigmas = sigmas.chain(self.rotation_sigma.map(|s| ("stage rotation sigma", s, true)));
        let sigmas =
            sigmas.chain(self.views.iter().map(|(_, s)| ("stage sigma of a view", *s, true)));
        for (setting, value, zero) in sigmas {
            if !value.is_finite() || value < 0.0 || (value == 0.0 && !zero) {
                let need = if zero { "a number that is 0 or more" } else { "a number above 0" };
                return Err(Error::Setting {
                    setting: setting.into(),
                    value: value.to_string(),
                    need: format!("{need}, in the data's unit (radians for rotations)"),
                });
            }
        }
        match self.views.iter().find(|(name, _)| !data.views.contains(name)) {
            Some((name, _)) => Err(Error::UnknownName {
                kind: "view",
                name: name.clone(),
                known: data.views.clone(),
            }),
            None => Ok(()),
        }
    }
}
