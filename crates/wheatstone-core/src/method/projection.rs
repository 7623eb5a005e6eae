//! Where a model's cameras see a world point, for the models that say it.

use super::AnyReconstructor;
use crate::geometry::{Pixel, Point3, Ray, Vector3};

impl AnyReconstructor {
    /// Whether it maps world points to pixels. Networks and interpolation only say where matched pixels
    /// meet; so it is taken to be with maps of other crates.
    #[must_use]
    pub fn has_projection(&self) -> bool {
        !matches!(self, Self::Network(_) | Self::Interpolation(_) | Self::Custom(_))
    }

    /// Where a camera, counted from 0, observes a world point. `None` where it does not, for a camera that
    /// there is not, and for every point without [`AnyReconstructor::has_projection`].
    #[must_use]
    pub fn project(&self, camera: usize, world: Point3) -> Option<Pixel> {
        match self {
            Self::Brown(fitted) => fitted.cameras.get(camera)?.project(world),
            Self::KannalaBrandt(fitted) => fitted.cameras.get(camera)?.project(world),
            Self::Tsai(fitted) => fitted.cameras.get(camera)?.project(world),
            Self::Dlt(fitted) => fitted.project(camera, world),
            Self::Soloff(fitted) => fitted.project(camera, world),
            Self::NeuralCamera(fitted) => Some(fitted.project(camera, world)?.0),
            Self::Network(_) | Self::Interpolation(_) | Self::Custom(_) => None,
        }
    }

    /// Where a pixel of a camera, counted from 0, looks, in the world. `None` but for the methods whose
    /// cameras are given by a formula and see from one place.
    #[must_use]
    pub fn ray(&self, camera: usize, pixel: Pixel) -> Option<Ray> {
        match self {
            Self::Brown(fitted) => fitted.cameras.get(camera)?.ray(pixel),
            Self::KannalaBrandt(fitted) => fitted.cameras.get(camera)?.ray(pixel),
            Self::Tsai(fitted) => fitted.cameras.get(camera)?.ray(pixel),
            Self::Dlt(fitted) => {
                let matrix = fitted.matrices().get(camera)?;
                let linear = matrix.0.fixed_view::<3, 3>(0, 0).into_owned();
                let along = linear.try_inverse()? * Vector3::new(pixel.x, pixel.y, 1.0);
                Some(Ray { origin: matrix.centre()?, direction: along.try_normalize(0.0)? })
            }
            _ => None,
        }
    }
}
