//! What a model loses on its way into another program is what is said of it.

use nalgebra::Matrix3;
use wheatstone::{
    Calibration,
    camera::{picture_domain::undistorts, pinhole::Pinhole},
    chart::AnyChart,
    formats::{Fold, Form, Optics, RigCamera, approximate, approximate_rig, coefficients},
    geometry::{Pixel, Pose, Vector3},
    method::{AnyMethod, AnyReconstructor},
    numeric::progress::Silent,
    preparation::Preparation,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
    tables::{self, Duplicates},
};

/// A model of a rig with distorting lenses.
fn model(method: &str, rig: &str) -> (Calibration, Rig) {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = &AnyChart::all()[0];
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, chart, &views, (Noise::Normal(0.05), 5), Some(900));
    let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
    let method = AnyMethod::named(method).unwrap();
    (Calibration::fit(&method, &prepared, 1, false, &Silent).unwrap(), rig)
}

#[test]
fn models_without_cameras_leave_as_cameras_with_their_loss() {
    for (method, most) in
        [("soloff", 5.0), ("neural-camera", 0.1), ("tsai", 1.0), ("interpolation", 30.0)]
    {
        let (model, rig) = model(method, "brown");
        let found = approximate(&model, &[Form::Brown(12)], &Silent).unwrap();
        let loss = found.loss.unwrap();
        assert!(
            loss.rms > 0.0 && loss.rms < most && loss.largest >= loss.rms,
            "{method}: {loss:?}"
        );
        assert!(loss.points > 500, "{method}: {loss:?}");
        // Where the rig and the model see the same pixels, they differ by about what was said.
        let chart = &AnyChart::all()[0];
        let exam = random_correspondences(&rig, chart, (70.0, 120.0), (Noise::Normal(0.0), 6), 100);
        let mut squares = Vec::new();
        for (world, _) in exam.known() {
            let cameras = &found.rig.cameras;
            let pixels: Vec<Option<Pixel>> =
                cameras.iter().map(|c| c.optics.project(world)).collect();
            let Some(there) = model.reconstructor.locate(&pixels) else { continue };
            for (camera, pixel) in cameras.iter().zip(&pixels) {
                let off = camera.optics.project(there.point).unwrap() - pixel.unwrap();
                squares.push(off.norm_squared());
            }
        }
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!(rms < 3.0 * loss.rms + 1e-6, "{method}: {rms} against {loss:?}");
    }
}

#[test]
fn exact_models_lose_nothing_and_smaller_forms_say_what_they_lose() {
    let (model, _) = model("brown", "brown");
    assert_eq!(approximate(&model, &[Form::Brown(5)], &Silent).unwrap().loss, None);
    let none = approximate(&model, &[Form::Brown(0)], &Silent).unwrap().loss.unwrap();
    assert!(none.rms > 0.1, "a lens without its distortion: {none:?}");
    let rig = super::rig(3, Some(12));
    let found = approximate_rig(&rig, &[Form::Brown(4)], &Silent).unwrap();
    let loss = found.loss.unwrap();
    assert!(loss.rms > 1e-3 && loss.largest < 20.0, "{loss:?}");
    assert_eq!(approximate_rig(&rig, &[Form::Brown(12)], &Silent).unwrap().loss, None);
}

/// The corner of the picture is at a radius of 0.575, that of a tenth beyond at 0.69; r + k r^3 turns round at
/// 2 / 3 / sqrt(3 |k|).
#[test]
fn a_lens_that_folds_beyond_the_picture_leaves_as_it_is_and_one_that_folds_within_does_not() {
    let (mut model, _) = model("brown", "brown");
    model.sizes = vec![Some([640, 480]); 2];
    let forms = [Form::Brown(5)];
    assert_eq!(approximate(&model, &forms, &Silent).unwrap().fold, None);
    for (k, is_within) in [(-0.35, false), (-0.6, true)] {
        let AnyReconstructor::Brown(fitted) = &mut model.reconstructor else { panic!() };
        fitted.cameras[1].model.radial = [k, 0.0, 0.0];
        let lens = fitted.cameras[1].clone();
        let found = approximate(&model, &forms, &Silent).unwrap();
        assert_eq!(found.fold, Some(Fold { camera: 1, is_within }), "{k}");
        assert_eq!(found.loss.is_some(), is_within, "{k}");
        assert_eq!(found.rig.cameras[1].optics == Optics::Brown(lens), !is_within, "{k}");
    }
    // Where the size is not known, a tenth beyond what was seen stands for the picture.
    model.sizes.clear();
    assert!(approximate(&model, &forms, &Silent).unwrap().fold.is_none_or(|fold| fold.is_within));
}

/// A pinhole camera that is nearest to a fisheye stands elsewhere and looks elsewhere.
#[test]
fn cameras_that_are_others_are_refused() {
    let pinhole = Pinhole { focal: [500.0; 2], principal: [639.5, 479.5] };
    let camera = |x: f64| RigCamera {
        optics: Optics::fisheye(
            pinhole,
            [-0.02, 0.004, 0.0, 0.0],
            Pose { translation: Vector3::new(x, 0.0, 0.0), rotation: Matrix3::identity() },
        ),
        ..super::rig(2, Some(0)).cameras[0].clone()
    };
    let mut rig = super::rig(2, Some(0));
    rig.cameras = vec![RigCamera { size: Some([1280, 960]), ..camera(0.0) }; 2];
    rig.cameras[1].optics = camera(-12.0).optics;
    let error = approximate_rig(&rig, &[Form::Brown(0)], &Silent).unwrap_err();
    assert!(error.to_string().contains("cameras like these"), "{error}");
}

#[test]
fn the_same_model_leaves_as_the_same_bytes() {
    let (model, _) = model("soloff", "brown");
    let write = || {
        let found = approximate(&model, &[Form::Brown(12)], &Silent).unwrap();
        super::format("opencv").write_rig(&found.rig).unwrap()
    };
    assert_eq!(write(), write());
}

/// A real rig in a water tank, of which no lens is the model. Five terms follow it nearly as well as twelve do, and
/// twelve have a pole in the picture.
#[test]
fn a_lens_has_as_few_terms_as_follow_and_holds_over_the_whole_picture() {
    let Some(folder) = crate::data::folder("myptv-vee") else { return };
    let data = tables::read(&folder.join("points.csv"), "mm", Duplicates::Refuse).unwrap();
    let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
    let method = AnyMethod::named("neural-camera").unwrap();
    let mut model = Calibration::fit(&method, &prepared, 0, false, &Silent).unwrap();
    model.sizes = vec![Some([1024, 1024]); 3];
    let found = approximate(&model, &[Form::Brown(14)], &Silent).unwrap();
    assert!(found.loss.unwrap().rms < 0.15);
    for camera in &found.rig.cameras {
        let Optics::Brown(lens) = &camera.optics else { panic!("{camera:?}") };
        assert!(coefficients(&lens.model, 0).len() <= 5, "{lens:?}");
        assert!(undistorts(&lens.model, [-0.5, -0.5, 1023.5, 1023.5]));
    }
}
