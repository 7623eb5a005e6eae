//! How a pixel changes with the lens's numbers.
//!
//! One projection tells all of it: what a point's place in the camera's frame does to the pixel, the
//! pixel follows by the chain rule; the plane's and the lens's own numbers enter at the end.

use super::lens::{FIRST_RADIAL, Lens, PARAMETERS, ProjectedPoint};
use crate::{
    geometry::{Point3, Vector3},
    method::resection::turn,
};
use nalgebra::{Matrix3, SMatrix, Vector2};

/// Derivatives of a pixel by the lens's numbers, in the units of a step.
pub(super) type ByNumbers = SMatrix<f64, 2, PARAMETERS>;

/// A lens that a step has moved, ready to say how its pixels change with the step's numbers.
pub(super) struct Sloped<'a> {
    lens: &'a Lens,
    /// Of the lens from which the step was taken.
    units: [f64; PARAMETERS],
    /// By how much the turned point moves with each of the rotation's numbers: axes of turns.
    axes: Matrix3<f64>,
    /// The point of the camera's frame about which it is turned.
    pivot: Vector3,
    /// By what the step multiplied the focal length.
    focal: f64,
}

impl<'a> Sloped<'a> {
    /// About the lens as it is.
    pub(super) fn new(lens: &'a Lens) -> Self {
        let (axes, pivot) = (Matrix3::identity(), Vector3::zeros());
        Self { lens, units: lens.units(), axes, pivot, focal: 1.0 }
    }

    /// About `lens`, which is `start` moved by `step`.
    pub(super) fn after(lens: &'a Lens, start: &Lens, step: &[f64; PARAMETERS]) -> Self {
        let units = start.units();
        let (_, left) = turn(Vector3::new(step[0], step[1], step[2]));
        let pivot = Vector3::new(step[3], step[4], step[5]) * units[3];
        Self { lens, units, axes: left, pivot, focal: 1.0 + step[6] }
    }

    /// Where a point falls, and how that changes; `None` where it is not seen.
    pub(super) fn project(&self, world: Point3) -> Option<(ProjectedPoint, ByNumbers)> {
        let lens = self.lens;
        let point = lens.camera_from_world.transform(world);
        let (place, by_place) = lens.layout.place(point)?;
        let nearness = lens.nearness(world);
        let (bent, by_bend) = lens.bent(place, nearness.0);
        let plane = lens.plane_matrix();
        let by_point = plane * by_bend * by_place;
        let mut slopes = ByNumbers::zeros();
        let turned = point.coords - self.pivot;
        for number in 0..3 {
            let turning = self.axes.column(number).cross(&turned);
            slopes.set_column(number, &(by_point * turning * self.units[number]));
            slopes.set_column(3 + number, &(by_point.column(number) * self.units[3 + number]));
        }
        let [fx, fy, ..] = lens.plane;
        let along = Vector2::new(fx * bent.x, fy * bent.y);
        slopes.set_column(6, &(along / self.focal));
        slopes.set_column(7, &(Vector2::new(along.x, -along.y) * 0.5));
        slopes.set_column(8, &Vector2::new(bent.y * self.units[8], 0.0));
        slopes.set_column(9, &Vector2::new(self.units[9], 0.0));
        slopes.set_column(10, &Vector2::new(0.0, self.units[10]));
        for (index, by) in lens.second_derivatives(place, nearness.0).into_iter().enumerate() {
            slopes.set_column(FIRST_RADIAL + index, &(plane * by));
        }
        Some((lens.seen((place, nearness), (bent, by_point))?, slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::layout::Layout, *};
    use crate::geometry::{Pixel, Pose};

    fn lens(layout: Layout) -> Lens {
        let translation = Vector3::new(4.0, -3.0, 70.0);
        Lens {
            layout,
            camera_from_world: Pose::from_rotation_vector(
                translation,
                Vector3::new(0.1, -0.2, 0.3),
            ),
            plane: [700.0, 690.0, 1.5, 320.0, 240.0],
            distortion: [-0.1, 0.03, -0.01, 2e-3, -1e-3],
            pupil: 0.02,
            middle_nearness: 0.012,
            middle: Pixel::new(320.0, 240.0),
            viewpoint: Point3::new(-4.0, 3.0, -70.0),
            reach: 0.6,
        }
    }

    #[test]
    fn they_are_the_differences_of_the_projection_after_any_step() {
        // The cube root of the machine's precision balances rounding and curvature.
        const DIFFERENCE: f64 = 6e-6;
        let far: [f64; PARAMETERS] = std::array::from_fn(|i| 0.05 * libm::cos(i as f64));
        for layout in [Layout::Perspective, Layout::Equidistant] {
            for step in [[0.0; PARAMETERS], far] {
                let start = lens(layout);
                let moved = start.moved(&step);
                let sloped = Sloped::after(&moved, &start, &step);
                for world in [[0.0, 0.0, 0.0], [20.0, -15.0, 10.0], [-25.0, 18.0, 40.0]] {
                    let (seen, slopes) = sloped.project(world.into()).unwrap();
                    assert_eq!(seen.pixel, moved.project(world.into()).unwrap().pixel);
                    for index in 0..PARAMETERS {
                        let at = |by: f64| {
                            let mut step = step;
                            step[index] += by;
                            start.moved(&step).project(world.into()).unwrap().pixel
                        };
                        let difference = (at(DIFFERENCE) - at(-DIFFERENCE)) / (2.0 * DIFFERENCE);
                        let gap = (difference - slopes.column(index)).norm();
                        assert!(gap < 1e-5, "{index} of {step:?}: {gap}");
                    }
                }
                if step == [0.0; PARAMETERS] {
                    let (_, own) = Sloped::new(&start).project(Point3::origin()).unwrap();
                    assert_eq!(own, sloped.project(Point3::origin()).unwrap().1);
                }
            }
        }
    }
}
