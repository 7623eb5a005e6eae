//! Files that a capture names: lists of points, start files, targets of Kalibr. The first byte says which.
#![no_main]
use libfuzzer_sys::fuzz_target;
use std::{path::PathBuf, sync::OnceLock};
use wheatstone::{Capture, GrayImage};
use wheatstone_fuzz::files;

const REST: &str = "[cameras]\nleft = \"left*.png\"\nright = \"right*.png\"\n[[views]]\nname = \"a\"\n\
                    translation = [0, 0, 50]\n";

fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder").keep();
        for name in ["left.png", "right.png"] {
            let picture = GrayImage::from_fn(4, 3, |x, y| (x + y) as f32);
            picture.write_png(&folder.join(name)).expect("a picture");
        }
        folder
    })
}

fuzz_target!(|data: &[u8]| {
    let [first, data @ ..] = data else { return };
    let listed = first % 2 == 0;
    let chart = if listed {
        "[chart]\ntype = \"point-list\"\nfile = \"points.csv\"\nstart = \"start.csv\"\n"
    } else {
        "[chart]\nfile = \"target.yaml\"\n"
    };
    let text = format!("unit = \"mm\"\n{chart}{REST}");
    std::fs::write(folder().join("capture.toml"), text).expect("the file is written");
    let names: &[&str] = if listed { &["points.csv", "start.csv"] } else { &["target.yaml"] };
    for file in files(data, names) {
        std::fs::write(folder().join(&file.path), file.bytes).expect("the file is written");
    }
    if let Ok(capture) = Capture::open(folder()) {
        let points = capture.chart.points();
        assert!(points.iter().all(|point| point.iter().all(|value| value.is_finite())));
    }
});
