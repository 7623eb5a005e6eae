//! One camera and a board held by hand: a wide fisheye of 24 million pixels, judged on views that the fit
//! did not see.

use crate::data::folder;
use wheatstone::{
    dataset::{Correspondence, Dataset},
    evaluate::evaluate_one_camera,
    fit::bundle::{self, BundleSettings, Gauge, Lenses},
    geometry::Pixel,
    method::{Method, neural_camera::NeuralCamera},
    numeric::progress::Silent,
    preparation::outliers,
};

/// Root mean square length of the errors of the same points, in pixels, with OpenCV 5.0's eight-parameter
/// lens (`calibrateCamera` with `CALIB_RATIONAL_MODEL` on the same training views; `solvePnP` and
/// `solvePnPRefineLM` on half of the corners of each view held out, the others predicted).
const RATIONAL: f64 = 1.412;

fn corners() -> Option<Dataset> {
    let text = std::fs::read_to_string(folder("mrcal-fisheye")?.join("corners.csv")).unwrap();
    let mut data =
        Dataset { unit: "mm".into(), cameras: 1, views: Vec::new(), correspondences: Vec::new() };
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |column: usize| cells[column].parse::<f64>().unwrap();
        // A corner that was not found has no weight.
        if number(7) <= 0.0 {
            continue;
        }
        if data.views.last().map(String::as_str) != Some(cells[0]) {
            data.views.push(cells[0].into());
        }
        data.correspondences.push(Correspondence {
            view: data.views.len() - 1,
            id: Some(format!("{} {}", cells[1], cells[2])),
            pixels: vec![Some(Pixel::new(number(5), number(6)))],
            world: None,
            board: Some([1000.0 * number(3), 1000.0 * number(4)]),
        });
    }
    Some(data)
}

#[test]
fn a_fisheye_predicts_better_than_the_rational_model() {
    let Some(data) = corners() else { return };
    let held_out = |view: usize| view % 5 == 2;
    let bundle_settings = BundleSettings {
        gauge: Gauge::FirstCamera,
        lenses: Lenses::KannalaBrandt,
        ..BundleSettings::default()
    };
    let train = data.subset(|_, row| !held_out(row.view));
    let placed = bundle::solve(&train, bundle_settings, &Silent).unwrap().data;
    let clean = outliers::screen(&placed, 0, &Silent).unwrap().clean(&placed);
    let fit = NeuralCamera::default().fit(&clean, 0, &Silent).unwrap();
    let exam = data.subset(|_, row| held_out(row.view));
    let judged = evaluate_one_camera(&*fit.reconstructor, &exam).unwrap();
    assert_eq!((judged.unit.as_str(), judged.located), ("px", exam.correspondences.len()));
    assert!(judged.rms < 0.85 * RATIONAL, "{:.3} px", judged.rms);
}
