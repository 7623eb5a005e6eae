//! What is written and read again is what it was.

use super::{format, given, places, rig, suited, written};
use wheatstone::{
    Calibration, Error,
    formats::{FORMATS, Form, Imported, Optics, Rig, approximate, calibration, exact},
    geometry::{Pixel, Pose, Vector3},
    numeric::progress::Silent,
};

/// Rigs whose cameras each are in one of the format's forms.
fn rigs(name: &str, forms: &[Form]) -> Vec<Rig> {
    let mut kinds: Vec<Option<usize>> = Vec::new();
    for form in forms {
        match form {
            Form::Brown(most) => {
                kinds.extend([0, 4, 5, 8, 12, 14].iter().filter(|c| *c <= most).map(|c| Some(*c)));
            }
            Form::KannalaBrandt(_) => kinds.push(None),
            Form::Linear => kinds.push(Some(0)),
        }
    }
    let counts: &[usize] = if name == "ros" { &[2] } else { &[2, 3] };
    let mut all = Vec::new();
    for kind in kinds {
        for count in counts {
            let mut rig = suited(name, rig(*count, kind));
            for camera in &mut rig.cameras {
                let held = forms.iter().find_map(|form| camera.optics.in_form(*form));
                camera.optics = held.unwrap();
            }
            all.push(rig);
        }
    }
    all
}

#[test]
fn every_format_gives_back_the_cameras_that_it_was_given() {
    for format in FORMATS.iter().filter(|f| f.is_calibration() && f.writes() && f.reads()) {
        for rig in rigs(format.name, format.forms()) {
            let files = written(format.write_rig(&rig).unwrap());
            let again = format.read_rig(&files, &given(rig.cameras.len())).unwrap();
            let again = again.in_unit("mm", "test").unwrap();
            // Formats without a world of their own stand in their first camera, or its rectified frame.
            let back = match (again.cameras[0].optics.pose(), rig.cameras[0].optics.pose()) {
                (Some(new), Some(old)) => new.inverse().rotation * old.rotation,
                _ => nalgebra::Matrix3::identity(),
            };
            let shift = match (again.cameras[0].optics.pose(), rig.cameras[0].optics.pose()) {
                (Some(new), Some(old)) => {
                    new.inverse().rotation * (old.translation - new.translation)
                }
                _ => Vector3::zeros(),
            };
            let moved = Pose { rotation: back, translation: shift };
            let own_world = (moved.rotation - nalgebra::Matrix3::identity()).norm() > 1e-9;
            assert_eq!(own_world, ["kalibr", "ros"].contains(&format.name), "{}", format.name);
            for (old, new) in rig.cameras.iter().zip(&again.cameras) {
                assert_eq!(old.size, new.size, "{}", format.name);
                for place in places() {
                    let was = old.optics.project(place).unwrap();
                    let is = new.optics.project(moved.transform(place)).unwrap();
                    // OpenPTV's distortion is about another point: fitted on the way out and on the way in.
                    let most = if format.name == "openptv" { 0.2 } else { 1e-8 };
                    assert!((was - is).norm() < most, "{}: {}", format.name, (was - is).norm());
                }
            }
            // The second time nothing changes at all.
            let rounded = ["ros", "kalibr", "dlt", "dltdv", "dltdv8", "openptv", "myptv-cameras"];
            if !rounded.contains(&format.name) {
                let optics =
                    |rig: &Rig| rig.cameras.iter().map(|c| c.optics.clone()).collect::<Vec<_>>();
                let files = written(format.write_rig(&again).unwrap());
                let third = format.read_rig(&files, &given(rig.cameras.len())).unwrap();
                let (second, third) = (optics(&again), optics(&third));
                for (a, b) in second.iter().zip(&third) {
                    assert_eq!(a.pinhole().map(|p| p.focal), b.pinhole().map(|p| p.focal));
                }
                if ["opencv", "opencv-fisheye", "mayacam"].contains(&format.name) {
                    assert_eq!(optics(&rig), second, "{} is not exact", format.name);
                    assert_eq!(second, third);
                }
            }
        }
    }
}

fn imported(cameras: usize) -> Imported {
    Imported {
        format: "opencv".into(),
        files: vec!["stereo.yml".into()],
        cameras: (0..cameras).map(|index| format!("cam {index}")).collect(),
        sizes: (0..cameras).map(|index| given(cameras).size(index)).collect(),
        pixel_sigma: 0.5,
    }
}

#[test]
fn an_imported_model_locates_survives_its_file_and_leaves_as_it_came() {
    for kind in [Some(0), Some(5), Some(12), Some(14), None] {
        let rig = rig(3, kind);
        let model = calibration(&rig, imported(3)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.json");
        model.save(&path).unwrap();
        let model = Calibration::load(&path).unwrap();
        assert_eq!(model.imported, Some(imported(3)));
        for place in places() {
            let pixels: Vec<Option<Pixel>> =
                rig.cameras.iter().map(|camera| camera.optics.project(place)).collect();
            let found = model.reconstructor.locate(&pixels).unwrap();
            assert!((found.point - place).norm() < 1e-6, "{}", (found.point - place).norm());
            // Half a pixel at 900 mm and 1100 px focal length is 0.4 mm across.
            let sigma = found.covariance.diagonal().map(f64::sqrt);
            assert!(sigma.x > 0.1 && sigma.x < 1.0, "{sigma}");
            assert_eq!(model.volume.trust(&pixels), wheatstone::dataset::volume::Trust::Outside);
        }
        assert_eq!(exact(&model).unwrap().cameras[1].optics, rig.cameras[1].optics);
        let forms = [Form::Brown(14), Form::KannalaBrandt(4)];
        let found = approximate(&model, &forms, &Silent).unwrap();
        assert_eq!((found.loss, found.rig.cameras), (None, rig.cameras));
    }
    let mixed = {
        let mut mixed = rig(2, None);
        mixed.cameras[0] = rig(1, Some(5)).cameras.remove(0);
        mixed
    };
    assert!(matches!(calibration(&mixed, imported(2)), Err(Error::Unsupported { .. })));
    assert!(matches!(calibration(&rig(1, None), imported(1)), Err(Error::Unsupported { .. })));
}

#[test]
fn matrices_become_models_and_keep_their_side() {
    let linear = |mirror: f64| {
        let mut rig = rig(2, Some(0));
        for camera in &mut rig.cameras {
            camera.optics = camera.optics.in_form(Form::Linear).unwrap();
            let Optics::Linear(matrix) = &mut camera.optics else { unreachable!() };
            matrix.0.column_mut(2).scale_mut(mirror);
        }
        rig
    };
    // A left-handed world has its z turned round; points lie before the cameras all the same.
    for mirror in [1.0, -1.0] {
        let rig = linear(mirror);
        let files = written(format("dltdv").write_rig(&rig).unwrap());
        let again = format("dltdv").read_rig(&files, &given(2)).unwrap();
        let model = calibration(&again, imported(2)).unwrap();
        for mut place in places() {
            place.z *= mirror;
            let pixels: Vec<Option<Pixel>> =
                rig.cameras.iter().map(|camera| camera.optics.project(place)).collect();
            assert!((model.reconstructor.locate(&pixels).unwrap().point - place).norm() < 1e-6);
        }
    }
    // What a matrix cannot say of the world's other side is refused by formats with rotations.
    let model = calibration(&linear(-1.0), imported(2)).unwrap();
    let refused = approximate(&model, &[Form::Brown(5)], &Silent);
    assert!(refused.is_err());
}

#[test]
fn formats_refuse_what_they_cannot_hold() {
    let refusal = |name: &str, rig: &Rig| {
        let error = format(name).write_rig(rig).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }) && error.hint().is_some(), "{error}");
        error.to_string()
    };
    assert!(refusal("ros", &rig(3, Some(5))).contains("3 cameras"));
    let mut sizeless = rig(2, Some(4));
    sizeless.cameras[1].size = None;
    for name in ["kalibr", "colmap", "mrcal", "anipose", "mayacam", "ros"] {
        assert!(refusal(name, &sizeless).contains("size"), "{name}");
    }
    let opencv = format("opencv").write_rig(&sizeless);
    opencv.unwrap();
}
