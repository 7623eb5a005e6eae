//! `wheatstone reconstruct`: what it writes, and what it says of pairs that are none.

use crate::{
    program::{done, refused},
    rendered::rendered,
};
use std::{fs, path::Path};

/// A capture with a scene, and a model of it.
pub(crate) fn prepared(at: &Path) {
    rendered(at, &["synth", "--scene", "-o", "capture"]);
    done(at, &["fit", "capture", "--method", "brown", "--no-validation", "-o", "model.json"]);
}

pub(crate) const LEFT: &str = "capture/scene/left.png";
pub(crate) const RIGHT: &str = "capture/scene/right.png";

#[test]
fn a_scene_becomes_a_cloud_depths_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let (printed, _) =
        done(at, &["reconstruct", "model.json", "--images", LEFT, RIGHT, "-o", "out", "--json"]);
    let told: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let frame = &told["frames"][0];
    let points = frame["points"].as_u64().unwrap();
    assert!(points > 100_000, "{frame}");
    assert!(frame["inside_calibrated_volume"].as_f64().unwrap() > 0.2, "{frame}");
    let ply = fs::read(at.join("out/cloud.ply")).unwrap();
    let header = String::from_utf8_lossy(&ply[..600]).into_owned();
    assert!(header.contains(&format!("element vertex {points}\n")), "{header}");
    let saved = fs::read_to_string(at.join("out/summary.json")).unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(&saved).unwrap(), told);
    let confidence = image::open(at.join("out/confidence.png")).unwrap().to_luma8();
    let depth = image::open(at.join("out/depth.png")).unwrap().into_luma16();
    assert_eq!(confidence.dimensions(), depth.dimensions());
    let deep = depth.pixels().filter(|pixel| pixel.0[0] > 0).count() as u64;
    assert_eq!(deep, points);
    let page = fs::read_to_string(at.join("out/scene.html")).unwrap();
    assert!(page.starts_with("<!") && page.len() < 15_000_000);
    for name in ["depth.tiff", "disparity.npy"] {
        assert!(at.join("out").join(name).is_file(), "{name}");
    }

    // The disparities that it has written, as if another matcher had.
    let given =
        ["--matches", "out/disparity.npy", "--matches-sigma", "0.1", "-o", "given", "--json"];
    let command = [&["reconstruct", "model.json", "--images", LEFT, RIGHT][..], &given].concat();
    let given: serde_json::Value = serde_json::from_str(&done(at, &command).0).unwrap();
    assert!(given["frames"][0]["points"].as_u64().unwrap() >= points, "{given}");
    let depths = |folder: &str, told: &serde_json::Value| -> Vec<f64> {
        let step = told["frames"][0]["depth_png_step"].as_f64().unwrap();
        let levels = image::open(at.join(folder).join("depth.png")).unwrap().into_luma16();
        levels.pixels().map(|level| f64::from(level.0[0]) * step).collect()
    };
    let pairs = depths("given", &given).into_iter().zip(depths("out", &told));
    let off = pairs.filter(|(a, b)| *b > 0.0 && (a - b).abs() > 0.1).count();
    assert!(off == 0, "{off}");
    fs::copy(at.join("capture/scene/left_points.npy"), at.join("wrong.npy")).unwrap();
    let wrong = ["--matches", "wrong.npy", "-o", "wrong"];
    let command = [&["reconstruct", "model.json", "--images", LEFT, RIGHT][..], &wrong].concat();
    assert!(refused(at, &command).contains("it is not a matrix"));

    // Fewer points of a part, and of smaller standard deviations.
    let part = ["--region", "200,150,100,80", "--max-sigma", "0.2", "-o", "part", "--json"];
    let part = [&part[..], &["--cloud", "ply,pcd,e57,laz"]].concat();
    let command = [&["reconstruct", "model.json", "--images", LEFT, RIGHT][..], &part].concat();
    let part: serde_json::Value = serde_json::from_str(&done(at, &command).0).unwrap();
    let fewer = part["frames"][0]["points"].as_u64().unwrap();
    assert!(fewer > 1000 && fewer <= 8000, "{part}");
    for (name, begins) in
        [("ply", "ply\n"), ("pcd", "# .PCD"), ("e57", "ASTM-E57"), ("laz", "LASF")]
    {
        let bytes = fs::read(at.join(format!("part/cloud.{name}"))).unwrap();
        assert!(bytes.starts_with(begins.as_bytes()), "{name}");
    }
}

#[test]
fn the_report_of_a_capture_shows_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let report = |more: &[&str]| -> (serde_json::Value, String) {
        let arguments = ["report", "model.json", "--pictures", "capture", "--no-validation"];
        let outputs = ["-o", "r.html", "--json", "r.json", "--figures", "figures"];
        done(at, &[&arguments[..], &outputs, more].concat());
        let json = fs::read_to_string(at.join("r.json")).unwrap();
        (serde_json::from_str(&json).unwrap(), fs::read_to_string(at.join("r.html")).unwrap())
    };
    let (summary, page) = report(&[]);
    let scene = &summary["scene"];
    assert!(scene["points"].as_u64().unwrap() > 100_000 && scene["problem"].is_null());
    assert_eq!(scene["pictures"], serde_json::json!(["left.png", "right.png"]));
    assert_eq!(scene["sample"]["points"].as_array().unwrap().len(), 4000);
    assert!(page.contains("id=\"reconstruction\"") && page.contains("left.png, right.png"));
    let drawn = fs::read_to_string(at.join("figures/cloud.svg")).unwrap();
    assert!(drawn.matches("<circle").count() > 3000);

    // Where there is nothing it says where it looked.
    let (summary, _) = report(&["--range", "400:800"]);
    let problem = summary["scene"]["problem"].as_str().unwrap();
    // In whole disparities.
    assert!(
        problem.contains("; depths of 3") && problem.contains(" cm were searched"),
        "{problem}"
    );

    // Pictures of the wrong cameras: it says so, and draws nothing.
    fs::rename(at.join(LEFT), at.join("left.png")).unwrap();
    fs::rename(at.join(RIGHT), at.join(LEFT)).unwrap();
    fs::rename(at.join("left.png"), at.join(RIGHT)).unwrap();
    let (summary, page) = report(&[]);
    let problem = summary["scene"]["problem"].as_str().unwrap();
    assert!(problem.contains("exchanged"), "{problem}");
    assert!(page.contains("could not be reconstructed") && summary["scene"]["points"] == 0);

    let command =
        ["report", "model.json", "--pictures", "capture", "--range", "50:150", "-o", "r.html"];
    let second = at.join("capture/scene/left.jpg");
    fs::copy(at.join(LEFT), &second).unwrap();
    let told = refused(at, &command);
    assert!(told.contains("two pictures of camera `left`") && told.contains("left.png"), "{told}");
    fs::remove_file(second).unwrap();
    fs::remove_file(at.join(LEFT)).unwrap();
    assert!(refused(at, &command).contains("the capture has none"));
}

#[test]
fn features_and_pixels_of_others_become_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let told = |more: &[&str]| -> serde_json::Value {
        let command = ["reconstruct", "model.json", "--json", "--images", LEFT, RIGHT];
        serde_json::from_str(&done(at, &[&command[..], more].concat()).0).unwrap()
    };
    let sparse = told(&["--sparse", "-o", "sparse"]);
    let points = sparse["frames"][0]["points"].as_u64().unwrap();
    assert!((3000..20_000).contains(&points), "{sparse}");

    // The chart's own points, as matched pixels of the pictures of the scene.
    let located =
        told(&["--matches", "capture/truth.csv", "--matches-sigma", "0.1", "-o", "table"]);
    let points = located["frames"][0]["points"].as_u64().unwrap() as usize;
    let truth = fs::read_to_string(at.join("capture/truth.csv")).unwrap();
    assert!(points == 441 && truth.lines().count() == 442, "{located}");
    let ply = fs::read(at.join("table/cloud.ply")).unwrap();
    let start = ply.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
    let places: Vec<[f64; 3]> = truth
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> =
                line.split(',').take(7).map(|cell| cell.parse().unwrap()).collect();
            [cells[4], cells[5], cells[6]]
        })
        .collect();
    for row in ply[start..].chunks_exact(31) {
        let found = [0, 4, 8].map(|byte| number(&row[byte..byte + 4]));
        let off = |place: &[f64; 3]| {
            (0..3).map(|axis| (place[axis] - found[axis]).powi(2)).sum::<f64>().sqrt()
        };
        let nearest = places.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.5, "{found:?}: {nearest}");
    }

    // What cannot be right is counted, and no input is written over.
    let row: Vec<&str> = truth.lines().nth(200).unwrap().split(',').take(4).collect();
    let wrong = format!("{},{},{},20", row[0], row[1], row[2]);
    let two = format!("x1,y1,x2,y2\n{}\n{wrong}\n", row.join(","));
    fs::write(at.join("two.csv"), two).unwrap();
    let two = ["--matches", "two.csv", "--matches-sigma", "0.5", "-o", "two"];
    let command = [&["reconstruct", "model.json", "--images", LEFT, RIGHT][..], &two].concat();
    let (_, said) = done(at, &command);
    assert!(said.contains("1 of 2 matches are left out"), "{said}");
    let command = ["reconstruct", "model.json", "--images", LEFT, RIGHT, "-o", "x", "--mcap", LEFT];
    assert!(refused(at, &command).contains("would be written over"));

    fs::write(at.join("one.csv"), "x1,y1\n3,4\n").unwrap();
    let wrong = |more: &[&str]| {
        let command = ["reconstruct", "model.json", "--images", LEFT, RIGHT, "-o", "wrong"];
        refused(at, &[&command[..], more].concat())
    };
    assert!(wrong(&["--matches", "one.csv"]).contains("one.csv"));
    assert!(wrong(&["--matches", "capture/truth.csv", "--sparse"]).contains("cannot be used with"));
    let sigma = wrong(&["--matches", "capture/truth.csv", "--matches-sigma", "0"]);
    assert!(sigma.contains("above 0"), "{sigma}");
}

#[test]
fn several_pairs_have_a_folder_each() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    for side in ["left", "right"] {
        fs::create_dir(at.join(side)).unwrap();
        for name in ["a", "b"] {
            let from = at.join(format!("capture/scene/{side}.png"));
            fs::copy(from, at.join(format!("{side}/{name}.png"))).unwrap();
        }
    }
    // What systems leave in folders is no picture.
    fs::write(at.join("left/.DS_Store"), "x").unwrap();
    done(at, &["reconstruct", "model.json", "--images", "left", "right", "-o", "folders"]);
    // Both frames as one, and the surface.
    let fused = ["--fuse", "--mesh", "-o", "fused", "--json"];
    let command = [&["reconstruct", "model.json", "--images", "left", "right"][..], &fused];
    let told: serde_json::Value = serde_json::from_str(&done(at, &command.concat()).0).unwrap();
    assert_eq!(told["frames"][0]["images"].as_array().unwrap().len(), 2);
    let points = told["frames"][0]["points"].as_u64().unwrap();
    let mesh = fs::read(at.join("fused/mesh.ply")).unwrap();
    let header = String::from_utf8_lossy(&mesh[..700]).into_owned();
    let header = &header[..header.find("end_header\n").unwrap() + 11];
    assert!(header.contains(&format!("element vertex {points}\n")), "{header}");
    let faces = header.split("element face ").nth(1).unwrap();
    let faces: u64 = faces.split('\n').next().unwrap().parse().unwrap();
    assert!(faces > points && header.contains("property float nz\n"), "{header}");
    assert_eq!(mesh.len() as u64, header.len() as u64 + points * 43 + faces * 13);
    let files = ["left/a.png", "left/b.png", "right/a.png", "right/b.png"];
    let command = [&["reconstruct", "model.json", "--images"], &files[..], &["-o", "files"]];
    done(at, &command.concat());
    let cloud = |path: &str| fs::read(at.join(path).join("cloud.ply")).unwrap();
    assert!(cloud("folders/a") == cloud("folders/b") && cloud("folders/a") == cloud("files/b"));
    let same = ["left/a.png", "folders/../left/a.png", "right/a.png", "right/b.png"];
    let command = [&["reconstruct", "model.json", "--images"], &same[..], &["-o", "same"]];
    assert!(refused(at, &command.concat()).contains("same name"));
    let told = fs::read_to_string(at.join("folders/summary.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["frames"].as_array().unwrap().len(), 2);
}

#[test]
fn a_third_camera_is_matched_with_the_left_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    rendered(at, &["synth", "--scene", "--cameras", "3", "-o", "capture"]);
    done(at, &["fit", "capture", "--method", "brown", "--no-validation", "-o", "model.json"]);
    let told = |arguments: &[&str]| -> serde_json::Value {
        let command =
            [&["reconstruct", "model.json", "--json", "-o", "out", "--images"], arguments];
        serde_json::from_str(&done(at, &command.concat()).0).unwrap()
    };
    let pictures: Vec<String> = {
        let files = fs::read_dir(at.join("capture/scene")).unwrap();
        let paths = files.map(|file| file.unwrap().path().display().to_string());
        let mut pictures: Vec<String> = paths.filter(|path| path.ends_with(".png")).collect();
        pictures.sort();
        pictures
    };
    let [one, two, three] = &pictures[..] else { panic!("{pictures:?}") };
    let all = told(&[one, two, three]);
    let pair = told(&[one, two]);
    let points = |told: &serde_json::Value| told["frames"][0]["points"].as_u64().unwrap();
    assert!(points(&all) > points(&pair), "{all}, {pair}");
    let sigma = |told: &serde_json::Value| told["frames"][0]["sigma_median"][2].as_f64().unwrap();
    assert!(sigma(&all) < 0.9 * sigma(&pair), "{all}, {pair}");
    let command =
        ["reconstruct", "model.json", "--images", one, two, "--cameras", "1,1", "-o", "x"];
    assert!(refused(at, &command).contains("two or more different cameras"));
    let command =
        ["reconstruct", "model.json", "--images", one, two, "--cameras", "1,2,3", "-o", "x"];
    assert!(refused(at, &command).contains("2 pictures or folders of 3 cameras"));
}

#[test]
fn pairs_that_do_not_fit_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let told = |pair: [&str; 2]| {
        let command = ["reconstruct", "model.json", "--images", pair[0], pair[1], "-o", "out"];
        let told = refused(at, &command);
        assert!(!at.join("out").exists(), "{told}");
        told
    };
    assert!(told([RIGHT, LEFT]).contains("the pictures are exchanged"));

    let right = image::open(at.join(RIGHT)).unwrap().to_luma8();
    let small = image::imageops::thumbnail(&right, 320, 240);
    small.save(at.join("small.png")).unwrap();
    assert!(told([LEFT, "small.png"]).contains("320 x 240"));

    // The right camera has turned down a little.
    let moved = image::GrayImage::from_fn(640, 480, |x, y| *right.get_pixel(x, (y + 3).min(479)));
    moved.save(at.join("moved.png")).unwrap();
    let moved = told([LEFT, "moved.png"]);
    assert!(moved.contains("rows higher (median of") && moved.contains("moved"), "{moved}");

    let two = |name: &str, pixel: fn(u32, u32) -> u32| {
        let names = [0, 1].map(|side| format!("{name}-{side}.png"));
        for (side, file) in (0..).zip(&names) {
            let pixel = |x, _| image::Luma([pixel(x, side) as u8]);
            image::GrayImage::from_fn(640, 480, pixel).save(at.join(file)).unwrap();
        }
        told([&names[0], &names[1]])
    };
    assert!(two("stripes", |x, side| x % 8 * 30 + side).contains("or one that repeats"));
    assert!(two("blank", |_, side| 120 + side).contains("have no texture"));
    assert!(told([LEFT, LEFT]).contains("both pictures are the same"));

    // Said, and done, for who insists.
    let command = ["reconstruct", "model.json", "--images", RIGHT, LEFT, "-o", "out", "--force"];
    assert!(done(at, &command).1.contains("exchanged"));
}

/// Changes the disparities of a NumPy file of single precision.
pub(crate) fn changed(from: &Path, to: &Path, change: impl Fn(f32) -> f32) {
    let bytes = fs::read(from).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let number = |four: &[u8]| f32::from_le_bytes(four.try_into().unwrap());
    let values = bytes[start..].chunks_exact(4).flat_map(|four| change(number(four)).to_le_bytes());
    let all: Vec<u8> = bytes[..start].iter().copied().chain(values).collect();
    fs::write(to, all).unwrap();
}

#[test]
fn without_points_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    let told = |pair: [&str; 2], more: &[&str]| {
        let command = ["reconstruct", "model.json", "--images", pair[0], pair[1], "-o", "out"];
        let told = refused(at, &[&command[..], more].concat());
        assert!(!at.join("out").exists(), "{told}");
        told
    };
    let region = told([LEFT, RIGHT], &["--region", "1000,400,100,100"]);
    assert!(region.contains("wholly outside of the picture of 640 x 480"), "{region}");
    let sigma = told([LEFT, RIGHT], &["--max-sigma", "0.00001"]);
    assert!(sigma.contains("0.00001 cm") && sigma.contains("`--max-sigma`"), "{sigma}");

    let command = ["reconstruct", "model.json", "--images", LEFT, RIGHT, "-o", "own"];
    done(at, &command);
    let summary = fs::read_to_string(at.join("own/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let rows = summary["rectified"]["rectified_from_world"]["rotation"].as_array().unwrap();
    assert!(rows.len() == 3 && rows.iter().all(|row| row.as_array().unwrap().len() == 3));

    // Disparities of another program, in other ways of writing them.
    let own = at.join("own/disparity.npy");
    changed(&own, &at.join("negative.npy"), |disparity| -disparity);
    changed(&own, &at.join("sixteenths.npy"), |disparity| 16.0 * disparity);
    changed(&own, &at.join("none.npy"), |_| f32::NAN);
    let given = |name: &str| told([LEFT, RIGHT], &["--matches", name]);
    let negative = given("negative.npy");
    assert!(negative.contains("change their sign"), "{negative}");
    let sixteenths = given("sixteenths.npy");
    assert!(sixteenths.contains("divide them by 16"), "{sixteenths}");
    let none = given("none.npy");
    assert!(none.contains("all of its values are NaN"), "{none}");
    let near = told([LEFT, RIGHT], &["--matches", "own/disparity.npy", "--range", "400:800"]);
    assert!(near.contains("none of the") && near.contains("`--range NEAR:FAR`"), "{near}");
    let zero = |disparity: f32| if disparity.is_nan() { 0.0 } else { disparity };
    changed(&own, &at.join("zeros.npy"), zero);
    let zeros = ["--matches", "zeros.npy", "-o", "zeros"];
    let (_, said) = done(at, &[&command[..5], &zeros].concat());
    assert!(said.contains("pixels have the disparity 0, below all others"), "{said}");

    // Pictures are looked at, too.
    let matches = ["--matches", "own/disparity.npy"];
    assert!(told([LEFT, LEFT], &matches).contains("both pictures are the same"));
    assert!(told([RIGHT, LEFT], &matches).contains("the pictures are exchanged"));

    fs::create_dir_all(at.join("taken/cloud.ply")).unwrap();
    let taken = refused(at, &[&command[..5], &["-o", "taken"]].concat());
    assert!(taken.contains("cloud.ply is a folder"), "{taken}");
    assert_eq!(fs::read_dir(at.join("taken")).unwrap().count(), 1);
}

#[test]
fn a_frame_without_points_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    prepared(at);
    for side in ["left", "right"] {
        fs::create_dir(at.join(side)).unwrap();
        let seen = image::open(at.join(format!("capture/scene/{side}.png"))).unwrap().to_luma8();
        seen.save(at.join(format!("{side}/a.png"))).unwrap();
        // Of the second pair the region is blank.
        let blank = |x: u32, y: u32| {
            if (120..260).contains(&y) { image::Luma([120]) } else { *seen.get_pixel(x, y) }
        };
        let blank = image::GrayImage::from_fn(640, 480, blank);
        blank.save(at.join(format!("{side}/b.png"))).unwrap();
    }
    let region = ["--region", "250,180,60,20", "-o", "out"];
    let command = [&["reconstruct", "model.json", "--images", "left", "right"][..], &region];
    let (_, said) = done(at, &command.concat());
    assert!(said.contains("b.png: no p") && said.contains(" in the region "), "{said}");
    assert!(at.join("out/a/cloud.ply").is_file() && !at.join("out/b").exists());
    let told = fs::read_to_string(at.join("out/summary.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert!(told["frames"][0]["points"].is_u64() && told["frames"][1]["fault"].is_string());
}
