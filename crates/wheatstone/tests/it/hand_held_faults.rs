//! Faults of charts held by hand, whose poses are estimated from the faulty pixels too.

use wheatstone::{
    camera::{brown_conrady::BrownConrady, pinhole::Pinhole},
    chart::{AnyChart, line_grid::LineGrid},
    dataset::{Correspondence, Dataset},
    fit::bundle::BundleSettings,
    geometry::Pixel,
    numeric::progress::Silent,
    preparation::{
        self, Preparation, Prepared,
        checks::{Severity, repair_all},
        examine_every_view,
    },
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences},
};

/// Points of the chart in the hand.
const COLUMNS: usize = 9;
const ROWS: usize = 7;

/// Changes one view of a capture of boards held by hand.
type Change = fn(&mut Dataset, usize);

fn each_row(data: &mut Dataset, view: usize, change: impl Fn(&mut Correspondence)) {
    data.correspondences.iter_mut().filter(|row| row.view == view).for_each(change);
}

fn sized(data: &mut Dataset, view: usize, by: f64) {
    each_row(data, view, |row| row.board = row.board.map(|board| board.map(|side| by * side)));
}

/// Of camera 1.
fn each_pixel(data: &mut Dataset, view: usize, change: impl Fn(Pixel) -> [f64; 2]) {
    each_row(data, view, |row| row.pixels[0] = row.pixels[0].map(|pixel| change(pixel).into()));
}

/// Camera 1 has the pixels of the same point of another view, or of another point of the same.
fn first_camera_from(data: &mut Dataset, view: usize, from: usize, id: impl Fn(usize) -> usize) {
    let before = data.clone();
    each_row(data, view, |row| {
        let meant = Some(id(row.id.as_ref().unwrap().parse().unwrap()).to_string());
        let twin = before.correspondences.iter().find(|c| c.view == from && c.id == meant);
        row.pixels[0] = twin.and_then(|twin| twin.pixels[0]);
    });
}

/// Names, cameras and makers of faults: those of all pictures of a view, and then those of camera 1's.
const IN_THE_HAND: [(&str, &[usize], Change); 10] = [
    ("cameras-swapped", &[0, 1], |data, view| each_row(data, view, |row| row.pixels.swap(0, 1))),
    ("wrong-pitch", &[0, 1], |data, view| sized(data, view, 1.1)),
    ("wrong-pitch", &[0, 1], |data, view| sized(data, view, 0.8)),
    ("units-mixed", &[0, 1], |data, view| sized(data, view, 10.0)),
    ("unsynchronised", &[0], |data, view| first_camera_from(data, view, view + 1, |id| id)),
    ("unsynchronised", &[0], |data, view| first_camera_from(data, view, view - 3, |id| id)),
    // Read turned in camera 1 is as good as in camera 2.
    ("board-turned", &[0, 1], |data, view| {
        first_camera_from(data, view, view, |id| COLUMNS * ROWS - 1 - id)
    }),
    // Shifted by some pixels, likewise but for little.
    ("camera-moved", &[0], |data, view| each_pixel(data, view, |p| [p.x + 3.0, p.y - 5.0])),
    ("pixel-offset", &[0], |data, view| each_pixel(data, view, |p| [p.x + 0.5, p.y + 0.5])),
    ("picture-resized", &[0], |data, view| {
        each_pixel(data, view, |p| [0.5 * p.x - 0.25, 0.5 * p.y - 0.25]);
    }),
];

fn held_by_hand(rig: &str, (cameras, views): (usize, usize), seed: u64) -> Dataset {
    waved(&Rig::named(rig, cameras).unwrap(), (views, 0.1), seed)
}

fn waved(rig: &Rig, (views, noise): (usize, f64), seed: u64) -> Dataset {
    let chart = LineGrid { columns: COLUMNS, rows: ROWS, ..LineGrid::default() };
    let chart = AnyChart::from(LineGrid { pitch: rig.chart_pitch(), ..chart });
    let views = HandHeld { views, ..HandHeld::default() };
    let placements = views.placements(&chart, seed).unwrap();
    hand_held_correspondences(rig, &chart, &placements, (Noise::Normal(noise), seed)).0
}

/// The names of fatal faults, with views and cameras.
fn fatal(data: &Dataset) -> Vec<(&'static str, Vec<String>, Vec<usize>)> {
    let found = preparation::examine(data, BundleSettings::default(), &Silent).unwrap();
    let faults = found.findings.into_iter().filter(|f| f.severity == Severity::Fatal);
    faults.map(|fault| (fault.code, fault.views, fault.cameras)).collect()
}

/// Where a pose was estimated from faulty pixels, it explains a part of them: every explanation has to find it anew.
#[test]
fn faults_of_boards_in_the_hand_have_their_own_names() {
    for seed in 0..2 {
        let sound = held_by_hand("paper", (2, 10), seed);
        assert_eq!(fatal(&sound), []);
        for (name, cameras, make) in &IN_THE_HAND {
            let mut data = sound.clone();
            make(&mut data, 4);
            let faulty = vec![data.views[4].clone()];
            let found = fatal(&data);
            let of_view: Vec<_> = found.iter().filter(|(_, views, _)| *views == faulty).collect();
            let [(code, _, said)] = &*of_view else { panic!("seed {seed}, {name}: {found:?}") };
            let is_told = cameras.iter().all(|camera| said.contains(camera));
            assert!(code == name && is_told, "seed {seed}, {name}: {found:?}");
        }
    }
}

/// A board in a corner of the picture that no other view reaches is judged by a lens whose elements stand off its axis.
#[test]
fn lenses_beside_their_axis_are_no_fault() {
    let mut rig = Rig::named("paper", 2).unwrap();
    for (camera, tangential) in rig.cameras.iter_mut().zip([[0.002, -0.001], [-0.002, 0.002]]) {
        let pinhole = Pinhole { focal: [600.0; 2], principal: [315.0, 244.0] };
        let lens = BrownConrady { radial: [-0.2, 0.08, 0.0], ..BrownConrady::ideal(pinhole) };
        camera.model = BrownConrady { tangential, ..lens }.into();
    }
    for seed in 0..6 {
        let data = waved(&rig, (20, 0.02), seed);
        assert_eq!(fatal(&data), [], "seed {seed}");
    }
}

/// What is wrong shows once the boards are placed; it is put right in what was recorded, and boards are placed anew.
#[test]
fn faults_of_boards_in_the_hand_are_put_right_in_what_was_recorded() {
    let sound = held_by_hand("paper", (2, 10), 0);
    let prepare = |data: &Dataset, insist: bool| {
        let preparation = Preparation { repair: true, insist, ..Preparation::default() };
        preparation.for_method(None).run(data.clone(), 0, &Silent)
    };
    let rms = |prepared: &Prepared| prepared.placed.as_ref().unwrap().rms;
    let best = rms(&prepare(&sound, false).unwrap());
    // One of each kind: a placement takes a while.
    for (name, _, make) in [0, 1, 3, 4, 6, 7].map(|kind| &IN_THE_HAND[kind]) {
        let mut data = sound.clone();
        make(&mut data, 4);
        // An estimate is taken on request only.
        let is_estimate = *name == "wrong-pitch";
        if is_estimate {
            let refused = prepare(&data, false).unwrap_err();
            assert!(refused.to_string().contains("is an estimate"), "{refused}");
        }
        let found = prepare(&data, is_estimate).unwrap();
        let findings = found.findings();
        assert!(findings.iter().any(|one| one.code == *name && one.repaired), "{findings:?}");
        let all = examine_every_view(&data, BundleSettings::default(), &Silent).unwrap();
        let file = preparation::repair(&data, &all, BundleSettings::default(), &Silent).unwrap();
        assert!(file.correspondences.iter().all(|row| row.world.is_none()), "{name}");
        if matches!(*name, "unsynchronised" | "camera-moved") {
            // What the picture should have been, nothing tells.
            assert_eq!(found.left_out, [(data.views[4].clone(), 0)], "{name}");
            continue;
        }
        assert_eq!(found.left_out, [], "{name}: {findings:#?}");
        // An estimate has its error; what is one of a few is right to the bit, or nearly.
        let (sizes, tolerance) = if is_estimate { (1e-2, 1.1) } else { (1e-12, 1.0 + 1e-6) };
        assert!(rms(&found) < tolerance * best, "{name}: {} against {best}", rms(&found));
        for (was, is) in sound.correspondences.iter().zip(&file.correspondences) {
            for (was, is) in was.board.unwrap().into_iter().zip(is.board.unwrap()) {
                assert!((is - was).abs() <= sizes * was.abs(), "{name}: {was} became {is}");
            }
        }
    }
}

/// Labels that are put right make a mirrored rig of mirrored pictures: nothing of a flat chart tells them apart.
#[test]
fn mirrored_pictures_of_a_camera_are_not_put_right_by_their_labels() {
    let mut data = held_by_hand("paper", (2, 10), 2);
    for row in &mut data.correspondences {
        row.pixels[0] = row.pixels[0].map(|p| Pixel::new(639.0 - p.x, p.y));
    }
    // A detector reads from left to right.
    let before = data.clone();
    for row in &mut data.correspondences {
        let id: usize = row.id.as_ref().unwrap().parse().unwrap();
        let other = (id / COLUMNS * COLUMNS + COLUMNS - 1 - id % COLUMNS).to_string();
        let twin = before
            .correspondences
            .iter()
            .find(|twin| twin.view == row.view && twin.id.as_ref() == Some(&other));
        row.pixels[0] = twin.and_then(|twin| twin.pixels[0]);
    }
    let found = preparation::examine(&data, BundleSettings::default(), &Silent).unwrap();
    let mirrored = found.findings.iter().find(|one| one.code == "board-mirrored").unwrap();
    assert!(!mirrored.is_fixable() && mirrored.explanation.contains("pictures are mirrored"));
}

/// Of many views some are placed to look for faults: what is changed are still the rows of all.
#[test]
fn a_sample_of_many_boards_in_the_hand_tells_the_rows_of_all() {
    let sound = held_by_hand("paper", (2, 42), 0);
    let mut data = sound.clone();
    each_row(&mut data, 6, |row| row.pixels.swap(0, 1));
    let found = preparation::examine(&data, BundleSettings::default(), &Silent).unwrap();
    assert_eq!(repair_all(&data, &found.findings), sound);
    assert!(found.cannot_be_seen.iter().any(|one| one.what.contains("21 of 42 views")));
}

/// Of two cameras nobody can tell in which a chart was read turned; of three the other two agree.
#[test]
fn three_cameras_tell_whose_picture_of_a_board_in_the_hand_is_faulty() {
    let sound = held_by_hand("paper", (3, 10), 1);
    for (name, _, make) in IN_THE_HAND.iter().skip(4) {
        let mut data = sound.clone();
        make(&mut data, 4);
        assert_eq!(fatal(&data), [(*name, vec![data.views[4].clone()], vec![0])]);
    }
}

/// Behind optics that are no lens, poses from few views are biased by more than their error bars say.
#[test]
fn few_views_of_boards_in_the_hand_are_named_where_no_lens_model_fits() {
    let is_named = |rig: &str, views: usize| {
        let data = held_by_hand(rig, (2, views), 0);
        let found = preparation::examine(&data, BundleSettings::default(), &Silent).unwrap();
        found.findings.iter().any(|f| f.code == "few-views" && f.severity == Severity::Warning)
    };
    assert!(is_named("water", 6) && !is_named("water", 10) && !is_named("paper", 6));
}
