//! One camera and a board held by hand: a wide fisheye of 24 million pixels, judged on views that the fit
//! did not see.

use crate::data::folder;
use nalgebra::{Matrix6, Vector6};
use wheatstone::{
    cleaning::{
        outliers,
        poses::{self, Gauge, Lenses, Placing},
    },
    dataset::{Correspondence, Dataset},
    evaluate::evaluate_one_camera,
    geometry::{Pixel, Point3, Pose, Vector3},
    method::{
        AnyReconstructor, Method,
        neural_camera::{NeuralCamera, NeuralCameraReconstructor},
    },
    progress::Silent,
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

/// Where the board stood by half of its corners, from a place near it.
fn resected(model: &NeuralCameraReconstructor, near: Pose, half: &[(Point3, Pixel)]) -> Pose {
    let mut pose = near;
    for _ in 0..20 {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (place, pixel) in half {
            let Some((at, slopes)) = model.project(0, pose.transform(*place)) else { continue };
            let arm = pose.rotation * place.coords;
            for axis in 0..2 {
                let along = slopes.row(axis).transpose();
                let turn = arm.cross(&along);
                let row = Vector6::new(turn.x, turn.y, turn.z, along.x, along.y, along.z);
                normal += row * row.transpose();
                right += row * (pixel - at)[axis];
            }
        }
        let step = normal.cholesky().unwrap().solve(&right);
        let turn = Vector3::new(step[0], step[1], step[2]);
        pose.rotation = Pose::from_rotation_vector(Vector3::zeros(), turn).rotation * pose.rotation;
        pose.translation += Vector3::new(step[3], step[4], step[5]);
    }
    pose
}

#[test]
fn a_fisheye_predicts_better_than_the_rational_model() {
    let Some(data) = corners() else { return };
    let held_out = |view: usize| view % 5 == 2;
    let placing =
        Placing { gauge: Gauge::FirstCamera, lenses: Lenses::KannalaBrandt, ..Placing::default() };
    // Of the views held out these places are only where the search begins.
    let near = poses::solve(&data, placing, &Silent).unwrap();
    let train = data.subset(|_, row| !held_out(row.view));
    let placed = poses::solve(&train, placing, &Silent).unwrap().data;
    let clean = outliers::screen(&placed, 0, &Silent).unwrap().clean(&placed);
    let fit = NeuralCamera::default().fit(&clean, 0, &Silent).unwrap();
    let AnyReconstructor::NeuralCamera(model) = fit.reconstructor else { unreachable!() };
    let (mut squares, mut count) = (0.0, 0.0);
    for view in (0..data.views.len()).filter(|view| held_out(*view)) {
        let known = near.views.iter().find(|found| found.view == data.views[view]).unwrap();
        let pose = Pose::from_rotation_vector(known.translation.into(), known.rotation.into());
        let rows = data.correspondences.iter().filter(|row| row.view == view);
        let (half, other): (Vec<_>, Vec<_>) = rows
            .map(|row| {
                let [x, y] = row.board.unwrap();
                let squares = ((x + y) / 77.0).round() as i64;
                (squares % 2 == 0, (Point3::new(x, y, 0.0), row.pixels[0].unwrap()))
            })
            .partition(|(even, _)| *even);
        let points = |some: Vec<(bool, (Point3, Pixel))>| -> Vec<(Point3, Pixel)> {
            some.into_iter().map(|(_, point)| point).collect()
        };
        let pose = resected(&model, pose, &points(half));
        for (place, pixel) in points(other) {
            let (at, _) = model.project(0, pose.transform(place)).unwrap();
            squares += (at - pixel).norm_squared();
            count += 1.0;
        }
    }
    let rms = f64::sqrt(squares / count);
    assert!(count > 1800.0 && rms < 0.97 * RATIONAL, "{rms:.3} px on {count} corners");
    // What the library itself says, which judges both halves and searches for the places from nothing.
    let exam = data.subset(|_, row| held_out(row.view));
    let judged = evaluate_one_camera(&model, &exam).unwrap();
    assert_eq!((judged.unit.as_str(), judged.located), ("px", exam.correspondences.len()));
    assert!((judged.rms / rms - 1.0).abs() < 0.05, "{:.3} px for {rms:.3}", judged.rms);
}
