//! Where the cameras are, whatever the method: its own cameras where it has some, else those of the direct linear
//! transformation.

use crate::plot::space::corners;
use wheatstone_core::{
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix, Vector3},
    method::AnyReconstructor,
};

/// A camera's place and the directions in which the corners of its picture look.
#[derive(Clone, Debug)]
pub(super) struct Stand {
    pub(super) centre: Point3,
    /// Unit vectors.
    pub(super) corners: [Vector3; 4],
}

impl Stand {
    /// The direction in which the camera looks, a unit vector.
    pub(super) fn forward(&self) -> Vector3 {
        self.corners.iter().sum::<Vector3>().normalize()
    }
}

fn of_matrix(matrix: &ProjectionMatrix, area: [f64; 4]) -> Option<Stand> {
    let centre = matrix.centre()?;
    // P (C + d) is (u, v, 1) for the direction d of the pixel (u, v).
    let back = matrix.0.fixed_view::<3, 3>(0, 0).try_inverse()?;
    let corners = corners(area, |pixel| Some(back * Vector3::new(pixel.x, pixel.y, 1.0)))?;
    Some(Stand { centre, corners })
}

/// Where camera number `camera` stands: by the map's own camera where it has one, else by the direct linear transformation;
/// `None` where the points do not determine it.
pub(super) fn stand(
    map: &AnyReconstructor,
    data: &Dataset,
    camera: usize,
    area: [f64; 4],
) -> Option<Stand> {
    let corners = corners(area, |pixel| Some(map.unproject(camera, pixel)?.direction));
    let own = corners.and_then(|corners| {
        let [left, top, right, bottom] = area;
        let middle = Pixel::new((left + right) / 2.0, (top + bottom) / 2.0);
        Some(Stand { centre: map.unproject(camera, middle)?.origin, corners })
    });
    own.or_else(|| of_matrix(&ProjectionMatrix::fit(&data.seen_by_camera(camera))?, area))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_core::method::AnyMethod;
    use wheatstone_numeric::progress::Silent;
    use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences};

    #[test]
    fn cameras_stand_where_they_truly_stand() {
        let rig = Rig::named("paper", 2).unwrap();
        let chart = wheatstone_charts::chart::line_grid::LineGrid::default().into();
        let views = Stage::default().views().unwrap();
        let data = chart_correspondences(&rig, &chart, &views, (Noise::None, 1), None);
        // The true cameras are Brown's: those are found. To the linear ones the lens looks like a
        // shift, by a quarter of the nearest distance at most, and at the corner of the nearest chart,
        // where it bends most, by some pixels.
        for (name, shift, miss) in [("brown", 0.01, 1e-3), ("dlt", 12.5, 10.0)] {
            let fit = AnyMethod::named(name).unwrap().fit(&data, 0, &Silent).unwrap();
            for (index, camera) in rig.cameras.iter().enumerate() {
                let area = [0.0, 0.0, camera.width as f64, camera.height as f64];
                let stand = stand(&fit.reconstructor, &data, index, area).unwrap();
                assert!((stand.centre - camera.centre()).norm() < shift, "{name}");
                let truth = camera.ray(Pixel::new(area[2] / 2.0, area[3] / 2.0)).unwrap();
                assert!(stand.forward().dot(&truth.direction) > 0.99, "{name}");
                let (world, row) = data.known().next().unwrap();
                let found = fit.reconstructor.project(index, world).unwrap();
                let off = (found - row.pixels[index].unwrap()).norm();
                assert!(off < miss, "{name}: {off} px");
            }
        }
    }

    /// Corners of a fisheye's picture look at right angles to its axis, or farther back.
    #[test]
    fn fisheyes_look_where_they_truly_look() {
        let rig = Rig::named("fisheye", 2).unwrap();
        let chart = wheatstone_charts::chart::line_grid::LineGrid::default().into();
        let views = Stage::default().views().unwrap();
        let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
        let fit = AnyMethod::named("neural-camera").unwrap().fit(&data, 0, &Silent).unwrap();
        for (index, camera) in rig.cameras.iter().enumerate() {
            let [width, height] = [camera.width, camera.height].map(|side| side as f64);
            let stand = stand(&fit.reconstructor, &data, index, [0.0, 0.0, width, height]).unwrap();
            let truth = camera.ray(Pixel::new(width / 2.0, height / 2.0)).unwrap().direction;
            assert!(stand.forward().dot(&truth) > 0.99);
            assert!((stand.centre - camera.centre()).norm() < 1.0);
            for corner in stand.corners {
                assert!((0.4..0.9).contains(&corner.dot(&truth)), "{corner} beside {truth}");
            }
        }
    }
}
