//! Kalibr's files of targets.

use wheatstone_charts::chart::{
    AnyChart, april_grid::AprilGrid, chessboard::Chessboard, kalibr_target::read,
};
use wheatstone_core::{Error, Result};

fn read_text(text: &str, unit: &str) -> Result<AnyChart> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("target.yaml");
    std::fs::write(&path, text).unwrap();
    read(&path, unit)
}

#[test]
fn targets_are_read_in_the_unit_that_is_asked_for() {
    let april = "target_type: 'aprilgrid' #gridtype\ntagCols: 6  #number\ntagRows: 5\ntagSize: 0.088 #[m]\ntagSpacing: 0.3\n";
    let wanted = AprilGrid { columns: 6, rows: 5, tag: 88.0, ..AprilGrid::default() };
    assert_eq!(read_text(april, "mm").unwrap(), wanted.into());
    let board = "%YAML:1.0\n---\ntarget_type: checkerboard\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n";
    let wanted = Chessboard { columns: 6, rows: 7, pitch: 6.0, ..Chessboard::default() };
    assert_eq!(read_text(board, "cm").unwrap(), wanted.into());
    let dots = "target_type: \"circlegrid\"\r\ntargetCols: 4\r\ntargetRows: 11\r\nspacingMeters: 0.02\r\nasymmetricGrid: True\r\n";
    let AnyChart::DotGrid(dots) = read_text(dots, "m").unwrap() else { panic!() };
    assert_eq!((dots.columns, dots.rows, dots.pitch, dots.asymmetric), (4, 11, 0.02, true));
}

#[test]
fn what_is_no_target_is_refused_with_its_line() {
    for (text, line) in [
        ("cam0:\n  camera_model: pinhole\n", 1),
        ("target_type: 'aprilgrid'\ntagCols: six\ntagRows: 6\n", 2),
        (
            "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.05\ncolSpacingMeters: 0.06\n",
            4,
        ),
        ("target_type: 'cube'\n", 1),
        ("target_type: 'aprilgrid'\ntagCols: 6\ntagCols: 7\n", 3),
        ("nothing\n", 1),
    ] {
        let Err(Error::Malformed { line: found, .. }) = read_text(text, "mm") else {
            panic!("{text}")
        };
        assert_eq!(found, Some(line), "{text}");
    }
    assert!(matches!(read_text("", "parsec"), Err(Error::UnknownName { .. })));
}
