//! Poses, there and back.

use nalgebra::Matrix3;
use wheatstone_core::geometry::{Point3, Pose, Vector3};

#[test]
fn rotation_vectors_come_back() {
    let axis = Vector3::new(1.0, -2.0, 0.5).normalize();
    for angle in [0.0, 1e-9, 1e-5, 0.3, 2.0, 3.1, std::f64::consts::PI] {
        let pose = Pose::from_rotation_vector(Vector3::zeros(), axis * angle);
        let gap = pose.rotation * pose.rotation.transpose() - Matrix3::identity();
        assert!(gap.norm() < 1e-14 && (pose.rotation.determinant() - 1.0).abs() < 1e-14);
        let back = Pose::from_rotation_vector(Vector3::zeros(), pose.rotation_vector());
        assert!((back.rotation - pose.rotation).norm() < 1e-8, "angle {angle}");
    }
}

#[test]
fn the_inverse_undoes() {
    let pose =
        Pose::from_rotation_vector(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, -0.3));
    let point = Point3::new(4.0, -5.0, 6.0);
    assert!((pose.inverse().transform(pose.transform(point)) - point).norm() < 1e-14);
}
