//! A fitted map, taken apart into what many points are located by.

use super::{super::Reconstructor, plan::Learned, rig::Rig};

/// A map as its plan has it.
pub(super) struct Map<'a> {
    pub(super) reconstructor: &'a dyn Reconstructor,
    /// Whose rays meet: the cameras, or those whose point a formula starts from.
    pub(super) base: Option<Rig<'a>>,
    /// The formula.
    pub(super) learned: Option<Learned<'a>>,
    /// Who says whether pixels belong together, beside a formula.
    pub(super) epipolar_check: Option<Rig<'a>>,
}

impl<'a> Map<'a> {
    /// Whose rays tell how near points are.
    pub(super) fn rays(&self) -> Option<&Rig<'a>> {
        if self.learned.is_some() { self.epipolar_check.as_ref() } else { self.base.as_ref() }
    }
}
