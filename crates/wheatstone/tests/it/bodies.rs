//! Bodies whose points are known in three dimensions, against the lists that came with their photographs;
//! AprilGrids against the truth of rendered ones.

use crate::data::folder;
use wheatstone::{
    camera::{PosedCamera, pinhole::Pinhole},
    chart::{
        AnyChart, Chart, Detection, PictureOf, Sighting, april_grid::AprilGrid,
        point_list::PointList,
    },
    geometry::{Pixel, Pose, Vector3},
    imaging::{Limits, read_image},
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
    let Sighting::Seen(readings) = chart.detect_in(&image, PictureOf { camera, view: "" }) else {
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
    let Sighting::Seen(readings) = chart.detect(&image) else { panic!("{rotation:?}") };
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
