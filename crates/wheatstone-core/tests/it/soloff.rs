//! Soloff's polynomials of a made world.

use crate::{
    staged::{rig, staged},
    worlds::charts,
};
use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::{
    camera::pinhole::Pinhole,
    evaluate::{evaluate, floor},
    geometry::Point3,
    method::{
        AnyReconstructor, Method, Reconstructor,
        soloff::{Soloff, SoloffReconstructor},
    },
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, Stage, random_correspondences};

#[test]
fn near_the_floor_between_the_planes_and_sane_with_two() {
    let rig = Rig::named("paper", 2).unwrap();
    // A depth range that a quadratic can follow.
    for (step, bar) in [(5.0, 1.3), (20.0, 6.0)] {
        let stage = Stage { near: 90.0, far: 110.0, step };
        let data = charts(&rig, stage, Noise::Quantised, 400);
        let fit = Soloff {}.fit(&data, 0, &Silent).unwrap();
        let chart = LineGrid::default().into();
        let test = random_correspondences(&rig, &chart, (90.0, 110.0), (Noise::Quantised, 5), 500);
        let own = evaluate(&*fit.reconstructor, &test, None).unwrap().rms;
        let ratio = own / floor(&rig.cameras, &test).unwrap().rms;
        assert!(ratio < bar, "every {step}: {ratio}");
    }
}

/// What is fitted to points before so many straight cameras, without noise.
fn exact(cameras: usize) -> SoloffReconstructor {
    let pinhole = Pinhole { focal: [690.0; 2], principal: [320.0, 240.0] };
    let data = staged(&rig(vec![pinhole; cameras]), 0.3, (0.0, 1), |world| world);
    match (Soloff {}).fit(&data, 0, &Silent).unwrap().reconstructor {
        AnyReconstructor::Soloff(fitted) => fitted,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_exact_polynomial_is_recovered_from_any_two_cameras() {
    let fitted = exact(3);
    let truth = Point3::new(6.0, -7.0, 90.0);
    let mut pixels: Vec<_> = (0..3).map(|camera| fitted.project(camera, truth)).collect();
    assert!(pixels.iter().all(Option::is_some));
    assert!((fitted.locate(&pixels).unwrap().point - truth).norm() < 1e-7);
    pixels[1] = None;
    assert!((fitted.locate(&pixels).unwrap().point - truth).norm() < 1e-7);
    pixels[2] = None;
    assert!(fitted.locate(&pixels).is_none());
}

#[test]
fn broken_numbers_are_refused() {
    let fitted = exact(2);
    assert!(fitted.is_consistent());
    let text = serde_json::to_string(&fitted).unwrap();
    let back: SoloffReconstructor = serde_json::from_str(&text).unwrap();
    assert_eq!(back, fitted);
    let odd = text.replacen('{', "{\"other\": 1,", 1);
    assert!(serde_json::from_str::<SoloffReconstructor>(&odd).is_err());
    let read = |file| serde_json::from_value::<SoloffReconstructor>(file).unwrap();
    let file = serde_json::to_value(&fitted).unwrap();
    let mut broken = file.clone();
    broken["half"][1] = 0.0.into();
    assert!(!read(broken).is_consistent());
    let mut broken = file.clone();
    broken["cameras"][0]["terms"].as_array_mut().unwrap().pop().unwrap();
    assert!(!read(broken).is_consistent());
    assert!(read(file).is_consistent());
}
