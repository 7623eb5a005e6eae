//! Recordings, whole and broken.

use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::Error;
use wheatstone_robot::{Vehicle, Velocity, recorded::Recording};

#[test]
fn pairs_come_in_the_order_of_their_names_until_they_end() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (side, grey) in [("left", 10.0), ("right", 100.0)] {
        std::fs::create_dir(at.join(side)).unwrap();
        for number in [2, 0, 1] {
            let picture = GrayImage::from_fn(8, 6, |_, _| grey + number as f32);
            picture.write_png(&at.join(side).join(format!("{number:03}.png"))).unwrap();
        }
    }
    std::fs::write(at.join("left/notes.txt"), "no picture").unwrap();
    let mut recording = Recording::open(at, 0.25).unwrap();
    assert_eq!((recording.pairs().len(), recording.size().unwrap()), (3, [8, 6]));
    for number in 0..3 {
        let [left, right] = recording.look().unwrap().unwrap();
        assert_eq!(
            (left.values()[0], right.values()[0]),
            (10.0 + number as f32, 100.0 + number as f32)
        );
        recording.drive(Velocity::STOP).unwrap();
    }
    assert!(recording.look().unwrap().is_none());
    std::fs::remove_file(at.join("right/001.png")).unwrap();
    let Err(Error::Malformed { problem, .. }) = Recording::open(at, 0.25) else { panic!() };
    assert!(problem.contains("3 pictures in `left`, 2 in `right`"), "{problem}");
    let odd = GrayImage::from_fn(9, 6, |_, _| 0.0);
    odd.write_png(&at.join("right/001.png")).unwrap();
    let mut recording = Recording::open(at, 0.25).unwrap();
    assert!(recording.look().is_ok() && matches!(recording.look(), Err(Error::Image { .. })));
    assert!(matches!(Recording::open(&at.join("none"), 0.25), Err(Error::Io { .. })));
}
