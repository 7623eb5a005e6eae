//! Chessboards in photographs, against the corners that OpenCV found in them.

use crate::data::folder;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use wheatstone::{
    chart::{Chart, ChartSearch, Detection, chessboard::Chessboard},
    geometry::Pixel,
    imaging::{Limits, read_image},
};

/// Reference corners of one picture, by OpenCV's number, which counts rows from OpenCV's first corner.
type Corners = BTreeMap<usize, Pixel>;

fn readings(board: &Chessboard, picture: &Path) -> Vec<Detection> {
    let image = read_image(picture, Limits::default()).unwrap();
    match board.detect(&image) {
        ChartSearch::Found(readings) => readings,
        ChartSearch::NotFound(why) => panic!("{}: {why}", picture.display()),
    }
}

fn board(columns: usize, rows: usize) -> Chessboard {
    Chessboard { columns, rows, ..Chessboard::default() }
}

fn pictures(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut pictures: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|e| e == "jpg")).collect();
    pictures.sort();
    pictures
}

/// The table's corners by picture. `name` makes a picture's path from the camera's place in
/// `cameras` and the table's second column.
fn reference(
    folder: &Path,
    cameras: &[&str],
    name: fn(&str, &str) -> String,
) -> BTreeMap<PathBuf, Corners> {
    let mut pictures: BTreeMap<PathBuf, Corners> = BTreeMap::new();
    let table = std::fs::read_to_string(folder.join("corners.csv")).unwrap();
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        for (index, camera) in cameras.iter().enumerate() {
            let cell = |axis: usize| cells[5 + 2 * index + axis].parse::<f64>();
            let (Ok(x), Ok(y)) = (cell(0), cell(1)) else { continue };
            let corners = pictures.entry(folder.join(name(camera, cells[1]))).or_default();
            corners.insert(cells[2].parse().unwrap(), Pixel::new(x, y));
        }
    }
    pictures
}

/// Every picture's board is found whole, under OpenCV's ids in one of `readings_expected` readings;
/// returns the median distance from OpenCV's corners.
fn median_distance(
    board: &Chessboard,
    pictures: &BTreeMap<PathBuf, Corners>,
    readings_expected: usize,
) -> f64 {
    let mut distances = Vec::new();
    for (picture, corners) in pictures {
        let found = readings(board, picture);
        assert_eq!(found.len(), readings_expected, "{}", picture.display());
        assert_eq!(found[0].points.len(), board.columns * board.rows, "{}", picture.display());
        let apart = |reading: &Detection| -> Vec<f64> {
            reading.points.iter().map(|(id, at)| (corners[id] - at).norm()).collect()
        };
        // Neighbours are 15 pixels apart or more.
        let close = |distances: &Vec<f64>| distances.iter().all(|distance| *distance < 3.0);
        let agreeing = found.iter().map(apart).find(close);
        distances.extend(agreeing.unwrap_or_else(|| panic!("{}: other ids", picture.display())));
    }
    distances.sort_by(f64::total_cmp);
    distances[distances.len() / 2]
}

#[test]
fn opencv_pictures_are_found_whole_with_the_ids_of_opencv() {
    let Some(folder) = folder("opencv-chessboard") else { return };
    let name = |camera: &str, left: &str| format!("{camera}/{}", left.replace("left", camera));
    let pictures = reference(&folder, &["left", "right"], name);
    assert_eq!(pictures.len(), 26);
    let median = median_distance(&board(9, 6), &pictures, 1);
    assert!(median <= 0.15, "median {median} px");
}

#[test]
fn bumblebee_pictures_are_found_whole_up_to_half_a_turn() {
    let Some(folder) = folder("boofcv-bumblebee2") else { return };
    let name = |camera: &str, left: &str| format!("images/{}", left.replace("left", camera));
    let pictures = reference(&folder, &["left", "right"], name);
    assert_eq!(pictures.len(), 22);
    let median = median_distance(&board(6, 4), &pictures, 2);
    assert!(median <= 0.15, "median {median} px");
}

#[test]
fn squares_with_marks_inside_are_found_whole() {
    let Some(folder) = folder("boofcv-trinocular") else { return };
    let name = |camera: &str, index: &str| format!("{camera}/{camera}{index}.jpg");
    let mut pictures = reference(&folder, &["left", "middle", "right"], name);
    // A third is enough, and quick.
    let mut index = 0;
    pictures.retain(|_, _| {
        index += 1;
        index % 3 == 0
    });
    let median = median_distance(&board(13, 9), &pictures, 2);
    // The reference is coarse here: its windows reached the marks.
    assert!(median <= 0.5, "median {median} px");
}

#[test]
fn a_full_circle_fisheye_shows_whole_boards() {
    let Some(folder) = folder("boofcv-fisheye") else { return };
    let pictures = pictures(&folder.join("images"));
    assert_eq!(pictures.len(), 26);
    for picture in pictures {
        assert_eq!(readings(&board(6, 4), &picture)[0].points.len(), 24, "{}", picture.display());
    }
}

#[test]
fn boards_of_266_points_are_found_whole_in_8_megapixels() {
    let Some(folder) = folder("multidic-cylinder") else { return };
    for camera in ["201", "202"] {
        for picture in pictures(&folder.join("chessboard").join(camera)) {
            let found = readings(&board(14, 19), &picture);
            assert_eq!(found[0].points.len(), 266, "{}", picture.display());
        }
    }
}

#[test]
fn two_walls_of_a_corner_are_two_boards() {
    let Some(folder) = folder("bailus-corner") else { return };
    // Not one board of 18 x 14 or 18 x 13.
    for (columns, rows, least) in [(9, 14, 110), (8, 14, 100)] {
        for picture in ["left", "right"] {
            let found =
                readings(&board(columns, rows), &folder.join(format!("images/{picture}.jpg")));
            let count = found[0].points.len();
            assert!(count >= least, "{picture}, {columns} x {rows}: {count}");
        }
    }
}
