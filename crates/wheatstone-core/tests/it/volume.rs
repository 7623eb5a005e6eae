//! Points within and beyond the volume that a fit was shown.

use crate::worlds::chart;
use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    dataset::{
        Dataset,
        volume::{Trust, Volume},
    },
    geometry::{Pixel, PixelColumns, Vector3},
};
use wheatstone_numeric::random::Random;
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

fn world(name: &str, cameras: usize, step: f64, noise: Noise) -> (Rig, AnyChart, Dataset) {
    let rig = Rig::named(name, cameras).unwrap();
    let chart = chart(&rig);
    let views = Stage { step, ..Stage::default() }.views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (noise, 11), Some(400));
    (rig, chart, train)
}

/// The dataset with some pixels not seen.
fn with_gaps(data: &Dataset, share: f64, seed: u64) -> Dataset {
    let mut random = Random::new(seed);
    let mut data = data.clone();
    for pixel in data.correspondences.iter_mut().flat_map(|row| &mut row.pixels) {
        *pixel = pixel.filter(|_| random.uniform(0.0, 1.0) > share);
    }
    data.subset(|_, row| row.seen_by() >= 2)
}

/// The convex hull of points that fill a body: unit normals outwards, how far along each the points reach, and from
/// how far. By trying every plane through three of those that lie furthest in some direction.
struct Hull(Vec<(Vector3, f64, f64)>);

impl Hull {
    fn of(points: &[Vector3]) -> Self {
        let mut random = Random::new(1);
        let mut furthest: Vec<usize> = (0..300)
            .map(|_| {
                let normal = Vector3::new(random.normal(), random.normal(), random.normal());
                let reach = |index: &usize| normal.dot(&points[*index]);
                (0..points.len()).max_by(|a, b| reach(a).total_cmp(&reach(b))).unwrap()
            })
            .collect();
        furthest.sort_unstable();
        furthest.dedup();
        let corners: Vec<Vector3> = furthest.into_iter().map(|index| points[index]).collect();
        let mut faces = Vec::new();
        for (i, a) in corners.iter().enumerate() {
            for (j, b) in corners.iter().enumerate().skip(i + 1) {
                for c in &corners[j + 1..] {
                    let across = (b - a).cross(&(c - a));
                    // Not through three corners in a line.
                    if across.norm() < 1e-3 * (b - a).norm() * (c - a).norm() {
                        continue;
                    }
                    let normal = across.normalize();
                    for normal in [normal, -normal] {
                        if corners.iter().all(|corner| normal.dot(&(corner - a)) < 1e-6) {
                            let reach = points.iter().map(|p| normal.dot(p));
                            let low = reach.clone().fold(f64::INFINITY, f64::min);
                            faces.push((normal, reach.fold(f64::NEG_INFINITY, f64::max), low));
                        }
                    }
                }
            }
        }
        assert!(faces.len() >= 4, "a body has four faces or more");
        Self(faces)
    }

    /// By how much a point lies beyond the hull, as a share of the hull's width; negative inside.
    fn beyond(&self, point: &Vector3) -> f64 {
        let beyond =
            |(normal, high, low): &(Vector3, f64, f64)| (normal.dot(point) - high) / (high - low);
        self.0.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Of the points of `exam` that lie beyond `train` by a share in `from..to` of the hull's width: how
/// many there are, and which share of them has this trust.
fn share(train: &Dataset, exam: &Dataset, (from, to): (f64, f64), is: Trust) -> (usize, f64) {
    let volume = Volume::of(train);
    let places: Vec<Vector3> = train.known().map(|(p, _)| p.coords).collect();
    let hull = Hull::of(&places);
    let asked: Vec<Trust> = exam
        .known()
        .filter(|(p, _)| (from..to).contains(&hull.beyond(&p.coords)))
        .map(|(_, row)| volume.trust(&row.pixels))
        .collect();
    let count = asked.iter().filter(|trust| **trust == is).count();
    (asked.len(), count as f64 / asked.len().max(1) as f64)
}

/// Points in range, beyond it and before it, and all round it; all cameras see them.
fn exams(rig: &Rig, chart: &AnyChart, noise: Noise) -> [Dataset; 4] {
    let wide: AnyChart = LineGrid { pitch: 3.0 * rig.chart_pitch(), ..LineGrid::default() }.into();
    let exam = |chart, range| random_correspondences(rig, chart, range, (noise, 12), 1500);
    [
        exam(chart, (50.0, 140.0)),
        exam(chart, (150.0, 200.0)),
        exam(chart, (20.0, 45.0)),
        exam(&wide, (30.0, 180.0)),
    ]
}

const IN: (f64, f64) = (f64::NEG_INFINITY, 0.0);
const OUT: (f64, f64) = (0.05, f64::INFINITY);

#[test]
fn what_is_inside_is_said_to_be_and_what_is_far_outside_as_well() {
    for name in ["paper", "fisheye", "water", "glass", "bump"] {
        for (cameras, step, noise, gaps) in [
            (2, 15.0, Noise::Normal(0.1), 0.0),
            (2, 15.0, Noise::Quantised, 0.0),
            (2, 45.0, Noise::Normal(0.1), 0.0),
            (5, 15.0, Noise::Normal(0.1), 0.3),
        ] {
            let case = format!("{name}, {cameras} cameras every {step}, {noise}");
            let (rig, chart, train) = world(name, cameras, step, noise);
            let train = with_gaps(&train, gaps, 1);
            for exam in exams(&rig, &chart, noise).map(|exam| with_gaps(&exam, gaps, 2)) {
                let (count, inside) = share(&train, &exam, IN, Trust::Inside);
                assert!(count < 100 || inside > 0.95, "{case}: {inside} of {count} inside");
                // A fisheye's whole pixels tell the last distances apart by 4 cm, so that 2 % of what
                // lies just beyond the edge cannot be known to.
                let rough = name == "fisheye" && noise == Noise::Quantised;
                let bar = if rough { 0.98 } else { 0.99 };
                let (count, outside) = share(&train, &exam, OUT, Trust::Outside);
                assert!(count < 100 || outside > bar, "{case}: {outside} of {count} outside");
            }
        }
    }
}

#[test]
fn the_edge_lies_between() {
    let (rig, chart, train) = world("bump", 2, 15.0, Noise::Normal(0.1));
    let exam = random_correspondences(&rig, &chart, (140.5, 144.0), (Noise::Normal(0.1), 5), 1000);
    let (count, edge) = share(&train, &exam, (0.012, 0.038), Trust::Edge);
    assert!(count > 400 && edge > 0.95, "{edge} of {count}");
}

#[test]
fn pixels_that_nothing_in_the_volume_could_show_are_outside() {
    let (_, _, train) = world("paper", 2, 15.0, Noise::Normal(0.1));
    let volume = Volume::of(&train);
    let row = &train.correspondences[200].pixels;
    assert_eq!(volume.trust(row), Trust::Inside);
    for (camera, x, y) in [(0, 0.0, 60.0), (1, 0.0, -60.0), (0, 300.0, 0.0), (1, 300.0, 0.0)] {
        let mut moved = row.clone();
        moved[camera] = moved[camera].map(|p| Pixel::new(p.x + x, p.y + y));
        assert_eq!(volume.trust(&moved), Trust::Outside, "camera {camera} by {x}, {y}");
    }
    for pixel in [1e6, -1e6, 1e300, f64::MAX] {
        let far = vec![Some(Pixel::new(pixel, pixel)); 2];
        assert_eq!(volume.trust(&far), Trust::Outside);
    }
    assert_eq!(volume.trust(&[row[0], None]), Trust::Outside);
    assert_eq!(volume.trust(&[]), Trust::Outside);
    let nothing = Volume::of(&train.subset(|_, _| false));
    assert_eq!(nothing.trust(row), Trust::Outside);
}

#[test]
fn many_points_are_trusted_as_each_is() {
    let (rig, chart, train) = world("bump", 3, 15.0, Noise::Normal(0.1));
    let volume = Volume::of(&with_gaps(&train, 0.2, 1));
    let mut random = Random::new(4);
    for exam in exams(&rig, &chart, Noise::Normal(0.1)) {
        let mut rows: Vec<Vec<Option<Pixel>>> =
            with_gaps(&exam, 0.1, 2).correspondences.into_iter().map(|row| row.pixels).collect();
        for row in rows.iter_mut().step_by(5) {
            let far = [30.0, 3000.0, 1e9][random.below(3)];
            row[random.below(3)] = Some(Pixel::new(random.uniform(-far, far), 100.0));
        }
        let column = |camera: usize, axis: usize| -> Vec<f64> {
            rows.iter().map(|row| row[camera].map_or(f64::NAN, |pixel| pixel[axis])).collect()
        };
        let columns = [0, 1, 2].map(|camera| [0, 1].map(|axis| column(camera, axis)));
        let pixels = columns.iter().map(|[x, y]| [&x[..], &y[..]]).collect();
        assert_eq!(volume.trust_columns(&PixelColumns::new(pixels)), volume.trust_all(&rows));
    }
}

#[test]
fn cameras_that_never_saw_a_point_together_are_trusted_where_both_were_trained() {
    let (rig, chart, train) = world("paper", 4, 15.0, Noise::Normal(0.1));
    let mut apart = train.clone();
    for row in &mut apart.correspondences {
        // The first two cameras see the near half, the others the far one.
        let near = row.world.unwrap().z < 90.0;
        for (camera, pixel) in row.pixels.iter_mut().enumerate() {
            *pixel = pixel.filter(|_| near == (camera < 2) || row.view == 3);
        }
    }
    let volume = Volume::of(&apart);
    let exam = random_correspondences(&rig, &chart, (112.0, 138.0), (Noise::Normal(0.1), 3), 200);
    for row in exam.correspondences {
        let of = |cameras: [usize; 2]| {
            let mut seen = vec![None; 4];
            for camera in cameras {
                seen[camera] = row.pixels[camera];
            }
            volume.trust(&seen)
        };
        assert_eq!(of([0, 1]), Trust::Outside);
        assert_eq!(of([1, 2]), Trust::Outside);
    }
    let middle = random_correspondences(&rig, &chart, (96.0, 108.0), (Noise::Normal(0.1), 3), 200);
    let trusted = middle
        .correspondences
        .iter()
        .filter(|row| volume.trust(&[None, None, row.pixels[2], row.pixels[3]]) == Trust::Inside);
    assert!(trusted.count() > 150);
}

#[test]
fn gross_errors_among_the_training_points_change_little() {
    let (rig, chart, mut train) = world("paper", 2, 15.0, Noise::Normal(0.1));
    let mut random = Random::new(9);
    for row in train.correspondences.iter_mut().step_by(10) {
        row.pixels[1] = Some(Pixel::new(random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)));
    }
    let exam = exams(&rig, &chart, Noise::Normal(0.1));
    assert!(share(&train, &exam[0], IN, Trust::Inside).1 > 0.95);
    for exam in &exam[1..] {
        let (count, outside) = share(&train, exam, OUT, Trust::Outside);
        assert!(outside > 0.98, "{outside} of {count}");
    }
}

#[test]
fn a_volume_survives_its_file_and_refuses_strangers() {
    let (_, _, train) = world("water", 3, 15.0, Noise::Normal(0.1));
    let volume = Volume::of(&train);
    let text = serde_json::to_string(&volume).unwrap();
    let again: Volume = serde_json::from_str(&text).unwrap();
    assert_eq!(again, volume);
    assert!(again.is_consistent() && again.cameras() == 3);
    assert!(text.len() < 30_000, "{} bytes", text.len());
    let typo = text.replacen('{', r#"{"strange":1,"#, 1);
    assert!(serde_json::from_str::<Volume>(&typo).is_err());
    assert_eq!(serde_json::to_string(&Trust::Outside).unwrap(), r#""outside""#);
    assert_eq!(Trust::Edge.to_string(), "edge");
}
