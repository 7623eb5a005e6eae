//! Epipolar curves: where the right picture shows what the left one shows at a pixel, from near to far.
//!
//! Of cameras whose rays have a common centre they are the rows. Of others (behind ports, in tubes) they bend away from
//! them, by the vertical difference that no virtual pair can take away.

use super::{Rectification, ray_table::reached};
use crate::geometry::{Pixel, Vector3};

impl Rectification<'_> {
    /// How many rows lower (in pixels, negative for higher) the right rectified picture shows what the left one shows
    /// at a pixel, at a disparity: what is left of [`super::AtDepth::vertical`] there. `None` where the model does not
    /// say it.
    #[must_use]
    pub fn vertical_difference(&self, left: Pixel, disparity: f64) -> Option<f64> {
        let source = self.source(0, left)?;
        let seen = |disparity: f64| {
            let place = self.meet(left, Pixel::new(left.x - disparity, left.y))?;
            let world_from_rectified = self.pair.rectified_from_world.inverse();
            let start = world_from_rectified.transform(place);
            let along = world_from_rectified.rotation * place.coords.normalize();
            let forward = world_from_rectified.rotation * Vector3::z();
            let depth = forward.dot(&start.coords);
            let on_ray = reached(&self.maps, 0, (start, along), source, (forward, depth))?;
            let right = self.rectified(1, self.maps.project(1, on_ray)?)?;
            Some((left.x - right.x, right.y - left.y))
        };
        // At the depth that pinholes have at a disparity, others have a slightly different one.
        let (found, _) = seen(disparity)?;
        let (_, vertical) = seen(disparity + (disparity - found))?;
        vertical.is_finite().then_some(vertical)
    }
}
