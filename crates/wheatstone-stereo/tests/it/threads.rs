//! The same bits for any number of threads, and for a matcher that was used before.

use crate::scene::{Pair, Plane, Scene};
use wheatstone_stereo::{DisparityMap, Matcher};

fn bits(map: &DisparityMap) -> Vec<u32> {
    let numbers = map.disparity.iter().chain(&map.confidence).chain(&map.sigma);
    numbers.map(|value| value.to_bits()).collect()
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let mut scene = Scene::slanted(0.02, 0.01, 4);
    scene.height = 600;
    scene.front = Some((
        Plane { at_origin: 40.0, along: 0.0, down: 0.01, bend: 0.0 },
        [100.0, 200.0, 100.0, 500.0],
    ));
    let pair = scene.render();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        bits(&pool.install(|| pair.compute(&Matcher::new(0..64).filling(true))))
    };
    let one = with(1);
    for threads in [2, 5] {
        assert!(with(threads) == one, "{threads} threads");
    }
}

#[test]
fn results_do_not_depend_on_what_a_matcher_did_before() {
    let pair = |width, height, seed| -> Pair {
        Scene { width, height, ..Scene::slanted(0.02, 0.01, seed) }.render()
    };
    // Larger, smaller and of another shape than the one before.
    let pairs = [pair(200, 150, 1), pair(320, 300, 2), pair(90, 40, 3), pair(150, 200, 4)];
    let used = Matcher::new(0..48);
    for (pair, range) in pairs.iter().cycle().zip([0..48, -40..90, 5..40, 0..64, 0..48, 0..33]) {
        let again = used.clone().range(range.clone());
        let fresh = Matcher::new(range);
        assert_eq!(bits(&pair.compute(&again)), bits(&pair.compute(&fresh)));
    }
}
