//! Where the charts stand that a camera saw, where that is not certain.

use crate::geometry::{Point3, Pose, Vector3};

/// Numbers of a chart's motion: offset along the world's axes, then the rotation vector.
pub(crate) const MOTION: usize = 6;

/// A chart's place, believed and possible.
#[derive(Clone, Debug)]
pub(crate) struct UncertainPose {
    /// About which it turns.
    pub(crate) centre: Point3,
    /// Standard deviations of its motion: offset in world units, rotation in radians.
    pub(crate) sigma: [f64; MOTION],
    /// Its present motion in units of `sigma`.
    pub(crate) motion: [f64; MOTION],
}

impl UncertainPose {
    /// Offset in world units and rotation vector in radians.
    pub(crate) fn moved_by(&self) -> (Vector3, Vector3) {
        let by = |index: usize| self.motion[index] * self.sigma[index];
        (Vector3::new(by(0), by(1), by(2)), Vector3::new(by(3), by(4), by(5)))
    }

    /// Where a point that is believed to be at `world` is with the chart moved.
    pub(crate) fn place(&self, world: Point3) -> Point3 {
        let (offset, rotation) = self.moved_by();
        let turned = Pose::from_rotation_vector(offset, rotation);
        self.centre + turned.transform(Point3::from(world - self.centre)).coords
    }
}

/// The charts of the points that one camera saw.
#[derive(Clone, Debug)]
pub(crate) struct UncertainPoses {
    pub(crate) charts: Vec<UncertainPose>,
    /// Each point's chart.
    pub(crate) of_point: Vec<usize>,
    /// Whether the charts stay as they are in a fit.
    pub(crate) held: bool,
}

impl UncertainPoses {
    pub(super) fn place(&self, row: usize, world: Point3) -> Point3 {
        self.charts[self.of_point[row]].place(world)
    }

    /// The motions that a fit may change.
    pub(super) fn free_numbers(&self) -> impl Iterator<Item = f64> {
        let free = if self.held { &[] } else { self.charts.as_slice() };
        free.iter().flat_map(|chart| chart.motion)
    }

    /// Slopes of a point's pixel (x, y) by its chart's motion, from those by the moved point's place;
    /// and the first of the motion's numbers. None while the charts are held.
    pub(super) fn slopes(
        &self,
        row: usize,
        placed: Point3,
        by_world: &[Vector3; 2],
    ) -> Option<(usize, [[f64; MOTION]; 2])> {
        let index = self.of_point[row];
        let chart = self.charts.get(index).filter(|_| !self.held)?;
        let arm = placed - (chart.centre + chart.moved_by().0);
        let slopes = by_world.map(|slope| {
            let turning = arm.cross(&slope);
            std::array::from_fn(|number| {
                let plain = if number < 3 { slope[number] } else { turning[number - 3] };
                plain * chart.sigma[number]
            })
        });
        Some((MOTION * index, slopes))
    }

    /// Moves free charts by a share of a step.
    pub(super) fn advance(&mut self, share: f64, step: &[f64]) {
        let motions = self.charts.iter_mut().flat_map(|chart| &mut chart.motion);
        motions.zip(step).for_each(|(number, step)| *number += share * step);
    }
}
