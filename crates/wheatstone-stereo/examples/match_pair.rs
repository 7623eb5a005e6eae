//! Matches two pictures and writes NumPy arrays: `disparity.npy`, `confidence.npy`, `sigma.npy`.
//!
//! match_pair LEFT RIGHT FIRST END FOLDER [--coarse] [--fill] [--evidence] [--repeat N]
//!
//! `--coarse` leaves off the refinement, `--evidence` writes what confidences are computed from. Prints the least
//! CPU time of N runs, in seconds, on all threads together (RAYON_NUM_THREADS=1 for one).
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a small program for the shell")]

use std::{fs, path::Path, time::Instant};
use wheatstone_stereo::{Matcher, Picture};

/// CPU seconds of all threads so far, where the system tells; the time of day elsewhere.
fn seconds(start: Instant) -> f64 {
    let threads = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let times = threads.filter_map(|thread| {
        let text = fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    let nanoseconds: f64 = times.sum();
    if nanoseconds > 0.0 { nanoseconds * 1e-9 } else { start.elapsed().as_secs_f64() }
}

/// An array of single-precision numbers, as NumPy writes them.
fn write(folder: &Path, name: &str, (width, height): (usize, usize), values: &[f32]) {
    let mut header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    fs::write(folder.join(format!("{name}.npy")), bytes).unwrap();
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let repeats = arguments.iter().position(|argument| argument == "--repeat");
    let repeats: usize = repeats.map_or(1, |at| arguments[at + 1].parse().unwrap());
    let open = |path: &str| image::open(path).unwrap().to_luma8();
    let (left, right) = (open(&arguments[0]), open(&arguments[1]));
    let size = (left.width() as usize, left.height() as usize);
    let picture = |grey| Picture::new(size.0, size.1, grey).unwrap();
    let (left, right) = (picture(left.as_raw()), picture(right.as_raw()));
    let range = arguments[2].parse().unwrap()..arguments[3].parse().unwrap();
    let matcher = Matcher::new(range).refining(!has("--coarse")).filling(has("--fill"));
    let folder = Path::new(&arguments[4]);
    fs::create_dir_all(folder).unwrap();

    let start = Instant::now();
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let (before, began) = (seconds(start), Instant::now());
        let map = matcher.compute(&left, &right).unwrap();
        least = least.min(seconds(start) - before);
        if has("--wall") {
            println!("{:.1} ms by the clock", began.elapsed().as_secs_f64() * 1e3);
        }
        write(folder, "disparity", size, &map.disparity);
        write(folder, "confidence", size, &map.confidence);
        write(folder, "sigma", size, &map.sigma);
    }
    println!("{least:.6}");
    if has("--evidence") {
        let evidence = matcher.evidence(&left, &right).unwrap();
        for (name, map) in evidence.named() {
            write(folder, name, size, map);
        }
    }
}
