//! Pairs in which the right picture shows things lower or higher, by how much depends on pixel and disparity.

use crate::{
    measure::{Judged, bad, confident, median_error, share},
    scene::{Plane, Scene},
};
use std::{f64::consts::PI, ops::Range};
use wheatstone_stereo::{DisparityMap, EpipolarCurves, MatchError, Matcher, Picture};

const RANGE: Range<i32> = 0..64;

/// Up to 7 pixels up and down. It changes by a tenth of a pixel per pixel of disparity, as much as behind a thick port.
fn lower(x: f64, y: f64, d: f64) -> f64 {
    let of_pixel = 3.0 * libm::sin(PI * x / 320.0) * libm::cos(PI * y / 240.0);
    of_pixel + (d - 30.0) * (0.04 + (y - 120.0) / 1200.0)
}

/// Slanted planes with another in front of each.
fn scenes() -> Vec<Scene> {
    (0..4u64)
        .map(|seed| {
            let slope = 0.02 * seed as f64 - 0.03;
            let mut scene = Scene::slanted(slope, -slope, seed);
            let at_origin = 34.3 + 3.1 * seed as f64;
            let plane = Plane { at_origin, along: 0.02, down: -0.01, bend: 0.0 };
            scene.front = Some((plane, [120.0, 250.0, 60.0, 190.0]));
            scene
        })
        .collect()
}

fn judge(scene: &Scene, map: &DisparityMap) -> Vec<Judged> {
    confident(map, 0.9, |x, y| Some(scene.disparity(x as f64, y as f64)))
}

fn bits(map: &DisparityMap) -> Vec<u32> {
    let numbers = map.disparity.iter().chain(&map.confidence).chain(&map.sigma);
    numbers.map(|value| value.to_bits()).collect()
}

#[test]
fn curves_are_followed_as_well_as_rows() {
    let matcher = Matcher::new(RANGE);
    for mut scene in scenes() {
        let rectified = scene.render().compute(&matcher);
        let rectified = (rectified.density(0.9), median_error(&judge(&scene, &rectified)));
        scene.lower = lower;
        let pair = scene.render();
        let curves = scene.curves(RANGE);
        assert!(curves.largest() > 6.0);
        let map = pair.compute_along(&matcher, &curves);
        let judged = judge(&scene, &map);
        let found = (map.density(0.9), median_error(&judged));
        // A few rows are not in the right picture.
        assert!(found.0 > rectified.0 - 0.02, "{found:?} {rectified:?}");
        assert!(found.1 < 1.15 * rectified.1, "{found:?} {rectified:?}");
        assert!(bad(&judged, 2.0) < 0.003, "{}", bad(&judged, 2.0));

        let along_rows = pair.compute(&matcher);
        let (density, error) = (along_rows.density(0.9), median_error(&judge(&scene, &along_rows)));
        assert!(density < 0.55 && error > 2.0 * rectified.1, "{density} {error}");
    }
}

#[test]
fn error_bars_hold_along_curves() {
    let matcher = Matcher::new(RANGE);
    let judged: Vec<Judged> = scenes()
        .into_iter()
        .flat_map(|scene| {
            let scene = Scene { lower, ..scene };
            judge(&scene, &scene.render().compute_along(&matcher, &scene.curves(RANGE)))
        })
        .collect();
    let within = |sigmas: f64| share(&judged, |judged| judged.error.abs() < sigmas * judged.sigma);
    assert!((0.64..0.78).contains(&within(1.0)), "{}", within(1.0));
    assert!((0.92..0.98).contains(&within(2.0)), "{}", within(2.0));
}

#[test]
fn what_the_right_picture_does_not_show_is_not_found() {
    let mut scene = Scene::slanted(0.01, 0.0, 3);
    scene.lower = |_, _, _| -12.0;
    let curves = scene.curves(RANGE);
    let map = scene.render().compute_along(&Matcher::new(RANGE), &curves);
    let confident = |rows: Range<usize>| {
        let confidence = &map.confidence[rows.start * map.width..rows.end * map.width];
        confidence.iter().filter(|&&confidence| confidence > 0.9).count() as f64
            / confidence.len() as f64
    };
    assert_eq!(confident(0..11), 0.0);
    assert!(confident(16..240) > 0.8, "{}", confident(16..240));
}

#[test]
fn curves_of_zero_are_rows() {
    let pair = scenes()[1].render();
    for (range, fills) in [(RANGE, false), (-9..40, true), (300..330, false)] {
        let matcher = Matcher::new(range.clone()).filling(fills);
        let size = (pair.width, pair.height);
        let curves = EpipolarCurves::new(size, range, |_, _, _| Some(0.0)).unwrap();
        assert_eq!(bits(&pair.compute(&matcher)), bits(&pair.compute_along(&matcher, &curves)));
    }
}

#[test]
fn maps_along_curves_do_not_depend_on_the_number_of_threads() {
    let scene = Scene { lower, height: 400, ..scenes()[2].clone() };
    let pair = scene.render();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let matcher = Matcher::new(RANGE);
        bits(&pool.install(|| pair.compute_along(&matcher, &scene.curves(RANGE))))
    };
    assert!(with(1) == with(3));
}

#[test]
fn wild_curves_are_survived() {
    type Wild = fn(f32, f32, f32) -> Option<f32>;
    let pair = scenes()[0].render();
    let matcher = Matcher::new(-20..20);
    let wild: [Wild; 4] = [
        |_, _, _| None,
        |_, _, _| Some(f32::MAX),
        |x, _, _| Some(if x < 100.0 { -f32::MAX } else { f32::MAX }),
        |x, y, d| Some((x + 7.0 * y + 31.0 * d) % 40.0 - 20.0),
    ];
    for v in wild {
        let curves = EpipolarCurves::new((pair.width, pair.height), -20..20, v).unwrap();
        let map = pair.compute_along(&matcher, &curves);
        assert!(map.confidence.iter().all(|confidence| (0.0..=1.0).contains(confidence)));
    }
}

#[test]
fn curves_that_do_not_suit_are_refused() {
    let new = |size, range, v: f32| EpipolarCurves::new(size, range, move |_, _, _| Some(v));
    for v in [f32::NAN, f32::INFINITY] {
        assert_eq!(new((9, 9), 0..4, v).unwrap_err(), MatchError::CurveValue { x: 0, y: 0 });
    }
    assert_eq!(new((9, 0), 0..4, 0.0).unwrap_err(), MatchError::Empty);
    assert!(matches!(new((9, 9), 4..4, 0.0), Err(MatchError::Range { .. })));

    let picture = Picture::new(4, 3, &[7; 12]).unwrap();
    let error = |curves| Matcher::new(0..3).compute_along(&picture, &picture, &curves).unwrap_err();
    let size = MatchError::CurveSize { curves: (3, 4), pictures: (4, 3) };
    assert_eq!(error(new((3, 4), 0..2, 0.0).unwrap()), size);
    for range in [0..2, 1..4] {
        let curves = (range.start, range.end);
        let expected = MatchError::CurveRange { curves, search: (0, 3) };
        assert_eq!(error(new((4, 3), range, 0.0).unwrap()), expected);
    }
}
