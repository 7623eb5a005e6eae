//! How far a pair is from being rectified.

use crate::scene::{Pair, Scene};
use wheatstone_stereo::{
    MatchError, PairFault, Picture, VerticalOffset, judge_pair, vertical_offset,
};

fn offset(pair: &Pair) -> Option<VerticalOffset> {
    let picture = |pixels| Picture::new(pair.width, pair.height, pixels).unwrap();
    vertical_offset(&picture(&pair.left), &picture(&pair.right), 0..48).unwrap()
}

fn fault(pair: &Pair) -> Option<PairFault> {
    let picture = |pixels| Picture::new(pair.width, pair.height, pixels).unwrap();
    let pictures = [&picture(&pair.left), &picture(&pair.right)];
    judge_pair(pictures, 0..48, (0.5, 0.0), || Ok(0.0)).unwrap().fault
}

#[test]
fn rows_that_a_picture_was_moved_are_found() {
    let pair = Scene::slanted(0.02, 0.01, 8).render();
    for rows in [0usize, 1, 3] {
        let (left, right) = (pair.left.clone(), pair.right.clone());
        let (left, right) =
            (left[rows * pair.width..].to_vec(), right[..right.len() - rows * pair.width].to_vec());
        let moved = Pair { width: pair.width, height: pair.height - rows, left, right };
        let found = offset(&moved).unwrap();
        assert!((found.median - rows as f32).abs() < 0.1, "{rows}: {found:?}");
        assert!(found.corners > 20, "{found:?}");
    }
}

#[test]
fn rows_that_a_turned_camera_moved_are_found() {
    // About its axis, ahead, sideways: the largest offsets of 19 in 20 corners of a picture of 320 x 240.
    let moves: [fn(f64, f64, f64) -> f64; 3] = [
        |x, _, _| 0.02 * (x - 160.0),
        |_, y, _| 0.02 * (y - 120.0),
        |x, y, _| 2.0 * (x / 160.0 - 1.0) * (y / 120.0 - 1.0),
    ];
    for (lower, largest) in moves.into_iter().zip([3.0, 2.2, 1.3]) {
        let pair = Scene { lower, ..Scene::slanted(0.02, 0.01, 8) }.render();
        let found = offset(&pair).unwrap();
        assert!(found.median.abs() < 0.3, "{found:?}");
        assert!((found.largest - largest).abs() < 0.3, "{largest}: {found:?}");
        assert!(found.median_size < 0.6 * found.largest, "{found:?}");
        let fault = fault(&pair).unwrap().to_string();
        assert!(fault.contains("higher or lower at its sides"), "{fault}");
    }
    assert_eq!(fault(&Scene::slanted(0.02, 0.01, 8).render()), None);
}

#[test]
fn offsets_below_a_fault_are_doubted_where_corners_are_clear() {
    let sound = Scene::slanted(0.02, 0.01, 8).render();
    assert!(!offset(&sound).unwrap().is_doubtful(0.0));
    // A camera that was turned about its axis by 0.3 degrees.
    let pair = Scene { lower: |x, _, _| 0.005 * (x - 160.0), ..Scene::slanted(0.02, 0.01, 8) };
    let pair = pair.render();
    let found = offset(&pair).unwrap();
    assert!(fault(&pair).is_none() && found.is_doubtful(0.0), "{found:?}");
    // That is no more than this calibration lets expect.
    assert!(!found.is_doubtful(0.5), "{found:?}");
    assert!((0.005..0.1).contains(&found.sigma), "{found:?}");
}

#[test]
fn rows_beyond_the_search_are_found_before_nothing_in_common_is_said() {
    let pair = Scene::slanted(0.02, 0.01, 8).render();
    let rows = 10;
    let left = pair.left[rows * pair.width..].to_vec();
    let right = pair.right[..pair.right.len() - rows * pair.width].to_vec();
    let moved = Pair { width: pair.width, height: pair.height - rows, left, right };
    let picture = |pixels| Picture::new(moved.width, moved.height, pixels).unwrap();
    let pictures = [&picture(&moved.left), &picture(&moved.right)];
    assert_eq!(offset(&moved), None);
    let judged = judge_pair(pictures, 0..48, (0.01, 0.0), || Ok(0.0)).unwrap();
    let Some(PairFault::Vertical(found)) = judged.fault else { panic!("{judged:?}") };
    assert!((found.median - 10.0).abs() < 1.0, "{found:?}");
}

#[test]
fn nothing_in_common_is_no_offset() {
    let (one, other) = (Scene::slanted(0.0, 0.0, 1).render(), Scene::slanted(0.0, 0.0, 2).render());
    assert_eq!(offset(&Pair { right: other.right, ..one }), None);
    let mut blank = Scene::slanted(0.0, 0.0, 1);
    blank.contrast = 0.0;
    assert_eq!(offset(&blank.render()), None);
}

#[test]
fn pictures_of_two_sizes_are_refused() {
    let pixels = [0; 12];
    let pictures = [(4, 3), (3, 4)].map(|(w, h)| Picture::new(w, h, &pixels).unwrap());
    let error = vertical_offset(&pictures[0], &pictures[1], 0..2).unwrap_err();
    assert!(matches!(error, MatchError::Sizes { .. }));
}
