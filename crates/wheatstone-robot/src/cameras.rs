//! The robot's two cameras: 7 cm apart and not aligned, as in the 2001 paper, one a little higher than
//! the other.

use wheatstone_core::{
    Result,
    camera::PosedCamera,
    geometry::{Pose, Vector3},
};
use wheatstone_numeric::random::Random;
use wheatstone_synthetic::Rig;

/// Where the cameras are, in the robot's frame, in centimetres. Their distance is the paper's. One is higher,
/// so that edges that lie and edges that stand both shift between the pictures: of two cameras side by
/// side neither can tell how far off the foot of a wall is.
const CENTRES: [[f64; 3]; 2] = [[-2.9, -31.9, 4.0], [2.9, -28.0, 4.2]];

/// What they are pointed at: floor a metre before the robot. From a hand's breadth below the horizon
/// down, so that all of the picture shows what the robot may run into.
const AIM: [f64; 3] = [0.0, 6.0, 100.0];

/// The cameras, in the robot's frame.
///
/// # Errors
///
/// None that the built-in rig has.
pub fn cameras() -> Result<[PosedCamera; 2]> {
    let rig = Rig::named("paper", 2)?;
    let mut mount = Random::stream(2001, 7);
    let placed = |index: usize| {
        let camera_from_world = pose(index, &mut mount);
        PosedCamera { camera_from_world, ..rig.cameras[index].clone() }
    };
    Ok([0, 1].map(placed))
}

/// Pointed at the aim, but for the errors of its mount.
fn pose(index: usize, mount: &mut Random) -> Pose {
    let degree = std::f64::consts::PI / 180.0;
    let centre = CENTRES[index].into();
    let error = Vector3::new(
        mount.uniform(-1.0, 1.0) * degree,
        mount.uniform(-1.0, 1.0) * degree,
        mount.uniform(-2.0, 2.0) * degree,
    );
    Pose::looking(centre, AIM.into(), error)
}
