//! What share of points their error ellipsoids hold.

use crate::worlds::chart;
use wheatstone_core::{
    dataset::{Dataset, split::FoldKind},
    evaluate::{Distance, Ellipsoids, coverage},
    method::{AnyMethod, AnyReconstructor},
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_synthetic::{
    Noise, Rig, Stage, chart_correspondences, random_correspondences as random_points,
};

fn fitted(rig: &str, noise: Noise, seed: u64) -> (Dataset, AnyReconstructor, Dataset) {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = chart(&rig);
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (noise, seed), Some(400));
    let method = AnyMethod::named("brown").unwrap();
    let map = method.fit_checked(&train, 0, &Silent).unwrap().reconstructor;
    let exam = random_points(&rig, &chart, (50.0, 140.0), (noise, seed + 1), 3000);
    (train, map, exam)
}

#[test]
fn ellipsoids_of_rounded_pixels_hold_what_they_say() {
    let (train, map, exam) = fitted("paper", Noise::Quantised, 40);
    let law = Ellipsoids::estimate(&*map, &train, &[]);
    assert!(law.radius2_95 < 0.9 * Ellipsoids::NORMAL.radius2_95, "{law:?}");
    let held = coverage(&*map, &exam, &law).unwrap();
    assert!((0.65..0.71).contains(&held.p68) && (0.93..0.97).contains(&held.p95), "{held:?}");
    // The chi-square's ellipsoid would hold nearly all.
    assert!(coverage(&*map, &exam, &Ellipsoids::NORMAL).unwrap().p95 > 0.975);
}

#[test]
fn normal_noise_keeps_the_radii_of_chi_square() {
    // Four fits: 800 pixels' coordinates tell the noise so that 68 % scatter by two.
    let (mut p68, mut p95) = (0.0, 0.0);
    for seed in [50, 60, 70, 80] {
        let (train, map, exam) = fitted("paper", Noise::Normal(0.1), seed);
        let law = Ellipsoids::estimate(&*map, &train, &[]);
        assert_eq!(law, Ellipsoids::NORMAL);
        let held = coverage(&*map, &exam, &law).unwrap();
        p68 += 0.25 * held.p68;
        p95 += 0.25 * held.p95;
    }
    assert!((0.65..0.71).contains(&p68) && (0.93..0.97).contains(&p95), "{p68} {p95}");
}

#[test]
fn points_held_out_are_heard_where_they_contradict() {
    let (train, map, _) = fitted("paper", Noise::Normal(0.1), 70);
    let mut random = Random::new(5);
    let mut sample = |scale: f64, power: f64| -> Vec<Distance> {
        let mut normal = || random.normal().powi(2);
        let distance2 = |_| scale * libm::pow(normal() + normal() + normal(), power);
        let of = |distance2| Distance { kind: FoldKind::Interpolation, distance2 };
        (0..2000).map(distance2).map(of).collect()
    };
    let right = Ellipsoids::estimate(&*map, &train, &sample(1.0, 1.0));
    let wrong = Ellipsoids::estimate(&*map, &train, &sample(0.6, 1.4));
    for (found, scale, power) in [(right, 1.0, 1.0), (wrong, 0.6, 1.4)] {
        let wanted = |normal: f64| scale * libm::pow(normal, power);
        let (small, large) = (found.radius2_68 / wanted(3.506), found.radius2_95 / wanted(7.815));
        assert!((small - 1.0).abs() < 0.08 && (large - 1.0).abs() < 0.08, "{found:?}");
    }
    let few: Vec<Distance> = sample(9.0, 1.0).into_iter().take(20).collect();
    assert_eq!(Ellipsoids::estimate(&*map, &train, &few), Ellipsoids::NORMAL);
}
