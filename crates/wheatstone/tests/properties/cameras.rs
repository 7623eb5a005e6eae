//! Every camera model: projecting undoes what looking along a pixel does, and derivatives are slopes.

use super::config;
use proptest::prelude::*;
use wheatstone::{
    camera::{AnyCamera, CameraModel, brown_conrady::BrownConrady, pinhole::Pinhole},
    geometry::{Pixel, Point3, Vector3},
};

/// Any of the registry's cameras, its parameters a few per cent from their usual values.
fn camera() -> impl Strategy<Value = AnyCamera> {
    let shares = prop::collection::vec(-0.05..0.05_f64, 64);
    (0..AnyCamera::NAMES.len(), shares).prop_map(|(kind, shares)| {
        let mut camera = AnyCamera::all().swap_remove(kind);
        for (parameter, share) in camera.parameters_mut().into_iter().zip(shares) {
            *parameter *= 1.0 + share;
        }
        camera
    })
}

/// Any camera, and a place that it sees: 0.3 to 3 m away, in a tank before its far wall.
fn camera_and_place() -> impl Strategy<Value = (AnyCamera, Point3)> {
    (camera(), 140.0..500.0_f64, 60.0..420.0_f64, 0.0..1.0_f64).prop_map(|(camera, x, y, share)| {
        let reach = if matches!(camera, AnyCamera::CylindricalPort(_)) { 70.0 } else { 270.0 };
        let ray = camera.ray(Pixel::new(x, y)).unwrap();
        let place = ray.at(30.0 + share * reach);
        (camera, place)
    })
}

/// A place in the field of a lens: up to 19 degrees off the axis, 0.3 to 3 m away.
fn place() -> impl Strategy<Value = Point3> {
    (-0.35..0.35_f64, -0.35..0.35_f64, 30.0..300.0_f64)
        .prop_map(|(x, y, depth)| Point3::new(x * depth, y * depth, depth))
}

/// OpenCV's model as its documentation writes it, without tilt.
fn opencv(lens: &BrownConrady, point: Point3) -> [f64; 2] {
    let (x, y) = (point.x / point.z, point.y / point.z);
    let r2 = x * x + y * y;
    let [[k1, k2, k3], [k4, k5, k6]] = [lens.radial, lens.rational];
    let ([p1, p2], [s1, s2, s3, s4]) = (lens.tangential, lens.prism);
    let radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
    let bent = [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + s1 * r2 + s2 * r2 * r2,
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + s3 * r2 + s4 * r2 * r2,
    ];
    let Pinhole { focal, principal } = lens.pinhole;
    [0, 1].map(|axis| focal[axis] * bent[axis] + principal[axis])
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn the_ray_of_a_pixel_goes_through_the_point((camera, point) in camera_and_place()) {
        let pixel = camera.project(point).unwrap();
        let ray = camera.ray(pixel).unwrap();
        prop_assert!((ray.direction.norm() - 1.0).abs() < 1e-12);
        let along = (point - ray.origin).dot(&ray.direction);
        prop_assert!(along > 0.0);
        let off = (ray.at(along) - point).norm();
        prop_assert!(off < 1e-7 * point.coords.norm(), "{off} off");
    }

    #[test]
    fn derivatives_are_slopes((camera, point) in camera_and_place()) {
        let (pixel, jacobian) = camera.project_with_jacobian(point).unwrap();
        prop_assert_eq!(Some(pixel), camera.project(point));
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1e-4 * point.coords.norm();
            let apart = camera.project(point + step).unwrap() - camera.project(point - step).unwrap();
            let gap = (apart / (2.0 * step[axis]) - jacobian.column(axis)).norm();
            prop_assert!(gap < 1e-5 * (1.0 + jacobian.norm()), "axis {axis}: {gap}");
        }
    }

    #[test]
    fn browns_lens_is_opencvs(
        radial in prop::array::uniform3(-0.1..0.1_f64),
        rational in prop::array::uniform3(-0.1..0.1_f64),
        tangential in prop::array::uniform2(-0.01..0.01_f64),
        prism in prop::array::uniform4(-0.01..0.01_f64),
        point in place(),
    ) {
        let ideal = BrownConrady::ideal(Pinhole::default());
        let lens = BrownConrady { radial, rational, tangential, prism, ..ideal };
        let due = opencv(&lens, point);
        let found = lens.project(point).unwrap();
        prop_assert!((found.x - due[0]).abs() < 1e-9 && (found.y - due[1]).abs() < 1e-9, "{found} for {due:?}");
    }
}
