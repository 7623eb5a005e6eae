//! `capture.toml`, beside pictures that it may name.
#![no_main]
use libfuzzer_sys::fuzz_target;
use std::{path::PathBuf, sync::OnceLock};
use wheatstone::{Capture, GrayImage, capture::CaptureFile};

/// A folder with two pictures a camera.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder").keep();
        for name in ["left", "right"] {
            std::fs::create_dir(folder.join(name)).expect("a folder");
            for view in ["050", "065"] {
                let picture = GrayImage::from_fn(4, 3, |x, y| (x + y) as f32);
                picture.write_png(&folder.join(name).join(format!("{view}.png"))).expect("a picture");
            }
        }
        folder
    })
}

/// Whether all that it names lies in its folder: a walk through the whole disk takes as long as it is asked to.
fn stays(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else { return true };
    if ["/", "\\", ".."].iter().all(|mark| !text.replace("t/*", "").contains(mark)) {
        return true;
    }
    toml::from_str::<CaptureFile>(text).is_err() && !text.contains("target") && !text.contains("file")
}

fuzz_target!(|data: &[u8]| {
    if !stays(data) {
        return;
    }
    std::fs::write(folder().join("capture.toml"), data).expect("the file is written");
    if let Ok(capture) = Capture::open(folder()) {
        let points = capture.chart.points();
        assert!(points.len() < 1 << 24);
        assert_eq!(capture.sizes().len(), capture.cameras.len());
    }
});
