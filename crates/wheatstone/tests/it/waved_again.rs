//! A second session with a board in the hand judges a model: lengths, flatness, shape, and error bars that hold.

use crate::hand_held::{chart, corners, waved};
use wheatstone::{
    Calibration,
    dataset::Dataset,
    evaluate::{BoardEvaluation, evaluate_boards},
    method::AnyMethod,
    numeric::progress::Silent,
    preparation::Preparation,
    synthetic::{Noise, Rig},
};

fn calibrated(data: &Dataset, method: &str) -> Calibration {
    let ready = Preparation::default().run(data.clone(), 0, &Silent).unwrap();
    Calibration::fit(&AnyMethod::named(method).unwrap(), &ready, 0, false, &Silent).unwrap()
}

fn judged(model: &Calibration, data: &Dataset) -> BoardEvaluation {
    evaluate_boards(&model.map(), data, &model.ellipsoids).unwrap()
}

#[test]
fn error_bars_of_lengths_and_flatness_hold() {
    for (name, method) in
        [("paper", "brown"), ("paper", "neural-camera"), ("fisheye", "kannala-brandt")]
    {
        let rig = Rig::named(name, 2).unwrap();
        let noise = Noise::Normal(0.1);
        let model = calibrated(&waved(&rig, 20, noise, 1).0, method);
        let found = judged(&model, &waved(&rig, 20, noise, 2).0);
        assert!(found.located > 1500, "{found:#?}");
        for held in [found.neighbours.error, found.across.error, found.flatness] {
            assert!((0.92..0.985).contains(&held.within95), "{name} {method}: {found:#?}");
            let ratio = held.rms / held.expected;
            assert!((0.85..1.15).contains(&ratio), "{name} {method}: {ratio} {found:#?}");
        }
        for lengths in [found.neighbours, found.across] {
            assert!(lengths.bias.abs() < 3.5 * lengths.bias_sigma, "{name} {method}: {found:#?}");
        }
        let pixels: Vec<f64> = found.cameras.iter().map(|camera| camera.unwrap()).collect();
        // Of a board of 99 points, six numbers of which are its pose, found from places that weigh depth as much as
        // the rest.
        assert!(pixels.iter().all(|error| (0.08..0.2).contains(error)), "{pixels:?}");
    }
}

/// A board that is longer than was said, and one that is bent, show as such.
#[test]
fn a_false_length_and_a_bent_board_show() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&waved(&rig, 20, Noise::Normal(0.1), 1).0, "brown");
    let (mut data, _) = waved(&rig, 10, Noise::Normal(0.1), 2);
    let straight = judged(&model, &data);
    for row in &mut data.correspondences {
        row.board = row.board.map(|board| board.map(|length| 1.01 * length));
    }
    let shorter = judged(&model, &data);
    let lost = (shorter.across.bias - straight.across.bias) / shorter.across.length;
    assert!((lost + 0.01 / 1.01).abs() < 2e-4, "{lost}");
    let pitch = rig.chart_pitch();
    assert!(straight.flatness.rms < 0.1 * pitch && chart(&rig).points().len() == 99);
}

/// Even pictures fit, odd ones judged.
#[test]
fn real_photographs_are_judged_in_millimetres() {
    let Some(data) = corners("opencv-chessboard", &["point"]) else { return };
    let part = |odd: usize| {
        let mut part = data.subset(|_, row| row.view % 2 == odd);
        let kept: Vec<usize> = (0..data.views.len()).filter(|view| view % 2 == odd).collect();
        part.views = kept.iter().map(|view| data.views[*view].clone()).collect();
        for row in &mut part.correspondences {
            row.view /= 2;
        }
        part
    };
    let model = calibrated(&part(0), "brown");
    let found = judged(&model, &part(1));
    assert_eq!(found.views.len(), 6);
    // Squares are believed to be 30 mm.
    assert!((found.across.bias / found.across.length).abs() < 0.005, "{found:#?}");
    assert!(found.neighbours.error.rms < 1.0 && found.flatness.rms < 1.5, "{found:#?}");
    for held in [found.neighbours.error, found.flatness] {
        assert!(held.within95 > 0.93, "{found:#?}");
    }
    // Seven views tell a real lens less well than its covariance has it; the scatter from view to view says so.
    let across = found.across;
    assert!(across.bias.abs() < 3.0 * across.bias_sigma && across.bias_sigma > 0.1, "{found:#?}");
}
