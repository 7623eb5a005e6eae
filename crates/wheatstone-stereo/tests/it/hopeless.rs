//! Pairs that nothing, or nothing certain, can be said of.

use crate::{
    measure::{bad, confident},
    scene::{Pair, Random, Scene},
};
use wheatstone_stereo::Matcher;

#[test]
fn a_blank_wall_is_never_confident() {
    for noise in [0.0, 1.0, 2.0, 4.0] {
        let mut scene = Scene::slanted(0.0, 0.0, 1);
        (scene.contrast, scene.noise) = (0.0, noise);
        let map = scene.render().compute(&Matcher::new(0..64));
        assert!(map.density(0.9) < 0.001, "{noise}: {}", map.density(0.9));
    }
}

#[test]
fn a_pattern_that_repeats_is_not_confidently_wrong() {
    for period in [8usize, 16] {
        let (width, height) = (320, 200);
        let mut random = Random(period as u64);
        let mut picture = |shift: usize| -> Vec<u8> {
            (0..width * height)
                .map(|at| {
                    let phase = (at % width + shift) % period;
                    let stripe = if phase < period / 2 { 90.0 } else { 170.0 };
                    (stripe + 2.0 * random.normal()) as u8
                })
                .collect()
        };
        let (left, right) = (picture(0), picture(21));
        let pair = Pair { width, height, left, right };
        let map = pair.compute(&Matcher::new(0..64));
        // Also at the left, where some candidates are outside of the right picture, and only one may be left.
        let judged = confident(&map, 0.9, |_, _| Some(21.0));
        let wrong = bad(&judged, 2.0) * judged.len() as f64 / (width * height) as f64;
        assert!(wrong < 0.001, "{period}: {wrong}");
    }
}

#[test]
fn exchanged_pictures_are_not_confident() {
    let pair = Scene::slanted(0.02, 0.01, 2).render();
    let exchanged = Pair { left: pair.right, right: pair.left, ..pair };
    let map = exchanged.compute(&Matcher::new(0..64));
    assert!(map.density(0.9) < 0.01, "{}", map.density(0.9));
}

#[test]
fn noise_is_not_confident() {
    let mut random = Random(9);
    let (width, height) = (200, 150);
    let mut picture = || (0..width * height).map(|_| random.byte()).collect();
    let pair = Pair { width, height, left: picture(), right: picture() };
    let map = pair.compute(&Matcher::new(0..64));
    assert!(map.density(0.9) < 0.001, "{}", map.density(0.9));
}
