//! Where rays meet.

use nalgebra::{Matrix3x4, Vector3};
use wheatstone_core::geometry::{
    Pixel, Point3, ProjectionMatrix,
    triangulation::{linear, refine},
};

fn cameras() -> Vec<ProjectionMatrix> {
    [-3.5, 3.5, 0.0]
        .map(|x| {
            ProjectionMatrix(Matrix3x4::new(
                700.0,
                0.0,
                320.0,
                -700.0 * x,
                0.0,
                700.0,
                240.0,
                700.0 * x * 0.1,
                0.0,
                0.0,
                1.0,
                0.0,
            ))
        })
        .to_vec()
}

#[test]
fn exact_pixels_give_the_exact_point_with_any_number_of_cameras() {
    let truth = Point3::new(5.0, -8.0, 100.0);
    for count in 2..=3 {
        let cameras = &cameras()[..count];
        let pixels: Vec<Pixel> = cameras.iter().map(|c| c.project(truth).unwrap()).collect();
        let start = linear(cameras.iter().zip(pixels.iter().copied())).unwrap();
        assert!((start - truth).norm() < 1e-9);
        let far = start + Vector3::new(3.0, -2.0, 20.0);
        let found = refine(far, &pixels, |i, p| cameras[i].project_with_jacobian(p)).unwrap();
        assert!((found.point - truth).norm() < 1e-9, "{found:?}");
        assert!(found.residual < 1e-9);
    }
    let one = cameras();
    assert!(linear([(&one[0], Pixel::origin())].into_iter()).is_none());
    // Two cameras in one place see no depth.
    let same = [(&one[0], Pixel::origin()), (&one[0], Pixel::origin())];
    assert!(linear(same.into_iter()).is_none());
}

#[test]
fn the_refined_point_is_a_minimum() {
    let cameras = cameras();
    let truth = Point3::new(5.0, -8.0, 100.0);
    let mut pixels: Vec<Pixel> = cameras.iter().map(|c| c.project(truth).unwrap()).collect();
    pixels[0].y += 1.5;
    pixels[2].x -= 0.7;
    let found = refine(truth, &pixels, |i, p| cameras[i].project_with_jacobian(p)).unwrap();
    let cost = |p: Point3| {
        cameras
            .iter()
            .zip(&pixels)
            .map(|(c, q)| (c.project(p).unwrap() - q).norm_squared())
            .sum::<f64>()
    };
    for axis in 0..3 {
        let mut step = Vector3::zeros();
        step[axis] = 1e-3;
        assert!(cost(found.point) < cost(found.point + step).min(cost(found.point - step)));
    }
    assert!((found.residual - (cost(found.point) / 6.0).sqrt()).abs() < 1e-12);
}
