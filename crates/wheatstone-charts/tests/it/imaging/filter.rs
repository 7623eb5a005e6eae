//! Filters of pictures that are easily worked out.

use wheatstone_charts::imaging::{
    GrayImage,
    filter::{gaussian_blur, gaussian_kernel, halve},
};

#[test]
fn a_blurred_dot_is_the_kernel_and_a_flat_picture_stays_flat() {
    let dot = GrayImage::from_fn(21, 21, |x, y| if (x, y) == (10, 10) { 1.0 } else { 0.0 });
    let blurred = gaussian_blur(&dot, 1.5);
    let kernel = gaussian_kernel(1.5);
    assert!((blurred.at(10, 10) - kernel[6] * kernel[6]).abs() < 1e-7);
    assert!((blurred.at(12, 9) - kernel[8] * kernel[5]).abs() < 1e-7);
    assert!((blurred.values().iter().sum::<f32>() - 1.0).abs() < 1e-4);
    let flat = GrayImage::from_fn(9, 5, |_, _| 100.0);
    assert!(gaussian_blur(&flat, 2.0).values().iter().all(|v| (v - 100.0).abs() < 1e-3));
}

#[test]
fn halving_averages() {
    let ramp = GrayImage::from_fn(5, 4, |x, y| (x + 10 * y) as f32);
    let half = halve(&ramp);
    assert_eq!((half.width(), half.height()), (2, 2));
    assert_eq!(half.at(1, 1), 2.5 + 10.0 * 2.5);
}
