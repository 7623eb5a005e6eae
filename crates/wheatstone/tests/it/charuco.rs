//! ChArUco boards: rendered ones against the truth, photographs against counts and a plane.

use crate::data::folder;
use wheatstone::{
    camera::{PosedCamera, pinhole::Pinhole},
    chart::{AnyChart, Chart, ChartSearch, Detection, charuco::Charuco},
    geometry::{Homography, Pixel, Pose, Vector3},
    imaging::{GrayImage, Limits, read_image},
    numeric::random::Random,
    synthetic::{Sensor, render},
};

fn reading(chart: &Charuco, image: &GrayImage) -> Detection {
    match chart.detect(image) {
        ChartSearch::Found(readings) => {
            assert_eq!(readings.len(), 1);
            readings[0].clone()
        }
        ChartSearch::NotFound(why) => panic!("{chart:?}: {why}"),
    }
}

fn view(
    chart: &Charuco,
    rotation: [f64; 3],
    shift: [f64; 3],
    seed: u64,
) -> (GrayImage, Vec<Pixel>) {
    let camera = PosedCamera {
        camera_from_world: Pose::default(),
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    };
    let pose = Pose::from_rotation_vector(Vector3::from(shift), Vector3::from(rotation));
    let any = AnyChart::from(chart.clone());
    let image = render(&camera, &any, &pose, Sensor::default(), &mut Random::new(seed));
    let truth = chart.points().into_iter().map(|p| camera.project(pose.transform(p)).unwrap());
    (image, truth.collect())
}

fn rms(found: &Detection, truth: &[Pixel]) -> f64 {
    let squares = found.points.iter().map(|(id, at)| (at - truth[*id]).norm_squared());
    (squares.sum::<f64>() / found.points.len() as f64).sqrt()
}

#[test]
fn rendered_boards_of_every_dictionary_and_layout_are_found_whole_to_a_twentieth_of_a_pixel() {
    let boards = [
        ("DICT_4X4_50", 22.0, false),
        ("DICT_4X4_50", 22.0, true),
        ("DICT_5X5_100", 20.0, true),
        ("DICT_6X6_250", 18.0, false),
        ("DICT_7X7_1000", 22.0, false),
        ("DICT_ARUCO_ORIGINAL", 22.0, true),
        ("DICT_APRILTAG_36h11", 24.0, false),
    ];
    let rotations = [[0.03, 0.02, 0.06], [0.5, -0.4, 1.9], [-0.6, 0.2, -2.9]];
    for (seed, (dictionary, marker, legacy)) in boards.into_iter().enumerate() {
        let drawn = Charuco { marker, legacy, dictionary: dictionary.into(), ..Charuco::default() };
        // Whoever looks for it does not know the layout.
        let sought = Charuco { legacy: false, ..drawn.clone() };
        let rotation = rotations[seed % 3];
        let (image, truth) = view(&drawn, rotation, [0.0, 0.0, 420.0], seed as u64);
        let found = reading(&sought, &image);
        assert_eq!(found.points.len(), truth.len(), "{drawn:?}");
        let rms = rms(&found, &truth);
        assert!(rms <= 0.05, "{drawn:?}: rms {rms} px");
    }
}

#[test]
fn a_piece_of_a_board_keeps_its_ids() {
    let chart = Charuco::default();
    let (image, truth) = view(&chart, [0.1, 0.1, 0.3], [90.0, 30.0, 300.0], 3);
    let found = reading(&chart, &image);
    assert!((10..truth.len()).contains(&found.points.len()), "{} points", found.points.len());
    let rms = rms(&found, &truth);
    assert!(rms <= 0.05, "rms {rms} px");
}

#[test]
fn boards_of_other_dictionaries_and_plain_pictures_are_no_such_board() {
    let chart = Charuco::default();
    let (image, _) = view(&chart, [0.1, 0.1, 0.3], [0.0, 0.0, 400.0], 3);
    let other = Charuco { dictionary: "DICT_6X6_250".into(), ..chart.clone() };
    assert!(matches!(other.detect(&image), ChartSearch::NotFound(_)));
    let mut random = Random::new(9);
    let noise: Vec<f32> = (0..800 * 600).map(|_| random.uniform(0.0, 255.0) as f32).collect();
    let noise = GrayImage::from_values(800, 600, noise).unwrap();
    let checkered = GrayImage::from_fn(800, 600, |x, y| {
        if (x / 25 + y / 25).is_multiple_of(2) { 20.0 } else { 220.0 }
    });
    for picture in [noise, checkered, GrayImage::from_fn(1, 1, |_, _| 0.0)] {
        assert!(matches!(chart.detect(&picture), ChartSearch::NotFound(_)));
    }
}

#[test]
fn dictionaries_that_are_unknown_or_too_small_are_refused() {
    let board = |dictionary: &str, columns| Charuco {
        dictionary: dictionary.into(),
        columns,
        ..Charuco::default()
    };
    board("DICT_4X4_50", 16).validate().unwrap();
    board("DICT_4X4_50", 18).validate().unwrap_err();
    board("DICT_4X4_51", 8).validate().unwrap_err();
    Charuco { marker: 29.0, ..Charuco::default() }.validate().unwrap_err();
}

#[test]
fn boards_in_a_robots_hand_are_found_whole_and_flat() {
    let Some(folder) = folder("rct-charuco") else { return };
    let chart = Charuco {
        columns: 5,
        rows: 7,
        pitch: 36.195,
        marker: 18.256,
        dictionary: "DICT_6X6_250".into(),
        ..Charuco::default()
    };
    let points = chart.points();
    let mut whole = 0;
    for index in 0..16 {
        let path = folder.join(format!("images/{index:02}.png"));
        let image = read_image(&path, Limits::default()).unwrap();
        let ChartSearch::Found(found) = chart.detect(&image) else { continue };
        let found = &found[0].points;
        let pairs: Vec<_> = found.iter().map(|(id, at)| (points[*id].xy(), *at)).collect();
        let map = Homography::fit(&pairs).unwrap();
        let squares = pairs.iter().map(|(p, at)| (map.map(*p).unwrap() - at).norm_squared());
        let off = (squares.sum::<f64>() / pairs.len() as f64).sqrt();
        // The lens bends lines by a pixel; a wrong id would be 60 pixels off.
        assert!(off < 1.2, "picture {index}: {off} px off a plane");
        whole += usize::from(found.len() == 24);
    }
    assert!(whole >= 14, "{whole} of 16");
}
