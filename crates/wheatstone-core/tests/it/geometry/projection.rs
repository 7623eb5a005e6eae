//! Projective cameras that are known.

use nalgebra::{Matrix3, Matrix3x4, Vector3};
use wheatstone_core::geometry::{Pixel, Point3, ProjectionMatrix};
use wheatstone_numeric::random::Random;

fn camera() -> ProjectionMatrix {
    ProjectionMatrix(Matrix3x4::new(
        700.0, 5.0, 320.0, -2000.0, -8.0, 690.0, 240.0, 500.0, 0.01, -0.02, 0.99975, 30.0,
    ))
}

fn pairs(z_span: f64) -> Vec<(Point3, Pixel)> {
    let mut random = Random::new(1);
    // World coordinates far from the origin, as a stage's read-out may be.
    let point = |r: &mut Random| {
        Point3::new(r.uniform(-20.0, 20.0), r.uniform(-20.0, 20.0), 900.0 + r.uniform(0.0, z_span))
    };
    (0..40).map(|_| point(&mut random)).map(|p| (p, camera().project(p).unwrap())).collect()
}

#[test]
fn recovers_a_camera_from_exact_points() {
    let pairs = pairs(60.0);
    let found = ProjectionMatrix::fit(&pairs).unwrap();
    let sketched = ProjectionMatrix::sketch(&pairs[..7]).unwrap();
    for (world, pixel) in &pairs {
        assert!((found.project(*world).unwrap() - pixel).norm() < 1e-8);
        assert!((sketched.project(*world).unwrap() - pixel).norm() < 1e-6);
    }
    assert!((found.centre().unwrap() - camera().centre().unwrap()).norm() < 1e-6);
}

#[test]
fn a_decomposed_camera_is_the_same_camera() {
    for side in [1.0, -1.0] {
        let mut camera = camera();
        camera.0.column_mut(0).scale_mut(side);
        let (k, r, t) = camera.decompose().unwrap();
        assert!((r * r.transpose() - Matrix3::identity()).norm() < 1e-12);
        // The camera is one with x right and y down, as long as the world is right-handed.
        assert!((r.determinant() - side).abs() < 1e-12 && k[(0, 0)] > 0.0 && k[(1, 1)] > 0.0);
        let scale = camera.0.fixed_view::<1, 3>(2, 0).norm();
        let mut back = Matrix3x4::zeros();
        back.fixed_view_mut::<3, 3>(0, 0).copy_from(&(k * r));
        back.set_column(3, &(k * t));
        assert!((back * scale - camera.0).norm() < 1e-9);
    }
}

#[test]
fn points_on_one_plane_are_refused() {
    assert!(ProjectionMatrix::fit(&pairs(0.0)).is_none());
}

#[test]
fn jacobian_agrees_with_differences() {
    let (camera, point, step) = (camera(), Point3::new(3.0, -4.0, 950.0), 1e-4);
    let (_, jacobian) = camera.project_with_jacobian(point).unwrap();
    for axis in 0..3 {
        let mut move_by = Vector3::zeros();
        move_by[axis] = step;
        let ahead = camera.project(point + move_by).unwrap();
        let behind = camera.project(point - move_by).unwrap();
        let difference = (ahead - behind) / (2.0 * step);
        assert!((difference - jacobian.column(axis)).norm() < 1e-7);
    }
}
