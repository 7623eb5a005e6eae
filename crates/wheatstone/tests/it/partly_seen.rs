//! The network where only some of the cameras saw a point.

use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::{Ellipsoids, coverage, evaluate, floor},
    method::{AnyMethod, AnyReconstructor},
    numeric::{progress::Silent, random::Random},
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

/// Each camera sees a point with this probability, and two at least do.
const SEEN: f64 = 0.7;

fn hidden(mut data: Dataset, seed: u64) -> Dataset {
    let mut random = Random::new(seed);
    for row in &mut data.correspondences {
        let seen = loop {
            let seen: Vec<bool> =
                row.pixels.iter().map(|_| random.uniform(0.0, 1.0) < SEEN).collect();
            if seen.iter().filter(|seen| **seen).count() >= 2 {
                break seen;
            }
        };
        row.pixels.iter_mut().zip(seen).filter(|(_, seen)| !seen).for_each(|(p, _)| *p = None);
    }
    data
}

/// What the network makes of 400 points, and points like them to judge it by.
fn fitted(rig: &Rig, seed: u64) -> (AnyReconstructor, Dataset) {
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(rig, &chart, &views, (NOISE, seed), Some(400));
    let exam = random_correspondences(rig, &chart, (50.0, 140.0), (NOISE, 500 + seed), 800);
    let method = AnyMethod::named("network").unwrap();
    let fit = method.fit_checked(&hidden(train, 100 + seed), 0, &Silent).unwrap();
    (fit.reconstructor, hidden(exam, 900 + seed))
}

#[test]
fn every_point_is_located_near_the_floor_and_error_bars_hold() {
    let tasks: Vec<(&str, usize)> =
        ["paper", "fisheye"].iter().flat_map(|rig| [2, 3, 4].map(|count| (*rig, count))).collect();
    tasks.into_par_iter().for_each(|(name, cameras)| {
        const SEEDS: u64 = 4;
        let rig = Rig::named(name, cameras).unwrap();
        let (mut ratio, mut p68, mut p95) = (0.0, 0.0, 0.0);
        for seed in 0..SEEDS {
            let (map, exam) = fitted(&rig, seed);
            let found = evaluate(&*map, &exam, None).unwrap();
            assert_eq!(found.located, found.n, "{name}, {cameras} cameras");
            ratio += found.rms / floor(&rig.cameras, &exam).unwrap().rms / SEEDS as f64;
            let held = coverage(&*map, &exam, &Ellipsoids::NORMAL).unwrap();
            p68 += held.p68 / SEEDS as f64;
            p95 += held.p95 / SEEDS as f64;
        }
        let figures = format!("{name}, {cameras} cameras: {ratio:.3} {p68:.3} {p95:.3}");
        assert!(ratio < 1.08, "{figures}");
        assert!((0.64..0.74).contains(&p68) && (0.92..0.98).contains(&p95), "{figures}");
    });
}

/// Files of when there was one network, of all cameras.
#[test]
fn a_network_of_older_files_locates_the_same() {
    let rig = Rig::named("paper", 2).unwrap();
    let (map, exam) = fitted(&rig, 1);
    let mut stored = serde_json::to_value(&map).unwrap();
    let of_all = stored["sets"][0].as_object().unwrap().clone();
    let fields = stored.as_object_mut().unwrap();
    fields.remove("sets");
    fields.remove("cameras");
    fields.extend(of_all.into_iter().filter(|(name, _)| name != "cameras"));
    let again: AnyReconstructor = serde_json::from_value(stored).unwrap();
    assert!(again.is_consistent());
    for row in exam.correspondences.iter().step_by(40) {
        let (a, b) = (map.locate(&row.pixels).unwrap(), again.locate(&row.pixels).unwrap());
        assert_eq!((a.point, a.covariance, a.residual), (b.point, b.covariance, b.residual));
    }
}
