//! Plates whose points are known in three dimensions, as a camera observes them.

use std::path::{Path, PathBuf};
use wheatstone_charts::{
    capture::{CameraPictures, Capture, CapturedView},
    chart::{Chart, ChartSearch, Detection, PictureOf, point_list::PointList, two_level::TwoLevel},
    detection::{DetectionSettings, detect_in},
    imaging::GrayImage,
};
use wheatstone_core::{
    camera::{PosedCamera, pinhole::Pinhole},
    geometry::{Pixel, Point3, Pose, Vector3},
};
use wheatstone_numeric::progress::Silent;

/// Where a camera sees points so far away, and its picture of dots there.
fn picture(points: &[Point3], distance: f64) -> (Vec<Pixel>, GrayImage) {
    let camera = PosedCamera {
        camera_from_world: Pose::default(),
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    };
    let place = Vector3::new(0.0, 0.0, distance);
    let pose = Pose::from_rotation_vector(place, Vector3::new(0.05, -0.25, 0.03));
    let seen: Vec<Pixel> =
        points.iter().map(|p| camera.project(pose.transform(*p)).unwrap()).collect();
    let image = GrayImage::from_fn(640, 480, |x, y| {
        let at = Pixel::new(x as f64, y as f64);
        let near = seen.iter().map(|it| (it - at).norm()).fold(f64::INFINITY, f64::min);
        (200.0 - 160.0 * (1500.0 / distance - near + 0.5).clamp(0.0, 1.0)) as f32
    });
    (seen, image)
}

/// Whether a reading has these points where they are.
fn is_right(reading: &Detection, seen: &[Pixel]) -> bool {
    reading.points.len() == seen.len()
        && reading.points.iter().all(|(id, at)| (at - seen[*id]).norm() < 0.5)
}

#[test]
fn a_plate_of_two_levels_is_not_taken_for_its_mirror_image() {
    let plate = |x: f64| {
        let mut plate = TwoLevel::default();
        (plate.columns, plate.rows, plate.second) = (8, 6, [x, 10.0, 4.0]);
        (plate.second_columns, plate.second_rows) = (None, None);
        plate
    };
    let (seen, image) = picture(&plate(10.0).points(), 300.0);
    let ChartSearch::Found(readings) = plate(10.0).detect(&image) else { panic!("not found") };
    assert!(readings.iter().any(|it| is_right(it, &seen)));
    let ChartSearch::NotFound(why) = plate(-10.0).detect(&image) else { panic!("found") };
    assert!(why.contains("mirror"), "{why}");
}

#[test]
fn named_points_of_one_view_do_no_harm_in_others() {
    let centred = |[x, y, z]: &[f64; 3]| [x - 90.0, y - 70.0, *z];
    let chart = PointList::new(PointList::default().points.iter().map(centred).collect());
    let (near, image) = picture(&chart.points(), 300.0);
    let (far, other) = picture(&chart.points(), 450.0);
    let started = |view: Option<&str>| {
        let named = [0, 5, 30, 62, 69];
        named.into_iter().fold(chart.clone(), |it, id| it.with_start(0, view, (id, near[id])))
    };
    let [of_near, of_far] = ["near", "far"].map(|view| PictureOf { camera: 0, view });
    for view in [None, Some("near")] {
        for (image, of, seen) in [(&image, of_near, &near), (&other, of_far, &far)] {
            let ChartSearch::Found(found) = started(view).detect_in(image, of) else {
                panic!("{view:?} {of:?}")
            };
            assert!(found.len() == 1 && is_right(&found[0], seen), "{view:?} {of:?}");
        }
    }
    // Points that are said to be of this picture are believed, and the way out is told.
    let ChartSearch::NotFound(why) = started(Some("far")).detect_in(&other, of_far) else {
        panic!("found")
    };
    assert!(why.contains("column `view`"), "{why}");
}

#[test]
fn pictures_that_contradict_named_points_are_counted() {
    let centred = |[x, y, z]: &[f64; 3]| [x - 90.0, y - 70.0, *z];
    let chart = PointList::new(PointList::default().points.iter().map(centred).collect());
    let [near, far] = [300.0, 450.0].map(|distance| picture(&chart.points(), distance));
    let view = |name: &str| CapturedView {
        name: name.into(),
        world_from_chart: Some(Pose::default()),
        sigma: None,
    };
    let named_elsewhere = |chart: PointList| {
        let files = ["near", "far"].map(|name| Some(PathBuf::from(name)));
        let capture = Capture {
            path: PathBuf::new(),
            unit: "mm".into(),
            chart: chart.into(),
            cameras: vec![CameraPictures { name: "only".into(), pictures: files.into() }],
            views: ["near", "far"].map(view).into(),
        };
        let read = |path: &Path| {
            Ok(if path == Path::new("near") { near.1.clone() } else { far.1.clone() })
        };
        let found = detect_in(&capture, DetectionSettings::default(), &read, &Silent).unwrap();
        let all = found.pictures.iter().flatten().flatten();
        assert!(all.filter(|it| it.outcome.is_ok()).count() == 2);
        found.named_elsewhere(&capture)
    };
    let named = |view: Option<&str>, ids: [usize; 5]| {
        let both = ids.into_iter().zip([0, 5, 30, 62, 69]);
        both.fold(chart.clone(), |it, (id, at)| it.with_start(0, view, (id, near.0[at])))
    };
    let (right, wrong) = ([0, 5, 30, 62, 69], [62, 69, 5, 30, 0]);
    assert_eq!(named_elsewhere(chart.clone()), (0, 0));
    assert_eq!(named_elsewhere(named(Some("near"), right)), (1, 0));
    // Without their view they are where the other picture has others, and wrong ids are wrong in both.
    assert_eq!(named_elsewhere(named(None, right)), (2, 1));
    assert_eq!(named_elsewhere(named(None, wrong)), (2, 2));
}
