//! `wheatstone reconstruct` of pictures and matches with something wrong: what is left out, and what is said.

use crate::{
    program::{done, refused},
    reconstruct::{LEFT, RIGHT, changed, prepared},
    rendered::rendered,
};
use serde_json::Value;
use std::{fs, path::Path};

/// Three frames of the same scene in two folders.
fn series(at: &Path) {
    prepared(at);
    for (side, from) in [("left", LEFT), ("right", RIGHT)] {
        fs::create_dir(at.join(side)).unwrap();
        for name in ["a", "b", "c"] {
            fs::copy(at.join(from), at.join(format!("{side}/{name}.png"))).unwrap();
        }
    }
}

/// A part of the picture, for speed.
const QUICK: [&str; 8] =
    ["reconstruct", "model.json", "--sparse", "--images", "left", "right", "-o", "out"];

#[test]
fn an_unreadable_picture_costs_its_own_frame() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    series(at);
    let whole = fs::read(at.join(RIGHT)).unwrap();
    fs::write(at.join("right/b.png"), &whole[..whole.len() / 2]).unwrap();
    let frames = || -> Vec<Value> {
        let told = fs::read_to_string(at.join("out/summary.json")).unwrap();
        serde_json::from_str::<Value>(&told).unwrap()["frames"].as_array().unwrap().clone()
    };
    let (_, said) = done(at, &QUICK);
    assert!(said.contains("warning: left out: right/b.png: not a complete picture"), "{said}");
    let told = frames();
    assert!(told[0]["points"].is_u64() && told[2]["points"].is_u64(), "{told:?}");
    let fault = told[1]["fault"].as_str().unwrap();
    assert!(fault.contains("right/b.png") && told[1]["points"].is_null(), "{fault}");
    assert!(at.join("out/c/cloud.ply").is_file() && !at.join("out/b").exists());

    // Also where it is the first, and where it has another size.
    fs::write(at.join("left/a.png"), "not a picture").unwrap();
    image::GrayImage::new(320, 240).save(at.join("right/b.png")).unwrap();
    let (_, said) = done(at, &QUICK);
    assert!(said.contains("left/a.png: not a picture: its first bytes"), "{said}");
    assert!(said.contains("right/b.png: 320 x 240 pixels, but"), "{said}");
    assert!(said.contains("out/a/cloud.ply") && said.contains("are of an earlier run"), "{said}");
    assert!(frames()[2]["points"].is_u64());
    let fused = ["reconstruct", "model.json", "--fuse", "--json", "--region", "250,180,60,20"];
    let command = [&fused[..], &["--images", "left", "right", "-o", "fused"]].concat();
    let told: Value = serde_json::from_str(&done(at, &command).0).unwrap();
    assert_eq!(told["frames"][0]["images"].as_array().unwrap().len(), 1);

    fs::write(at.join("right/c.png"), &whole[..whole.len() / 2]).unwrap();
    assert!(refused(at, &QUICK).contains("error: left/a.png: not a picture"));
    assert!(refused(at, &command).contains("error: left/a.png: not a picture"));
}

#[test]
fn what_is_of_an_earlier_run_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let region = ["--region", "250,180,60,20", "-o", "out"];
    let command = [&["reconstruct", "model.json", "--images", LEFT, RIGHT][..], &region].concat();
    let more = [&command[..], &["--mesh", "--cloud", "ply,pcd"]].concat();
    for _ in 0..2 {
        assert!(!done(at, &more).1.contains("earlier run"));
    }
    let (_, said) = done(at, &command);
    assert!(said.contains("note: out/cloud.pcd and out/mesh.ply are of an earlier run"), "{said}");

    let plain = ["rectify", "model.json", "-o", "pair"];
    // What lies there may be pictures as they were taken.
    fs::create_dir_all(at.join("pair/left")).unwrap();
    fs::write(at.join("pair/left/taken.png"), "x").unwrap();
    assert!(!done(at, &plain).1.contains("earlier run"));
    let command = [&plain[..], &["--images", LEFT, RIGHT]].concat();
    assert!(!done(at, &command).1.contains("earlier run"));
    fs::remove_file(at.join("pair/left/taken.png")).unwrap();
    assert!(!done(at, &command).1.contains("earlier run"));
    let (_, said) = done(at, &plain);
    let files = "pair/left/left.png, pair/lines.png and pair/right/right.png";
    assert!(said.contains(&format!("note: {files} are of an earlier run")), "{said}");
}

#[test]
fn a_whole_number_below_all_disparities_is_no_match() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let command = ["reconstruct", "model.json", "--images", LEFT, RIGHT, "--json", "-o"];
    let (printed, _) = done(at, &[&command[..], &["own"]].concat());
    let told: Value = serde_json::from_str(&printed).unwrap();
    let searched = |end: usize| told["disparities"][end].as_i64().unwrap() as f32;
    // As a matcher that begins in the midst of the range.
    let lowest = ((searched(0) + searched(1)) / 2.0).floor();
    let kept = move |disparity: f32| disparity > lowest + 1.0;
    let own = at.join("own/disparity.npy");
    let with = |name: &str, other: f32| {
        changed(&own, &at.join(name), |own| if kept(own) { own } else { other });
        let (printed, said) = done(at, &[&command[..], &["x", "--matches", name]].concat());
        let told: Value = serde_json::from_str(&printed).unwrap();
        (told["frames"][0]["points"].as_u64().unwrap(), said)
    };
    let (points, _) = with("nan.npy", f32::NAN);
    let (same, said) = with("lowest.npy", lowest);
    assert!(points > 1000 && points == same, "{points} {same}");
    let note = format!("pixels have the disparity {lowest}, below all others");
    assert!(said.contains(&note) && said.contains("note: lowest.npy: "), "{said}");
    // A number that is not whole was measured.
    let (more, said) = with("measured.npy", lowest + 0.25);
    assert!(more > points && !said.contains("below all others"), "{more} {said}");
}

#[test]
fn wrong_matches_and_numbers_of_pictures_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let told = |more: &[&str]| {
        let command = ["reconstruct", "model.json", "-o", "out", "--images", LEFT, RIGHT];
        refused(at, &[&command[..], more].concat())
    };
    let own = ["rectify", "model.json", "-o", "pair"];
    done(at, &own);
    // The upper half of an array of the right size.
    let map = fs::read(at.join("pair/left_map_x.npy")).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([map[8], map[9]]));
    let head = String::from_utf8_lossy(&map[10..start]).into_owned();
    let shape = head.split(['(', ')', ',']).filter_map(|part| part.trim().parse::<usize>().ok());
    let [height, width] = shape.collect::<Vec<_>>()[..] else { panic!("{head}") };
    let half = head.replacen(&height.to_string(), &(height / 2).to_string(), 1);
    let array = [&map[..10], half.as_bytes(), &map[start..start + 2 * width * height]].concat();
    fs::write(at.join("half.npy"), array).unwrap();
    let said = told(&["--matches", "half.npy"]);
    let sizes = format!(
        "{width} x {} disparities; the rectified pictures have {width} x {height}",
        height / 2
    );
    assert!(said.contains("half.npy: an array of") && said.contains(&sizes), "{said}");
    let said = told(&["--matches", LEFT]);
    assert!(said.contains("a picture, not matches") && said.contains(".npy"), "{said}");
    let said = told(&[RIGHT]);
    assert!(said.contains("3 pictures or folders for a model of 2 cameras"), "{said}");
}

#[test]
fn two_of_four_cameras_that_are_exchanged_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    rendered(at, &["synth", "--scene", "--cameras", "4", "-o", "capture"]);
    done(at, &["fit", "capture", "--method", "brown", "--no-validation", "-o", "model.json"]);
    let mut files: Vec<String> = fs::read_dir(at.join("capture/scene"))
        .unwrap()
        .map(|file| file.unwrap().path().display().to_string())
        .filter(|path| path.ends_with(".png"))
        .collect();
    files.sort();
    let [one, two, three, four] = &files[..] else { panic!("{files:?}") };
    let command = |pictures: &[&str]| {
        let start = ["reconstruct", "model.json", "--sparse", "-o", "out", "--images"];
        [&start[..], pictures].concat().iter().map(|part| (*part).to_owned()).collect::<Vec<_>>()
    };
    let run = |pictures: &[&str]| {
        let command = command(pictures);
        done(at, &command.iter().map(String::as_str).collect::<Vec<_>>()).1
    };
    let said = run(&[one, two, four, three]);
    assert!(said.contains("cameras 3 and 4 are left out: their pictures are exchanged"), "{said}");
    image::GrayImage::from_pixel(640, 480, image::Luma([99])).save(at.join("blank.png")).unwrap();
    let said = run(&[one, two, "blank.png", four]);
    assert!(said.contains("camera 3 is left out: hardly anything of its picture"), "{said}");
    let exchanged = command(&[one, three, two, four]);
    let said = refused(at, &exchanged.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("the pictures of cameras 2 and 3 are exchanged"), "{said}");
    let command = command(&[one, two, three]);
    let said = refused(at, &command.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("a model of 4 cameras") && said.contains("`--cameras 1,2,3`"), "{said}");
}

#[test]
fn a_camera_that_has_moved_a_little_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let right = image::open(at.join(RIGHT)).unwrap().to_luma8();
    // Rows between two, farther down from left to right: as a camera that was turned about its axis.
    let sheared = image::GrayImage::from_fn(640, 480, |x, y| {
        let down = f64::from(y) + 0.002 * (f64::from(x) - 320.0);
        let (row, part) = (down.floor().clamp(0.0, 478.0), down.fract());
        let level = |row: f64| f64::from(right.get_pixel(x, row as u32).0[0]);
        image::Luma([((1.0 - part) * level(row) + part * level(row + 1.0)).round() as u8])
    });
    sheared.save(at.join("turned.png")).unwrap();
    let run = |second: &str| {
        let command = ["reconstruct", "model.json", "--images", LEFT, second, "-o", "out"];
        let (_, said) = done(at, &command);
        let read = |name: &str| fs::read_to_string(at.join("out").join(name)).unwrap();
        let summary = read("summary.json");
        assert!(summary.contains("\"confidence\": 0.95,"), "{summary}");
        let told: Value = serde_json::from_str(&summary).unwrap();
        (told["frames"][0].clone(), said, read("scene.html"))
    };
    let (told, said, page) = run(RIGHT);
    assert!(
        told["warnings"].as_array().unwrap().is_empty() && !page.contains("Warning:"),
        "{told}"
    );
    assert!(told["vertical_offsets"][0]["p95_px"].as_f64().unwrap() < 0.2, "{told}");
    assert!(!said.contains("more than the calibration"), "{said}");
    let (told, said, page) = run("turned.png");
    let warning = told["warnings"][0].as_str().unwrap();
    assert!(warning.starts_with("cameras 1 and 2: the right picture shows things"), "{warning}");
    assert!(said.contains(&format!("warning: {warning}; fit again")), "{said}");
    assert!(page.contains("Warning:") && page.contains(warning), "{warning}");
    assert!(told["vertical_offsets"][0]["p95_px"].as_f64().unwrap() > 0.45, "{told}");
    // Also of matches that another program found.
    fs::copy(at.join("out/disparity.npy"), at.join("given.npy")).unwrap();
    let command = ["reconstruct", "model.json", "--images", LEFT, "turned.png", "-o", "out"];
    let (_, said) = done(at, &[&command[..], &["--matches", "given.npy"]].concat());
    assert!(said.contains(&format!("warning: {warning}; fit again")), "{said}");
}
