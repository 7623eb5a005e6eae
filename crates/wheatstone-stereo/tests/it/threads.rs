//! The same bits for any number of threads.

use crate::scene::{Plane, Scene};
use wheatstone_stereo::Matcher;

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let mut scene = Scene::slanted(0.02, 0.01, 4);
    scene.height = 600;
    scene.front =
        Some((Plane { at_origin: 40.0, along: 0.0, down: 0.01 }, [100.0, 200.0, 100.0, 500.0]));
    let pair = scene.render();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let map = pool.install(|| pair.compute(&Matcher::new(0..64).filling(true)));
        let numbers = map.disparity.iter().chain(&map.confidence).chain(&map.sigma);
        numbers.map(|value| value.to_bits()).collect::<Vec<u32>>()
    };
    let one = with(1);
    for threads in [2, 5] {
        assert!(with(threads) == one, "{threads} threads");
    }
}
