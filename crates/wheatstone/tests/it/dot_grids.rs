//! Grids of dots: rendered ones against the truth, photographs against counts and hand-made lists.

use crate::data::folder;
use wheatstone::{
    camera::{PosedCamera, pinhole::Pinhole},
    chart::{AnyChart, Chart, ChartSearch, Detection, dot_grid::DotGrid},
    geometry::{Pixel, Pose, Vector3},
    imaging::{GrayImage, Limits, read_image},
    numeric::random::Random,
    synthetic::{Sensor, render},
};

fn readings(chart: &dyn Chart, image: &GrayImage, name: &str) -> Vec<Detection> {
    match chart.detect(image) {
        ChartSearch::Found(readings) => readings,
        ChartSearch::NotFound(why) => panic!("{name}: {why}"),
    }
}

fn camera() -> PosedCamera {
    PosedCamera {
        camera_from_world: Pose::default(),
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    }
}

/// The chart turned by `rotation`, its middle `distance` away.
fn view(chart: &DotGrid, rotation: [f64; 3], distance: f64, seed: u64) -> (GrayImage, Vec<Pixel>) {
    let place = Vector3::new(0.0, 0.0, distance);
    let pose = Pose::from_rotation_vector(place, Vector3::from(rotation));
    let any = AnyChart::from(chart.clone());
    let image = render(&camera(), &any, &pose, Sensor::default(), &mut Random::new(seed));
    let truth = chart.points().into_iter().map(|p| camera().project(pose.transform(p)).unwrap());
    (image, truth.collect())
}

/// Root mean square distance from the truth of the best reading, which must hold every dot.
fn rms(chart: &DotGrid, rotation: [f64; 3], distance: f64, seed: u64) -> (usize, f64) {
    let (image, truth) = view(chart, rotation, distance, seed);
    let found = readings(chart, &image, &format!("{chart:?} {rotation:?}"));
    let off = |reading: &Detection| {
        assert_eq!(reading.points.len(), truth.len(), "{chart:?} {rotation:?}");
        let squares = reading.points.iter().map(|(id, at)| (at - truth[*id]).norm_squared());
        (squares.sum::<f64>() / truth.len() as f64).sqrt()
    };
    (found.len(), found.iter().map(off).fold(f64::INFINITY, f64::min))
}

/// From the front, aslant, and aslant along a diagonal and turned.
const VIEWS: [([f64; 3], f64); 3] =
    [([0.02, 0.03, 0.05], 300.0), ([0.9, 0.1, 0.2], 300.0), ([0.6, -0.7, 0.9], 420.0)];

#[test]
fn dots_of_rendered_grids_are_found_to_a_twentieth_of_a_pixel() {
    let plain = DotGrid { columns: 10, rows: 7, pitch: 20.0, ..DotGrid::default() };
    let large = DotGrid { diameter: Some(15.0), ..plain.clone() };
    let small = DotGrid { diameter: Some(4.0), ..plain.clone() };
    let asymmetric =
        DotGrid { columns: 4, rows: 11, pitch: 15.0, asymmetric: true, ..DotGrid::default() };
    for (chart, count) in [(plain, 2), (large, 2), (small, 2), (asymmetric, 1)] {
        for (seed, (rotation, distance)) in VIEWS.into_iter().enumerate() {
            let (readings, rms) = rms(&chart, rotation, distance, seed as u64);
            assert_eq!(readings, count, "{chart:?} {rotation:?}");
            assert!(rms <= 0.05, "{chart:?} {rotation:?}: rms {rms} px");
        }
    }
}

#[test]
fn a_larger_first_dot_tells_how_the_chart_is_turned() {
    let chart = DotGrid { columns: 7, rows: 7, first_larger: true, ..DotGrid::default() };
    for turn in [0.1, 1.6, 3.2, 4.8] {
        let (readings, rms) = rms(&chart, [0.0, 0.0, turn], 260.0, 4);
        assert_eq!(readings, 1);
        assert!(rms <= 0.05, "rms {rms} px");
    }
    let same = DotGrid { first_larger: false, ..chart };
    assert_eq!(rms(&same, [0.0, 0.0, 0.1], 260.0, 4).0, 4);
}

#[test]
fn light_dots_on_a_dark_ground_are_found() {
    let chart = DotGrid::default();
    let (image, truth) = view(&chart, [0.3, 0.2, 0.1], 300.0, 5);
    let found = readings(&chart, &image.inverted(), "inverted");
    assert!(found[0].points.iter().all(|(id, at)| (truth[*id] - at).norm() < 0.2));
}

#[test]
fn what_is_no_grid_of_dots_is_reported_as_such() {
    let mut random = Random::new(9);
    let noise: Vec<f32> = (0..800 * 600).map(|_| random.uniform(0.0, 255.0) as f32).collect();
    let checkered = |side: usize| {
        GrayImage::from_fn(800, 600, move |x, y| {
            if (x / side + y / side).is_multiple_of(2) { 20.0 } else { 220.0 }
        })
    };
    let pictures = [
        GrayImage::from_values(800, 600, noise).unwrap(),
        checkered(1),
        checkered(4),
        checkered(9),
        checkered(40),
        GrayImage::from_fn(800, 600, |_, _| 0.0),
        GrayImage::from_fn(800, 600, |_, _| 255.0),
        GrayImage::from_fn(2, 900, |_, y| (y % 7) as f32),
        GrayImage::from_fn(1, 1, |_, _| 7.0),
        GrayImage::from_fn(30, 30, |x, y| (x * y) as f32),
    ];
    for (index, picture) in pictures.iter().enumerate() {
        for asymmetric in [false, true] {
            let chart = DotGrid { asymmetric, ..DotGrid::default() };
            assert!(matches!(chart.detect(picture), ChartSearch::NotFound(_)), "picture {index}");
        }
    }
}

#[test]
fn robot_pictures_of_a_plate_of_100_dots_are_found_whole_and_the_right_way_round() {
    let Some(folder) = folder("rct-dot-grid") else { return };
    let chart =
        DotGrid { columns: 10, rows: 10, pitch: 25.4, first_larger: true, ..DotGrid::default() };
    let mut whole = 0;
    for index in 0..15 {
        let path = folder.join(format!("images/{index:02}.png"));
        let image = read_image(&path, Limits::default()).unwrap();
        let ChartSearch::Found(found) = chart.detect(&image) else { continue };
        whole += usize::from(found.len() == 1 && found[0].points.len() == 100);
    }
    assert!(whole >= 14, "{whole} of 15");
}

#[test]
fn a_piece_of_a_stepped_plate_agrees_with_its_list() {
    let Some(folder) = folder("myptv-plate") else { return };
    let table = std::fs::read_to_string(folder.join("points.csv")).unwrap();
    let listed: Vec<Pixel> = table
        .lines()
        .skip(1)
        .filter_map(|line| {
            let mut cells = line.split(',').skip(2).map(str::parse::<f64>);
            Some(Pixel::new(cells.next()?.ok()?, cells.next()?.ok()?))
        })
        .collect();
    let image = read_image(&folder.join("images/cal2.tif"), Limits::default()).unwrap();
    let chart = DotGrid { columns: 6, rows: 23, pitch: 3.0, ..DotGrid::default() };
    let found = &readings(&chart, &image, "cal2")[0].points;
    let nearest = |at: &Pixel| listed.iter().map(|l| (l - at).norm()).fold(f64::INFINITY, f64::min);
    let mut apart: Vec<f64> = found.iter().map(|(_, at)| nearest(at)).collect();
    apart.sort_by(f64::total_cmp);
    // Six pixels wide, pale, with glints: the list itself is off a camera by half a pixel.
    assert!(apart.len() >= 120, "{} of 138", apart.len());
    assert!(apart[apart.len() / 2] <= 0.25, "median {} px", apart[apart.len() / 2]);
}
