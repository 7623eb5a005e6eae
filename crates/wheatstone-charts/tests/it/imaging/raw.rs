//! Pictures from memory.

use wheatstone_charts::imaging::GrayImage;

#[test]
fn rows_may_be_padded_and_values_have_any_depth() {
    let padded = [1, 2, 99, 3, 4];
    let image = GrayImage::from_raw_stride(2, 2, 3, &padded).unwrap();
    assert_eq!(image.values(), [1.0, 2.0, 3.0, 4.0]);
    let deep = GrayImage::from_raw16(2, 1, 4095, &[4095, 0]).unwrap();
    assert_eq!(deep.values(), [255.0, 0.0]);
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    assert!(GrayImage::from_raw_stride(2, 2, 3, &[0; 4]).is_err());
    assert!(GrayImage::from_raw_stride(2, 2, 1, &[0; 4]).is_err());
    assert!(GrayImage::from_raw(0, 2, &[]).is_err());
    assert!(GrayImage::from_raw(usize::MAX, 2, &[0]).is_err());
    assert!(GrayImage::from_raw16(1, 1, 0, &[0]).is_err());
}
