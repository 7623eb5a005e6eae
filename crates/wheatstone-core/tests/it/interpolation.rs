//! Interpolation between known points.

use crate::worlds::charts;
use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::{
    evaluate::{evaluate, floor},
    method::{
        AnyReconstructor, Method, Reconstructor,
        interpolation::{Interpolation, InterpolationReconstructor},
    },
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, Stage, random_correspondences};

fn fitted(rig: &Rig, noise: Noise) -> InterpolationReconstructor {
    let data = charts(rig, Stage::default(), noise, 400);
    match Interpolation::default().fit(&data, 0, &Silent).unwrap().reconstructor {
        AnyReconstructor::Interpolation(fitted) => fitted,
        other => panic!("{other:?}"),
    }
}

#[test]
fn known_points_come_back_and_every_camera_is_needed() {
    let rig = Rig::named("paper", 3).unwrap();
    let data = charts(&rig, Stage::default(), Noise::None, 400);
    let fitted = fitted(&rig, Noise::None);
    for (world, row) in data.known().take(20) {
        assert!((fitted.locate(&row.pixels).unwrap().point - world).norm() < 0.01);
        let mut missing = row.pixels.clone();
        missing[2] = None;
        assert!(fitted.locate(&missing).is_none());
    }
}

#[test]
fn between_known_points_it_is_of_the_order_of_the_study() {
    let rig = Rig::named("paper", 2).unwrap();
    let fitted = fitted(&rig, Noise::Quantised);
    let chart = LineGrid::default().into();
    let test = random_correspondences(&rig, &chart, (50.0, 140.0), (Noise::Quantised, 5), 500);
    let own = evaluate(&fitted, &test, None).unwrap().rms;
    // A thin-plate spline came to 3.9.
    let ratio = own / floor(&rig.cameras, &test).unwrap().rms;
    assert!(ratio < 6.0, "{ratio}");
}
