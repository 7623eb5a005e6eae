//! Sound captures that look odd: none may be accused.

use nalgebra::Matrix3;
use rayon::prelude::*;
use wheatstone::{
    camera::{PosedCamera, flat_port::FlatPort, pinhole::Pinhole},
    chart::{AnyChart, dot_grid::DotGrid, line_grid::LineGrid, two_level::TwoLevel},
    dataset::Dataset,
    fit::stage::StagePrior,
    geometry::{Pixel, Pose, Vector3},
    numeric::{progress::Silent, random::Random},
    preparation::{
        Preparation,
        checks::{Severity, examine},
    },
    synthetic::{
        Noise, Rig, Stage, StageError, chart_correspondences, misplaced_correspondences,
        random_correspondences,
    },
};

fn accused(data: &Dataset) -> Vec<&'static str> {
    let findings = examine(data).findings;
    findings.iter().filter(|f| f.severity == Severity::Fatal).map(|f| f.code).collect()
}

/// Squeezed along one axis they look like lattices.
#[test]
fn plates_that_are_no_lattice_are_no_column_in_another_unit() {
    let views = Stage { near: 50.0, far: 140.0, step: 15.0 }.views().unwrap();
    for name in ["paper", "glass"] {
        let rig = Rig::named(name, 2).unwrap();
        let pitch = rig.chart_pitch();
        let mut plate = TwoLevel::default();
        (plate.pitch, plate.second) = (pitch, [0.5 * pitch, 0.5 * pitch, 0.2 * pitch]);
        let charts: [AnyChart; 2] = [
            plate.into(),
            DotGrid { pitch, asymmetric: true, columns: 5, ..DotGrid::default() }.into(),
        ];
        for chart in charts {
            let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
            assert_eq!(accused(&data), [""; 0], "{name} {}", chart.label(1.0));
        }
    }
}

/// Parts of a volume are no pictures, and the camera of thirty points is uncertain beyond them.
#[test]
fn a_few_points_at_random_places_are_not_unsynchronised() {
    let chart = LineGrid::default().into();
    let accused: Vec<_> = ["paper", "glass", "water"]
        .into_par_iter()
        .flat_map_iter(|name| (0..10).map(move |seed| (name, seed)))
        .filter_map(|(name, seed)| {
            let rig = Rig::named(name, 2).unwrap();
            let noise = (Noise::Normal(0.2), seed);
            let data = random_correspondences(&rig, &chart, (50.0, 140.0), noise, 40);
            Some((name, seed, accused(&data))).filter(|(_, _, found)| !found.is_empty())
        })
        .collect();
    assert!(accused.is_empty(), "{accused:?}");
}

/// Telephoto cameras all around, each behind an oblique window of its own on a tank of water.
fn around_a_tank(seed: u64) -> Rig {
    let mut random = Random::new(seed);
    let mut about = |spread: f64| spread * random.normal();
    let cameras = [-0.4_f64, 0.02, 0.42].map(|angle| {
        let turn = Pose::from_rotation_vector(Vector3::zeros(), Vector3::new(0.0, -angle, 0.0));
        let centre = turn.rotation * Vector3::new(0.0, 0.0, -60.0);
        let pose = Pose::looking(centre, Vector3::zeros(), Vector3::new(0.0, 0.0, about(0.05)));
        let normal = pose.rotation * (-centre / 60.0 + Vector3::from_fn(|_, _| about(0.25)));
        let lens = Pinhole { focal: [9000.0, 9000.0], principal: [1023.5, 1023.5] };
        let port = FlatPort {
            camera: Box::new(lens.into()),
            normal: normal.normalize(),
            distance: 45.0,
            thickness: 3.0,
            ..FlatPort::default()
        };
        let (width, height) = (2048, 2048);
        PosedCamera { camera_from_world: pose, model: port.into(), width, height }
    });
    Rig { name: "water".into(), cameras: cameras.into() }
}

/// A second place of a camera takes up a part of what a lens formula leaves over behind an oblique window.
#[test]
fn cameras_behind_oblique_windows_did_not_move() {
    let chart = LineGrid { pitch: 0.5, columns: 20, rows: 20, ..LineGrid::default() }.into();
    let views: Vec<_> = (0..7)
        .map(|view| {
            let place = Vector3::new(0.0, 0.0, 0.8 * (f64::from(view) - 3.0));
            (format!("{view}"), Pose { rotation: Matrix3::identity(), translation: place })
        })
        .collect();
    let accused: Vec<_> = (0..80_u64)
        .into_par_iter()
        .filter_map(|seed| {
            let noise = (Noise::Normal(0.04), seed);
            let data = chart_correspondences(&around_a_tank(seed), &chart, &views, noise, None);
            let is_seen = data.correspondences.len() > 1000;
            is_seen.then(|| (seed, accused(&data)))
        })
        .collect();
    assert!(accused.len() > 60, "{}", accused.len());
    let accused: Vec<_> = accused.iter().filter(|(_, found)| !found.is_empty()).collect();
    assert!(accused.is_empty(), "{accused:?}");
}

/// Charts that stand elsewhere by as much as was said are no fault, and their points no outliers.
#[test]
fn errors_of_a_stage_of_the_size_that_was_told_are_left_to_it() {
    const SIGMA: f64 = 0.03;
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid { pitch: 1.0, columns: 8, rows: 6, ..LineGrid::default() }.into();
    let nominal = Stage { near: 40.0, far: 52.0, step: 3.0 }.views().unwrap();
    let prior = StagePrior::of(SIGMA);
    let preparation = Preparation { stage: Some(prior), ..Preparation::default() };
    let lost: Vec<_> = (0..12_u64)
        .into_par_iter()
        .map(|seed| {
            let error = StageError { offset: SIGMA, rotation: 0.0 };
            let places = error.apply(&nominal, 50 + seed);
            let noise = (Noise::Normal(0.03), seed);
            let given = misplaced_correspondences(&rig, &chart, (&places, &nominal), noise, None);
            let prepared = preparation.run(given, 0, &Silent);
            (seed, prepared.map(|prepared| prepared.outliers.len()))
        })
        .filter(|(_, lost)| !lost.as_ref().is_ok_and(|lost| *lost < 5))
        .collect();
    assert!(lost.is_empty(), "{lost:?}");
}

/// It bends a camera that is fitted to all points as a stretched world does.
#[test]
fn one_gross_pixel_is_no_column_in_another_unit() {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage { near: 50.0, far: 140.0, step: 15.0 }.views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    for far in [1500.0, 5000.0] {
        let mut data = data.clone();
        data.correspondences[0].pixels[0] = Some(Pixel::new(far, far));
        assert_eq!(accused(&data), [""; 0], "{far}");
    }
}

/// It looks as pixels that are not square: nobody can see which it is, but it is said.
#[test]
fn a_pitch_that_is_wrong_along_one_side_is_among_what_cannot_be_seen() {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage { near: 50.0, far: 140.0, step: 15.0 }.views().unwrap();
    let mut data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    let told = |data: &Dataset| {
        let said = examine(data).cannot_be_seen;
        said.into_iter().find(|one| one.what.contains("not square")).map(|one| one.check)
    };
    assert_eq!(told(&data), None);
    for row in &mut data.correspondences {
        row.world.iter_mut().for_each(|world| world.x *= 1.1);
    }
    let said = told(&data).unwrap();
    assert!(said.contains("% shorter than along y in every camera"), "{said}");
}
