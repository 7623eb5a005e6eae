//! Files of other programs: pixels that their own tools project, round trips, losses, and damaged files.

mod tables;
mod batches;
mod damage;
mod damaged;
mod losses;
mod points;
mod round_trips;
mod seeds;
mod targets;
mod tools;

use std::path::PathBuf;
use wheatstone::{
    camera::pinhole::Pinhole,
    formats::{Format, Given, InputFile, Optics, OutputFile, Rig, RigCamera},
    geometry::{Point3, Pose, Vector3},
    numeric::random::Random,
};

/// A file of this folder.
fn file(name: &str) -> InputFile {
    let path = PathBuf::from("tests/it/formats/files").join(name);
    InputFile { bytes: std::fs::read(&path).unwrap(), path }
}

/// What was written, as if it had been read.
fn written(files: Vec<OutputFile>) -> Vec<InputFile> {
    let read = |file: OutputFile| InputFile {
        path: PathBuf::from(if file.name.is_empty() { "file".into() } else { file.name }),
        bytes: file.bytes,
    };
    files.into_iter().map(read).filter(|file| !file.path.ends_with("points3D.txt")).collect()
}

/// Two sizes, as rigs have.
fn given(cameras: usize) -> Given {
    let size = |camera| if camera == 1 { [1600, 1200] } else { [1280, 1024] };
    Given { sizes: (0..cameras).map(size).collect(), ..Given::default() }
}

/// So many cameras around a volume, each with OpenCV's coefficients in this number; a fisheye for none.
fn rig(cameras: usize, coefficients: Option<usize>) -> Rig {
    let mut random = Random::new(11);
    let all =
        [0.31, -0.12, 1.1e-3, -4e-4, 0.02, 0.52, -0.11, 0.01, 2e-3, -1e-3, 3e-3, 5e-4, 0.06, -0.1];
    let camera = |index: usize| {
        let mut near = |value: f64| value * random.uniform(0.97, 1.03);
        let pinhole =
            Pinhole { focal: [near(1100.0), near(1100.0)], principal: [near(640.0), near(511.0)] };
        let turn = Vector3::new(near(0.1), near(-0.2) + 0.2 * index as f64, near(0.05));
        let moved = Vector3::new(near(30.0) - 190.0 * index as f64, near(-20.0), near(900.0));
        let pose = Pose::from_rotation_vector(moved, turn);
        let optics = match coefficients {
            Some(count) => {
                let terms: Vec<f64> = all[..count].iter().map(|term| near(*term)).collect();
                Optics::brown(pinhole, &terms, pose).unwrap()
            }
            None => Optics::fisheye(pinhole, [-0.02, 0.004, -0.003, 5e-4].map(near), pose),
        };
        RigCamera { name: format!("cam {index}"), size: given(cameras).size(index), optics }
    };
    Rig { unit: Some("mm".into()), cameras: (0..cameras).map(camera).collect() }
}

/// The same cameras as OpenPTV's files need them: with pictures of one size, and the principal point near
/// their middle, about which distortion is there.
fn suited(name: &str, mut rig: Rig) -> Rig {
    for camera in rig.cameras.iter_mut().filter(|_| name == "openptv") {
        camera.size = Some([1280, 1024]);
        if let Optics::Brown(brown) = &mut camera.optics {
            brown.model.pinhole.principal = [642.0, 509.0];
        }
    }
    rig
}

/// Places in the volume.
fn places() -> Vec<Point3> {
    let mut random = Random::new(12);
    let mut side = |half: f64| random.uniform(-half, half);
    (0..50).map(|_| Point3::new(side(200.0), side(150.0), side(120.0))).collect()
}

fn format(name: &str) -> &'static Format {
    Format::named(name).unwrap()
}
