//! Chessboards in pictures whose truth is known.

use wheatstone_charts::{
    chart::{
        Chart, ChartSearch,
        chessboard::Chessboard,
        lattice::{Origin, size_in_reason},
    },
    imaging::{GrayImage, filter},
};
use wheatstone_core::geometry::{Homography, Pixel};
use wheatstone_numeric::random::Random;

/// A picture of a chart, through a homography and a lens with one radial coefficient.
struct Scene {
    size: (usize, usize),
    /// From the chart to the undistorted picture.
    view: Homography,
    /// Radial coefficient, in units of half the picture's width.
    k1: f64,
}

const BOARD: Chessboard = Chessboard { columns: 9, rows: 6, pitch: 30.0, origin: Origin::Centre };

impl Scene {
    /// The board's four outermost points at these pixels, clockwise from point 0.
    fn new(board: &Chessboard, size: (usize, usize), corners: [[f64; 2]; 4], k1: f64) -> Self {
        let points = board.points();
        let last = board.columns * board.rows - 1;
        let ids = [0, board.columns - 1, last, last + 1 - board.columns];
        let pairs = [0, 1, 2, 3].map(|corner| {
            let [x, y] = corners[corner];
            (points[ids[corner]].xy(), Pixel::new(x, y))
        });
        Self { size, view: Homography::fit(&pairs).unwrap(), k1 }
    }

    fn middle(&self) -> Pixel {
        Pixel::new(self.size.0 as f64 / 2.0, self.size.1 as f64 / 2.0)
    }

    /// From the distorted picture to the undistorted one.
    fn straighten(&self, at: Pixel) -> Pixel {
        let from_middle = (at - self.middle()) / self.middle().x;
        at + from_middle * (self.k1 * from_middle.norm_squared() * self.middle().x)
    }

    /// The inverse, by steps short enough for the strongest lens here.
    fn see(&self, straight: Pixel) -> Pixel {
        let mut at = straight;
        for _ in 0..50 {
            at += (straight - self.straighten(at)) * 0.4;
        }
        at
    }

    fn truth(&self, board: &Chessboard) -> Vec<Pixel> {
        board.points().iter().map(|p| self.see(self.view.map(p.xy()).unwrap())).collect()
    }

    /// Blurred by 0.7 pixels, with noise of 2 of 255, in whole grey values.
    fn render(&self, board: &Chessboard, seed: u64) -> GrayImage {
        const SUB: usize = 8;
        let back = Homography(self.view.0.try_inverse().unwrap());
        let light = |x: usize, y: usize| {
            let mut sum = 0.0;
            for part in 0..SUB * SUB {
                let offset = |part: usize| (part as f64 + 0.5) / SUB as f64 - 0.5;
                let (dx, dy) = (offset(part % SUB), offset(part / SUB));
                let at = self.straighten(Pixel::new(x as f64 + dx, y as f64 + dy));
                let place = back.map(at).unwrap();
                sum += board.reflectance([place.x, place.y], [0.0, 0.0]).unwrap_or(0.4);
            }
            (30.0 + 190.0 * sum / (SUB * SUB) as f64) as f32
        };
        let sharp = GrayImage::from_fn(self.size.0, self.size.1, light);
        noisy(&filter::gaussian_blur(&sharp, 0.7), seed)
    }
}

fn noisy(image: &GrayImage, seed: u64) -> GrayImage {
    let mut random = Random::new(seed);
    let values = image.values().iter().map(|v| (v + 2.0 * random.normal() as f32).round());
    GrayImage::from_values(image.width(), image.height(), values.collect()).unwrap()
}

fn readings(board: &Chessboard, image: &GrayImage) -> Vec<Vec<(usize, Pixel)>> {
    match board.detect(image) {
        ChartSearch::Found(readings) => readings.into_iter().map(|r| r.points).collect(),
        ChartSearch::NotFound(why) => panic!("{why}"),
    }
}

fn rms(found: &[(usize, Pixel)], truth: &[Pixel]) -> f64 {
    let squares = found.iter().map(|(id, pixel)| (pixel - truth[*id]).norm_squared());
    (squares.sum::<f64>() / found.len() as f64).sqrt()
}

const FRONTAL: [[f64; 2]; 4] = [[120.0, 90.0], [520.0, 105.0], [510.0, 370.0], [115.0, 350.0]];

#[test]
fn corners_of_rendered_boards_are_found_to_a_thirtieth_of_a_pixel() {
    let slanted = [[150.3, 80.7], [470.1, 140.2], [455.8, 320.9], [160.4, 400.6]];
    let turned = [[330.2, 40.6], [570.9, 330.1], [390.5, 455.8], [140.1, 160.3]];
    for (seed, (corners, k1)) in
        [(FRONTAL, 0.0), (slanted, 0.1), (turned, 0.25)].into_iter().enumerate()
    {
        let scene = Scene::new(&BOARD, (640, 480), corners, k1);
        let truth = scene.truth(&BOARD);
        let found = &readings(&BOARD, &scene.render(&BOARD, seed as u64))[0];
        assert_eq!(found.len(), truth.len());
        let rms = rms(found, &truth);
        assert!(rms <= 0.035, "rms {rms} px");
    }
}

#[test]
fn uneven_light_does_not_draw_corners_aside() {
    let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.2);
    let even = scene.render(&BOARD, 10);
    let (across, down) = (0.5 / 640.0, -0.3 / 480.0);
    let light = |x: usize, y: usize| 0.9 + across * (x as f64 - 320.0) + down * (y as f64 - 240.0);
    let lit = GrayImage::from_fn(640, 480, |x, y| even.row(y)[x] * light(x, y) as f32);
    let truth = scene.truth(&BOARD);
    let found = &readings(&BOARD, &lit)[0];
    assert!(rms(found, &truth) < 0.025, "rms {} px", rms(found, &truth));
    // A saddle is drawn aside along the light's slope, by 0.01 to 0.03 px here.
    let mean = found.iter().map(|(id, at)| at - truth[*id]).sum::<nalgebra::Vector2<f64>>();
    assert!(mean.norm() / (found.len() as f64) < 0.005, "{mean}");
}

/// The picture in so many times the light, with that of a highlight added, cut off as a camera does.
fn lit(image: &GrayImage, light: impl Fn(f64, f64) -> f64, highlight: f64) -> GrayImage {
    GrayImage::from_fn(image.width(), image.height(), |x, y| {
        let at = Pixel::new(x as f64, y as f64);
        let away = (at - Pixel::new(330.0, 240.0)).norm() / 35.0;
        let added = highlight * libm::exp(-away * away / 2.0);
        (f64::from(image.row(y)[x]) * light(at.x, at.y) + added).min(255.0) as f32
    })
}

#[test]
fn corners_that_a_highlight_draws_aside_are_left_out() {
    let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.1);
    let truth = scene.truth(&BOARD);
    let image = lit(&scene.render(&BOARD, 30), |_, _| 1.0, 290.0);
    let found = &readings(&BOARD, &image)[0];
    assert!((40..54).contains(&found.len()), "{}", found.len());
    let worst = found.iter().map(|(id, at)| (at - truth[*id]).norm()).fold(0.0, f64::max);
    assert!(worst < 0.3 && rms(found, &truth) < 0.08, "{worst} {}", rms(found, &truth));
}

#[test]
fn an_overexposed_board_loses_no_corner() {
    let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.1);
    let image = scene.render(&BOARD, 31);
    let lamps: [fn(f64, f64) -> f64; 4] = [
        |_, _| 1.3,
        |_, _| 2.0,
        // From one side; and a shadow over a half.
        |x, _| 0.6 + 1.8 * x / 640.0,
        |x, _| if x < 340.0 { 0.4 } else { 1.8 },
    ];
    for (lamp, light) in lamps.into_iter().enumerate() {
        let found = readings(&BOARD, &lit(&image, light, 0.0));
        assert_eq!(found[0].len(), 54, "{lamp}");
    }
}

#[test]
fn errors_are_what_sigmas_say() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 20..24 {
        let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.1);
        let truth = scene.truth(&BOARD);
        let ChartSearch::Found(found) = BOARD.detect(&scene.render(&BOARD, seed)) else { panic!() };
        for ((id, at), sigma) in found[0].points.iter().zip(&found[0].sigmas) {
            squares += (at - truth[*id]).norm_squared() / (2.0 * sigma * sigma);
            count += 1.0;
        }
    }
    let ratio = f64::sqrt(squares / count);
    assert!(count == 216.0 && (0.5..1.3).contains(&ratio), "{ratio} of {count}");
}

#[test]
fn a_board_is_found_among_stronger_corners() {
    let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.0);
    let picture = scene.render(&BOARD, 11);
    // Squares at random beside a board of little contrast: more strong corners than the board has.
    let mut random = Random::new(12);
    let cells: Vec<f32> =
        (0..92 * 54).map(|_| 255.0 * random.uniform(0.0, 2.0).floor() as f32).collect();
    let value = |x: usize, y: usize| {
        let beside = x >= 560 || y < 60;
        if beside { cells[y / 9 * 92 + x / 7] } else { 100.0 + 0.25 * picture.row(y)[x] }
    };
    let found = &readings(&BOARD, &GrayImage::from_fn(640, 480, value))[0];
    assert_eq!(found.len(), 54);
    assert!(rms(found, &scene.truth(&BOARD)) < 0.06);
}

#[test]
fn colours_tell_which_way_up_a_board_of_odd_and_even_counts_is() {
    let upside_down = [FRONTAL[2], FRONTAL[3], FRONTAL[0], FRONTAL[1]];
    for corners in [FRONTAL, upside_down] {
        let scene = Scene::new(&BOARD, (640, 480), corners, 0.05);
        let found = readings(&BOARD, &scene.render(&BOARD, 3));
        assert_eq!(found.len(), 1);
        assert!(rms(&found[0], &scene.truth(&BOARD)) < 0.05);
    }
}

#[test]
fn a_board_that_looks_the_same_upside_down_has_two_readings_upright_first() {
    let board = Chessboard { columns: 6, rows: 4, ..BOARD };
    let scene = Scene::new(&board, (640, 480), FRONTAL, 0.05);
    let found = readings(&board, &scene.render(&board, 4));
    assert_eq!(found.len(), 2);
    assert!(rms(&found[0], &scene.truth(&board)) < 0.05);
    assert!((found[1][0].1 - found[0][23].1).norm() < 1e-9);
}

#[test]
fn a_strongly_bent_board_is_found_whole() {
    // A lens that draws the rim in by a third.
    let wide = [[-60.0, -40.0], [700.0, -30.0], [690.0, 500.0], [-50.0, 520.0]];
    let scene = Scene::new(&BOARD, (640, 480), wide, 0.45);
    let found = readings(&BOARD, &scene.render(&BOARD, 5));
    assert_eq!((found.len(), found[0].len()), (1, 54));
    let rms = rms(&found[0], &scene.truth(&BOARD));
    assert!(rms < 0.05, "rms {rms} px");
}

#[test]
fn a_board_that_leaves_the_picture_keeps_its_ids() {
    let corners = [[-60.0, 90.0], [420.0, 100.0], [425.0, 380.0], [-65.0, 370.0]];
    let scene = Scene::new(&BOARD, (640, 480), corners, 0.0);
    let found = readings(&BOARD, &scene.render(&BOARD, 6));
    assert!(found[0].len() >= 6 * 7, "{} points", found[0].len());
    let truth = scene.truth(&BOARD);
    assert!(found.iter().any(|reading| rms(reading, &truth) < 0.05));
}

#[test]
fn a_board_of_other_counts_is_told_by_them() {
    let scene = Scene::new(&BOARD, (640, 480), FRONTAL, 0.0);
    let other = Chessboard { columns: 8, rows: 6, ..BOARD };
    let ChartSearch::NotFound(why) = other.detect(&scene.render(&BOARD, 7)) else { panic!() };
    assert_eq!(size_in_reason(&why), Some((9, 6)), "{why}");
}

#[test]
fn pictures_without_a_board_are_reported_as_such() {
    let flat = |width, height| GrayImage::from_fn(width, height, |_, _| 90.0);
    for (width, height) in [(1, 1), (1, 40), (2, 2), (3, 700), (13, 13), (320, 240)] {
        assert_eq!(
            BOARD.detect(&flat(width, height)),
            ChartSearch::NotFound("no chessboard found".into())
        );
    }
    let noise = noisy(&flat(800, 600), 8);
    assert!(matches!(BOARD.detect(&noise), ChartSearch::NotFound(_)));
    let mut random = Random::new(9);
    let wild = (0..800 * 600).map(|_| random.uniform(0.0, 255.0) as f32).collect();
    let wild = GrayImage::from_values(800, 600, wild).unwrap();
    assert!(matches!(BOARD.detect(&wild), ChartSearch::NotFound(_)));
}
