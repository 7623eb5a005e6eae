//! Pictures: PNG, JPEG, TIFF, BMP, PNM.
#![no_main]
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use wheatstone::{Limits, imaging::decode_image};

fuzz_target!(|data: &[u8]| {
    // A picture of the default limits may take gigabytes, and minutes.
    let limits = Limits { side: 4096, pixels: 1 << 21 };
    if let Ok(picture) = decode_image(Path::new("picture"), data, limits) {
        assert_eq!(picture.values().len(), picture.width() * picture.height());
        assert!(picture.values().iter().all(|value| (0.0..=255.0).contains(value)));
    }
});
