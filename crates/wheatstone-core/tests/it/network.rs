//! How sure the network's points are.

use crate::worlds::charts;
use wheatstone_core::method::{AnyMethod, network::Training};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, Stage};

#[test]
fn a_fit_of_which_points_are_asked_only_is_the_same_map_and_takes_the_start_it_is_given() {
    let rig = Rig::named("paper", 2).unwrap();
    let data = charts(&rig, Stage::default(), Noise::Normal(0.1), 200);
    let mut method = AnyMethod::named("network").unwrap();
    if let AnyMethod::Network(network) = &mut method
        && let Training::Evidence(training) = &mut network.training
    {
        (training.starts, training.steps) = (3, 200);
    }
    let whole = method.fit_checked(&data, 0, &Silent).unwrap();
    assert!(whole.start.is_some_and(|start| start < 3));
    for known in [None, Some(&whole)] {
        let part = method.fit_fold(&data, known, 0, &Silent).unwrap();
        assert_eq!(part.start, whole.start);
        for row in data.correspondences.iter().step_by(20) {
            let (a, b) = (part.reconstructor.locate(&row.pixels), &whole.reconstructor);
            let (a, b) = (a.unwrap(), b.locate(&row.pixels).unwrap());
            assert_eq!((a.point, a.covariance), (b.point, b.covariance));
            assert!(a.residual.is_none() && b.residual.is_some());
        }
    }
}

#[test]
fn the_residual_of_the_map_is_in_pixels() {
    let rig = Rig::named("fisheye", 2).unwrap();
    let data = charts(&rig, Stage::default(), Noise::Normal(0.1), 300);
    let mut method = AnyMethod::named("network").unwrap();
    if let AnyMethod::Network(network) = &mut method
        && let Training::Evidence(training) = &mut network.training
    {
        (training.starts, training.steps) = (1, 60);
    }
    let fit = method.fit_checked(&data, 0, &Silent).unwrap();
    let fitted = fit.reconstructor;
    for row in data.correspondences.iter().step_by(37) {
        let residual = fitted.locate(&row.pixels).unwrap().residual.unwrap();
        assert!((residual.sigma - 0.1).abs() < 0.02);
        assert!(residual.rms < 0.4);
        // Another row's pixel does not belong to it.
        let mut wrong = row.pixels.clone();
        wrong[1].as_mut().unwrap().y += 8.0;
        assert!(fitted.locate(&wrong).unwrap().residual.unwrap().rms > 1.0);
    }
}

#[test]
fn points_without_noise_can_be_fitted() {
    let rig = Rig::named("scheimpflug", 2).unwrap();
    let data = charts(&rig, Stage::default(), Noise::None, 900);
    let method = AnyMethod::named("network").unwrap();
    let fit = method.fit_checked(&data, 0, &Silent).unwrap();
    for row in data.correspondences.iter().step_by(50) {
        let found = fit.reconstructor.locate(&row.pixels).unwrap();
        assert!((found.point - row.world.unwrap()).norm() < 0.02);
    }
}
