//! NumPy's matrices.
#![no_main]
use libfuzzer_sys::fuzz_target;
use wheatstone::Format;
use wheatstone_fuzz::{files, given};

fuzz_target!(|data: &[u8]| {
    let format = Format::named("npy").expect("it is known");
    if let Ok(found) = format.read_points(&files(data, &[]), &given()) {
        let _ = format.write_points(&found, &given());
    }
});
