//! Where cameras stand to each other, against fits to the same points with other noise.

use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    fit::bundle::{BundleSettings, Lenses},
    method::{AnyMethod, RelativePose},
    numeric::{progress::Silent, statistics::mean},
    preparation::Preparation,
    synthetic::{
        HandHeld, Noise, Rig, Stage, chart_correspondences, hand_held_correspondences,
        random_correspondences,
    },
};

/// Standard deviations told, on average, over the scatter of the values.
fn told_over_scatter(told: &[(f64, f64)]) -> f64 {
    let values: Vec<f64> = told.iter().map(|(value, _)| *value).collect();
    let middle = mean(&values);
    let squares: Vec<f64> = values.iter().map(|value| (value - middle).powi(2)).collect();
    let scatter = (squares.iter().sum::<f64>() / (squares.len() - 1) as f64).sqrt();
    mean(&told.iter().map(|(_, sigma)| *sigma).collect::<Vec<_>>()) / scatter
}

fn told(times: u64, of: impl Fn(u64) -> Vec<RelativePose> + Sync) -> [f64; 2] {
    let fits: Vec<RelativePose> =
        (0..times).into_par_iter().map(|seed| of(seed).swap_remove(0)).collect();
    let baselines: Vec<_> =
        fits.iter().map(|pose| (pose.baseline, pose.baseline_sigma.unwrap())).collect();
    let angles: Vec<_> = fits.iter().map(|pose| (pose.angle, pose.angle_sigma.unwrap())).collect();
    [told_over_scatter(&baselines), told_over_scatter(&angles)]
}

fn fitted(method: &AnyMethod, data: &Dataset) -> Vec<RelativePose> {
    let fit = method.fit_checked(data, 0, &Silent).unwrap();
    fit.reconstructor.relative_poses().unwrap()
}

#[test]
fn sigmas_of_baselines_and_angles_are_those_of_repeated_fits() {
    let rig = Rig::named("brown", 2).unwrap();
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let fixed = AnyMethod::named("brown").unwrap().preset("fixed").unwrap();
    let neural = AnyMethod::named("neural-camera").unwrap();
    // Sixty fits know a standard deviation to nine percent, thirty to thirteen.
    for (method, times, bar) in [(fixed, 60, 0.75..1.35), (neural, 30, 0.65..1.5)] {
        let ratios = told(times, |seed| {
            let noise = (Noise::Normal(0.1), seed);
            fitted(&method, &chart_correspondences(&rig, &chart, &views, noise, None))
        });
        assert!(ratios.iter().all(|ratio| bar.contains(ratio)), "{}: {ratios:?}", method.name());
    }
}

/// Where charts are held by hand, their poses are uncertain, too.
#[test]
fn sigmas_of_baselines_include_those_of_charts_in_the_hand() {
    let rig = Rig::named("brown", 2).unwrap();
    let chart: AnyChart =
        LineGrid { pitch: 0.75 * rig.chart_pitch(), columns: 11, rows: 9, ..LineGrid::default() }
            .into();
    let placements = HandHeld { views: 8, ..HandHeld::default() }.placements(&chart, 4).unwrap();
    let bundle_settings =
        BundleSettings { lenses: Lenses::Brown, all_terms: true, ..BundleSettings::default() };
    let preparation =
        Preparation { bundle_settings, keep_outliers: true, ..Preparation::default() };
    let fixed = AnyMethod::named("brown").unwrap().preset("fixed").unwrap();
    let ratios = told(30, |seed| {
        let noise = (Noise::Normal(0.1), seed);
        let (data, _) = hand_held_correspondences(&rig, &chart, &placements, noise);
        fitted(&fixed, &preparation.run(data, 0, &Silent).unwrap().data)
    });
    assert!(ratios.iter().all(|ratio| (0.65..1.5).contains(ratio)), "{ratios:?}");
}

/// Cameras of which all is known but the noise have the baseline and the angle of their rig.
#[test]
fn relative_poses_are_those_of_the_rig() {
    let rig = Rig::named("pinhole", 3).unwrap();
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let data = random_correspondences(&rig, &chart, (50.0, 140.0), (Noise::None, 0), 200);
    let centres: Vec<_> = rig.cameras.iter().map(|camera| camera.centre()).collect();
    for method in ["dlt", "brown", "neural-camera"] {
        let poses = fitted(&AnyMethod::named(method).unwrap(), &data);
        for (pose, centre) in poses.iter().zip(&centres[1..]) {
            let baseline = (centre - centres[0]).norm();
            assert!((pose.baseline / baseline - 1.0).abs() < 1e-4, "{method}: {}", pose.baseline);
            assert_eq!(pose.baseline_sigma.is_some(), method != "dlt");
        }
        assert_eq!(poses.iter().map(|pose| pose.camera).collect::<Vec<_>>(), [1, 2]);
    }
}
