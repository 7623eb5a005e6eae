//! Captures as users lay them down.

use wheatstone_charts::{
    capture::{Capture, FILE_NAME, Reach},
    chart::chessboard::Chessboard,
};
use wheatstone_core::{Result, error::Remedy};

const HEAD: &str = "unit = \"cm\"\n[chart]\ntype = \"line-grid\"\ncolumns = 17\nrows = 13\npitch = 5.0\n[cameras]\nleft = \"left/*.png\"\nright = \"right/*.png\"\n";

fn capture(text: &str, pictures: &[&str]) -> (tempfile::TempDir, Result<Capture>) {
    let dir = tempfile::tempdir().unwrap();
    for picture in pictures {
        let path = dir.path().join(picture);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, b"").unwrap();
    }
    std::fs::write(dir.path().join(FILE_NAME), text).unwrap();
    let opened = Capture::open(dir.path());
    (dir, opened)
}

/// The files of a camera's pictures, view by view.
fn names(capture: &Capture, camera: usize) -> Vec<String> {
    let name = |picture: &Option<std::path::PathBuf>| match picture {
        Some(path) => path.file_name().unwrap().to_str().unwrap().to_owned(),
        None => "none".to_owned(),
    };
    capture.cameras[camera].pictures.iter().map(name).collect()
}

#[test]
fn a_picture_that_one_camera_lacks_leaves_a_view_without_it() {
    let views: String = ["01", "02", "03"]
        .map(|name| format!("[[views]]\nname = \"{name}\"\ntranslation = [0, 0, 50]\n"))
        .concat();
    let named = ["left/01.png", "left/02.png", "right/02.png", "right/03.png"];
    // Named like views; alike among the cameras; with one number, before and behind the camera's.
    let cam = [
        "left/l1_08.png",
        "left/l1_09.png",
        "left/l1_10.png",
        "right/r2_08.png",
        "right/r2_10.png",
    ];
    let img =
        ["left/7_l1.png", "left/8_l1.png", "left/9_l1.png", "right/7_r1.png", "right/9_r1.png"];
    for (text, pictures, left, right) in [
        (
            HEAD.to_owned() + &views,
            &named[..],
            ["01.png", "02.png", "none"],
            ["none", "02.png", "03.png"],
        ),
        (
            HEAD.to_owned(),
            &cam[..],
            ["l1_08.png", "l1_09.png", "l1_10.png"],
            ["r2_08.png", "none", "r2_10.png"],
        ),
        (
            HEAD.to_owned(),
            &img[..],
            ["7_l1.png", "8_l1.png", "9_l1.png"],
            ["7_r1.png", "none", "9_r1.png"],
        ),
    ] {
        let (_dir, capture) = capture(&text, pictures);
        let capture = capture.unwrap();
        assert_eq!(names(&capture, 0), left);
        assert_eq!(names(&capture, 1), right);
        assert_eq!(capture.views.len(), 3);
        let missing = right.iter().chain(&left).filter(|name| **name == "none").count();
        assert_eq!(capture.missing().count(), missing);
    }
    let (_dir, capture) = capture(
        HEAD,
        &["left/a.png", "left/b.png", "left/d.png", "right/a.png", "right/c.png", "right/d.png"],
    );
    let capture = capture.unwrap();
    let names: Vec<&str> = capture.views.iter().map(|view| &*view.name).collect();
    assert_eq!(names, ["a", "b", "c", "d"]);
    assert_eq!(capture.missing().collect::<Vec<_>>(), [("left", "c"), ("right", "b")]);
}

#[test]
fn pictures_pair_up_in_sorted_order_and_cameras_keep_theirs() {
    let text = HEAD.replace("left = ", "zeta = ");
    let (_dir, capture) =
        capture(&text, &["left/b.png", "left/a.png", "right/1.png", "right/2.png"]);
    let capture = capture.unwrap();
    assert_eq!(capture.cameras[0].name, "zeta");
    assert_eq!(names(&capture, 0), ["a.png", "b.png"]);
    assert_eq!(capture.views[1].name, "b");
    assert_eq!(capture.views[0].world_from_chart, None);
}

#[test]
fn where_order_alone_pairs_pictures_numbers_count_by_their_values_and_it_is_said() {
    let pictures = [
        "left/img_100.png",
        "left/img_99.png",
        "left/img_101.png",
        "right/00.png",
        "right/01.png",
        "right/02.png",
    ];
    let (_dir, without) = capture(HEAD, &pictures);
    let without = without.unwrap();
    assert_eq!(names(&without, 0), ["img_99.png", "img_100.png", "img_101.png"]);
    assert_eq!(names(&without, 1), ["00.png", "01.png", "02.png"]);
    let told = without.order_of_pairs().unwrap();
    assert!(told.ends_with(": img_99 with 00, …, img_101 with 02"), "{told}");
    // Views in their order, too.
    let views: String = ["near", "middle", "far"]
        .map(|name| format!("[[views]]\nname = \"{name}\"\ntranslation = [0, 0, 50]\n"))
        .concat();
    let alike = pictures.map(|name| name.replace("right/0", "right/img_10").replace("_102", "_99"));
    let alike: Vec<&str> = alike.iter().map(String::as_str).collect();
    let (_dir, named) = capture(&(HEAD.to_owned() + &views), &alike);
    let named = named.unwrap();
    assert_eq!(names(&named, 0), names(&named, 1));
    assert_eq!(names(&named, 0), names(&without, 0));
    assert_eq!(
        named.order_of_pairs().unwrap(),
        "pictures were taken for those of the views in the order of their names: `near` is of img_99 with img_99, …, `far` is of img_101 with img_101"
    );
    let (_dir, named) = capture(
        &(HEAD.to_owned()
            + &views.replace("near", "99").replace("middle", "100").replace("far", "101")),
        &alike,
    );
    assert_eq!(named.unwrap().order_of_pairs(), None);
}

#[test]
fn pictures_of_other_kinds_are_named_where_they_lie() {
    let text = HEAD.replace("*.png", "*.*");
    // The second is a picture's own raw file.
    let files = [
        "left/00.png",
        "left/00.CR2",
        "left/01.webp",
        "right/00.png",
        "right/01.png",
        "left/.x.gif",
    ];
    let (_dir, opened) = capture(&text, &files);
    let opened = opened.unwrap();
    assert_eq!(opened.missing().collect::<Vec<_>>(), [("left", "01")]);
    let told = opened.passed_over().unwrap();
    assert!(told.contains("01.webp` was passed over"), "{told}");
    assert!(!told.contains("CR2") && !told.contains("gif"), "{told}");
    let files = ["left/a.png", "left/b.heic", "right/3.png", "right/4.png"];
    let (_dir, refused) = capture(&text, &files);
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("b.heic` was passed over"), "{refused}");
    let (_dir, plain) = capture(HEAD, &["left/a.png", "right/a.png"]);
    assert_eq!(plain.unwrap().passed_over(), None);
}

#[test]
fn a_target_of_kalibr_declares_the_chart_in_the_unit_of_the_capture() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("board.yaml");
    let text = "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n";
    std::fs::write(&target, text).unwrap();
    let rest = &HEAD[HEAD.find("[cameras]").unwrap()..];
    let text = format!("unit = \"cm\"\n[chart]\nfile = {target:?}\n{rest}");
    let (_dir, capture) = capture(&text, &["left/a.png", "right/a.png"]);
    let chart = Chessboard { columns: 6, rows: 7, pitch: 6.0, ..Chessboard::default() };
    assert_eq!(capture.unwrap().chart, chart.into());
}

#[test]
fn views_go_by_name_where_pictures_have_their_names() {
    let views = "[[views]]\nname = \"50\"\ntranslation = [0, 0, 50]\n[[views]]\nname = \"110\"\ntranslation = [0, 0, 110]\nrotation = [0, 0.1, 0]\n";
    let pictures = ["left/110.png", "left/50.png", "right/110.png", "right/50.png"];
    let (_dir, capture) = capture(&(HEAD.to_owned() + views), &pictures);
    let capture = capture.unwrap();
    assert_eq!(names(&capture, 1), ["50.png", "110.png"]);
    assert_eq!(capture.views[1].world_from_chart.unwrap().translation.z, 110.0);
    assert!((capture.views[1].world_from_chart.unwrap().rotation_vector().y - 0.1).abs() < 1e-12);
}

#[test]
fn faults_are_named() {
    let both = ["left/a.png", "right/a.png"];
    let [view, other] = ["a", "b"].map(|name| format!("[[views]]\nname = \"{name}\"\n"));
    for (text, pictures, words) in [
        (HEAD.replace("columns", "colums"), &both[..], "colums"),
        (HEAD.replace("line-grid", "line-gird"), &both[..], "line-gird"),
        (HEAD.replace("columns = 17", "columns = 1"), &both[..], "columns cannot be 1"),
        (HEAD.replace("5.0", "-5.0"), &both[..], "pitch cannot be -5"),
        (HEAD.to_owned(), &["left/a.png"], "no file matches `right/*.png`"),
        (HEAD.to_owned(), &["left/a1.png", "left/a2.png", "right/b3.png"], "`left` has 2"),
        (format!("{HEAD}{view}{view}"), &both[..], "two [[views]] are named `a`"),
        (format!("{HEAD}{view}{other}"), &both[..], "no camera has a picture of view `b`"),
        (
            format!("{HEAD}{other}"),
            &["left/a.png", "left/c.png", "right/a.png", "right/c.png"],
            "1 [[views]], but 2",
        ),
        (HEAD.replace("\"cm\"", "cm"), &both[..], ":1:"),
        (format!("{HEAD}{view}rotation = [0, 0, 0]\n"), &both[..], "no translation"),
    ] {
        let (_dir, outcome) = capture(&text, pictures);
        let error = outcome.unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
        assert!(error.hint().is_some());
    }
    // What systems leave beside pictures is none.
    let every = HEAD.replace("*.png", "*");
    let (_dir, with_others) = capture(
        &every,
        &[&both[..], &["left/.DS_Store", "left/Thumbs.db", "right/._a.png"]].concat(),
    );
    assert!(with_others.unwrap().views.len() == both.len() / 2);
    // One camera alone can be calibrated.
    let (_dir, one) = capture(&HEAD.replace("right = \"right/*.png\"\n", ""), &both[..1]);
    assert_eq!(one.unwrap().cameras.len(), 1);
}

#[test]
fn faults_of_the_text_are_told_with_their_line() {
    let view = format!("{HEAD}[[views]]\nname = \"a\"\n");
    for (text, line, words) in [
        (HEAD.replace("pitch", "pich"), 6, "unknown key `pich`"),
        (HEAD.replace("rows = 13", "rows = -3"), 5, "`-3` must be a whole number"),
        (HEAD.replace("17", "\"9\""), 4, "`\"9\"` must be a whole number"),
        (HEAD.replace("17", "6.5"), 4, "`6.5` must be a whole number"),
        (HEAD.replace("5.0", "[5]"), 6, "a list must be a number"),
        (HEAD.replace("5.0", "5\norigin = \"corner\""), 7, "unknown name `corner`"),
        (HEAD.replace("line-grid", "line-gird"), 3, "unknown name `line-gird`"),
        (HEAD.replace("pitch = 5.0", ""), 2, "the key `pitch` is missing"),
        (HEAD.replace("[chart]\ntype", "[chart]\nkind"), 2, "the key `type` is missing"),
        (HEAD.replace("[chart]", "chart = 3\n[other]"), 2, "`3` must be a table"),
        (HEAD.replace("unit", "units"), 1, "unknown key `units`"),
        (HEAD.replace("\"cm\"", "3"), 1, "`3` must be text in quotes"),
        (format!("{view}shift = [0, 0, 1]\n"), 12, "unknown key `shift`"),
        (format!("{view}translation = [0, 1]\n"), 12, "a list of 2, where 3 are expected"),
        (format!("{view}translation = 1\n"), 12, "`1` must be a list"),
        (format!("{view}sigma = \"wide\"\n"), 12, "`\"wide\"` must be a number"),
    ] {
        let (_dir, outcome) = capture(&text, &[]);
        let error = outcome.unwrap_err().to_string();
        assert!(error.contains(&format!("{FILE_NAME}:{line}: ")), "{words}: {error}");
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[cfg(unix)]
#[test]
fn pictures_outside_of_the_folder_are_read_only_where_that_is_asked_for() {
    let outside = tempfile::tempdir().unwrap();
    std::fs::write(outside.path().join("01.png"), b"").unwrap();
    let absolute = format!("{}/*.png", outside.path().display());
    let (inner, opened) = capture(HEAD, &["left/01.png", "right/01.png"]);
    assert!(opened.is_ok());
    std::os::unix::fs::symlink(outside.path(), inner.path().join("link")).unwrap();
    std::os::unix::fs::symlink("left", inner.path().join("inward")).unwrap();
    let up = format!("../{}/*.png", outside.path().file_name().unwrap().to_str().unwrap());
    for (pattern, is_within) in [
        (&*absolute, false),
        (&*up, false),
        ("/**/*.png", false),
        ("left/../../*.png", false),
        ("link/*.png", false),
        ("inward/*.png", true),
        ("./left/*.png", true),
    ] {
        let text = HEAD.replace("right/*.png", pattern);
        std::fs::write(inner.path().join(FILE_NAME), text).unwrap();
        let opened = Capture::open(inner.path());
        assert_eq!(opened.is_ok(), is_within, "{pattern}");
        if let Err(error) = opened {
            assert!(error.to_string().contains("not in the folder"), "{pattern}: {error}");
            assert_eq!(error.hint().unwrap().remedy(), Some(Remedy::Follow));
        }
    }
    for pattern in [absolute, up, "link/*.png".to_owned()] {
        let text = HEAD.replace("right/*.png", &pattern);
        std::fs::write(inner.path().join(FILE_NAME), text).unwrap();
        let opened = Capture::open_within(inner.path(), Reach::Anywhere).unwrap();
        assert_eq!(names(&opened, 1), ["01.png"], "{pattern}");
    }
}
