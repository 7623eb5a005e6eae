//! Cameras that are written in a format and read again project as they did.

use super::config;
use proptest::{collection::vec, prelude::*};
use std::path::PathBuf;
use wheatstone::{
    FORMATS, Format, Given, InputFile,
    camera::pinhole::Pinhole,
    formats::{Form, Optics, Rig, RigCamera},
    geometry::{Pose, Vector3},
};

/// Distortion of a real lens in the number of OpenCV's coefficients; a fisheye's for none.
type Lens = (Option<usize>, Vec<f64>);

/// A format that is read and written, and one of its forms.
fn format() -> impl Strategy<Value = (&'static str, Form)> {
    let all: Vec<(&str, Form)> = FORMATS
        .iter()
        .filter(|format| format.is_calibration() && format.reads() && format.writes())
        // OpenPTV's distortion is about another point: its cameras come back nearly the same.
        .filter(|format| format.name != "openptv")
        .flat_map(|format| format.forms().iter().map(move |form| (format.name, *form)))
        .collect();
    prop::sample::select(all)
}

fn camera() -> impl Strategy<Value = (Pinhole, Vec<f64>, Pose)> {
    let lens = (600.0..1800.0, 600.0..1800.0, 500.0..800.0, 400.0..600.0)
        .prop_map(|(fx, fy, cx, cy)| Pinhole { focal: [fx, fy], principal: [cx, cy] });
    let pose = (super::vector(0.25), super::vector(60.0)).prop_map(|(turn, aside)| {
        Pose::from_rotation_vector(aside + Vector3::new(0.0, 0.0, 1000.0), turn)
    });
    (lens, vec(-1.0..1.0_f64, 14), pose)
}

/// The largest that each of OpenCV's coefficients is drawn.
const MOST: [f64; 14] =
    [0.2, 0.1, 2e-3, 2e-3, 0.02, 0.2, 0.05, 0.02, 2e-3, 2e-3, 2e-3, 2e-3, 0.05, 0.05];

/// The optics in a form.
fn optics(form: Form, (pinhole, shares, pose): (Pinhole, Vec<f64>, Pose)) -> Option<Optics> {
    let (count, shares): Lens = match form {
        Form::Brown(most) => (Some(most), shares),
        Form::KannalaBrandt(_) => (None, shares),
        Form::Linear => (Some(0), shares),
    };
    let terms: Vec<f64> = shares.iter().zip(MOST).map(|(share, most)| share * most).collect();
    let made = match count {
        Some(count) => Optics::brown(pinhole, &terms[..count], pose)?,
        None => Optics::fisheye(pinhole, [0, 1, 2, 3].map(|term| 0.02 * shares[term]), pose),
    };
    made.in_form(form)
}

/// The motion between the worlds of two rigs: formats without a world stand in their first camera.
fn between(new: &Rig, old: &Rig) -> Pose {
    match (new.cameras[0].optics.pose(), old.cameras[0].optics.pose()) {
        (Some(new), Some(old)) => new.inverse().after(&old),
        _ => Pose::default(),
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn cameras_come_back(
        (name, form) in format(),
        drawn in vec(camera(), 2..4),
        places in vec(super::point(150.0), 1..10),
    ) {
        let format = Format::named(name).unwrap();
        let count = if name == "ros" { 2 } else { drawn.len() };
        let sizes = [[1280, 1024], [1600, 1200], [1280, 1024]];
        let cameras = drawn.into_iter().take(count).enumerate();
        let cameras: Option<Vec<RigCamera>> = cameras
            .map(|(index, drawn)| {
                let optics = optics(form, drawn)?;
                Some(RigCamera { name: format!("cam {index}"), size: Some(sizes[index]), optics })
            })
            .collect();
        prop_assume!(cameras.is_some());
        let rig = Rig { unit: Some("mm".into()), cameras: cameras.unwrap() };
        let files: Vec<InputFile> = format
            .write_rig(&rig)
            .unwrap()
            .into_iter()
            .filter(|file| file.name != "points3D.txt")
            .map(|file| InputFile { path: PathBuf::from(file.name), bytes: file.bytes })
            .collect();
        let given = Given { sizes: sizes[..count].to_vec(), ..Given::default() };
        let again = format.read_rig(&files, &given);
        let again = again.map_err(|e| TestCaseError::fail(format!("{}: {e}", name)))?;
        let again = again.in_unit("mm", "test").unwrap();
        prop_assert_eq!(again.cameras.len(), count);
        let moved = between(&again, &rig);
        for (old, new) in rig.cameras.iter().zip(&again.cameras) {
            prop_assert_eq!(old.size, new.size);
            for place in &places {
                let was = old.optics.project(*place);
                let is = new.optics.project(moved.transform(*place));
                let (Some(was), Some(is)) = (was, is) else {
                    prop_assert!(was.is_none() && is.is_none(), "{}: {was:?} {is:?}", name);
                    continue;
                };
                let digits = if matches!(form, Form::Linear) { 1e-6 } else { 1e-7 };
                prop_assert!((was - is).norm() < digits, "{}: {was} {is}", name);
            }
        }
    }
}
