//! Pictures that show less than they seem to.

use crate::scene::{Pair, Scene};
use wheatstone_stereo::Matcher;

const SIZE: (usize, usize) = (240, 120);

/// Some level below 128 for every column and row, the same in every run.
fn noise(x: usize, y: usize) -> u64 {
    let mixed = (x as u64 * 73_856_093) ^ (y as u64 * 19_349_663);
    (mixed ^ (mixed >> 13)).wrapping_mul(1_274_126_177) >> 16 & 127
}

#[test]
fn the_only_copy_that_is_in_the_picture_is_not_trusted() {
    // Stripes that repeat after 20 pixels, 45 pixels of disparity: at the left border the right picture shows the copy at 25
    // alone. Without a look at the left picture 445 of these are wrong with a confidence above 0.9.
    let (width, height) = SIZE;
    let picture = |shift: usize, grain: usize| -> Vec<u8> {
        let level = |at: usize| {
            let (x, y) = (at % width, at / width);
            (60 + noise((x + shift) % 20, 0) + noise(x + 1000 * grain, y) / 32) as u8
        };
        (0..width * height).map(level).collect()
    };
    let pair = Pair { width, height, left: picture(0, 1), right: picture(45, 2) };
    let map = pair.compute(&Matcher::new(20..80));
    let wrong = |at: &usize| (map.disparity[*at] - 45.0).abs() > 1.0;
    let trusted =
        (0..map.disparity.len()).filter(|at| wrong(at) && map.confidence[*at] > 0.9).count();
    assert!(trusted < 60, "{trusted}");
}

#[test]
fn saturated_windows_have_no_confidence_and_others_longer_error_bars() {
    let scene = Scene { contrast: 60.0, ..Scene::slanted(0.02, 0.01, 8) };
    let pair = scene.render();
    let matcher = Matcher::new(0..48);
    let whole = pair.compute(&matcher);
    let brighter = |picture: &[u8]| picture.iter().map(|level| level.saturating_add(110)).collect();
    let [left, right] = [&pair.left, &pair.right].map(|picture| brighter(picture));
    let clipped = Pair { left, right, ..pair };
    let map = clipped.compute(&matcher);
    let (width, height) = (map.width, map.height);
    let share = |at: usize| {
        let (x, y) = (at % width, at / width);
        let inside = (x - 4..=x + 4).flat_map(|x| (y - 4..=y + 4).map(move |y| (x, y)));
        inside.filter(|(x, y)| clipped.left[y * width + x] == 255).count()
    };
    let inner = |at: &usize| {
        (4..width - 4).contains(&(at % width)) && (4..height - 4).contains(&(at / width))
    };
    let inner: Vec<usize> = (0..map.confidence.len()).filter(inner).collect();
    let mostly: Vec<&usize> = inner.iter().filter(|at| share(**at) > 40).collect();
    assert!(mostly.len() > 1000, "{}", mostly.len());
    assert!(mostly.iter().all(|at| map.confidence[**at] == 0.0 && map.sigma[**at].is_nan()));
    let partly = inner.iter().filter(|at| (25..=40).contains(&share(**at)));
    let both = partly.filter(|at| map.sigma[**at].is_finite() && whole.sigma[**at].is_finite());
    let longer: Vec<bool> = both.map(|at| map.sigma[*at] > whole.sigma[*at]).collect();
    let count = longer.iter().filter(|longer| **longer).count();
    assert!(longer.len() > 500 && 10 * count > 9 * longer.len(), "{count} of {}", longer.len());
}
