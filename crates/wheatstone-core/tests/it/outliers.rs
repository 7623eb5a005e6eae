//! Gross outliers of known number and kind.

use crate::worlds::chart;
use wheatstone_core::{
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    preparation::outliers::{Screening, screen},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{
    GrossError, Noise, Region, Rig, Stage, chart_correspondences, with_gross_errors,
};

fn charts(rig: &str, cameras: usize, noise: Noise, most: usize) -> Dataset {
    let rig = Rig::named(rig, cameras).unwrap();
    let views = Stage::default().views().unwrap();
    chart_correspondences(&rig, &chart(&rig), &views, (noise, 5), Some(most))
}

fn named(screening: &Screening) -> Vec<usize> {
    screening.outliers.iter().map(|outlier| outlier.row).collect()
}

/// Shares of the bad rows that were named and of the good ones that were accused.
fn shares(screening: &Screening, bad: &[usize], rows: usize) -> (f64, f64) {
    let named = named(screening);
    let hits = bad.iter().filter(|row| named.contains(row)).count();
    let alarms = named.len() - hits;
    (hits as f64 / bad.len() as f64, alarms as f64 / (rows - bad.len()) as f64)
}

/// One of each kind that a table of points can have.
const MIXED: [GrossError; 6] = [
    GrossError::Shift(20.0),
    GrossError::Shift(200.0),
    GrossError::Anywhere,
    GrossError::Mismatch,
    GrossError::Mislabel,
    GrossError::Misplace,
];

#[test]
fn three_in_ten_bad_points_are_named_through_any_optics() {
    for rig in ["paper", "fisheye", "water", "glass", "bump"] {
        let data = charts(rig, 2, Noise::Normal(0.1), 400);
        let (spoilt, bad) = with_gross_errors(&data, &MIXED.map(|k| (k, 20)), Region::All, 8);
        let (found, alarms) = shares(&screen(&spoilt, 1, &Silent).unwrap(), &bad, 400);
        assert!(found >= 0.98 && alarms <= 0.01, "{rig}: {found} named, {alarms} false");
    }
}

#[test]
fn half_the_points_may_be_mislabelled() {
    let data = charts("paper", 2, Noise::Quantised, 400);
    let half = [(GrossError::Mislabel, 200)];
    let (spoilt, bad) = with_gross_errors(&data, &half, Region::All, 2);
    let (found, alarms) = shares(&screen(&spoilt, 1, &Silent).unwrap(), &bad, 400);
    assert!(found >= 0.98 && alarms <= 0.01, "{found} named, {alarms} false");
}

#[test]
fn bad_points_in_one_corner_or_one_view_are_named() {
    let data = charts("paper", 3, Noise::Normal(0.1), 400);
    for (region, count) in [(Region::Corner, 40), (Region::View(0), 20), (Region::View(6), 25)] {
        let kinds = [(GrossError::Shift(20.0), count / 2), (GrossError::Mismatch, count / 2)];
        let (spoilt, bad) = with_gross_errors(&data, &kinds, region, 4);
        let (found, alarms) = shares(&screen(&spoilt, 1, &Silent).unwrap(), &bad, 400);
        assert!(found >= 0.98 && alarms <= 0.01, "{region:?}: {found} named, {alarms} false");
    }
}

#[test]
fn good_points_lose_nothing() {
    for (rig, noise) in [
        ("paper", Noise::Quantised),
        ("paper", Noise::None),
        ("fisheye", Noise::Normal(0.1)),
        ("glass", Noise::Normal(0.1)),
        ("bump", Noise::Normal(0.1)),
    ] {
        let data = charts(rig, 3, noise, 300);
        let screening = screen(&data, 1, &Silent).unwrap();
        assert_eq!(screening.clean(&data), data, "{rig} {noise}");
        let sigma = screening.pixel_sigma[0];
        assert!(
            noise == Noise::None || (sigma / noise.sigma() - 1.0).abs() < 0.35,
            "{rig} {sigma}"
        );
    }
}

#[test]
fn the_guilty_camera_is_named_and_the_others_keep_their_pixels() {
    let mut data = charts("paper", 3, Noise::Normal(0.1), 300);
    data.correspondences[7].pixels[1].as_mut().unwrap().x += 400.0;
    data.correspondences[9].pixels = vec![None, None, Some(Pixel::new(3.0, 4.0))];
    data.correspondences[11].pixels[0] = None;
    let screening = screen(&data, 1, &Silent).unwrap();
    let guilty: Vec<(usize, Vec<usize>)> =
        screening.outliers.iter().map(|o| (o.row, o.cameras.clone())).collect();
    assert_eq!(guilty, [(7, vec![1]), (9, vec![2])]);
    assert!((screening.outliers[0].residual - 400.0).abs() < 2.0);
    let first = &screening.outliers[0];
    assert_eq!(first.view, data.views[data.correspondences[7].view]);
    assert_eq!(first.id, data.correspondences[7].id);
    let mut expected = data.clone();
    expected.correspondences[7].pixels[1] = None;
    expected.correspondences.remove(9);
    assert_eq!(screening.clean(&data), expected);
}

/// So far away that a camera fitted to the others cannot tell where it would see it: a typing error, or what stands
/// for "unknown". Pixels of all cameras tell; a point that lies apart in them too is no outlier.
#[test]
fn places_beyond_all_others_are_named() {
    for (rig, seed) in [("paper", 1), ("fisheye", 2), ("water", 3), ("scheimpflug", 4)] {
        let clean = charts(rig, 2, Noise::Normal(0.1), 400);
        assert_eq!(named(&screen(&clean, 1, &Silent).unwrap()), [0; 0], "{rig}");
        for place in [[999.0; 3], [-999.0; 3], [-999.0, 0.0, 0.0], [60.0, 0.0, 90.0]] {
            for bad in [vec![100], vec![3, 150, 250]] {
                let mut data = clean.clone();
                for row in &bad {
                    data.correspondences[*row].world = Some(Point3::from(place));
                }
                let screening = screen(&data, seed, &Silent).unwrap();
                assert_eq!(named(&screening), bad, "{rig} {place:?}");
                assert!(screening.outliers.iter().all(|o| o.cameras == [0, 1]), "{rig} {place:?}");
            }
        }
    }
}

/// The same world in other words: left-handed, in thousandths of the unit, far from the origin.
#[test]
fn neither_unit_nor_handedness_nor_place_nor_a_name_matters() {
    let data = charts("paper", 2, Noise::Normal(0.1), 300);
    let (spoilt, bad) = with_gross_errors(&data, &MIXED.map(|k| (k, 6)), Region::All, 3);
    let mut other = spoilt;
    other.views.clear();
    for row in &mut other.correspondences {
        (row.view, row.id) = (0, None);
        row.world = row.world.map(|w| Point3::new(-1000.0 * w.x, 1000.0 * w.y, 1000.0 * w.z + 5e5));
    }
    assert_eq!(named(&screen(&other, 1, &Silent).unwrap()), bad);
}

#[test]
fn two_planes_and_scattered_points_are_enough() {
    let data = charts("paper", 2, Noise::Normal(0.1), 400);
    let ends = data.subset(|_, point| point.view == 0 || point.view == 6);
    let few = data.subset(|row, _| row % 8 == 0);
    for some in [ends, few] {
        let (spoilt, bad) =
            with_gross_errors(&some, &[(GrossError::Jump(100.0), 5)], Region::All, 3);
        assert_eq!(named(&screen(&spoilt, 1, &Silent).unwrap()), bad);
    }
}

#[test]
fn nobody_is_accused_where_nothing_can_be_known() {
    let data = charts("paper", 2, Noise::Normal(0.1), 400);
    let few = data.subset(|row, _| row < 20);
    let plane = data.subset(|_, point| point.view == 3);
    let mut unknown = data.clone();
    unknown.correspondences.iter_mut().for_each(|row| row.world = None);
    let mut blind = data.clone();
    blind.correspondences.iter_mut().for_each(|row| row.pixels[1] = None);
    let mut equal = data.clone();
    equal.correspondences.iter_mut().for_each(|row| *row = data.correspondences[0].clone());
    let empty = Dataset { correspondences: Vec::<Correspondence>::new(), ..data };
    for data in [few, plane, unknown, blind, equal, empty] {
        let screening = screen(&data, 1, &Silent).unwrap();
        assert_eq!(screening.clean(&data), data);
    }
}

#[test]
fn the_same_seed_gives_the_same_screening() {
    let data = charts("glass", 2, Noise::Normal(0.1), 300);
    let (spoilt, _) = with_gross_errors(&data, &MIXED.map(|k| (k, 6)), Region::All, 3);
    let once = screen(&spoilt, 6, &Silent).unwrap();
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| screen(&spoilt, 6, &Silent).unwrap()), once);
}
