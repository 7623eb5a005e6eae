//! How long cameras and charts take to be adjusted together, from nothing but a hand-held points file:
//! `cargo bench --bench hand_held -- points.csv [times]` prints one JSON object. `tests/peers/stereo.py`
//! makes the file, and runs OpenCV beside it.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{path::Path, time::Instant};
use wheatstone::{
    cleaning::poses::{self, Lenses, Placing},
    dataset::points_file::{self, Duplicates},
    progress::Silent,
};

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let Some(path) = given.first() else { return };
    let times: usize = given.get(1).map_or(9, |times| times.parse().unwrap());
    let data = points_file::read(Path::new(path), "mm", Duplicates::Refuse).unwrap();
    // All terms and all points, as OpenCV has them: the same minimum.
    let placing =
        Placing { lenses: Lenses::Brown, all_terms: true, keep_gross: true, ..Placing::default() };
    let mut seconds = Vec::new();
    let mut found = None;
    for _ in 0..times {
        let start = Instant::now();
        found = Some(poses::solve(&data, placing, &Silent).unwrap());
        seconds.push(start.elapsed().as_secs_f64());
    }
    let found = found.unwrap();
    seconds.sort_by(f64::total_cmp);
    println!(
        "{{\"median\": {}, \"least\": {}, \"rms\": {}, \"baseline\": {}}}",
        seconds[seconds.len() / 2],
        seconds[0],
        found.rms,
        found.baselines.first().copied().unwrap_or(0.0)
    );
}
