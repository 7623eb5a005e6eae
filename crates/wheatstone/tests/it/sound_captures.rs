//! Sound captures that look odd: none may be accused.

use rayon::prelude::*;
use wheatstone::{
    camera::AnyCamera,
    chart::{AnyChart, dot_grid::DotGrid, line_grid::LineGrid, two_level::TwoLevel},
    dataset::Dataset,
    fit::stage::StagePrior,
    geometry::Vector3,
    numeric::progress::Silent,
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

/// A camera's second place takes up a part of what a lens formula leaves over behind an oblique window.
#[test]
fn cameras_behind_oblique_windows_did_not_move() {
    let mut rig = Rig::named("water", 3).unwrap();
    for (index, posed) in rig.cameras.iter_mut().enumerate() {
        let AnyCamera::FlatPort(port) = &mut posed.model else { panic!("a port") };
        let tilt = [[0.14, 0.03], [-0.06, 0.12], [0.02, -0.15]][index];
        port.normal = (port.normal + Vector3::new(tilt[0], tilt[1], 0.0)).normalize();
        port.thickness = 4.0;
    }
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let accused: Vec<_> = (0..12_u64)
        .into_par_iter()
        .filter_map(|seed| {
            let step = [15.0, 22.0, 30.0][seed as usize % 3];
            let views = Stage { near: 50.0, far: 140.0, step }.views().unwrap();
            let data =
                chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.03), seed), None);
            Some((seed, accused(&data))).filter(|(_, found)| !found.is_empty())
        })
        .collect();
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
