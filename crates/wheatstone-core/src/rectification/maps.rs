//! World point to pixel, for two cameras of any model.

use super::ErrorSummary;
use crate::{
    Calibration, Error, Result,
    dataset::Dataset,
    error::{Hint, Remedy},
    geometry::{Pixel, Point3},
    method::{AnyMethod, AnyReconstructor},
};
use nalgebra::{Matrix2x3, Vector3};
use wheatstone_numeric::progress::Progress;

/// Where two cameras see a point.
pub(super) struct Maps<'a> {
    how: How<'a>,
    /// Left and right, counted from 0 among the model's.
    pub(super) cameras: [usize; 2],
    /// How far from the model's own pixels those of a map that was learned from it lie.
    pub(super) followed: Option<ErrorSummary>,
    /// How long a step is that is small within the space that was shown.
    pub(super) step: f64,
}

enum How<'a> {
    /// The model says it.
    Own(&'a AnyReconstructor),
    /// Learned from where the model finds points.
    Learned(Box<AnyReconstructor>),
}

/// Enough for what a camera that learns its lens asks for, few enough for seconds of work.
const PLACES: usize = 900;

impl<'a> Maps<'a> {
    /// Of two cameras of a model.
    pub(super) fn of(
        model: &'a Calibration,
        cameras: [usize; 2],
        progress: &dyn Progress,
    ) -> Result<Self> {
        // Differences over this share of the space's width are good to eight digits for smooth maps.
        const SHARE: f64 = 1e-4;
        let spread = model.data.spread();
        let step = SHARE * if spread > 0.0 { spread } else { 1.0 };
        if model.reconstructor.has_projection() {
            return Ok(Self { how: How::Own(&model.reconstructor), cameras, followed: None, step });
        }
        let (learned, followed) = follow(model, progress)?;
        Ok(Self { how: How::Learned(Box::new(learned)), cameras, followed: Some(followed), step })
    }

    /// Where the left (0) or right (1) camera observes a point.
    pub(super) fn project(&self, side: usize, world: Point3) -> Option<Pixel> {
        let map = match &self.how {
            How::Own(model) => *model,
            How::Learned(model) => &**model,
        };
        let pixel = map.project(self.cameras[side], world)?;
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// The derivatives of that by the world's coordinates.
    pub(super) fn slopes(&self, side: usize, world: Point3) -> Option<Matrix2x3<f64>> {
        let mut slopes = Matrix2x3::zeros();
        for axis in 0..3 {
            let mut by = Vector3::zeros();
            by[axis] = self.step;
            let (ahead, behind) =
                (self.project(side, world + by)?, self.project(side, world - by)?);
            slopes.set_column(axis, &((ahead - behind) / (2.0 * self.step)));
        }
        Some(slopes)
    }
}

/// Cameras that learn their lens from where the model finds its own points, then twice from where it
/// finds the points of those cameras' pixels, which have no noise; and how far they are from it.
fn follow(
    model: &Calibration,
    progress: &dyn Progress,
) -> Result<(AnyReconstructor, ErrorSummary)> {
    let data = model.data.restored();
    let method = AnyMethod::named("neural-camera")?;
    let rows = data.correspondences.iter().filter_map(|row| {
        let found = model.reconstructor.locate(&row.pixels)?;
        let mut row = row.clone();
        row.world = Some(found.point);
        Some(row)
    });
    let located = Dataset { correspondences: rows.collect(), ..data.clone() };
    let mut learned = method.fit(&located, 0, progress)?.reconstructor;
    for seed in 0..2 {
        let clean = found_again(model, &learned, &data, seed);
        learned = method.fit(&clean, 0, progress)?.reconstructor;
    }
    let exam = found_again(model, &learned, &data, 2);
    let mut misses = Vec::new();
    for camera in 0..data.cameras {
        for (world, pixel) in exam.seen_by_camera(camera) {
            misses.extend(learned.project(camera, world).map(|at| (at - pixel).norm()));
        }
    }
    ErrorSummary::of(misses).map(|spread| (learned, spread)).ok_or_else(|| Error::Degenerate {
        problem: "the model locates no points in the common field of view of the cameras".into(),
        hint: Hint::new("evaluate the model, and fit again", Remedy::Evaluate),
    })
}

/// The pixels of places in the space that the model was shown, with where the model finds them.
fn found_again(
    model: &Calibration,
    cameras: &AnyReconstructor,
    data: &Dataset,
    seed: u64,
) -> Dataset {
    let mut rows = Vec::with_capacity(PLACES);
    for place in model.data.places(PLACES, seed) {
        let pixels: Vec<Option<Pixel>> =
            (0..data.cameras).map(|camera| cameras.project(camera, place)).collect();
        let found = model.reconstructor.locate(&pixels).map(|found| found.point);
        // What the model finds far from where it ought to be is no part of its map.
        let near = found.filter(|found| (found - place).norm() < 0.25 * model.data.spread());
        rows.extend(near.map(|world| crate::dataset::Correspondence {
            view: 0,
            id: None,
            pixels,
            world: Some(world),
            board: None,
        }));
    }
    Dataset { correspondences: rows, ..data.clone() }
}
