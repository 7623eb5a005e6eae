//! Where the cameras are and what they expect, whatever the method: its own cameras where it has
//! some, else those of the direct linear transformation.

use wheatstone_core::{
    camera::CameraModel,
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix, Ray, Vector3},
    method::{AnyReconstructor, FittedCamera, FittedCameras},
};

/// What a fitted map expects one camera to see at a world point; `None` where its method has no
/// cameras, or the camera cannot see the point.
pub(super) fn expected(map: &AnyReconstructor, camera: usize, world: Point3) -> Option<Pixel> {
    fn of<L: CameraModel>(all: &FittedCameras<L>, camera: usize, world: Point3) -> Option<Pixel> {
        all.cameras.get(camera)?.project(world)
    }
    match map {
        AnyReconstructor::Dlt(all) => all.project(camera, world),
        AnyReconstructor::Brown(all) => of(all, camera, world),
        AnyReconstructor::KannalaBrandt(all) => of(all, camera, world),
        AnyReconstructor::Tsai(all) => of(all, camera, world),
        AnyReconstructor::NeuralCamera(all) => Some(all.predict(camera, world)?.0),
        _ => None,
    }
}

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

/// Left, top, right, bottom to the corners in their order round.
fn corner_pixels([left, top, right, bottom]: [f64; 4]) -> [Pixel; 4] {
    [[left, top], [right, top], [right, bottom], [left, bottom]].map(Pixel::from)
}

fn from_rays(rays: [Option<Ray>; 4]) -> Option<Stand> {
    let [a, b, c, d] = rays;
    let all = [a?, b?, c?, d?];
    Some(Stand { centre: all[0].origin, corners: all.map(|ray| ray.direction) })
}

fn of_matrix(matrix: &ProjectionMatrix, area: [f64; 4]) -> Option<Stand> {
    let centre = matrix.centre()?;
    // P (C + d) is (u, v, 1) for the direction d of the pixel (u, v).
    let back = matrix.0.fixed_view::<3, 3>(0, 0).try_inverse()?;
    let look = |pixel: Pixel| (back * Vector3::new(pixel.x, pixel.y, 1.0)).normalize();
    Some(Stand { centre, corners: corner_pixels(area).map(look) })
}

/// Where camera number `camera` stands: by the map's own camera where it has one with a centre, else
/// by the direct linear transformation; `None` where the points do not determine it.
pub(super) fn stand(
    map: &AnyReconstructor,
    data: &Dataset,
    camera: usize,
    area: [f64; 4],
) -> Option<Stand> {
    fn own<L: CameraModel>(camera: Option<&FittedCamera<L>>, area: [f64; 4]) -> Option<Stand> {
        let camera = camera?;
        from_rays(corner_pixels(area).map(|pixel| camera.ray(pixel)))
    }
    let own = match map {
        AnyReconstructor::Brown(all) => own(all.cameras.get(camera), area),
        AnyReconstructor::KannalaBrandt(all) => own(all.cameras.get(camera), area),
        AnyReconstructor::Tsai(all) => own(all.cameras.get(camera), area),
        _ => None,
    };
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
                let found = expected(&fit.reconstructor, index, world).unwrap();
                let off = (found - row.pixels[index].unwrap()).norm();
                assert!(off < miss, "{name}: {off} px");
            }
        }
    }
}
