//! What shows in a fitted model alone, and what is said of it.

use rayon::prelude::*;
use wheatstone::{
    calibration::{Calibration, Judgement},
    camera::{PosedCamera, brown_conrady::BrownConrady, pinhole::Pinhole},
    chart::line_grid::LineGrid,
    dataset::Dataset,
    evaluate::{Coverage, Ellipsoids, coverage},
    geometry::{Pose, Vector3},
    method::AnyMethod,
    numeric::{progress::Silent, statistics::mean},
    preparation::Prepared,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

const DEPTHS: (f64, f64) = (50.0, 140.0);

fn points(count: usize, seed: u64) -> Dataset {
    let rig = Rig::named("pinhole", 2).unwrap();
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    random_correspondences(&rig, &chart, DEPTHS, (Noise::Normal(0.1), seed), count)
}

fn fitted(method: &str, data: Dataset) -> Calibration {
    let method = AnyMethod::named(method).unwrap();
    Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent).unwrap()
}

fn codes(model: &Calibration) -> Vec<&str> {
    model.findings.iter().map(|finding| finding.code.as_str()).collect()
}

/// Their noise is told from few errors, of which the fit takes a part: that is Student's t, and no noise that differs.
#[test]
fn error_bars_of_few_points_hold() {
    for (method, count) in [("dlt", 12), ("dlt", 20), ("brown", 16), ("brown", 24)] {
        let held: Vec<Coverage> = (0..40_u64)
            .into_par_iter()
            .map(|seed| {
                let model = fitted(method, points(count, seed));
                assert_eq!(model.point_noise, None, "{method} {count} {seed}");
                coverage(&model.map(), &points(200, 100 + seed), &Ellipsoids::NORMAL).unwrap()
            })
            .collect();
        let of = |share: fn(&Coverage) -> f64| mean(&held.iter().map(share).collect::<Vec<_>>());
        let (p68, p95) = (of(|held| held.p68), of(|held| held.p95));
        assert!((0.62..0.74).contains(&p68), "{method} {count}: {p68}");
        assert!((0.91..0.975).contains(&p95), "{method} {count}: {p95}");
    }
}

#[test]
fn few_points_are_said_to_be_few() {
    assert_eq!(codes(&fitted("brown", points(12, 1))), ["few-points"]);
    assert_eq!(codes(&fitted("brown", points(60, 1))), [""; 0]);
}

/// A plate that the stage does not move at right angles, as its coordinates say it does: no lens with distortion sees the
/// world so, but one before a tilted sensor does.
#[test]
fn a_stage_that_moves_obliquely_is_said() {
    let lens = |k1: f64| BrownConrady {
        pinhole: Pinhole { focal: [1200.0; 2], principal: [640.0, 512.0] },
        radial: [k1, 0.08, 0.0],
        ..BrownConrady::default()
    };
    let camera = |x: f64, k1: f64| {
        let pose = Pose::looking(
            Vector3::new(x, 0.0, 0.0),
            Vector3::new(0.0, 0.0, 90.0),
            Vector3::zeros(),
        );
        PosedCamera { camera_from_world: pose, model: lens(k1).into(), width: 1280, height: 1024 }
    };
    let cameras = [camera(-12.0, -0.17), camera(12.0, -0.2)];
    let rig = Rig { name: "brown".into(), cameras: cameras.into() };
    let chart = LineGrid { pitch: 4.0, columns: 14, rows: 10, ..LineGrid::default() }.into();
    let views = Stage { near: 80.0, far: 100.0, step: 2.5 }.views().unwrap();
    let sound = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.05), 1), None);
    let mut oblique = sound.clone();
    for row in &mut oblique.correspondences {
        row.world.iter_mut().for_each(|world| world.x += 0.05 * (world.z - 90.0));
    }
    assert_eq!(codes(&fitted("auto", sound.clone())), [""; 0]);
    let model = fitted("auto", oblique);
    let choice = model.choice.as_ref().unwrap();
    let expected = if choice.chosen.contains("tilt") { "tilted-sensors" } else { "stage-oblique" };
    assert_eq!(codes(&model), [expected], "{choice:?} {:?}", model.reconstructor.intrinsics());
    let Judgement::Points(found) = model.judge(sound, false, &Silent).unwrap() else { panic!() };
    let linear = found.linear.unwrap();
    assert!(linear.share > 0.9, "{}", linear.share);
    assert!((linear.slopes[0][2] - 0.05).abs() < 0.005, "{:?}", linear.slopes);
}
