//! How long cameras and charts take to be adjusted together, from nothing but a hand-held points file:
//! `cargo bench --bench hand_held -- points.csv [times]` prints one JSON object. `tests/peers/stereo.py`
//! makes the file, and runs OpenCV beside it. The joint adjustment alone begins with the lenses that each
//! camera's own pixels tell, as OpenCV's does; its time is told apart.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{path::Path, time::Instant};
use wheatstone::{
    camera::{AnyCamera, brown_conrady::BrownConrady},
    dataset::Dataset,
    fit::bundle::{self, BundleSettings, Lenses, SolvedPoses},
    numeric::progress::Silent,
    tables::{self, Duplicates},
};

/// What one camera saw.
fn of_one(data: &Dataset, camera: usize) -> Dataset {
    let mut one = Dataset { cameras: 1, ..data.clone() };
    for row in &mut one.correspondences {
        row.pixels = vec![row.pixels[camera]];
    }
    one
}

/// Seconds of each of several runs, by size, and what the last one found.
fn timed(times: usize, run: impl Fn() -> SolvedPoses) -> (Vec<f64>, SolvedPoses) {
    let mut seconds = Vec::new();
    let mut found = run();
    for _ in 0..times {
        let start = Instant::now();
        found = run();
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    (seconds, found)
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let Some(path) = given.first() else { return };
    let times: usize = given.get(1).map_or(9, |times| times.parse().unwrap());
    let data = tables::read(Path::new(path), "mm", Duplicates::Refuse).unwrap();
    // All terms and all points, as OpenCV has them: the same minimum.
    let bundle_settings = BundleSettings {
        lenses: Lenses::Brown,
        all_terms: true,
        keep_gross: true,
        ..BundleSettings::default()
    };
    let lens = |camera: usize| -> BrownConrady {
        let own = bundle::solve(&of_one(&data, camera), bundle_settings, &Silent).unwrap();
        match &own.cameras[0] {
            AnyCamera::BrownConrady(lens) => *lens,
            other => panic!("{other:?}"),
        }
    };
    let lenses: Vec<BrownConrady> = (0..data.cameras).map(lens).collect();
    let (whole, found) = timed(times, || bundle::solve(&data, bundle_settings, &Silent).unwrap());
    let (joint, near) =
        timed(times, || bundle::solve_near(&data, &lenses, bundle_settings, &Silent).unwrap());
    println!(
        "{{\"median\": {}, \"least\": {}, \"joint\": {}, \"joint_least\": {}, \"rms\": {}, \"joint_rms\": {}, \"baseline\": {}}}",
        whole[whole.len() / 2],
        whole[0],
        joint[joint.len() / 2],
        joint[0],
        found.rms,
        near.rms,
        found.baselines.first().copied().unwrap_or(0.0)
    );
}
