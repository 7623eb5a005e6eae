//! How far a pair is from being rectified.

use crate::scene::{Pair, Scene};
use wheatstone_stereo::{MatchError, Picture, VerticalOffset, vertical_offset};

fn offset(pair: &Pair) -> Option<VerticalOffset> {
    let picture = |pixels| Picture::new(pair.width, pair.height, pixels).unwrap();
    vertical_offset(&picture(&pair.left), &picture(&pair.right), 0..48).unwrap()
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
