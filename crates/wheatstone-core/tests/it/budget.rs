//! Errors whose cause is known.

use crate::worlds::chart;
use wheatstone_charts::chart::AnyChart;
use wheatstone_core::{
    Calibration,
    dataset::Dataset,
    evaluate::{Budget, HeldOut, Reference, compare},
    geometry::Vector3,
    method::AnyMethod,
    preparation::Prepared,
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

fn stage(name: &str, seed: u64, noise: Noise) -> (Rig, AnyChart, Dataset) {
    let rig = Rig::named(name, 2).unwrap();
    let chart = chart(&rig);
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (noise, seed), Some(500));
    (rig, chart, data)
}

/// Charts that stood elsewhere than was written down, by about `size`, and turned by half a degree.
fn displaced(mut data: Dataset, size: f64, seed: u64) -> Dataset {
    let mut random = Random::new(seed);
    let mut any =
        |size: f64| Vector3::new(random.normal(), random.normal(), random.normal()) * size;
    let moves: Vec<(Vector3, Vector3)> =
        data.views.iter().map(|_| (any(size), any(0.005))).collect();
    for row in &mut data.correspondences {
        let (shift, turn) = moves[row.view];
        row.world = row.world.map(|p| p + shift + turn.cross(&Vector3::new(p.x, p.y, 0.0)));
    }
    data
}

fn compared(method: &str, data: &Dataset) -> Budget {
    let method = AnyMethod::named(method).unwrap();
    let budget = compare(&[method], data, None, 0, &Silent).unwrap().budget.unwrap();
    let parts = [budget.detector, budget.lens_model, budget.stage, budget.extrapolation];
    assert!((parts.iter().map(|part| part.share).sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(parts.iter().all(|part| part.share >= 0.0 && part.rms >= 0.0));
    budget
}

#[test]
fn pixel_noise_alone_is_called_so() {
    for seed in [1, 2] {
        for noise in [Noise::Normal(0.1), Noise::Quantised] {
            let budget = compared("brown", &stage("paper", seed, noise).2);
            assert!(budget.detector.share > 0.9, "{noise}: {budget:?}");
            assert!((budget.ratio_to_floor - 1.0).abs() < 0.12, "{noise}: {budget:?}");
            assert!((budget.pixel_noise / noise.sigma() - 1.0).abs() < 0.1, "{noise}: {budget:?}");
        }
    }
}

#[test]
fn a_lens_taken_for_another_is_the_lens_model() {
    for (rig, method) in [("bump", "brown"), ("bump", "dlt"), ("fisheye", "dlt")] {
        let budget = compared(method, &stage(rig, 3, Noise::Normal(0.1)).2);
        assert!(budget.lens_model.share > 0.5, "{rig}, {method}: {budget:?}");
        assert!(budget.stage.share < 0.1, "{rig}, {method}: {budget:?}");
    }
}

#[test]
fn charts_that_stood_elsewhere_are_the_stage() {
    for seed in [4, 5] {
        let data = displaced(stage("paper", seed, Noise::Normal(0.1)).2, 0.5, seed);
        let budget = compared("brown", &data);
        assert!(budget.stage.share > 0.5, "{budget:?}");
        // The noise of the pixels is none of the stage's doing.
        assert!((budget.pixel_noise / 0.1 - 1.0).abs() < 0.15, "{budget:?}");
        let without_views = Dataset { views: Vec::new(), ..data };
        assert_eq!(compared("brown", &without_views).stage.share, 0.0);
    }
}

#[test]
fn what_lies_beyond_is_extrapolation() {
    let noise = Noise::Normal(0.1);
    let (rig, chart, data) = stage("paper", 6, noise);
    let soloff = AnyMethod::named("soloff").unwrap();
    let model =
        Calibration::fit(&soloff, &Prepared::as_given(data.clone()), 0, false, &Silent).unwrap();
    let exam = random_correspondences(&rig, &chart, (50.0, 200.0), (noise, 7), 600);
    let budget = model.budget(&exam, &Silent).unwrap().unwrap();
    assert!(budget.extrapolation.share > 0.8, "{budget:?}");
    let near = random_correspondences(&rig, &chart, (55.0, 135.0), (noise, 7), 600);
    let budget = model.budget(&near, &Silent).unwrap().unwrap();
    assert!(budget.extrapolation.share < 0.05 && budget.lens_model.share > 0.8, "{budget:?}");
    // Among the views of a comparison, the outermost ones count as beyond.
    let budget = compared("soloff", &data);
    assert!(budget.extrapolation.share > 0.3 && budget.stage.share < 0.1, "{budget:?}");
}

#[test]
fn nothing_to_judge_is_no_budget() {
    let (_, _, data) = stage("paper", 8, Noise::Normal(0.1));
    let reference = Reference::fit(&data, &Silent).unwrap().unwrap();
    assert_eq!(Budget::of(&data, &[], &[], &reference), None);
    let error = HeldOut { row: usize::MAX, difference: Vector3::x(), beyond: false };
    assert_eq!(Budget::of(&data, &[error], &[error], &reference), None);
}
