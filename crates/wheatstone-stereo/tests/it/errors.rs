//! What cannot be matched, and says so.

use wheatstone_stereo::{MatchError, Matcher, Penalties, Picture};

const PIXELS: [u8; 12] = [7; 12];

fn picture(width: usize, height: usize) -> Picture<'static> {
    Picture::new(width, height, &PIXELS).unwrap()
}

fn error(matcher: &Matcher) -> MatchError {
    matcher.compute(&picture(4, 3), &picture(4, 3)).unwrap_err()
}

#[test]
fn pictures_have_pixels_as_their_size_says() {
    assert_eq!(Picture::new(0, 3, &[]).unwrap_err(), MatchError::Empty);
    let error = Picture::new(5, 3, &PIXELS).unwrap_err();
    assert_eq!(error, MatchError::Pixels { expected: 15, given: 12 });
    assert!(Picture::new(usize::MAX, 2, &PIXELS).is_err());
}

#[test]
fn both_pictures_have_one_size() {
    let error = Matcher::new(0..4).compute(&picture(4, 3), &picture(3, 4)).unwrap_err();
    assert_eq!(error, MatchError::Sizes { left: (4, 3), right: (3, 4) });
    assert_eq!(error.to_string(), "the left picture has 4 x 3 pixels and the right one 3 x 4");
}

#[test]
fn ranges_have_disparities_within_the_picture() {
    for (first, end) in [(3, 3), (9, 2), (0, 1025), (i32::MIN, i32::MAX)] {
        assert_eq!(error(&Matcher::new(first..end)), MatchError::Range { first, end });
    }
    for range in [4..9, -9..-3] {
        let (first, end) = (range.start, range.end);
        let outside = MatchError::OutsidePicture { first, end, width: 4 };
        assert_eq!(error(&Matcher::new(range)), outside);
    }
    assert!(Matcher::new(-3..-2).compute(&picture(4, 3), &picture(4, 3)).is_ok());
}

#[test]
fn penalties_grow_and_fit_into_a_byte() {
    for (small, least, large) in [(40, 40, 50), (10, 60, 50), (10, 20, 201)] {
        let matcher = Matcher::new(0..4).penalties(Penalties { small, least, large });
        assert_eq!(error(&matcher), MatchError::Penalties);
    }
}
