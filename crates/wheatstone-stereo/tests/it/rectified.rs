//! How far a pair is from being rectified.

use crate::scene::{Pair, Scene};
use wheatstone_stereo::{
    MatchError, PairFault, Picture, VerticalOffset, pair_fault, vertical_offset,
};

fn offset(pair: &Pair) -> Option<VerticalOffset> {
    let picture = |pixels| Picture::new(pair.width, pair.height, pixels).unwrap();
    vertical_offset(&picture(&pair.left), &picture(&pair.right), 0..48).unwrap()
}

fn fault(pair: &Pair) -> Option<PairFault> {
    let picture = |pixels| Picture::new(pair.width, pair.height, pixels).unwrap();
    let pictures = [&picture(&pair.left), &picture(&pair.right)];
    pair_fault(pictures, 0..48, (0.5, 0.0), || Ok(0.0)).unwrap()
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
