//! Slanted planes and steps, whose disparities are known exactly.

use crate::{
    measure::{Judged, bad, confident, locking, root_mean_square, share},
    scene::{Plane, Scene},
};
use wheatstone_stereo::Matcher;

fn judge(scene: &Scene, matcher: &Matcher) -> Vec<Judged> {
    let map = scene.render().compute(matcher);
    confident(&map, 0.9, |x, y| Some(scene.disparity(x as f64, y as f64)))
}

/// Planes with other slopes each, and a step each.
fn scenes() -> Vec<Scene> {
    (0..8u64)
        .map(|seed| {
            let (along, down) = (0.01 * seed as f64 - 0.03, 0.05 - 0.012 * seed as f64);
            let mut scene = Scene::slanted(along, down, seed);
            scene.contrast = 12.0 + 4.0 * seed as f64;
            scene.noise = 0.5 + 0.25 * seed as f64;
            let plane =
                Plane { at_origin: 34.3 + 0.1 * seed as f64, along: 0.02, down: -0.01, bend: 0.0 };
            scene.front = Some((plane, [120.0, 250.0, 60.0, 190.0]));
            scene
        })
        .collect()
}

#[test]
fn disparities_do_not_lock_to_whole_pixels() {
    let judged: Vec<Judged> =
        scenes().iter().flat_map(|scene| judge(scene, &Matcher::new(0..64))).collect();
    let near: Vec<Judged> = judged.iter().copied().filter(|j| j.error.abs() < 1.0).collect();
    assert!(root_mean_square(&near) < 0.06, "{}", root_mean_square(&near));
    assert!(locking(&near) < 0.012, "{}", locking(&near));
    assert!(bad(&judged, 2.0) < 0.005, "{}", bad(&judged, 2.0));
}

#[test]
fn refinement_makes_disparities_several_times_as_exact() {
    let scene = Scene::slanted(0.03, 0.02, 3);
    let coarse = root_mean_square(&judge(&scene, &Matcher::new(0..64).refining(false)));
    let fine = root_mean_square(&judge(&scene, &Matcher::new(0..64)));
    assert!(fine < 0.5 * coarse, "{fine} {coarse}");
}

#[test]
fn errors_are_as_large_as_their_bars() {
    let judged: Vec<Judged> =
        scenes().iter().flat_map(|scene| judge(scene, &Matcher::new(0..64))).collect();
    let within = |sigmas: f64| share(&judged, |j| j.error.abs() < sigmas * j.sigma);
    assert!((0.64..0.76).contains(&within(1.0)), "{}", within(1.0));
    assert!((0.93..0.975).contains(&within(2.0)), "{}", within(2.0));
    // Of matches that are less sure, too.
    let (doubtful, sure): (Vec<Judged>, Vec<Judged>) =
        judged.iter().partition(|judged| judged.confidence < 0.99);
    for (part, least) in [(doubtful, 0.88), (sure, 0.94)] {
        let within = |sigmas: f64| share(&part, |j| j.error.abs() < sigmas * j.sigma);
        assert!((0.64..0.8).contains(&within(1.0)), "{}", within(1.0));
        assert!((least..0.975).contains(&within(2.0)), "{}", within(2.0));
    }
}

/// As a rectification resamples them: neighbours share noise, which is half as large.
#[test]
fn errors_are_as_large_as_their_bars_where_pictures_were_resampled() {
    let judged: Vec<Judged> = scenes()
        .iter()
        .flat_map(|scene| {
            let pair = scene.render().between_pixels();
            let map = pair.compute(&Matcher::new(0..64));
            confident(&map, 0.9, |x, y| Some(scene.disparity(x as f64 + 0.5, y as f64 + 0.5)))
        })
        .collect();
    let within = |sigmas: f64| share(&judged, |j| j.error.abs() < sigmas * j.sigma);
    assert!((0.62..0.82).contains(&within(1.0)), "{}", within(1.0));
    assert!((0.91..0.985).contains(&within(2.0)), "{}", within(2.0));
}

/// A window that takes what it sees for a plane finds a ball too far away.
#[test]
fn curved_surfaces_are_where_they_are() {
    for bend in [-0.003, 0.003] {
        let mut scene = Scene::slanted(0.0, 0.0, 9);
        scene.back = Plane { at_origin: 30.0, along: 0.0, down: 0.0, bend };
        let inner = |x: usize, y: usize| (90..230).contains(&x) && (50..190).contains(&y);
        let truth = |x: usize, y: usize| inner(x, y).then(|| scene.disparity(x as f64, y as f64));
        let judged = confident(&scene.render().compute(&Matcher::new(0..90)), 0.9, truth);
        let bias = judged.iter().map(|judged| judged.error).sum::<f64>() / judged.len() as f64;
        assert!(judged.len() > 15_000 && (bias / bend).abs() < 2.5, "{bend}: {bias}");
    }
}

#[test]
fn most_of_what_both_see_is_found() {
    for scene in scenes() {
        let map = scene.render().compute(&Matcher::new(0..64));
        let both = |x: usize, y: usize| scene.is_seen_by_both(x as f64, y as f64);
        let seen = (0..map.width * map.height).filter(|at| both(at % map.width, at / map.width));
        let truth = |x: usize, y: usize| both(x, y).then(|| scene.disparity(x as f64, y as f64));
        let found = confident(&map, 0.9, truth).len() as f64 / seen.count() as f64;
        assert!(found > 0.85, "{found}");
    }
}

#[test]
fn disparities_may_be_negative_and_far() {
    for (first, shift) in [(-40, -50.0), (100, 90.0), (-8, -20.0)] {
        let mut scene = Scene::slanted(0.01, 0.0, 5);
        scene.back.at_origin += shift;
        let judged = judge(&scene, &Matcher::new(first..first + 48));
        assert!(judged.len() > 320 * 240 / 2, "{first}: {}", judged.len());
        assert!(bad(&judged, 1.0) < 0.002, "{first}: {}", bad(&judged, 1.0));
    }
}

#[test]
fn a_long_range_finds_what_a_short_one_finds() {
    let mut scene = Scene::slanted(0.01, 0.02, 6);
    scene.width = 640;
    let short = judge(&scene, &Matcher::new(0..64));
    let long = judge(&scene, &Matcher::new(0..512));
    assert!(long.len() as f64 > 0.95 * short.len() as f64, "{} {}", long.len(), short.len());
    assert!(bad(&long, 1.0) < 0.002);
}

#[test]
fn gaps_are_filled_with_what_is_behind() {
    let scene = &scenes()[4];
    let map = scene.render().compute(&Matcher::new(0..64).filling(true));
    let pixels = (0..map.width * map.height).map(|at| ((at % map.width), (at / map.width)));
    let wrong = pixels.filter(|&(x, y)| {
        let found = f64::from(map.disparity[y * map.width + x]);
        (found - scene.disparity(x as f64, y as f64)).abs() > 2.0
    });
    let share = wrong.count() as f64 / (map.width * map.height) as f64;
    assert!(map.disparity.iter().all(|d| d.is_finite()));
    assert!(share < 0.03, "{share}");
}
