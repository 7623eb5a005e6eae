//! Tables as text, plain or gzipped.
#![no_main]
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: wheatstone_fuzz::catching(), |data: &[u8]| wheatstone_fuzz::table("points.csv", data));
