//! Poses, homographies, projection matrices, triangulation.

use super::{config, point, pose, turn, vector};
use proptest::{collection::vec, prelude::*};
use wheatstone::{
    Pixel,
    geometry::{
        Homography, Point3, Pose, ProjectionMatrix, Ray, Vector3,
        triangulation::{linear, nearest, refine},
    },
};

/// A camera before the origin's surroundings: its matrix, of a focal length of 500 to 2000 px.
fn matrix() -> impl Strategy<Value = ProjectionMatrix> {
    let lens = (500.0..2000.0, 500.0..2000.0, 200.0..900.0, 200.0..900.0);
    (lens, vector(0.4), vector(200.0)).prop_map(|((fx, fy, cx, cy), turn, aside)| {
        let away = Vector3::new(aside.x, aside.y, 1500.0 + aside.z);
        let pose = Pose::from_rotation_vector(away, turn);
        let lens = nalgebra::Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
        let mut own = nalgebra::Matrix3x4::zeros();
        own.fixed_columns_mut::<3>(0).copy_from(&pose.rotation);
        own.set_column(3, &pose.translation);
        ProjectionMatrix(lens * own)
    })
}

/// Two or more cameras that stand well apart.
fn matrices() -> impl Strategy<Value = Vec<ProjectionMatrix>> {
    vec(matrix(), 2..5).prop_filter("cameras stand apart", |all| {
        let centres: Vec<Point3> = all.iter().filter_map(ProjectionMatrix::centre).collect();
        centres.len() == all.len() && (centres[0] - centres[1]).norm() > 50.0
    })
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_pose_and_its_inverse_lead_back(pose in pose(), point in point(1000.0)) {
        let there = pose.transform(point);
        prop_assert!((pose.inverse().transform(there) - point).norm() < 1e-9);
        prop_assert!((pose.transform(pose.inverse().transform(point)) - point).norm() < 1e-9);
    }

    #[test]
    fn a_pose_after_another_does_both(first in pose(), then in pose(), point in point(1000.0)) {
        let both = then.after(&first).transform(point);
        prop_assert!((both - then.transform(first.transform(point))).norm() < 1e-9);
        // Lengths stay, and so does the side.
        let moved = then.transform(first.transform(point)) - then.transform(first.transform(Point3::origin()));
        prop_assert!((moved.norm() - point.coords.norm()).abs() < 1e-9);
        prop_assert!((then.after(&first).rotation.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_rotation_vector_comes_back(place in vector(1000.0), turn in turn()) {
        let pose = Pose::from_rotation_vector(place, turn);
        prop_assert!((pose.rotation_vector() - turn).norm() < 1e-7, "{}", pose.rotation_vector());
        // It turns by its length about itself, by the right hand.
        prop_assert!((pose.rotation * turn - turn).norm() < 1e-9);
        let angle = turn.norm();
        let across = turn.cross(&Vector3::new(0.3, -0.5, 0.8));
        let area = across.cross(&(pose.rotation * across)).dot(&turn);
        let due = across.norm_squared() * angle * libm::sin(angle);
        prop_assert!((area - due).abs() < 1e-6, "{area} for {due}");
    }

    #[test]
    fn points_moved_together_give_the_motion(
        pose in pose(),
        points in vec(point(100.0), 4..20).prop_filter("points span a plane", |points| {
            let [a, b, c] = [0, 1, 2].map(|index: usize| points[index]);
            (b - a).cross(&(c - a)).norm() > 100.0
        }),
    ) {
        let pairs: Vec<_> = points.iter().map(|p| (*p, pose.transform(*p))).collect();
        let found = Pose::aligning(&pairs).unwrap();
        for (from, to) in pairs {
            prop_assert!((found.transform(from) - to).norm() < 1e-7);
        }
    }

    #[test]
    fn a_homography_maps_what_it_was_not_fitted_to(
        entries in prop::array::uniform8(-0.3..0.3_f64),
        others in vec((-1.0..1.0_f64, -1.0..1.0_f64), 1..8),
    ) {
        let [a, b, c, d, e, f, g, h] = entries;
        let exact = Homography(nalgebra::Matrix3::new(1.0 + a, b, c, d, 1.0 + e, f, g, h, 1.0));
        let map = |(x, y): (f64, f64)| (Pixel::new(x, y), exact.map(Pixel::new(x, y)).unwrap());
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.1, 0.2)].map(map);
        let found = Homography::fit(&corners).unwrap();
        for (from, to) in others.into_iter().map(map) {
            let mapped = found.map(from).unwrap();
            prop_assert!((mapped - to).norm() < 1e-8, "{mapped} for {to}");
        }
    }

    #[test]
    fn a_matrix_is_what_it_decomposes_to(matrix in matrix(), point in point(200.0)) {
        let (lens, rotation, translation) = matrix.decompose().unwrap();
        let own = lens * (rotation * point.coords + translation);
        let pixel = matrix.project(point).unwrap();
        prop_assert!((Pixel::new(own.x / own.z, own.y / own.z) - pixel).norm() < 1e-7);
        prop_assert!((rotation * rotation.transpose() - nalgebra::Matrix3::identity()).norm() < 1e-10);
        prop_assert!(lens[(0, 0)] > 0.0 && lens[(1, 1)] > 0.0);
        let (_, jacobian) = matrix.project_with_jacobian(point).unwrap();
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1e-2;
            let apart = matrix.project(point + step).unwrap() - matrix.project(point - step).unwrap();
            prop_assert!((apart / 2e-2 - jacobian.column(axis)).norm() < 1e-5);
        }
    }

    #[test]
    fn exact_pixels_triangulate_to_their_point(cameras in matrices(), point in point(200.0)) {
        let pixels: Vec<Pixel> = cameras.iter().map(|c| c.project(point).unwrap()).collect();
        let start = linear(cameras.iter().zip(pixels.iter().copied())).unwrap();
        prop_assert!((start - point).norm() < 1e-4, "linear: {start}");
        let begun = start + Vector3::new(5.0, -4.0, 6.0);
        let found = refine(begun, &pixels, |n, p| cameras[n].project_with_jacobian(p)).unwrap();
        prop_assert!((found.point - point).norm() < 1e-5, "refined: {}", found.point);
        prop_assert!(found.residual < 1e-7);
        // A covariance of positive variances, for unit noise of the pixels.
        prop_assert!(found.cofactor.diagonal().min() > 0.0);
        prop_assert!((found.cofactor - found.cofactor.transpose()).norm() < 1e-9 * found.cofactor.norm());
    }

    #[test]
    fn rays_through_a_point_meet_there(
        point in point(500.0),
        origins in vec(point(500.0), 2..6),
    ) {
        let rays: Vec<Ray> = origins
            .iter()
            .filter(|origin| (point - **origin).norm() > 10.0)
            .map(|origin| Ray { origin: *origin, direction: (point - origin).normalize() })
            .collect();
        let spread = rays.iter().any(|ray| ray.direction.cross(&rays[0].direction).norm() > 0.05);
        prop_assume!(spread);
        let found = nearest(rays.into_iter(), 0.0).unwrap();
        prop_assert!((found - point).norm() < 1e-6, "{found}");
    }

    #[test]
    fn a_ray_turns_with_its_frame(pose in pose(), from in point(500.0), to in point(500.0)) {
        prop_assume!((to - from).norm() > 1.0);
        let ray = Ray { origin: from, direction: (to - from).normalize() };
        let length = (to - from).norm();
        let moved = ray.transformed(&pose);
        prop_assert!((moved.at(length) - pose.transform(to)).norm() < 1e-8);
    }
}
