//! Grids of lines in pictures whose truth is known.

mod rendered;

use rendered::{Scene, clutter};
use wheatstone_charts::{
    chart::{Chart, ChartSearch, Detection, line_grid::LineGrid},
    imaging::{GrayImage, filter::gaussian_blur},
};
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::{random::Random, statistics::percentile};

/// What became of the crossings that are fully visible.
#[derive(Debug)]
struct Outcome {
    visible: usize,
    found: usize,
    /// Found where no reading allows it.
    wrong: usize,
    errors: Vec<f64>,
    why: String,
    seconds: f64,
}

fn outcome(scene: &Scene) -> Outcome {
    let image = scene.render();
    let truth = scene.truth();
    let start = std::time::Instant::now();
    let sighting = scene.chart.detect(&image);
    let seconds = start.elapsed().as_secs_f64();
    let columns = scene.chart.columns;
    let visible: Vec<usize> = (0..truth.len())
        .filter(|id| {
            let near = [id.wrapping_sub(1), id + 1, id.wrapping_sub(columns), id + columns];
            let step = near
                .iter()
                .filter_map(|other| truth.get(*other))
                .map(|other| (other - truth[*id]).norm())
                .fold(f64::INFINITY, f64::min);
            image.contains(truth[*id], 0.45 * step)
        })
        .collect();
    let mut result = Outcome {
        visible: visible.len(),
        found: 0,
        wrong: 0,
        errors: vec![],
        why: String::new(),
        seconds,
    };
    let readings = match sighting {
        ChartSearch::Found(readings) => readings,
        ChartSearch::NotFound(why) => {
            result.why = why;
            return result;
        }
    };
    // The picture leaves symmetries open: the best reading is judged.
    let error = |(id, pixel): &(usize, Pixel)| (pixel - truth[*id]).norm();
    let best = readings
        .iter()
        .min_by(|a, b| {
            let sum = |r: &&Detection| r.points.iter().map(error).sum::<f64>();
            sum(a).total_cmp(&sum(b))
        })
        .unwrap();
    result.errors = best.points.iter().map(error).filter(|e| *e < 2.0).collect();
    result.wrong = best.points.len() - result.errors.len();
    result.found = visible
        .iter()
        .filter(|id| best.points.iter().any(|p| p.0 == **id && error(p) < 2.0))
        .count();
    result
}

fn report(name: &str, scene: &Scene) -> Outcome {
    let out = outcome(scene);
    eprintln!(
        "{name:38} {:4}/{:4} wrong {} median {:.4} p95 {:.4} max {:.3} {:.0} ms {}",
        out.found,
        out.visible,
        out.wrong,
        percentile(&out.errors, 0.5),
        percentile(&out.errors, 0.95),
        percentile(&out.errors, 1.0),
        out.seconds * 1e3,
        out.why,
    );
    out
}

#[test]
#[ignore = "a survey to read, not to pass"]
fn survey() {
    let base = Scene::default();
    report("default", &base);
    report("light", &Scene { grey: (205.0, 35.0), ..base.clone() });
    for (pitch, columns, rows) in
        [(12.0, 21, 15), (15.0, 21, 15), (25.0, 13, 11), (40.0, 9, 7), (70.0, 7, 5)]
    {
        for line_width in [0.04, 0.1, 0.25] {
            if line_width * pitch < 0.99 {
                continue;
            }
            let chart = LineGrid { columns, rows, line_width, pitch: 1.0, ..LineGrid::default() };
            for (cut, light) in [(false, false), (true, false), (true, true)] {
                let grey = if light { (205.0, 35.0) } else { (35.0, 205.0) };
                let scene = Scene {
                    pitch,
                    chart: chart.clone(),
                    cut,
                    grey,
                    tilt: (0.0, 0.0),
                    ..base.clone()
                };
                report(
                    &format!("pitch {pitch} width {line_width} cut {cut} light {light}"),
                    &scene,
                );
            }
        }
    }
    for turn in [0.0, 0.3, 0.6, 5.0, 30.0, 45.0, 80.0] {
        for pitch in [15.0, 25.0, 40.0] {
            let turn = f64::to_radians(turn);
            report(
                &format!("turn {:.1} pitch {pitch} flat", turn.to_degrees()),
                &Scene { turn, pitch, tilt: (0.0, 0.0), ..base.clone() },
            );
        }
    }
}

#[test]
#[ignore = "a survey to read, not to pass"]
fn survey_of_poses() {
    let base = Scene::default();
    for tilt in [15.0, 30.0, 45.0, 60.0] {
        for axis in [0.0, 0.7, 1.6, 3.9] {
            report(
                &format!("tilt {tilt} axis {axis}"),
                &Scene { tilt: (f64::to_radians(tilt), axis), ..base.clone() },
            );
        }
    }
    for k1 in [-0.25, 0.2] {
        for cut in [false, true] {
            let chart = LineGrid { columns: 15, rows: 11, pitch: 1.0, ..LineGrid::default() };
            report(
                &format!("k1 {k1} cut {cut}"),
                &Scene { k1, cut, chart: chart.clone(), ..base.clone() },
            );
            let scene = Scene { k1, pitch: 60.0, chart, cut, ..base.clone() };
            report(&format!("k1 {k1} cut {cut} partial"), &scene);
        }
    }
    for warp in [2.0, 4.0] {
        report(&format!("warp {warp}"), &Scene { warp, ..base.clone() });
        report(&format!("warp {warp} pitch 60"), &Scene { warp, pitch: 60.0, ..base.clone() });
    }
    for shift in [(200.0, 0.0), (-250.0, 120.0), (260.0, -180.0), (0.0, 220.0)] {
        report(&format!("shift {shift:?}"), &Scene { shift, ..base.clone() });
        report(&format!("shift {shift:?} turned"), &Scene { shift, turn: 0.6, ..base.clone() });
    }
    for (noise, blur) in [(0.0, 0.7), (2.0, 0.4), (5.0, 0.7), (2.0, 1.5), (10.0, 1.0)] {
        report(&format!("noise {noise} blur {blur}"), &Scene { noise, blur, ..base.clone() });
    }
    report("contrast 30", &Scene { grey: (100.0, 130.0), ..base.clone() });
    report("contrast 30 light", &Scene { grey: (130.0, 100.0), ..base.clone() });
    report("saturated", &Scene { grey: (60.0, 300.0), ..base.clone() });
}

#[test]
#[ignore = "a survey to read, not to pass"]
fn large_survey() {
    let base = Scene::default();
    for (pitch, columns, rows) in [(400.0, 7, 5)] {
        for line_width in [0.04, 0.1, 0.25] {
            let chart = LineGrid { columns, rows, line_width, pitch: 1.0, ..LineGrid::default() };
            let scene =
                Scene { pitch, chart, size: (4000, 3000), focal: 4000.0, k1: -0.1, ..base.clone() };
            report(&format!("12 MP pitch {pitch} width {line_width}"), &scene);
        }
    }
}

#[test]
#[ignore = "a survey to read, not to pass"]
fn random_survey() {
    let mut random = Random::new(5);
    let (mut visible, mut found, mut wrong, mut errors) = (0, 0, 0, vec![]);
    for seed in 0..120 {
        let mut pick = |low: f64, high: f64| random.uniform(low, high);
        let pitch = libm::exp(pick(libm::log(15.0), libm::log(80.0)));
        let line_width = pick(0.04, 0.25).max(1.2 / pitch);
        let grey = if pick(0.0, 1.0) < 0.7 { (35.0, 205.0) } else { (180.0, 60.0) };
        let scene = Scene {
            chart: LineGrid {
                columns: (pick(200.0, 700.0) / pitch).clamp(4.0, 30.0) as usize,
                rows: (pick(200.0, 500.0) / pitch).clamp(4.0, 30.0) as usize,
                line_width,
                pitch: 1.0,
                ..LineGrid::default()
            },
            pitch,
            turn: pick(-3.2, 3.2),
            tilt: (pick(0.0, if pitch > 30.0 { 1.05 } else { 0.5 }), pick(0.0, 6.3)),
            shift: (pick(-120.0, 120.0), pick(-90.0, 90.0)),
            k1: pick(-0.25, 0.05),
            cut: pick(0.0, 1.0) < 0.4,
            warp: pick(0.0, 3.0),
            grey,
            seed,
            ..Scene::default()
        };
        let out = outcome(&scene);
        if out.wrong > 0 || out.found < out.visible || percentile(&out.errors, 0.5) > 0.04 {
            eprintln!(
                "{seed}: {}/{} wrong {} median {:.3} max {:.2} {} :: {:?}",
                out.found,
                out.visible,
                out.wrong,
                percentile(&out.errors, 0.5),
                percentile(&out.errors, 1.0),
                out.why,
                scene
            );
        }
        visible += out.visible;
        found += out.found;
        wrong += out.wrong;
        errors.extend(out.errors);
    }
    eprintln!(
        "{found}/{visible}, wrong {wrong}, median {:.4} p95 {:.4} p99 {:.4}",
        percentile(&errors, 0.5),
        percentile(&errors, 0.95),
        percentile(&errors, 0.99)
    );
}

/// All crossings found, none wrong, and the middle error within `median` pixels.
fn expect(name: &str, scene: &Scene, median: f64) {
    let out = report(name, scene);
    assert_eq!((out.found, out.wrong), (out.visible, 0), "{name}: {}", out.why);
    assert!(out.visible >= 12, "{name} shows too little");
    assert!(percentile(&out.errors, 0.5) < median, "{name}");
    assert!(percentile(&out.errors, 0.95) < 5.0 * median, "{name}");
}

fn grid(columns: usize, rows: usize, line_width: f64) -> LineGrid {
    LineGrid { columns, rows, line_width, pitch: 1.0, ..LineGrid::default() }
}

#[test]
fn crossings_are_found_at_every_pitch_and_width_in_both_polarities() {
    let cases = [(12.0, 0.1), (15.0, 0.25), (25.0, 0.04), (40.0, 0.1), (70.0, 0.25)];
    for (i, (pitch, line_width)) in cases.into_iter().enumerate() {
        for cut in [false, true] {
            let grey = if (i % 2 == 0) == cut { (205.0, 35.0) } else { (35.0, 205.0) };
            let chart =
                grid((250.0 / pitch) as usize + 3, (180.0 / pitch) as usize + 3, line_width);
            let scene = Scene { pitch, chart, cut, grey, ..Scene::default() };
            expect(&format!("pitch {pitch} width {line_width} cut {cut}"), &scene, 0.025);
        }
    }
}

#[test]
fn lines_along_the_pixels_are_not_drawn_to_them() {
    for degrees in [0.0, 0.3, 0.6, 45.0, 90.0] {
        let turn = f64::to_radians(degrees);
        let scene = Scene { turn, pitch: 25.0, tilt: (0.0, 0.0), ..Scene::default() };
        expect(&format!("turned by {degrees}"), &scene, 0.015);
    }
}

#[test]
fn bent_and_tilted_grids_are_followed() {
    let base = Scene::default();
    let chart = grid(15, 11, 0.1);
    expect("barrel", &Scene { k1: -0.25, chart: chart.clone(), ..base.clone() }, 0.015);
    expect("barrel, cut", &Scene { k1: -0.25, chart, cut: true, ..base.clone() }, 0.015);
    expect("warp", &Scene { warp: 4.0, ..base.clone() }, 0.015);
    for axis in [0.0, 0.8, 1.6] {
        let tilt = (f64::to_radians(60.0), axis);
        expect(&format!("tilt about {axis}"), &Scene { tilt, ..base.clone() }, 0.015);
    }
}

#[test]
fn grids_that_leave_the_picture_are_found_as_far_as_they_are_in_it() {
    for shift in [(200.0, 0.0), (-250.0, 120.0), (260.0, -150.0), (0.0, 220.0)] {
        for turn in [0.1, 0.6] {
            let scene = Scene { shift, turn, ..Scene::default() };
            expect(&format!("shift {shift:?} turn {turn}"), &scene, 0.015);
        }
    }
}

#[test]
fn poor_pictures_are_read() {
    let base = Scene::default();
    expect("noise", &Scene { noise: 6.0, ..base.clone() }, 0.03);
    expect("low contrast", &Scene { grey: (100.0, 130.0), ..base.clone() }, 0.05);
    expect("saturated", &Scene { grey: (60.0, 300.0), ..base.clone() }, 0.02);
    expect("blurred", &Scene { blur: 1.8, ..base.clone() }, 0.03);
}

fn unseen(name: &str, image: &GrayImage) {
    let start = std::time::Instant::now();
    for chart in [LineGrid::default(), grid(30, 30, 0.1), grid(4, 3, 0.1)] {
        let sighting = chart.detect(image);
        assert!(matches!(sighting, ChartSearch::NotFound(_)), "{name}: {sighting:?}");
    }
    eprintln!("{name}: {:.0} ms", start.elapsed().as_secs_f64() * 1e3 / 3.0);
}

#[test]
fn pictures_without_a_grid_are_not_one() {
    for (width, height) in [(1, 1), (2, 3), (24, 24), (640, 1), (200, 150)] {
        unseen("flat", &GrayImage::from_fn(width, height, |_, _| 128.0));
    }
    for seed in 0..6 {
        unseen("clutter", &clutter((640, 480), seed));
        let mut random = Random::new(seed);
        let sigma = [2.0, 50.0, 300.0][seed as usize % 3];
        let mut noise = || (128.0 + sigma * random.normal()).clamp(0.0, 255.0) as f32;
        let values = (0..320 * 240).map(|_| noise()).collect();
        let picture = GrayImage::from_values(320, 240, values).unwrap();
        unseen("noise", &picture);
        unseen("blotches", &gaussian_blur(&picture, 2.0));
    }
    for (pitch, turn) in [(6.0, 0.0), (9.0, 0.3), (17.0, 0.785), (40.0, 0.1), (71.0, 1.2)] {
        let turned = |x: usize, y: usize| {
            let (x, y) = (x as f64 / pitch, y as f64 / pitch);
            (x * libm::cos(turn) + y * libm::sin(turn), y * libm::cos(turn) - x * libm::sin(turn))
        };
        let board = GrayImage::from_fn(400, 300, |x, y| {
            let (u, v) = turned(x, y);
            if (u.floor() + v.floor()).rem_euclid(2.0) == 0.0 { 40.0 } else { 210.0 }
        });
        let stripes = GrayImage::from_fn(400, 300, |x, y| {
            if turned(x, y).0.rem_euclid(1.0) < 0.15 { 40.0 } else { 210.0 }
        });
        let dots = GrayImage::from_fn(400, 300, |x, y| {
            let (u, v) = turned(x, y);
            let (u, v) = (u.rem_euclid(1.0) - 0.5, v.rem_euclid(1.0) - 0.5);
            if u * u + v * v < 0.06 { 40.0 } else { 210.0 }
        });
        for (name, picture) in [("board", board), ("stripes", stripes), ("dots", dots)] {
            unseen(&format!("{name} {pitch}"), &picture);
            unseen(&format!("{name} {pitch} blurred"), &gaussian_blur(&picture, 0.8));
        }
    }
}

/// Errors over the sigmas that are told, root mean square over some views.
fn pull(noise: f64) -> (f64, f64) {
    let (mut sum, mut count, mut told) = (0.0, 0.0, 0.0);
    for (seed, (tilt, pitch)) in
        [(0.05, 40.0), (0.5, 30.0), (0.8, 45.0), (0.3, 22.0)].into_iter().enumerate()
    {
        let scene = Scene {
            tilt: (tilt, 0.5 + seed as f64),
            pitch,
            noise,
            clutter: false,
            seed: seed as u64,
            ..Scene::default()
        };
        let truth = scene.truth();
        let ChartSearch::Found(readings) = scene.chart.detect(&scene.render()) else {
            panic!("{noise}, {tilt}")
        };
        assert_eq!(readings[0].sigmas.len(), readings[0].points.len());
        for ((id, at), sigma) in readings[0].points.iter().zip(&readings[0].sigmas) {
            sum += (at - truth[*id]).norm_squared() / (sigma * sigma);
            told += sigma;
            count += 2.0;
        }
    }
    ((sum / count).sqrt(), 2.0 * told / count)
}

#[test]
fn crossings_say_how_well_they_are_known() {
    for noise in [0.5, 3.0, 8.0] {
        let (pull, told) = pull(noise);
        eprintln!("noise {noise}: errors are {pull:.2} of their sigmas, {told:.4} px");
        assert!((0.6..1.4).contains(&pull), "noise {noise}: errors are {pull} of their sigmas");
    }
}
