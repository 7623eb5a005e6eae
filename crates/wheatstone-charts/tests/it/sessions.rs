//! Captures whose patterns have stars in the names of folders.

use wheatstone_charts::capture::{Capture, FILE_NAME};
use wheatstone_core::Result;

const HEAD: &str = "unit = \"cm\"\n[chart]\ntype = \"line-grid\"\ncolumns = 17\nrows = 13\npitch = 5.0\n[cameras]\n";
const BOTH: &str = "left = \"*/left/*.png\"\nright = \"*/right/*.png\"\n";

/// The capture with these patterns, views and empty pictures.
fn capture(
    patterns: &str,
    views: &[&str],
    pictures: &[&str],
) -> (tempfile::TempDir, Result<Capture>) {
    let dir = tempfile::tempdir().unwrap();
    for picture in pictures {
        let path = dir.path().join(picture);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, b"").unwrap();
    }
    let mut text = format!("{HEAD}{patterns}");
    for (z, name) in views.iter().enumerate() {
        text += &format!("[[views]]\nname = \"{name}\"\ntranslation = [0, 0, {z}]\n");
    }
    std::fs::write(dir.path().join(FILE_NAME), text).unwrap();
    let opened = Capture::open(dir.path());
    (dir, opened)
}

/// The views' names, each with the cameras' pictures.
fn views((dir, opened): &(tempfile::TempDir, Result<Capture>)) -> Vec<String> {
    let capture = opened.as_ref().unwrap();
    assert_eq!(capture.order_of_pairs(), None);
    let of = |view: usize| {
        let within = |camera: &wheatstone_charts::capture::CameraPictures| {
            let file = camera.pictures[view].as_deref();
            let file = file.map(|file| file.strip_prefix(dir.path()).unwrap());
            file.map_or(" -".to_owned(), |file| format!(" {}", file.display()))
        };
        let pictures: String = capture.cameras.iter().map(within).collect();
        format!("{}:{pictures}", capture.views[view].name)
    };
    (0..capture.views.len()).map(of).collect()
}

#[test]
fn pictures_of_different_sessions_never_come_together() {
    let pictures = [
        "mon/left/0.png",
        "mon/right/0.png",
        "tue/right/0.png",
        "tue/left/1.png",
        "tue/right/1.png",
    ];
    let found = views(&capture(BOTH, &[], &pictures));
    let paired = [
        "mon/0: mon/left/0.png mon/right/0.png",
        "tue/0: - tue/right/0.png",
        "tue/1: tue/left/1.png tue/right/1.png",
    ];
    assert_eq!(found, paired);
    let named = views(&capture(BOTH, &["tue/1", "mon/0", "tue/0"], &pictures));
    assert_eq!(named, [paired[2], paired[0], paired[1]]);
    // One camera alone has its views by their whole names, too.
    let alone = ["mon/left/0.png", "tue/left/0.png"];
    let one = views(&capture("left = \"*/left/*.png\"\n", &[], &alone));
    assert_eq!(one, ["mon/0: mon/left/0.png", "tue/0: tue/left/0.png"]);
}

#[test]
fn numbers_and_folders_of_single_pictures_tell_the_views_of_sessions() {
    let patterns = "left = \"*/l1_*.png\"\nright = \"*/r2_*.png\"\n";
    let pictures = ["a/l1_7.png", "a/r2_7.png", "b/l1_7.png", "b/r2_7.png"];
    let found = views(&capture(patterns, &[], &pictures));
    assert_eq!(found, ["a/l1_7: a/l1_7.png a/r2_7.png", "b/l1_7: b/l1_7.png b/r2_7.png"]);
    // What the stars stand for is a name, too.
    let found = views(&capture(patterns, &["b/7", "a/7"], &pictures));
    assert_eq!(found, ["b/7: b/l1_7.png b/r2_7.png", "a/7: a/l1_7.png a/r2_7.png"]);
    let patterns = "left = \"view*/left1.png\"\nright = \"view*/right2.png\"\n";
    let pictures = ["view2/left1.png", "view2/right2.png", "view1/left1.png", "view1/right2.png"];
    let found = views(&capture(patterns, &[], &pictures));
    assert_eq!(
        found,
        ["1: view1/left1.png view1/right2.png", "2: view2/left1.png view2/right2.png"]
    );
}

#[test]
fn views_have_plain_names_where_there_is_one_session_or_no_other_picture_of_that_name() {
    let single = ["mon/left/0.png", "mon/right/0.png"];
    let found = ["0: mon/left/0.png mon/right/0.png"];
    assert_eq!(views(&capture(BOTH, &[], &single)), found);
    assert_eq!(views(&capture(BOTH, &["0"], &single)), found);
    // Stars for what names a camera are no session.
    let serial = "left = \"a_*/*.png\"\nright = \"b_*/*.png\"\n";
    let found = views(&capture(serial, &[], &["a_221/0.png", "b_307/0.png"]));
    assert_eq!(found, ["0: a_221/0.png b_307/0.png"]);
    let pictures = ["mon/left/0.png", "mon/right/0.png", "tue/left/1.png", "tue/right/1.png"];
    let found = views(&capture(BOTH, &["1", "0"], &pictures));
    assert_eq!(found, ["1: tue/left/1.png tue/right/1.png", "0: mon/left/0.png mon/right/0.png"]);
}

#[test]
fn what_is_ambiguous_is_refused_with_the_files() {
    let two = ["mon/left/0.png", "mon/right/0.png", "tue/left/0.png", "tue/right/0.png"];
    let apart = [
        "mon/left/0.png",
        "mon/left/1.png",
        "tue/right/0.png",
        "tue/right/1.png",
        "wed/right/1.png",
    ];
    let more = ["mon/left/0.png", "mon/right/0.png", "tue/left/1.png", "tue/right/1.png"];
    let any = "left = \"left/*\"\nright = \"right/*\"\n";
    let double = ["left/0.jpg", "left/0.png", "right/0.jpg", "right/0.png"];
    for (patterns, names, pictures, words) in [
        (BOTH, &["0"][..], &two[..], &["mon/left/0.png", "tue/left/0.png"][..]),
        (BOTH, &["mon/0", "tue/1"], &two, &["`tue/1`"]),
        (BOTH, &["mon/0"], &two, &["tue/left/0.png", "no [[views]] entry"]),
        (BOTH, &["mon/0", "0", "1"], &more, &["views `mon/0` and `0`", "mon/left/0.png"]),
        (BOTH, &[], &apart, &["`left` has `mon/0`", "`right` has `tue/0`"]),
        (any, &[], &double, &["left/0.jpg", "left/0.png"]),
        (any, &["0"], &double, &["left/0.jpg", "left/0.png"]),
    ] {
        let (_dir, opened) = capture(patterns, names, pictures);
        let error = opened.unwrap_err();
        let told = error.to_string();
        assert!(words.iter().all(|word| told.contains(word)), "{words:?}: {told}");
        assert!(error.hint().is_some());
    }
    let (_dir, opened) = capture(BOTH, &["0"], &two);
    let way = opened.unwrap_err().hint().unwrap().to_string();
    assert!(way.contains("`mon/0`") && way.contains("`tue/0`"), "{way}");
}
