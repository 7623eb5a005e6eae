//! Cameras that creep during a capture.

use wheatstone::{
    chart::line_grid::LineGrid,
    dataset::Dataset,
    geometry::Pixel,
    numeric::random::Random,
    preparation::checks::{Severity, examine},
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

/// Planes of a stage in some order, the first camera's picture creeping by so many pixels in all.
fn capture(order: &[usize], drift: f64, seed: u64) -> Dataset {
    let rig = Rig::named("pinhole", 2).unwrap();
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let planes = Stage { near: 50.0, far: 140.0, step: 11.25 }.views().unwrap();
    let views: Vec<_> = order
        .iter()
        .enumerate()
        .map(|(time, plane)| (format!("{time}"), planes[*plane].1))
        .collect();
    let noise = (Noise::Normal(0.08), seed);
    let mut data = chart_correspondences(&rig, &chart, &views, noise, None);
    for row in &mut data.correspondences {
        let by = drift * row.view as f64 / (order.len() - 1) as f64;
        row.pixels[0] = row.pixels[0].map(|pixel| Pixel::new(pixel.x + by, pixel.y));
    }
    data
}

fn shuffled(seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..9).collect();
    Random::new(seed).shuffle(&mut order);
    order
}

fn codes(data: &Dataset) -> Vec<&'static str> {
    let findings = examine(data).findings;
    findings.iter().filter(|f| f.severity > Severity::Information).map(|f| f.code).collect()
}

#[test]
fn a_drift_is_named_where_the_planes_were_shown_in_no_order() {
    for seed in 0..6 {
        let order = shuffled(seed);
        assert_eq!(codes(&capture(&order, 0.0, seed)), [""; 0], "{seed}");
        for drift in [1.0, -4.0, 12.0] {
            let found = examine(&capture(&order, drift, seed)).findings;
            let found = found.iter().find(|f| f.severity > Severity::Information).unwrap();
            assert_eq!((found.code, &found.cameras[..]), ("camera-drifted", &[0][..]), "{seed}");
            let told = found.figures.iter().find(|(name, _)| name == "drift of x, px").unwrap().1;
            assert!((told - drift).abs() < 0.05 + 0.03 * drift.abs(), "{seed}: {told} for {drift}");
        }
    }
}

/// In order of depth a drift looks as other cameras do. It is said, and one plane that is shown again tells.
#[test]
fn a_drift_in_step_with_the_stage_is_told_by_a_plane_that_is_shown_again() {
    let in_order: Vec<usize> = (0..9).collect();
    let said = |data: &Dataset| {
        examine(data).cannot_be_seen.iter().any(|one| one.what.contains("drifts while the stage"))
    };
    assert!(said(&capture(&in_order, 1.0, 1)));
    assert!(!said(&capture(&shuffled(3), 1.0, 1)));
    let again = [&in_order[..], &[0]].concat();
    assert_eq!(codes(&capture(&again, 2.0, 1)), ["camera-drifted"]);
    // Shown twice at rest it is no copy.
    assert_eq!(codes(&capture(&again, 0.0, 1)), [""; 0]);
}
