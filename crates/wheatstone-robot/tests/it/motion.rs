//! Poses on the floor, and what wheels make of them.

use wheatstone_robot::{Ground, PlanarPose, Velocity};

#[test]
fn poses_go_there_and_back() {
    let pose = PlanarPose { x: 3.0, z: -2.0, heading: 0.7 };
    let place = Ground::new(1.0, 4.0);
    assert!((pose.inverse_transform(pose.transform(place)) - place).norm() < 1e-12);
    let next = PlanarPose { x: -1.0, z: 8.0, heading: -3.0 };
    let again = pose.then(&pose.motion_to(&next));
    assert!((again.place() - next.place()).norm() < 1e-12);
    assert!((again.heading - next.heading).abs() < 1e-12);
    // A quarter turn to the right looks along x.
    let right = PlanarPose { heading: std::f64::consts::FRAC_PI_2, ..PlanarPose::default() };
    assert!((right.transform(Ground::new(0.0, 1.0)) - Ground::new(1.0, 0.0)).norm() < 1e-12);
}

#[test]
fn an_arc_is_many_short_straight_steps() {
    let velocity = Velocity { forward: 20.0, turn: 0.8 };
    let whole = velocity.motion(1.5);
    let mut steps = PlanarPose::default();
    for _ in 0..15_000 {
        steps = steps.then(&velocity.motion(1e-4));
    }
    assert!((whole.place() - steps.place()).norm() < 1e-9);
    assert!((whole.heading - steps.heading).abs() < 1e-9);
}
