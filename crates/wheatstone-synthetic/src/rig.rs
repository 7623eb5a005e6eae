//! Sets of cameras: the 2001 paper's two on a robot, about 7 cm apart, toed in and rolled a little,
//! never aligned, with one lens or another before them.

use serde::{Deserialize, Serialize};
use wheatstone_core::{
    Error, Result,
    camera::{
        AnyCamera, PosedCamera,
        brown_conrady::BrownConrady,
        bumped_lens::{Bump, BumpedLens},
        convex_mirror::ConvexMirror,
        cylindrical_port::CylindricalPort,
        flat_port::FlatPort,
        kannala_brandt::KannalaBrandt,
        pinhole::Pinhole,
    },
    geometry::{Point3, Pose, Vector3},
};
use wheatstone_numeric::random::Random;

/// Cameras that look at the same place. Lengths are centimetres; the world's origin lies between the
/// cameras, x right, y down, z towards what they look at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// The lens, as [`Rig::NAMES`] lists it.
    pub name: String,
    /// The cameras.
    pub cameras: Vec<PosedCamera>,
}

/// Picture size of every rig, in pixels: that of the cameras of the paper's time.
const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// Where all cameras are pointed: the middle of the paper's range.
const AIM: f64 = 95.0;

impl Rig {
    /// The lenses: none; Brown's distortion (the paper's rig); a fisheye; the paper's rig looking into
    /// water, and through a thick pane at a slant; the paper's rig with a wavy window, and with sensors
    /// tilted after Scheimpflug; the paper's rig before a round tank of water, and before a convex mirror.
    pub const NAMES: &'static [&'static str] =
        &["paper", "pinhole", "fisheye", "water", "glass", "bump", "scheimpflug", "tube", "mirror"];

    /// The rig called `name` (`brown` is another name of `paper`) with so many cameras.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], [`Error::Setting`] for fewer than 2 or more than 8 cameras.
    pub fn named(name: &str, cameras: usize) -> Result<Self> {
        let name = if name == "brown" { "paper" } else { name };
        if !Self::NAMES.contains(&name) {
            let known = Self::NAMES.iter().map(|name| (*name).to_owned()).collect();
            return Err(Error::UnknownName { kind: "rig", name: name.into(), known });
        }
        if !(2..=8).contains(&cameras) {
            return Err(Error::Setting {
                setting: "cameras".into(),
                value: cameras.to_string(),
                need: "2 to 8".into(),
            });
        }
        let all = (0..cameras).map(|index| {
            let (centre, camera_from_world) = pose(name, index);
            let model = lens(name, index, centre, &camera_from_world);
            PosedCamera { camera_from_world, model, width: WIDTH, height: HEIGHT }
        });
        Ok(Self { name: name.into(), cameras: all.collect() })
    }

    /// A chart that fills the common field of view from near to far, as a pitch in centimetres.
    #[must_use]
    pub fn chart_pitch(&self) -> f64 {
        match self.name.as_str() {
            "fisheye" => 14.0,
            // Water narrows the field of view by its index; a round tank does so along its axis.
            "water" | "tube" => 3.8,
            "mirror" => 7.0,
            _ => 5.0,
        }
    }
}

/// The camera's centre, and its pose: pointed at the aim but for a small error of its mount, and
/// rolled.
fn pose(name: &str, index: usize) -> (Vector3, Pose) {
    // The first two are the paper's pair; others stand above, below and between.
    const CENTRES: [[f64; 3]; 8] = [
        [-3.5, 0.0, 0.0],
        [3.5, 0.05, 0.1],
        [0.1, -6.0, -0.2],
        [-0.1, 6.1, 0.1],
        [-7.0, -4.0, 0.2],
        [7.1, -4.1, -0.1],
        [-7.1, 4.0, 0.0],
        [7.0, 4.2, 0.1],
    ];
    let degree = std::f64::consts::PI / 180.0;
    let mut mount = Random::stream(2001, index as u64);
    let mut centre = Vector3::from(CENTRES[index % 8]);
    let error = Vector3::new(
        mount.uniform(-0.4, 0.4) * degree,
        mount.uniform(-0.3, 0.3) * degree,
        mount.uniform(-1.0, 1.0) * degree,
    );
    let mut aim = Vector3::new(0.0, 0.0, AIM);
    if name == "mirror" {
        // Cameras before a mirror turn their backs on what they look at; the first one is to their left.
        (centre.x, aim.z) = (-centre.x, -AIM);
    }
    (centre, Pose::looking(centre, aim, error))
}

fn lens(name: &str, index: usize, centre: Vector3, camera_from_world: &Pose) -> AnyCamera {
    let mut made = Random::stream(1838, index as u64);
    let mut about = |value: f64, spread: f64| value + made.uniform(-spread, spread);
    if name == "fisheye" {
        return KannalaBrandt {
            pinhole: Pinhole {
                focal: [about(260.0, 3.0), about(260.0, 3.0)],
                principal: [about(319.5, 6.0), about(239.5, 6.0)],
            },
            coefficients: [about(-0.02, 0.005), about(0.005, 0.001), -0.003, 0.0006],
        }
        .into();
    }
    let pinhole = Pinhole {
        focal: [about(695.0, 8.0), about(695.0, 8.0)],
        principal: [about(319.5, 8.0), about(239.5, 8.0)],
    };
    if name == "pinhole" {
        return pinhole.into();
    }
    let brown = BrownConrady {
        radial: [about(-0.23, 0.02), about(0.12, 0.01), about(-0.02, 0.01)],
        tangential: [about(0.0, 0.0012), about(0.0, 0.0012)],
        tilt: if name == "scheimpflug" { tilt(index) } else { [0.0; 2] },
        ..BrownConrady::ideal(pinhole)
    };
    match name {
        "water" => behind_port(brown, (10.0, 8.0, 2.0, 1.333), centre, camera_from_world),
        "glass" => behind_port(brown, (30.0, 10.0, 6.0, 1.0), centre, camera_from_world),
        "tube" => behind_tube(brown, camera_from_world),
        "mirror" => before_mirror(brown, camera_from_world),
        "bump" => BumpedLens { camera: Box::new(brown.into()), bumps: bumps(index) }.into(),
        _ => brown.into(),
    }
}

/// Six degrees about both axes, about y the other way for every second camera: sensors tilted alike are
/// nearly those of turned cameras, which a lens with a moved principal point explains.
fn tilt(index: usize) -> [f64; 2] {
    let angle = 6.0 * std::f64::consts::PI / 180.0;
    [angle, if index.is_multiple_of(2) { angle } else { -angle }]
}

/// Behind a plate of acrylic that is the same for all cameras of the rig: tilt in degrees, distance
/// from the world's origin and thickness in centimetres, index of what lies beyond.
fn behind_port(
    camera: BrownConrady,
    (tilt, distance, thickness, medium_index): (f64, f64, f64, f64),
    centre: Vector3,
    camera_from_world: &Pose,
) -> AnyCamera {
    let angle = tilt * std::f64::consts::PI / 180.0;
    // Tilted to both axes of the cameras.
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let normal = Vector3::new(0.8 * sine, -0.6 * sine, cosine);
    FlatPort {
        camera: Box::new(camera.into()),
        normal: camera_from_world.rotation * normal,
        distance: distance - normal.dot(&centre),
        thickness,
        plate_index: 1.49,
        medium_index,
    }
    .into()
}

/// Before a round tank of acrylic, full of water, that stands a little askew.
fn behind_tube(camera: BrownConrady, camera_from_world: &Pose) -> AnyCamera {
    CylindricalPort {
        camera: Box::new(camera.into()),
        centre: camera_from_world.transform(Point3::new(1.5, 0.0, 75.0)),
        axis: camera_from_world.rotation * Vector3::new(0.03, 1.0, -0.04).normalize(),
        ..CylindricalPort::default()
    }
    .into()
}

/// Before a mirror, 15 cm away, that is as curved as a car's.
fn before_mirror(camera: BrownConrady, camera_from_world: &Pose) -> AnyCamera {
    let radius = 140.0;
    let centre = camera_from_world.transform(Point3::new(4.0, -3.0, -15.0 - radius));
    ConvexMirror { camera: Box::new(camera.into()), centre, radius }.into()
}

/// Ten smooth errors of a few pixels.
fn bumps(index: usize) -> Vec<Bump> {
    let mut random = Random::stream(77, index as u64);
    let bump = |_| Bump {
        centre: [random.uniform(60.0, 580.0), random.uniform(50.0, 430.0)],
        radius: random.uniform(50.0, 110.0),
        shift: [2.0 * random.normal(), 2.0 * random.normal()],
    };
    (0..10).map(bump).collect()
}
