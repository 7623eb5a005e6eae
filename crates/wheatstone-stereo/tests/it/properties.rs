//! Whatever the pictures and the range are.

use crate::scene::Random;
use proptest::prelude::*;
use wheatstone_stereo::{Matcher, Picture};

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn maps_are_sound(
        width in 1usize..70,
        height in 1usize..40,
        first in -80i32..80,
        count in 1i32..140,
        seed in 0u64..1000,
        kind in 0usize..3,
        refines: bool,
        fills: bool,
    ) {
        let mut random = Random(seed);
        let mut picture = || -> Vec<u8> {
            let mut next = |x: usize| match kind {
                0 => random.byte(),
                1 => (x as u8).wrapping_mul(31) ^ (random.byte() & 3),
                _ => 200,
            };
            (0..width * height).map(|at| next(at % width)).collect()
        };
        let (left, right) = (picture(), picture());
        let left = Picture::new(width, height, &left).unwrap();
        let right = Picture::new(width, height, &right).unwrap();
        let matcher = Matcher::new(first..first + count).refining(refines).filling(fills);
        let Ok(map) = matcher.compute(&left, &right) else {
            prop_assert!(first >= width as i32 || first + count <= 1 - width as i32);
            return Ok(());
        };
        for at in 0..width * height {
            let (disparity, confidence) = (map.disparity[at], map.confidence[at]);
            prop_assert!((0.0..=1.0).contains(&confidence));
            if confidence > 0.0 {
                // Half a pixel beyond the first and the last.
                let (least, most) = (first as f32 - 0.5, (first + count) as f32 - 0.5);
                prop_assert!(disparity >= least && disparity <= most, "{disparity}");
                prop_assert!(map.sigma[at] > 0.0 && map.sigma[at].is_finite());
            }
        }
    }
}
