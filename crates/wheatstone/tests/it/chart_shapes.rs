//! Charts held by hand that have another shape than was declared.

use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    fit::bundle::BundleSettings,
    geometry::Point3,
    numeric::{progress::Silent, random::Random},
    preparation::{self, checks::Severity},
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

/// Boards whose points lie where `bent` puts them, in space, and are declared to lie where it did not.
fn captured(rig: &str, seed: u64, bent: impl Fn(Point3) -> Point3) -> Dataset {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = LineGrid { columns: 9, rows: 7, ..LineGrid::default() };
    let chart = AnyChart::from(LineGrid { pitch: rig.chart_pitch(), ..chart });
    let views = HandHeld { views: 12, ..HandHeld::default() };
    let placements = views.placements(&chart, seed).unwrap();
    let (mut data, _) = hand_held_correspondences(&rig, &chart, &placements, (NOISE, seed));
    let mut random = Random::new(seed + 100);
    for row in &mut data.correspondences {
        let [x, y] = row.board.unwrap();
        let world = placements[row.view].1.transform(bent(Point3::new(x, y, 0.0)));
        let seen = rig.cameras.iter().map(|camera| camera.project_visible(world));
        row.pixels = seen.map(|pixel| pixel.map(|p| NOISE.apply(p, &mut random))).collect();
    }
    data.correspondences.retain(|row| row.pixels.iter().any(Option::is_some));
    data
}

/// What is said of the chart's shape, with its figure.
fn told(data: &Dataset) -> Option<(String, f64)> {
    let found = preparation::examine(data, BundleSettings::default(), &Silent).unwrap();
    let fatal = found.findings.iter().filter(|finding| finding.severity == Severity::Fatal);
    assert_eq!(fatal.count(), 0, "{:?}", found.findings);
    let shape = found.findings.into_iter().find(|finding| finding.code == "chart-shape")?;
    Some((shape.explanation, shape.figures[0].1))
}

#[test]
fn a_chart_that_is_printed_longer_than_wide_is_measured() {
    for (rig, seed) in [("paper", 1), ("fisheye", 2), ("brown", 3)] {
        for stretch in [1.02, 0.985, 1.1] {
            let data = captured(rig, seed, |p| Point3::new(p.x * stretch, p.y, 0.0));
            let (said, percent) = told(&data).unwrap_or_else(|| panic!("{rig} {stretch}"));
            assert!(said.contains("along x, against along y"), "{said}");
            let off = percent - 100.0 * (stretch - 1.0);
            assert!(off.abs() < 0.3, "{rig} {stretch}: {percent} %");
        }
    }
}

/// As the tags of a grid with other gaps than were declared.
#[test]
fn points_that_lie_elsewhere_on_the_chart_are_told() {
    let pitch = Rig::named("paper", 2).unwrap().chart_pitch();
    let apart = |p: Point3| {
        let of_pair = |along: f64| {
            let index = (along / pitch).round() as i64;
            along + if index.rem_euclid(2) == 0 { -0.1 } else { 0.1 } * pitch
        };
        Point3::new(of_pair(p.x), of_pair(p.y), 0.0)
    };
    let (said, _) = told(&captured("paper", 4, apart)).unwrap();
    assert!(said.contains("has not the shape that was declared"), "{said}");
}

#[test]
fn a_board_that_is_not_flat_is_told() {
    let pitch = Rig::named("paper", 2).unwrap().chart_pitch();
    let bent = |p: Point3| {
        let share = p.x / (4.0 * pitch);
        Point3::new(p.x, p.y, 0.5 * pitch * (share * share - 0.5))
    };
    let (said, _) = told(&captured("paper", 5, bent)).unwrap();
    assert!(said.contains("is not flat"), "{said}");
}

/// Whatever the optics: what a lens formula leaves stays with the picture.
#[test]
fn nothing_is_said_of_charts_of_the_right_shape() {
    for rig in ["paper", "fisheye", "brown", "water", "glass", "bump", "scheimpflug", "tube"] {
        for seed in 0..2 {
            let found = told(&captured(rig, seed, |point| point));
            assert!(found.is_none(), "{rig} {seed}: {found:?}");
        }
    }
}
