//! Error bars of cameras that were fitted to charts held by hand.

use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::compare,
    fit::bundle::{BundleSettings, Lenses},
    geometry::{Point3, Pose, Vector3},
    method::AnyMethod,
    numeric::progress::Silent,
    preparation::Preparation,
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

/// Few views, so that what is not known of the cameras is most of an error.
const VIEWS: usize = 6;

/// How often charts are held at the same places and seen with other noise.
const TIMES: u64 = 12;

/// Crossings across and down, a few to the size of the picture.
const LARGE: (usize, usize) = (11, 9);

/// A quarter of that: how far away it is, and how long the focal length, are told apart by little.
const SMALL: (usize, usize) = (6, 4);

fn chart(rig: &Rig, (columns, rows): (usize, usize)) -> AnyChart {
    LineGrid { pitch: 0.75 * rig.chart_pitch(), columns, rows, ..LineGrid::default() }.into()
}

/// Charts placed with a lens whose terms are all there, or as if nothing were known of the optics.
fn placed(data: Dataset, lenses: Lenses) -> Dataset {
    let bundle_settings = BundleSettings {
        lenses,
        all_terms: lenses != Lenses::Either,
        always_model_free: true,
        ..BundleSettings::default()
    };
    let preparation = Preparation {
        bundle_settings,
        keep_outliers: true,
        insist: true,
        ..Preparation::default()
    };
    preparation.run(data, 0, &Silent).unwrap().data
}

/// Sigmas told over scatter, about their mean, of points located with pixels free of noise, which err as
/// the cameras do: the root of the mean squares, whatever was taken up by the frame.
fn told(method: &AnyMethod, (rig, views): (&str, usize), lenses: Lenses, times: u64) -> f64 {
    told_of(method, (rig, LARGE, views), lenses, times)
}

fn told_of(
    method: &AnyMethod,
    (rig, size, views): (&str, (usize, usize), usize),
    lenses: Lenses,
    times: u64,
) -> f64 {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = chart(&rig, size);
    let placements = HandHeld { views, ..HandHeld::default() }.placements(&chart, 4).unwrap();
    let (mut clean, mut places) =
        hand_held_correspondences(&rig, &chart, &placements, (Noise::None, 0));
    let both: Vec<bool> = clean.correspondences.iter().map(|row| row.seen_by() == 2).collect();
    clean = clean.subset(|row, _| both[row]);
    places =
        places.into_iter().zip(both).filter(|(_, both)| *both).map(|(place, _)| place).collect();
    let mut expected = 0.0;
    let mut errors: Vec<Vec<Vector3>> = Vec::new();
    for seed in 0..times {
        let (data, _) = hand_held_correspondences(&rig, &chart, &placements, (NOISE, seed));
        let fit = method.fit_checked(&placed(data, lenses), 0, &Silent).unwrap().reconstructor;
        let located: Vec<_> = clean
            .correspondences
            .iter()
            .zip(&places)
            .map(|(row, world)| (row, fit.locate(&row.pixels).unwrap(), *world))
            .collect();
        let pairs: Vec<(Point3, Point3)> = located.iter().map(|(_, l, w)| (l.point, *w)).collect();
        let aligned = Pose::aligning(&pairs).unwrap();
        errors.push(pairs.iter().map(|(l, w)| aligned.transform(*l) - w).collect());
        for (row, located, world) in &located {
            // These pixels are exact: their part of the covariance is taken off.
            let mut normal = nalgebra::Matrix3::zeros();
            for (camera, pixel) in row.pixels.iter().enumerate() {
                let sigma = fit.pixel_sigma(camera, pixel.unwrap(), located.point).unwrap();
                let slopes = rig.cameras[camera].project_with_jacobian(*world).unwrap().1;
                normal += slopes.transpose() * slopes / (sigma * sigma);
            }
            expected += located.covariance.trace() - normal.try_inverse().unwrap().trace();
        }
    }
    let scatter = |point: usize| {
        let mean = errors.iter().map(|fit| fit[point]).sum::<Vector3>() / times as f64;
        errors.iter().map(|fit| (fit[point] - mean).norm_squared()).sum::<f64>()
    };
    let squares: f64 = (0..places.len()).map(scatter).sum();
    (expected * (1.0 - 1.0 / times as f64) / squares).sqrt()
}

#[test]
fn sigmas_are_those_of_repeated_fits() {
    let method = AnyMethod::named("kannala-brandt").unwrap().preset("fixed").unwrap();
    let ratio = told(&method, ("fisheye", VIEWS), Lenses::KannalaBrandt, 60);
    assert!((0.9..1.1).contains(&ratio), "{ratio:.3}");
}

/// Linear cameras predict views left out as well as any here, but take the estimated poses for known: 0.47.
#[test]
fn auto_chooses_error_bars_with_the_charts_poses_in_them() {
    let method = AnyMethod::named("auto").unwrap();
    let ratio = told_of(&method, ("pinhole", SMALL, 12), Lenses::Either, 24);
    assert!((0.75..1.15).contains(&ratio), "{ratio:.3}");
}

#[test]
fn methods_that_omit_the_uncertainty_of_poses_are_named_and_not_recommended() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let chart = chart(&rig, SMALL);
    let placements = HandHeld { views: 12, ..HandHeld::default() }.placements(&chart, 4).unwrap();
    let (data, _) = hand_held_correspondences(&rig, &chart, &placements, (NOISE, 0));
    let prepared = |method: &str| {
        let method = AnyMethod::named(method).unwrap();
        Preparation::default().for_method(Some(&method)).run(data.clone(), 0, &Silent).unwrap()
    };
    let omits = |method| {
        let findings = prepared(method).examination.findings;
        findings.iter().any(|finding| finding.code == "omitted-pose-uncertainty")
    };
    assert!(["dlt", "soloff", "interpolation"].into_iter().all(omits));
    assert!(
        !["auto", "tsai", "brown", "kannala-brandt", "neural-camera", "network"]
            .into_iter()
            .any(omits)
    );
    let methods = ["dlt", "brown"].map(|name| AnyMethod::named(name).unwrap());
    let found = compare(&methods, &prepared("auto").data, None, 0, &Silent).unwrap();
    assert!(found.methods[0].rms.unwrap() < 1.02 * found.methods[1].rms.unwrap());
    assert_eq!(found.chosen.as_deref(), Some("brown"));
}

/// With any optics charts are placed together with the cameras that are fitted.
#[test]
fn sigmas_of_model_free_cameras_have_the_charts_places_in_them() {
    for rig in ["fisheye", "water"] {
        let method = AnyMethod::named("neural-camera").unwrap();
        let ratio = told(&method, (rig, VIEWS), Lenses::Either, TIMES);
        assert!((0.9..1.15).contains(&ratio), "{rig}: {ratio:.3}");
    }
}

#[test]
fn sigmas_of_the_network_have_the_charts_places_in_them() {
    // Before a fisheye noise is fifty times as much as what is not known of the network, so that a hundredth of it
    // makes a quarter.
    let bars = [
        ("paper", VIEWS, 0.9..1.12),
        ("water", VIEWS, 0.9..1.15),
        ("fisheye", VIEWS, 0.8..1.3),
        ("fisheye", 15, 0.8..1.25),
    ];
    bars.into_par_iter().for_each(|(rig, views, bar)| {
        let method = AnyMethod::named("network").unwrap();
        let ratio = told(&method, (rig, views), Lenses::Either, TIMES);
        assert!(bar.contains(&ratio), "{rig}, {views} views: {ratio:.3}");
    });
}

/// A camera alone tells nothing of its place: its intrinsics have the uncertainty of all charts' poses in them.
#[test]
fn sigmas_of_a_camera_alone_are_those_of_repeated_fits() {
    let rig = Rig::named("brown", 2).unwrap();
    let views = HandHeld { views: 10, ..HandHeld::default() };
    let chart = chart(&rig, LARGE);
    let placements = views.placements(&chart, 3).unwrap();
    let brown = AnyMethod::named("brown").unwrap().preset("fixed").unwrap();
    let repeated = (0..2 * TIMES).into_par_iter().map(|seed| {
        let mut data = hand_held_correspondences(&rig, &chart, &placements, (NOISE, seed)).0;
        data.cameras = 1;
        data.correspondences.iter_mut().for_each(|row| row.pixels.truncate(1));
        let fit = brown.fit_checked(&placed(data, Lenses::Brown), 0, &Silent).unwrap();
        let parameters = fit.reconstructor.intrinsics().unwrap().swap_remove(0).parameters;
        parameters.iter().map(|own| [own.value, own.sigma.unwrap()]).collect::<Vec<_>>()
    });
    let repeated: Vec<Vec<[f64; 2]>> = repeated.collect();
    let count = repeated.len() as f64;
    for parameter in 0..repeated[0].len() {
        let of = |which: usize| repeated.iter().map(move |fit| fit[parameter][which]);
        let mean = of(0).sum::<f64>() / count;
        let scatter =
            (of(0).map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        // Two dozen fits know a standard deviation to fifteen percent.
        let ratio = of(1).sum::<f64>() / count / scatter;
        assert!((0.6..1.7).contains(&ratio), "parameter {parameter}: {ratio:.2}");
    }
}
