//! Real tables of matched pixels, 2 to 4 cameras. The bars are what was measured, rounded up; they
//! only ever get tighter.

use super::data;
use wheatstone::{
    evaluate::cross_validate,
    method::AnyMethod,
    numeric::progress::Silent,
    preparation::outliers::screen,
    tables::{self, Duplicates},
};

/// Held-out error of DLT on a data set, in millimetres, and how many cameras it has.
fn held_out(set: &str) -> Option<(f64, usize)> {
    let path = data::folder(set)?.join("points.csv");
    let data = tables::read(&path, "mm", Duplicates::Refuse).unwrap();
    let dlt = AnyMethod::named("dlt").unwrap();
    let scores = cross_validate(&dlt, &data, 0, &Silent).unwrap().unwrap();
    assert_eq!(scores.all.located, scores.all.n);
    Some((scores.all.rms, data.cameras))
}

#[test]
fn dlt_on_held_out_slabs_of_real_charts() {
    for (set, cameras, bar) in [
        ("myptv-vee", 3, 0.90),
        ("myptv-plate", 3, 0.10),
        ("multidic-cylinder", 2, 0.85),
        ("openptv-multiplane", 4, 0.50),
        ("bailus-corner", 2, 3.0),
    ] {
        if let Some((rms, found)) = held_out(set) {
            assert_eq!(found, cameras, "{set}");
            assert!(rms < bar, "{set}: {rms} mm");
        }
    }
}

/// Of real points hardly any are accused. On the plate it is right to: the pictures show that three
/// dots of its row Y = 33 mm hardly stand out of the noise.
#[test]
fn real_points_are_accused_with_good_reason_only() {
    for (set, accused) in [
        ("myptv-plate", Some([15.0, 34.0, 53.0])),
        ("multidic-cylinder", None),
        ("bailus-corner", None),
    ] {
        let Some(folder) = data::folder(set) else { continue };
        let data = tables::read(&folder.join("points.csv"), "mm", Duplicates::Refuse).unwrap();
        let screening = screen(&data, 0, &Silent).unwrap();
        let places: Vec<f64> = screening
            .outliers
            .iter()
            .map(|outlier| data.correspondences[outlier.row].world.unwrap().x)
            .collect();
        assert_eq!(places, accused.map_or(Vec::new(), Vec::from), "{set}");
    }
}
