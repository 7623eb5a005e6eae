//! Calibrations of other programs: the first byte says whose.
#![no_main]
use libfuzzer_sys::fuzz_target;
use wheatstone::geometry::Point3;
use wheatstone_fuzz::{files, formats, given, names};

fuzz_target!(|data: &[u8]| {
    let [first, data @ ..] = data else { return };
    let formats = formats(true);
    let format = formats[usize::from(*first) % formats.len()];
    if let Ok(rig) = format.read_rig(&files(data, names(format)), &given()) {
        for camera in &rig.cameras {
            if let Some(pixel) = camera.optics.project(Point3::new(1.0, 2.0, 300.0)) {
                assert!(!pixel.x.is_nan() && !pixel.y.is_nan());
            }
        }
        let _ = format.write_rig(&rig);
    }
});
