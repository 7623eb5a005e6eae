//! Photographs of chessboards against the corner lists that came with them. The bars are what was
//! measured, rounded up; they only ever get tighter.

use super::data;
use std::path::Path;
use wheatstone::{
    chart::chessboard::Chessboard,
    dataset::{
        capture::{CameraPictures, Capture, CapturedView},
        detection::{DetectionSettings, detect},
    },
    geometry::Pixel,
    numeric::statistics::median,
    progress::Silent,
};

/// A corner of the list: its picture's name, its number on the board, and a pixel a camera.
type Listed = (String, String, [Pixel; 2]);

fn listed(path: &Path) -> Vec<Listed> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    reader
        .records()
        .map(|record| {
            let record = record.unwrap();
            let pixel = |x: usize| Pixel::new(number(&record[x]), number(&record[x + 1]));
            let name = record[1].trim_end_matches(".jpg").to_owned();
            (name, record[2].to_owned(), [pixel(5), pixel(7)])
        })
        .collect()
}

fn pictures(folder: &Path, camera: &str) -> CameraPictures {
    let pattern = folder.join(format!("{camera}*.jpg"));
    let mut found: Vec<_> =
        glob::glob(pattern.to_str().unwrap()).unwrap().map(Result::unwrap).collect();
    found.sort();
    CameraPictures { name: camera.into(), pictures: found }
}

/// Every board must be found whole in both pictures, and its corners lie where the list has them.
fn agrees(set: &str, folders: [&str; 2], board: Chessboard, bar: f64) {
    let Some(folder) = data::folder(set) else { return };
    let cameras: Vec<CameraPictures> = ["left", "right"]
        .into_iter()
        .zip(folders)
        .map(|(camera, inside)| pictures(&folder.join(inside), camera))
        .collect();
    let name = |p: &std::path::PathBuf| p.file_stem().unwrap().to_str().unwrap().to_owned();
    let views = cameras[0]
        .pictures
        .iter()
        .map(|picture| CapturedView { name: name(picture), world_from_chart: None })
        .collect();
    let chart = board.into();
    let path = folder.join("capture.toml");
    let capture = Capture { path, unit: "mm".into(), chart, cameras, views };
    let found = detect(&capture, DetectionSettings::default(), &Silent).unwrap().dataset;
    let mut distances = Vec::new();
    for (view, _, pixels) in listed(&folder.join("corners.csv")) {
        let view = found.views.iter().position(|own| *own == view).unwrap();
        let nearest = [0, 1].map(|camera| {
            found
                .correspondences
                .iter()
                .filter(|row| row.view == view)
                .filter_map(|row| {
                    Some(((row.pixels[camera]? - pixels[camera]).norm(), row.id.clone()))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or_else(|| panic!("{set}: no board in view {view}, camera {camera}"))
        });
        assert_eq!(nearest[0].1, nearest[1].1, "{set}: the cameras name a corner differently");
        distances.extend(nearest.map(|n| n.0));
    }
    let median = median(&distances);
    assert!(median < bar, "{set}: median distance {median} px");
}

#[test]
fn opencvs_classic_pairs() {
    let board = Chessboard { columns: 9, rows: 6, ..Chessboard::default() };
    agrees("opencv-chessboard", ["left", "right"], board, 0.10);
}

#[test]
fn the_bumblebee_pairs() {
    let board = Chessboard { columns: 6, rows: 4, ..Chessboard::default() };
    agrees("boofcv-bumblebee2", ["images", "images"], board, 0.11);
}
