//! The clinic on captures with known faults, on captures without, and on real data.

use super::data;
use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::{Correspondence, Dataset},
    evaluate::cross_validate,
    geometry::{Pixel, Point3},
    method::AnyMethod,
    numeric::{progress::Silent, random::Random},
    preparation::checks::{
        ExpectedDistance, Severity, compare_baseline, compare_distance, examine, left_out,
        repair_all,
    },
    synthetic::{
        Noise, Rig, Stage, chart_correspondences,
        fault_survey::{Recorded, Tally, survey},
        faults::{inject, names},
        random_capture::RandomCapture,
    },
    tables::{self, Duplicates},
};

fn codes(data: &Dataset) -> Vec<&'static str> {
    let findings = examine(data).findings;
    findings.iter().filter(|f| f.severity > Severity::Information).map(|f| f.code).collect()
}

#[test]
fn faults_are_named_with_their_place_and_nothing_is_cried_of_clean_captures() {
    // The whole table is in docs/fault-clinic.md; this is a part of it.
    let found = survey(2 * names().len(), 11, Recorded::Charts);
    let captures: usize = found.faults.iter().map(|row| row.captures).sum();
    let rightly: usize = found.faults.iter().map(|row| row.rightly).sum();
    let wrong: Vec<_> = found.faults.iter().flat_map(|row| &row.wrong).collect();
    assert!(
        captures >= 40 && 100 * rightly >= 93 * captures,
        "{rightly} of {captures}: {wrong:#?}"
    );
    for row in &found.clean {
        assert_eq!(row.otherwise, 0, "{}: {:#?}", row.fault, row.wrong);
    }
}

/// Of 128 coordinates of pixels a second place of a camera, and the lens fitted anew, take up a third of the noise.
#[test]
fn noise_of_small_tables_is_no_move_of_a_camera() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let pitch = 2.0 * rig.chart_pitch();
    let chart = LineGrid { pitch, columns: 4, rows: 4, ..LineGrid::default() }.into();
    let views = Stage { near: 60.0, far: 120.0, step: 20.0 }.views().unwrap();
    let accused: Vec<(u64, Vec<&str>)> = (0..60)
        .into_par_iter()
        .map(|seed| {
            let noise = (Noise::Normal(0.2), seed);
            (seed, codes(&chart_correspondences(&rig, &chart, &views, noise, None)))
        })
        .filter(|(_, codes)| codes.contains(&"camera-moved"))
        .collect();
    assert!(accused.is_empty(), "{accused:?}");
}

/// Points at random places have no twins in other views: no explanation may live on that.
#[test]
fn faults_of_tables_whose_views_share_no_point_have_their_own_names() {
    let found = survey(4 * names().len(), 7, Recorded::Scattered);
    let captures: usize = found.faults.iter().map(|row| row.captures).sum();
    let rightly: usize = found.faults.iter().map(|row| row.rightly).sum();
    let wrong: Vec<_> = found.faults.iter().flat_map(|row| &row.wrong).collect();
    assert!(
        captures >= 70 && 100 * rightly >= 94 * captures,
        "{rightly} of {captures}: {wrong:#?}"
    );
    let unsynchronised = |row: &Tally| row.named.keys().any(|name| name.contains("unsynchronised"));
    assert!(!found.faults.iter().any(unsynchronised), "{:#?}", found.faults);
    for row in &found.clean {
        assert!(row.otherwise <= 1, "{}: {:#?}", row.fault, row.wrong);
    }
}

/// Points at random places of a chart have their middle elsewhere than the chart, about which it is tilted.
#[test]
fn a_chart_in_the_other_of_its_two_poses_is_not_said_to_be_misplaced_at_random_places() {
    let is_two_fold = |name: &&str| name.contains("other of its two poses");
    let fault = names().iter().position(is_two_fold).unwrap();
    let faulty = |seed: u64| {
        inject(&RandomCapture::scattered(seed), fault, seed as usize % 3, &mut Random::new(seed))
    };
    let said: Vec<Vec<&str>> =
        (0..60).filter_map(faulty).map(|faulty| codes(&faulty.data)).collect();
    let named = said.iter().filter(|codes| ***codes == ["pose-two-fold"]).count();
    assert!(said.len() >= 20 && 10 * named >= 9 * said.len(), "{said:?}");
    assert!(!said.iter().flatten().any(|code| *code == "view-misplaced"), "{said:?}");
}

/// Faults that are put right leave data that are as good as if there had been none.
#[test]
fn repaired_data_fit_as_well_as_sound_ones() {
    let dlt = AnyMethod::named("brown").unwrap();
    let error =
        |data: &Dataset| cross_validate(&dlt, data, 0, &Silent).unwrap().unwrap().all.median;
    let capture = (0..50)
        .map(RandomCapture::new)
        .find(|c| c.cameras.len() == 2 && c.placements.len() > 6 && c.lost == 0.0)
        .unwrap();
    let sound = error(&capture.dataset());
    for (fault, repairable) in names().into_iter().enumerate().filter(|(_, name)| {
        ["swapped", "180 degrees", "reversed", "permuted", "pitch", "units", "resized", "duplicate"]
            .iter()
            .any(|part| name.contains(part))
    }) {
        let Some(faulty) = inject(&capture, fault, 1, &mut Random::new(5)) else { continue };
        let findings = examine(&faulty.data).findings;
        let named = findings.iter().find(|finding| faulty.codes.contains(&finding.code));
        let named = named.unwrap_or_else(|| panic!("{repairable}: {findings:#?}"));
        assert!(named.is_fixable(), "{repairable}: {}", named.explanation);
        let repaired = repair_all(&faulty.data, &findings);
        assert_eq!(codes(&repaired), Vec::<&str>::new(), "{repairable}");
        let after = error(&repaired);
        assert!(after < 1.2 * sound, "{repairable}: {after} against {sound}");
    }
}

/// What a choice among a few puts right is as if it had never been wrong; a picture of another instant is left out, and
/// that is told.
#[test]
fn repairs_are_exact_and_pictures_left_out_are_told() {
    let lost = |name: &str| name == "one picture of the next view";
    let exact = |name: &str| {
        let parts = ["board turned by 90 degrees in a view", "picture resized", "cameras swapped"];
        parts.iter().any(|part| name.contains(part))
    };
    let (mut repaired_exactly, mut told) = (0, 0);
    for seed in 0..12 {
        let capture = RandomCapture::new(seed);
        for (fault, name) in names().into_iter().enumerate().filter(|(_, n)| exact(n) || lost(n)) {
            let faulty = inject(&capture, fault, 1, &mut Random::new(seed));
            let Some(faulty) = faulty else { continue };
            let findings = examine(&faulty.data).findings;
            let right = |code: &&str| findings.iter().any(|finding| finding.code == *code);
            if !faulty.codes.iter().any(right) {
                continue;
            }
            let left_out = left_out(&faulty.data, &findings);
            if lost(name) {
                let picture = (capture.dataset().views[faulty.views[0]].clone(), faulty.cameras[0]);
                assert_eq!(left_out, [picture], "{name}, seed {seed}");
                told += 1;
                continue;
            }
            assert!(left_out.is_empty(), "{name}, seed {seed}: {left_out:?}");
            // Which of two origins a resized picture has, few points do not tell.
            if findings.iter().any(|finding| finding.is_estimate) {
                assert!(name.contains("resized"), "{name}, seed {seed}");
                continue;
            }
            let (sound, repaired) = (capture.dataset(), repair_all(&faulty.data, &findings));
            assert_eq!(sound.correspondences.len(), repaired.correspondences.len());
            // Rows may have changed places with their labels.
            for is in &repaired.correspondences {
                let at = is.world.unwrap();
                let off = |row: &&Correspondence| (row.world.unwrap() - at).norm();
                let rows = sound.correspondences.iter().filter(|row| row.view == is.view);
                let was = rows.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
                assert!(off(&was) < 1e-6 * at.coords.norm(), "{name}, seed {seed}");
                for (was, is) in was.pixels.iter().zip(&is.pixels) {
                    let gap = was.zip(*is).map(|(was, is)| (was - is).norm());
                    let same = gap.map_or(was.is_none() && is.is_none(), |gap| gap < 1e-6);
                    assert!(same, "{name}, seed {seed}: {was:?} became {is:?}");
                }
            }
            repaired_exactly += 1;
        }
    }
    assert!(repaired_exactly >= 25 && told >= 8, "{repaired_exactly}, {told}");
}

#[test]
fn the_same_data_give_the_same_findings() {
    let capture = RandomCapture::new(3);
    let faulty = inject(&capture, 0, 1, &mut Random::new(1)).unwrap();
    assert_eq!(examine(&faulty.data), examine(&faulty.data));
}

#[test]
fn what_cannot_be_seen_is_said_and_a_measured_baseline_tells() {
    let capture = RandomCapture::new(8);
    let mut data = capture.dataset();
    let truth = (capture.cameras[0].centre() - capture.cameras[1].centre()).norm();
    let sound = examine(&data);
    assert!(sound.cannot_be_seen.len() >= 3);
    assert!((sound.layout[0].baseline / truth - 1.0).abs() < 0.05, "{:?}", sound.layout);
    assert!(compare_baseline(&sound, truth, 0.05).is_none());
    // Every place a tenth too large: nothing in the data says so, the rig does.
    for row in &mut data.correspondences {
        row.world = row.world.map(|world| world * 1.1);
    }
    let scaled = examine(&data);
    assert_eq!(codes(&data), Vec::<&str>::new());
    assert_eq!(compare_baseline(&scaled, truth, 0.05).unwrap().code, "baseline-differs");
}

#[test]
fn data_of_which_nothing_can_be_said_are_not_said_to_be_sound() {
    let whole = RandomCapture::new(1).dataset();
    for kept in [0, 1, 3, 7] {
        let few = whole.subset(|index, _| index < kept);
        assert!(!examine(&few).cannot_be_seen.is_empty());
        assert_eq!(codes(&few).contains(&"too-few-points"), kept < 6, "{kept}");
    }
    let mut blind = whole.clone();
    blind.correspondences.iter_mut().for_each(|row| row.pixels[1] = None);
    assert_eq!(codes(&blind), ["camera-without-pixels"]);
    let mut constant = whole.clone();
    let same = constant.correspondences[0].pixels[0];
    constant.correspondences.iter_mut().for_each(|row| row.pixels[1] = same);
    assert!(codes(&constant).contains(&"pixels-constant"), "{:?}", codes(&constant));
    let mut unplaced = whole.clone();
    for row in &mut unplaced.correspondences {
        row.world = None;
    }
    assert_eq!(codes(&unplaced), ["too-few-points"]);
}

#[test]
fn many_gross_errors_and_random_pairs_are_named() {
    let (rig, chart) = (Rig::named("paper", 2).unwrap(), AnyChart::from(LineGrid::default()));
    let views = Stage::default().views().unwrap();
    let sound = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    assert_eq!(codes(&sound), Vec::<&str>::new());
    let mut random = Random::new(4);
    let mut gross = sound.clone();
    for row in gross.correspondences.iter_mut().filter(|_| random.uniform(0.0, 1.0) < 0.4) {
        let by = Pixel::new(30.0, 20.0) - Pixel::origin();
        row.pixels[1] = row.pixels[1].map(|pixel| pixel + by);
    }
    assert!(codes(&gross).contains(&"gross-errors"), "{:?}", codes(&gross));
    let mut paired = sound.clone();
    let mut order: Vec<usize> = (0..paired.correspondences.len()).collect();
    random.shuffle(&mut order);
    for (row, other) in paired.correspondences.iter_mut().zip(order) {
        row.pixels[1] = sound.correspondences[other].pixels[1];
    }
    let found = examine(&paired).findings;
    let fatal = found.iter().filter(|finding| finding.severity == Severity::Fatal);
    assert!(fatal.clone().any(|finding| finding.code == "unexplained"), "{found:#?}");
}

#[test]
fn half_a_pixel_in_all_cameras_of_some_views_is_said() {
    let (rig, chart) = (Rig::named("paper", 2).unwrap(), AnyChart::from(LineGrid::default()));
    let views = Stage { step: 10.0, ..Stage::default() }.views().unwrap();
    let mut data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    for row in data.correspondences.iter_mut().filter(|row| (2..5).contains(&row.view)) {
        let by = Pixel::new(0.5, 0.5) - Pixel::origin();
        row.pixels.iter_mut().flatten().for_each(|pixel| *pixel += by);
    }
    let found = examine(&data).findings;
    let said: Vec<_> = found.iter().filter(|f| f.code == "pixel-offset").collect();
    assert!(!said.is_empty(), "{found:#?}");
    assert!(said.iter().all(|f| f.severity == Severity::Warning && !f.is_fixable()));
    let views: Vec<&str> = said[0].views.iter().map(String::as_str).collect();
    assert_eq!(views, ["070", "080", "090"]);
}

#[test]
fn a_distance_on_the_stage_tells_another_unit_of_its_axis() {
    let (rig, chart) = (Rig::named("paper", 2).unwrap(), AnyChart::from(LineGrid::default()));
    let views = Stage { near: 50.0, far: 140.0, step: 15.0 }.views().unwrap();
    let mut data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    let ends = [data.views[0].clone(), data.views[data.views.len() - 1].clone()];
    let expected = ExpectedDistance { views: ends, length: 90.0 };
    assert_eq!(compare_distance(&data, &expected).unwrap(), None);
    let unseen = examine(&data).cannot_be_seen;
    assert!(unseen.iter().any(|statement| statement.what.contains("another unit of Z alone")));
    for row in &mut data.correspondences {
        row.world = row.world.map(|world| Point3::new(world.x, world.y, world.z / 10.0));
    }
    let found = compare_distance(&data, &expected).unwrap().unwrap();
    assert_eq!(found.code, "distance-differs");
    assert!(found.explanation.contains("ratio 0.1000"), "{}", found.explanation);
    let unknown = ExpectedDistance { views: ["?".into(), "050".into()], length: 1.0 };
    assert!(compare_distance(&data, &unknown).is_err());
}

#[test]
fn real_data_raise_no_fatal_finding() {
    for set in
        ["myptv-vee", "myptv-plate", "multidic-cylinder", "openptv-multiplane", "bailus-corner"]
    {
        let Some(folder) = data::folder(set) else { continue };
        let data = tables::read(&folder.join("points.csv"), "mm", Duplicates::Refuse).unwrap();
        let findings = examine(&data).findings;
        assert!(findings.iter().all(|f| f.severity < Severity::Fatal), "{set}: {findings:#?}");
    }
}
