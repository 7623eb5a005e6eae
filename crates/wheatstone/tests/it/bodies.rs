//! Bodies whose points are known in three dimensions, against the lists that came with their photographs;
//! AprilGrids against the truth of rendered ones.

use crate::data::folder;
use wheatstone::{
    camera::{PosedCamera, pinhole::Pinhole},
    chart::{
        AnyChart, Chart, ChartSearch, Detection, PictureOf, april_grid::AprilGrid,
        point_list::PointList, rigid::MarkKind, two_level::TwoLevel,
    },
    geometry::{Pixel, Pose, Vector3},
    imaging::{GrayImage, Limits, read_image},
    numeric::random::Random,
    synthetic::{Sensor, render},
};

/// Where one camera's list has each point.
type Seen = Vec<Option<Pixel>>;

/// A set's points, and where each camera's list has them.
fn listed(set: &str, cameras: usize) -> Option<(Vec<[f64; 3]>, Vec<Seen>)> {
    let table = std::fs::read_to_string(folder(set)?.join("points.csv")).unwrap();
    let rows: Vec<Vec<Option<f64>>> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|c| c.parse().ok()).collect())
        .collect();
    let point = |row: &Vec<Option<f64>>| [0, 1, 2].map(|axis| row[2 * cameras + axis].unwrap());
    let seen = |camera: usize| {
        rows.iter().map(|row| Some(Pixel::new(row[2 * camera]?, row[2 * camera + 1]?))).collect()
    };
    Some((rows.iter().map(point).collect(), (0..cameras).map(seen).collect()))
}

/// Finds a set's body in one picture, led by five points that were named to three pixels; gives how many
/// were found and the median distance from the list.
fn led(set: &str, picture: &str, camera: usize, cameras: usize) -> Option<(usize, f64)> {
    let (points, lists) = listed(set, cameras)?;
    let list = &lists[camera];
    let known: Vec<usize> = (0..points.len()).filter(|id| list[*id].is_some()).collect();
    let mut chart = PointList::new(points);
    for named in 0..5 {
        let id = known[(named * known.len() / 5 + 7 * named) % known.len()];
        let about = list[id].unwrap() + nalgebra::Vector2::new(2.0, -2.0);
        chart = chart.with_start(camera, None, (id, about));
    }
    let image = read_image(&folder(set)?.join(picture), Limits::default()).unwrap();
    let ChartSearch::Found(readings) = chart.detect_in(&image, PictureOf { camera, view: "" })
    else {
        panic!("{set}/{picture} is not found");
    };
    let found = &readings[0];
    assert_eq!(found.sigmas.len(), found.points.len());
    let mut apart: Vec<f64> =
        found.points.iter().filter_map(|(id, at)| Some((list[*id]? - at).norm())).collect();
    apart.sort_by(f64::total_cmp);
    Some((found.points.len(), apart[apart.len() / 2]))
}

#[test]
fn bodies_in_photographs_are_found_about_five_named_points() {
    for (set, pictures, least, median) in [
        ("myptv-plate", &["cal1.tif", "cal2.tif", "cal3.tif"][..], 390, 0.5),
        ("myptv-vee", &["cam1.tif", "cam2.tif", "cam3.tif"][..], 475, 0.15),
        ("multidic-cylinder", &["201.jpg", "202.jpg"][..], 140, 0.6),
    ] {
        for (camera, picture) in pictures.iter().enumerate() {
            let path = format!("images/{picture}");
            let Some((found, apart)) = led(set, &path, camera, pictures.len()) else { return };
            assert!(found >= least, "{path}: {found}");
            assert!(apart <= median, "{path}: {apart} px");
        }
    }
}

/// The readings of a set's body in one picture, with so many points named to three pixels; in each, how many
/// points are told and how many of them are more than 4 px from the list.
fn readings(
    set: &str,
    picture: &str,
    (camera, cameras): (usize, usize),
    named: usize,
) -> Option<Vec<(usize, usize)>> {
    let (points, lists) = listed(set, cameras)?;
    let list = &lists[camera];
    let known: Vec<usize> = (0..points.len()).filter(|id| list[*id].is_some()).collect();
    let mut chart = PointList::new(points);
    for at in 0..named {
        let id = known[(at * known.len() / named + 134) % known.len()];
        let about = list[id].unwrap() + nalgebra::Vector2::new(2.0, -2.0);
        chart = chart.with_start(camera, None, (id, about));
    }
    let image = read_image(&folder(set)?.join(picture), Limits::default()).unwrap();
    let ChartSearch::Found(readings) = chart.detect_in(&image, PictureOf { camera, view: "" })
    else {
        return Some(Vec::new());
    };
    let wrong = |(id, at): &&(usize, Pixel)| list[*id].is_some_and(|it| (it - at).norm() > 4.0);
    let count = |it: &Detection| (it.points.len(), it.points.iter().filter(wrong).count());
    Some(readings.iter().map(count).collect())
}

#[test]
fn what_is_told_without_four_named_points_is_right() {
    for (set, pictures) in [
        ("myptv-plate", &["cal1.tif", "cal2.tif", "cal3.tif"][..]),
        ("myptv-vee", &["cam1.tif", "cam2.tif", "cam3.tif"][..]),
        ("multidic-cylinder", &["201.jpg", "202.jpg"][..]),
    ] {
        for (camera, picture) in pictures.iter().enumerate() {
            // The hardest of the plate's pictures tells as much as all.
            if set == "myptv-plate" && camera < 2 {
                continue;
            }
            let of = (camera, pictures.len());
            for named in [0, 1] {
                let Some(told) = readings(set, &format!("images/{picture}"), of, named) else {
                    return;
                };
                // The plate looks the same upside down.
                let right = told.is_empty() || told.iter().any(|(_, wrong)| *wrong == 0);
                assert!(right && told.len() <= 2, "{set} {picture}, {named} named: {told:?}");
                let plate = set == "myptv-plate";
                assert!(
                    !plate || told.len() == if named == 0 { 2 } else { 1 },
                    "{picture}: {told:?}"
                );
            }
        }
    }
}

/// Two chessboards that meet at a right angle. The set's world is left-handed, and has x and z exchanged here.
#[test]
fn an_inside_corner_of_two_walls_is_found_where_its_points_were_clicked() {
    let Some((listed, seen)) = listed("bailus-corner", 2) else { return };
    let clicked = listed.iter().map(|[x, y, z]| [*z, *y, *x]).collect::<Vec<_>>();
    let mut points = Vec::new();
    for y in (-200..=140).step_by(20).map(f64::from) {
        for away in (20..=180).step_by(20).map(f64::from) {
            points.extend([[away, y, 0.0], [0.0, y, away]]);
        }
    }
    let ids: Vec<usize> = clicked.iter().map(|at| index(&points, at)).collect();
    let mut chart = PointList::new(points);
    chart.marks = MarkKind::Corners;
    for (camera, picture) in ["left", "right"].into_iter().enumerate() {
        let path = format!("images/{picture}.jpg");
        let image = read_image(&folder("bailus-corner").unwrap().join(path), Limits::default());
        let image = image.unwrap();
        // Walls that the picture cuts look alike a row aside.
        let of = PictureOf { camera, view: "" };
        assert!(matches!(chart.detect_in(&image, of), ChartSearch::NotFound(_)));
        let mut led = chart.clone();
        for named in [3, 8, 13, 18, 23] {
            let about = seen[camera][named].unwrap() + nalgebra::Vector2::new(2.0, -2.0);
            led = led.with_start(camera, None, (ids[named], about));
        }
        let ChartSearch::Found(readings) = led.detect_in(&image, of) else { panic!("{picture}") };
        assert_eq!(readings.len(), 1);
        let found = &readings[0];
        assert!(found.points.len() >= 205, "{picture}: {}", found.points.len());
        assert_eq!(found.sigmas.len(), found.points.len());
        let at = |id: usize| found.points.iter().find(|point| point.0 == id).unwrap().1;
        let mut apart: Vec<f64> =
            (0..26).map(|row| (at(ids[row]) - seen[camera][row].unwrap()).norm()).collect();
        apart.sort_by(f64::total_cmp);
        assert!(apart[13] < 1.0 && apart[25] < 1.6, "{picture}: {apart:?}");
    }
}

fn index(points: &[[f64; 3]], wanted: &[f64; 3]) -> usize {
    points.iter().position(|point| point == wanted).unwrap()
}

/// A plate of two levels as a camera observes it: dots on two planes.
#[test]
fn both_levels_of_a_plate_are_found_where_they_are() {
    let declared = r#"{"columns": 10, "rows": 7, "pitch": 20.0, "second": [10.0, 10.0, 2.5],
        "second_columns": 9, "second_rows": 6}"#;
    let chart: TwoLevel = serde_json::from_str(declared).unwrap();
    let camera = PosedCamera {
        camera_from_world: Pose::default(),
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    };
    let place = Vector3::new(0.0, 0.0, 300.0);
    let pose = Pose::from_rotation_vector(place, Vector3::new(0.1, -0.35, 0.06));
    let points = chart.points();
    let seen: Vec<Pixel> =
        points.iter().map(|p| camera.project(pose.transform(*p)).unwrap()).collect();
    let mut random = Random::new(4);
    let noise: Vec<f64> = (0..640 * 480).map(|_| 2.0 * random.normal()).collect();
    let image = GrayImage::from_fn(640, 480, |x, y| {
        let at = Pixel::new(x as f64, y as f64);
        let near = seen.iter().map(|it| (it - at).norm()).fold(f64::INFINITY, f64::min);
        let ink = (5.0 - near + 0.5).clamp(0.0, 1.0);
        (200.0 - 160.0 * ink + noise[640 * y + x]) as f32
    });
    let ChartSearch::Found(readings) = chart.detect(&image) else {
        panic!("{:?}", chart.detect(&image))
    };
    assert!(readings.len() <= 2, "{}", readings.len());
    let right = readings.iter().any(|it| {
        it.points.len() == points.len()
            && it.points.iter().all(|(id, at)| (at - seen[*id]).norm() < 0.2)
    });
    assert!(right);
}

/// A rendered grid with the truth of its points.
fn april(rotation: [f64; 3], distance: f64, seed: u64) -> (Detection, Vec<Pixel>) {
    let chart = AnyChart::from(AprilGrid::default());
    let camera = PosedCamera {
        camera_from_world: Pose::default(),
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    };
    let place = Vector3::new(0.0, 0.0, distance);
    let pose = Pose::from_rotation_vector(place, Vector3::from(rotation));
    let image = render(&camera, &chart, &pose, Sensor::default(), &mut Random::new(seed));
    let ChartSearch::Found(readings) = chart.detect(&image) else { panic!("{rotation:?}") };
    assert_eq!(readings.len(), 1);
    let truth = chart.points().into_iter().map(|p| camera.project(pose.transform(p)).unwrap());
    (readings[0].clone(), truth.collect())
}

#[test]
fn april_grids_are_found_to_a_twentieth_of_a_pixel_and_say_how_well() {
    for (seed, (rotation, distance, least)) in [
        ([0.02, 0.03, 0.05], 330.0, 96),
        ([0.8, 0.1, 0.2], 330.0, 96),
        ([0.5, -0.6, 0.9], 390.0, 96),
        ([0.1, 0.1, 2.5], 195.0, 40),
    ]
    .into_iter()
    .enumerate()
    {
        let (found, truth) = april(rotation, distance, seed as u64);
        assert!(found.points.len() >= least, "{rotation:?}: {}", found.points.len());
        let count = 2.0 * found.points.len() as f64;
        let off = |(id, at): &(usize, Pixel)| (at - truth[*id]).norm_squared();
        let rms = (found.points.iter().map(off).sum::<f64>() / count).sqrt();
        assert!(rms < 0.035, "{rotation:?}: {rms} px an axis");
        let pairs = found.points.iter().zip(&found.sigmas);
        let pull = (pairs.map(|(p, s)| off(p) / (s * s)).sum::<f64>() / count).sqrt();
        assert!((0.6..1.4).contains(&pull), "{rotation:?}: errors are {pull} of their sigmas");
    }
}
