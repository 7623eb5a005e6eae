//! Points of other programs: the first byte says whose.
#![no_main]
use libfuzzer_sys::fuzz_target;
use wheatstone_fuzz::{catching, files, formats, given, names};

fuzz_target!(init: catching(), |data: &[u8]| {
    let [first, data @ ..] = data else { return };
    let formats = formats(false);
    let format = formats[usize::from(*first) % formats.len()];
    if let Ok(found) = format.read_points(&files(data, names(format)), &given()) {
        assert!(found.correspondences.iter().all(|row| row.pixels.len() == found.cameras));
        if format.writes() {
            let _ = format.write_points(&found, &given());
        }
    }
});
