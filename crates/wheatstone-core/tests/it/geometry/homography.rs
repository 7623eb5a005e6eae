//! Planes seen as planes.

use nalgebra::Matrix3;
use wheatstone_core::geometry::{Homography, Pixel};

#[test]
fn four_pairs_determine_it_and_three_on_a_line_do_not() {
    let truth = Homography(Matrix3::new(30.0, 2.0, 100.0, -1.0, 28.0, 50.0, 1e-3, 2e-3, 1.0));
    let corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)].map(|(x, y)| Pixel::new(x, y));
    let found = Homography::fit(&corners.map(|c| (c, truth.map(c).unwrap()))).unwrap();
    let elsewhere = Pixel::new(3.0, 5.0);
    assert!((found.map(elsewhere).unwrap() - truth.map(elsewhere).unwrap()).norm() < 1e-9);
    let line = [0.0, 1.0, 2.0, 3.0].map(|x| (Pixel::new(x, 0.0), Pixel::new(x, x)));
    assert!(Homography::fit(&line).is_none());
}
