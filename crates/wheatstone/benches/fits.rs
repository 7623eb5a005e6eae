//! How long methods take to be fitted to a points file: `cargo bench --bench fits -- points.csv [times]`
//! prints one JSON object, of each method the median and the least milliseconds a camera. With
//! `RAYON_NUM_THREADS=1` that is processor time on a machine that does nothing else.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{path::Path, time::Instant};
use wheatstone::{
    method::AnyMethod,
    numeric::progress::Silent,
    tables::{self, Duplicates},
};

const METHODS: [&str; 6] = ["dlt", "brown", "kannala-brandt", "tsai", "neural-camera", "network"];

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let Some(path) = given.first() else { return };
    let times: usize = given.get(1).map_or(9, |times| times.parse().unwrap());
    let data = tables::read(Path::new(path), "mm", Duplicates::Refuse).unwrap();
    let milliseconds = |method: &AnyMethod| {
        let start = Instant::now();
        method.fit_checked(&data, 0, &Silent).unwrap();
        start.elapsed().as_secs_f64() * 1e3 / data.cameras as f64
    };
    let rows = METHODS.map(|name| {
        let method = AnyMethod::named(name).unwrap();
        let mut taken: Vec<f64> = (0..times).map(|_| milliseconds(&method)).collect();
        taken.sort_by(f64::total_cmp);
        format!("\"{name}\": {{\"median\": {:.3}, \"least\": {:.3}}}", taken[times / 2], taken[0])
    });
    println!("{{{}}}", rows.join(", "));
}
