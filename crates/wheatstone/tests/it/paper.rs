//! The 2001 paper's recipe does what the paper says, and its rival what theory says.

use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::{evaluate, floor, viewpoint},
    method::AnyMethod,
    numeric::progress::Silent,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

fn chart() -> AnyChart {
    LineGrid::default().into()
}

fn pairs(rig: &Rig, noise: Noise, count: Option<usize>) -> Dataset {
    let views = Stage::default().views().unwrap();
    chart_correspondences(rig, &chart(), &views, (noise, 11), count)
}

#[test]
fn the_papers_recipe_errs_by_one_to_five_percent_after_100_000_epochs() {
    let rig = Rig::named("paper", 2).unwrap();
    let train = pairs(&rig, Noise::Quantised, Some(400));
    assert_eq!(train.correspondences.len(), 400);
    let exam = random_correspondences(&rig, &chart(), (50.0, 140.0), (Noise::Quantised, 12), 1000);
    let network = AnyMethod::named("network").unwrap().preset("paper").unwrap();
    let percents: Vec<f64> = (0..5_u64)
        .into_par_iter()
        .map(|seed| {
            let fit = network.fit_checked(&train, seed, &Silent).unwrap();
            let errors: Vec<f64> = fit.curve.iter().map(|p| p.mean_square_error).collect();
            assert_eq!(fit.curve.last().unwrap().epoch, 100_000);
            assert!(errors.windows(2).all(|pair| pair[1] <= pair[0]), "seed {seed}");
            evaluate(&*fit.reconstructor, &exam, viewpoint(&train)).unwrap().mean_percent
        })
        .collect();
    eprintln!("{percents:?}");
    assert!(percents.iter().all(|percent| (1.0..5.0).contains(percent)), "{percents:?}");
}

#[test]
fn dlt_is_exact_where_there_is_no_lens_and_no_noise() {
    for cameras in 2..=4 {
        let rig = Rig::named("pinhole", cameras).unwrap();
        let train = pairs(&rig, Noise::None, None);
        let fit = AnyMethod::named("dlt").unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let exam = random_correspondences(&rig, &chart(), (50.0, 200.0), (Noise::None, 3), 500);
        let found = evaluate(&*fit.reconstructor, &exam, viewpoint(&train)).unwrap();
        assert!(found.mean_percent < 1e-4 * 1e-2, "{found:?}");
    }
}

#[test]
fn dlt_reaches_the_floor_where_there_is_no_lens_and_not_where_there_is() {
    let ratio = |name: &str| {
        let rig = Rig::named(name, 2).unwrap();
        let train = pairs(&rig, Noise::Normal(0.1), None);
        let fit = AnyMethod::named("dlt").unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let noise = (Noise::Normal(0.1), 4);
        let exam = random_correspondences(&rig, &chart(), (50.0, 140.0), noise, 3000);
        let found = evaluate(&*fit.reconstructor, &exam, None).unwrap();
        found.rms / floor(&rig.cameras, &exam).unwrap().rms
    };
    let pinhole = ratio("pinhole");
    // Nothing beats the floor by more than chance: 3000 points leave 2 % of it.
    assert!((0.98..1.03).contains(&pinhole), "{pinhole}");
    let brown = ratio("paper");
    assert!(brown > 1.15, "{brown}");
}

#[test]
fn the_floor_is_what_theory_says_of_the_noise() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let exam = random_correspondences(&rig, &chart(), (99.0, 101.0), (Noise::Normal(0.1), 1), 4000);
    let found = floor(&rig.cameras, &exam).unwrap();
    // sigma_Z = Z^2 / (f B) * sigma_disparity, at 1 m, f = 695 px, B = 7 cm, 0.1 px a camera.
    let expected = 100.0_f64.powi(2) / (695.0 * 7.0) * 0.1 * 2.0_f64.sqrt();
    assert!((found.rms_xyz[2] / expected - 1.0).abs() < 0.06, "{found:?} against {expected}");
}
