//! How long chessboards take to be found: `cargo bench --bench chessboard` renders boards of 0.3, 1.2 and 12
//! megapixels and prints one JSON object of milliseconds. With `-- 9x6 5 a.png b.png` it looks for a board
//! of so many inner corners in each picture, so many times over, and prints a line of JSON a picture: the
//! median milliseconds and the first reading's points. `bench/peers/chessboard.py` compares these with others'.
//!
//! Times are of processor time, of all threads together: run with `RAYON_NUM_THREADS=1` to have no other.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{hint::black_box, path::Path, time::Instant};
use wheatstone::{
    chart::{Chart, ChartSearch, chessboard::Chessboard},
    geometry::{Homography, Pixel},
    imaging::{GrayImage, Limits, filter::gaussian_blur, read_image},
};

/// Processor time of all threads, where the system tells it; the wall's clock elsewhere.
fn seconds(start: Instant) -> f64 {
    let told = |task: std::io::Result<std::fs::DirEntry>| -> Option<f64> {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").ok();
    let all: Option<f64> = tasks.map(|tasks| tasks.filter_map(told).sum());
    all.filter(|all| *all > 0.0).map_or(start.elapsed().as_secs_f64(), |all| all * 1e-9)
}

/// Median milliseconds of `times` looks, and what is seen.
fn look(board: &Chessboard, image: &GrayImage, times: usize) -> (f64, ChartSearch) {
    let start = Instant::now();
    // Each run is several looks, so that it is longer than the system's clock is coarse.
    let mut seen = board.detect(image);
    let once = start.elapsed().as_secs_f64();
    let looks = (0.03 / once).ceil().max(1.0) as u32;
    let mut runs: Vec<f64> = (0..times)
        .map(|_| {
            let before = seconds(start);
            (0..looks).for_each(|_| seen = black_box(board.detect(image)));
            (seconds(start) - before) / f64::from(looks)
        })
        .collect();
    runs.sort_by(f64::total_cmp);
    (1e3 * runs[times / 2], seen)
}

/// An 11 x 8 board, tilted and blurred, over half of a picture.
fn rendered(board: &Chessboard, width: usize, height: usize) -> GrayImage {
    let [left, top, right, bottom] = board.board();
    let (w, h) = (width as f64, height as f64);
    let back = Homography::fit(&[
        (Pixel::new(0.2 * w, 0.15 * h), Pixel::new(left, top)),
        (Pixel::new(0.85 * w, 0.25 * h), Pixel::new(right, top)),
        (Pixel::new(0.8 * w, 0.8 * h), Pixel::new(right, bottom)),
        (Pixel::new(0.15 * w, 0.85 * h), Pixel::new(left, bottom)),
    ])
    .unwrap();
    let pixel = (right - left) / (0.65 * w);
    let light = |x: usize, y: usize| {
        let place = back.map(Pixel::new(x as f64, y as f64)).unwrap();
        let lit = board.reflectance([place.x, place.y], [pixel, pixel]).unwrap_or(0.4);
        // Noise of two grey levels, from no stream of random numbers.
        let mixed = (x as u32 * 73_856_093) ^ (y as u32 * 19_349_663);
        let noise = f64::from(mixed.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
        (30.0 + 190.0 * lit + 7.0 * noise).round() as f32
    };
    gaussian_blur(&GrayImage::from_fn(width, height, light), 0.7)
}

fn points(seen: &ChartSearch) -> String {
    let ChartSearch::Found(readings) = seen else { return "[]".into() };
    let points = readings.iter().take(1).flat_map(|reading| &reading.points);
    let points: Vec<String> =
        points.map(|(id, at)| format!("[{id}, {:.5}, {:.5}]", at.x, at.y)).collect();
    format!("[{}]", points.join(", "))
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    if let [counts, times, pictures @ ..] = &given[..] {
        let (columns, rows) = counts.split_once('x').unwrap();
        let (columns, rows) = (columns.parse().unwrap(), rows.parse().unwrap());
        let board = Chessboard { columns, rows, ..Chessboard::default() };
        for picture in pictures {
            let image = read_image(Path::new(picture), Limits::default()).unwrap();
            let (milliseconds, seen) = look(&board, &image, times.parse().unwrap());
            println!("{{\"milliseconds\": {milliseconds:.3}, \"points\": {}}}", points(&seen));
        }
        return;
    }
    let board = Chessboard { columns: 11, rows: 8, ..Chessboard::default() };
    let figures = [(640, 480), (1280, 960), (4000, 3000)].map(|(width, height)| {
        let (milliseconds, seen) = look(&board, &rendered(&board, width, height), 5);
        assert!(matches!(seen, ChartSearch::Found(_)));
        format!("\"{width}x{height}\": {milliseconds:.2}")
    });
    println!("{{{}}}", figures.join(", "));
}
