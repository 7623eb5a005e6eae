//! Charts held by hand: placed, cameras fitted, and judged against the truth.

use crate::data::folder;
use wheatstone::{
    Error,
    camera::{AnyCamera, brown_conrady::BrownConrady},
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::floor,
    fit::bundle::{self, BundleSettings, Gauge, Lenses, SolvedPoses},
    geometry::{Point3, Pose},
    method::AnyMethod,
    numeric::{progress::Silent, random::Random},
    preparation::{Preparation, Prepared},
    synthetic::{
        HandHeld, Noise, Rig, Stage, chart_correspondences, hand_held_correspondences,
        random_correspondences,
    },
    tables::{self, Duplicates},
};

pub(crate) const NOISE: Noise = Noise::Normal(0.1);

pub(crate) fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: 0.75 * rig.chart_pitch(), columns: 11, rows: 9, ..LineGrid::default() }.into()
}

pub(crate) fn waved(rig: &Rig, views: usize, noise: Noise, seed: u64) -> (Dataset, Vec<Point3>) {
    let chart = chart(rig);
    let placements = HandHeld { views, ..HandHeld::default() }.placements(&chart, seed).unwrap();
    hand_held_correspondences(rig, &chart, &placements, (noise, seed))
}

fn prepared(data: &Dataset, lenses: Lenses) -> Prepared {
    let always_model_free = true;
    let bundle_settings = BundleSettings { lenses, always_model_free, ..BundleSettings::default() };
    Preparation { bundle_settings, ..Preparation::default() }.run(data.clone(), 0, &Silent).unwrap()
}

/// Root mean square error of a method after the best rigid motion, over the floor of the pixels.
fn ratio(rig: &Rig, method: &str, data: &Dataset) -> f64 {
    let fit = AnyMethod::named(method).unwrap().fit_checked(data, 0, &Silent).unwrap();
    let exam = random_correspondences(rig, &chart(rig), (70.0, 120.0), (NOISE, 5), 1500);
    let pairs: Vec<(Point3, Point3)> = exam
        .known()
        .map(|(world, row)| (fit.reconstructor.locate(&row.pixels).unwrap().point, world))
        .collect();
    let aligned = Pose::aligning(&pairs).unwrap();
    let square =
        |(found, world): &(Point3, Point3)| (aligned.transform(*found) - world).norm_squared();
    let rms = (pairs.iter().map(square).sum::<f64>() / pairs.len() as f64).sqrt();
    rms / floor(&rig.cameras, &exam).unwrap().rms
}

#[test]
fn brown_reaches_the_floor_on_its_own_rig() {
    let rig = Rig::named("paper", 2).unwrap();
    let (data, _) = waved(&rig, 30, NOISE, 1);
    let ready = prepared(&data, Lenses::Brown);
    assert_eq!(ready.placed.as_ref().unwrap().lens, "brown-conrady");
    let ratio = ratio(&rig, "brown", &ready.data);
    assert!(ratio <= 1.02, "{ratio:.3} times the floor");
}

#[test]
fn the_model_free_camera_reaches_the_floor_on_any_optics() {
    for name in ["paper", "fisheye", "water", "glass"] {
        let rig = Rig::named(name, 2).unwrap();
        let (data, _) = waved(&rig, 30, NOISE, 2);
        let ready = prepared(&data, Lenses::Either);
        assert!(ready.placed.as_ref().unwrap().freed);
        let ratio = ratio(&rig, "neural-camera", &ready.data);
        // The bar is 1.10; 1.00 to 1.01 is what it does.
        assert!(ratio <= 1.05, "{name}: {ratio:.3} times the floor");
    }
}

#[test]
fn lenses_that_are_known_nearly_lead_to_the_minimum_that_is_found_from_nothing() {
    let rig = Rig::named("paper", 2).unwrap();
    let (data, _) = waved(&rig, 12, NOISE, 6);
    let bundle_settings =
        BundleSettings { lenses: Lenses::Brown, all_terms: true, ..BundleSettings::default() };
    let whole = bundle::solve(&data, bundle_settings, &Silent).unwrap();
    let mut lenses: Vec<BrownConrady> = Vec::new();
    for camera in &whole.cameras {
        let AnyCamera::BrownConrady(lens) = camera else { panic!("{camera:?}") };
        let mut off = *lens;
        off.pinhole.focal = lens.pinhole.focal.map(|focal| 1.02 * focal);
        lenses.push(off);
    }
    let near = bundle::solve_near(&data, &lenses, bundle_settings, &Silent).unwrap();
    assert!((near.rms - whole.rms).abs() < 1e-6 * whole.rms);
    assert!((near.baselines[0] - whole.baselines[0]).abs() < 1e-3 * whole.baselines[0]);
    let few = bundle::solve_near(&data, &lenses[..1], bundle_settings, &Silent);
    assert!(matches!(few, Err(Error::TooFew { got: 1, need: 2, .. })));
}

pub(crate) fn solve(data: &Dataset) -> SolvedPoses {
    bundle::solve(data, BundleSettings::default(), &Silent).unwrap()
}

/// The largest distance, in cm, of a point from its place, after the best rigid motion of all.
pub(crate) fn worst_place(solved: &SolvedPoses, places: impl IntoIterator<Item = Point3>) -> f64 {
    let found = solved.data.known().map(|(world, _)| world);
    let pairs: Vec<(Point3, Point3)> = found.zip(places).collect();
    let aligned = Pose::aligning(&pairs).unwrap();
    pairs.iter().map(|(a, b)| (aligned.transform(*a) - b).norm()).fold(0.0, f64::max)
}

#[test]
fn three_cameras_of_which_each_view_has_two() {
    let rig = Rig::named("paper", 3).unwrap();
    let (mut data, places) = waved(&rig, 18, NOISE, 3);
    for row in &mut data.correspondences {
        row.pixels[row.view % 3] = None;
    }
    let seen: Vec<bool> = data.correspondences.iter().map(|row| row.seen_by() > 0).collect();
    let data = data.subset(|index, _| seen[index]);
    let places = places.into_iter().zip(seen).filter(|(_, seen)| *seen).map(|(place, _)| place);
    let bundle_settings = BundleSettings { gauge: Gauge::FirstCamera, ..BundleSettings::default() };
    let solved = bundle::solve(&data, bundle_settings, &Silent).unwrap();
    assert_eq!(solved.baselines.len(), 2);
    let worst = worst_place(&solved, places);
    assert!(worst < 0.3, "a point is {worst:.3} cm off");
}

#[test]
fn sigmas_of_places_are_those_of_repeated_solutions() {
    const TIMES: u64 = 30;
    let rig = Rig::named("paper", 2).unwrap();
    let bundle_settings = BundleSettings {
        gauge: Gauge::FirstCamera,
        lenses: Lenses::Brown,
        ..BundleSettings::default()
    };
    let solved: Vec<_> = (0..TIMES)
        .map(|seed| {
            // The same placements, other noise.
            let chart = chart(&rig);
            let waving = HandHeld { views: 10, ..HandHeld::default() };
            let placements = waving.placements(&chart, 4).unwrap();
            let (data, _) = hand_held_correspondences(&rig, &chart, &placements, (NOISE, seed));
            bundle::solve(&data, bundle_settings, &Silent).unwrap()
        })
        .collect();
    for axis in 0..3 {
        let values: Vec<f64> = solved.iter().map(|s| s.views[6].translation[axis]).collect();
        let mean = values.iter().sum::<f64>() / TIMES as f64;
        let scatter =
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (TIMES - 1) as f64).sqrt();
        let told =
            solved.iter().map(|s| s.views[6].translation_sigma[axis]).sum::<f64>() / TIMES as f64;
        // Thirty tell a scatter to 13 %; terms are chosen by the data.
        assert!((0.65..1.5).contains(&(told / scatter)), "axis {axis}: {told:.4} for {scatter:.4}");
    }
}

#[test]
fn the_first_views_chart_is_the_world_or_the_first_camera() {
    let rig = Rig::named("water", 2).unwrap();
    let (data, _) = waved(&rig, 12, NOISE, 6);
    // Freed charts move a little; the frame stays.
    let ready = prepared(&data, Lenses::Either);
    let first = |row: &&wheatstone::dataset::Correspondence| row.view == 0;
    for row in ready.data.correspondences.iter().filter(first) {
        assert!(row.world.unwrap().z.abs() < 1e-6, "{row:?}");
    }
    let bundle_settings = BundleSettings { gauge: Gauge::FirstCamera, ..BundleSettings::default() };
    let solved = bundle::solve(&data, bundle_settings, &Silent).unwrap();
    // In front of the first camera, at about the distance at which it was held.
    let depths: Vec<f64> = solved.views.iter().map(|view| view.translation[2]).collect();
    assert!(depths.iter().all(|depth| (40.0..160.0).contains(depth)), "{depths:?}");
}

#[test]
fn known_places_are_kept_and_the_others_found_in_their_frame() {
    let rig = Rig::named("paper", 2).unwrap();
    let (mut data, places) = waved(&rig, 14, NOISE, 7);
    for (row, place) in data.correspondences.iter_mut().zip(&places) {
        if row.view == 3 || row.view == 9 {
            (row.world, row.board) = (Some(*place), None);
        }
    }
    let solved = solve(&data);
    assert_eq!(solved.views.len(), 12);
    let off = solved.data.known().zip(&places).map(|((found, row), place)| {
        let off = (found - place).norm();
        assert!(off == 0.0 || row.view != 3 && row.view != 9);
        off * off
    });
    let rms = (off.sum::<f64>() / places.len() as f64).sqrt();
    assert!(rms < 0.1, "{rms:.3} cm");
}

fn add_gross_errors(data: &mut Dataset, share: f64) {
    let mut random = Random::new(1);
    for pixel in data.correspondences.iter_mut().flat_map(|row| row.pixels.iter_mut().flatten()) {
        if random.uniform(0.0, 1.0) < share {
            pixel.x += random.uniform(-60.0, 60.0);
            pixel.y += random.uniform(-60.0, 60.0);
        }
    }
}

/// Charts that are adjusted together with model-free cameras, from which no error is cut off.
#[test]
fn gross_errors_do_not_bend_model_free_cameras() {
    let rig = Rig::named("fisheye", 2).unwrap();
    let (mut data, _) = waved(&rig, 14, NOISE, 8);
    let error = |data: &Dataset| ratio(&rig, "neural-camera", &prepared(data, Lenses::Either).data);
    let without = error(&data);
    add_gross_errors(&mut data, 0.02);
    let with = error(&data);
    assert!(with < 1.1 * without, "{with:.3} against {without:.3}");
}

#[test]
fn gross_errors_do_not_move_charts() {
    let rig = Rig::named("paper", 2).unwrap();
    let (mut data, places) = waved(&rig, 14, NOISE, 8);
    add_gross_errors(&mut data, 0.05);
    let solved = solve(&data);
    let pairs: Vec<(Point3, Point3)> =
        solved.data.known().map(|(world, _)| world).zip(places).collect();
    let aligned = Pose::aligning(&pairs).unwrap();
    let square = |(a, b): &(Point3, Point3)| (aligned.transform(*a) - b).norm_squared();
    let rms = (pairs.iter().map(square).sum::<f64>() / pairs.len() as f64).sqrt();
    assert!(rms < 0.05, "{rms:.3} cm");
}

#[test]
fn parallel_charts_are_refused_with_the_reason() {
    for (name, noise) in
        [("paper", Noise::Quantised), ("glass", Noise::Quantised), ("fisheye", NOISE)]
    {
        let rig = Rig::named(name, 2).unwrap();
        let views = Stage::default().views().unwrap();
        let mut data = chart_correspondences(&rig, &chart(&rig), &views, (noise, 1), None);
        for row in &mut data.correspondences {
            row.board = row.world.take().map(|world| [world.x, world.y]);
        }
        let refused = bundle::solve(&data, BundleSettings::default(), &Silent).unwrap_err();
        let Error::Degenerate { problem, hint } = refused else { panic!("{refused}") };
        assert!(problem.contains("parallel") && hint.contains("tilt"), "{problem}: {hint}");
    }
}

/// One known plane tells no more of the focal length than an unknown one.
#[test]
fn one_known_plane_among_parallel_charts_does_not_help() {
    let rig = Rig::named("paper", 2).unwrap();
    let views = Stage::default().views().unwrap();
    let noise = (Noise::Quantised, 1);
    let mut data = chart_correspondences(&rig, &chart(&rig), &views, noise, None);
    for row in data.correspondences.iter_mut().filter(|row| row.view != 2) {
        row.board = row.world.take().map(|world| [world.x, world.y]);
    }
    let refused = bundle::solve(&data, BundleSettings::default(), &Silent).unwrap_err();
    assert!(refused.to_string().contains("parallel"), "{refused}");
}

#[test]
fn too_few_views_and_unlinked_cameras_are_named() {
    let rig = Rig::named("paper", 2).unwrap();
    let (data, _) = waved(&rig, 2, NOISE, 9);
    assert!(matches!(
        bundle::solve(&data, BundleSettings::default(), &Silent),
        Err(Error::TooFew { need: 3, got: 2, .. })
    ));
    let (mut data, _) = waved(&rig, 12, NOISE, 9);
    for row in &mut data.correspondences {
        row.pixels[usize::from(row.view % 2 == 0)] = None;
    }
    let data = data.subset(|_, row| row.seen_by() > 0);
    let refused = bundle::solve(&data, BundleSettings::default(), &Silent).unwrap_err();
    assert!(refused.to_string().contains("camera 2 has no view in common"), "{refused}");
}

/// A stored corner list, by its columns, as a hand-held points file.
pub(crate) fn corners(name: &str, id: &[&str]) -> Option<Dataset> {
    let text = std::fs::read_to_string(folder(name)?.join("corners.csv")).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |head: &str| heads.iter().position(|h| *h == head).unwrap();
    let mut out = String::from("view,id,board_x,board_y,x1,y1,x2,y2\n");
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let id: Vec<&str> = id.iter().map(|head| cells[column(head)]).collect();
        let rest: Vec<&str> =
            ["X_mm", "Y_mm", "x1", "y1", "x2", "y2"].iter().map(|h| cells[column(h)]).collect();
        out += &format!("{},{},{}\n", cells[column("view")], id.join("_"), rest.join(","));
    }
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    std::fs::write(file.path(), out).unwrap();
    Some(tables::read(file.path(), "mm", Duplicates::Refuse).unwrap())
}

/// A set, the columns that name a point, root mean square, baseline, and fx, fy, cx, cy a camera.
type Expected = (&'static str, &'static [&'static str], f64, f64, [[f64; 4]; 2]);

/// On the same corners OpenCV 5.0's `stereoCalibrate` with five terms a camera, run to convergence
/// (1e-12), found these.
const EXPECTED: [Expected; 3] = [
    (
        "opencv-chessboard",
        &["point"],
        0.271_148,
        99.458_929,
        [
            [532.552_757, 532.352_061, 342.158_804, 234.162_782],
            [534.953_027, 534.452_480, 326.099_376, 249.481_929],
        ],
    ),
    (
        "boofcv-bumblebee2",
        &["point"],
        0.141_200,
        120.366_551,
        [
            [523.466_837, 525.854_780, 313.475_086, 247.179_933],
            [525.636_209, 527.577_962, 318.923_059, 243.005_279],
        ],
    ),
    (
        "calibration-rs-stereo",
        &["i", "j"],
        0.279_809,
        189.918_162,
        [
            [726.438_448, 737.536_193, 524.434_599, 286.665_304],
            [723.738_514, 734.616_039, 515.384_369, 293.920_409],
        ],
    ),
];

#[test]
fn the_minimum_is_that_of_other_tools() {
    let bundle_settings = BundleSettings {
        lenses: Lenses::Brown,
        all_terms: true,
        keep_gross: true,
        ..BundleSettings::default()
    };
    for (name, id, rms, baseline, lenses) in EXPECTED {
        let Some(data) = corners(name, id) else { continue };
        let solved = bundle::solve(&data, bundle_settings, &Silent).unwrap();
        assert!((solved.rms / rms - 1.0).abs() < 1e-3, "{name}: {} for {rms}", solved.rms);
        let found = solved.baselines[0];
        assert!((found / baseline - 1.0).abs() < 1e-3, "{name}: {found} for {baseline}");
        let method = AnyMethod::named("brown").unwrap().preset("fixed").unwrap();
        let fit = method.fit_checked(&solved.data, 0, &Silent).unwrap();
        let text = serde_json::to_value(&fit.reconstructor).unwrap();
        for (camera, known) in lenses.iter().enumerate() {
            let pinhole = &text["cameras"][camera]["model"]["pinhole"];
            for (index, known) in known.iter().enumerate() {
                let part = ["focal", "principal"][index / 2];
                let found = pinhole[part][index % 2].as_f64().unwrap();
                let off = (found / known - 1.0).abs();
                assert!(off < 1e-3, "{name}, camera {}: {part} {found} for {known}", camera + 1);
            }
        }
    }
}

/// Where a lens explains the corners as well as the model-free camera does, its focal lengths and baseline are those
/// of other tools, whose standard deviations (from the adjustment's own covariance) these are.
#[test]
fn charts_stay_where_a_lens_that_holds_puts_them() {
    const SIGMAS: [(&str, f64, f64); 2] =
        [("boofcv-bumblebee2", 0.86, 0.116), ("calibration-rs-stereo", 2.41, 0.253)];
    for (name, focal_sigma, baseline_sigma) in SIGMAS {
        let (_, id, _, baseline, lenses) = EXPECTED.into_iter().find(|set| set.0 == name).unwrap();
        let Some(data) = corners(name, id) else { continue };
        let ready = Preparation::default().run(data, 0, &Silent).unwrap();
        let placed = ready.placed.as_ref().unwrap();
        assert!(!placed.freed, "{name}");
        let off = (placed.baselines[0] - baseline) / baseline_sigma;
        assert!(off.abs() < 2.0, "{name}: the baseline is off by {off} standard deviations");
        let fit = AnyMethod::named("brown").unwrap().fit_checked(&ready.data, 0, &Silent).unwrap();
        let text = serde_json::to_value(&fit.reconstructor).unwrap();
        for (camera, known) in lenses.iter().enumerate() {
            for (axis, known) in known[..2].iter().enumerate() {
                let found = text["cameras"][camera]["model"]["pinhole"]["focal"][axis].as_f64();
                let off = (found.unwrap() - known) / focal_sigma;
                assert!(off.abs() < 2.0, "{name}, camera {}: {found:?} for {known}", camera + 1);
            }
        }
    }
}
