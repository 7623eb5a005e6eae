//! `wheatstone match`: what it writes, and what it says of pairs that are none.

use crate::program::{command, done, refused, said, wheatstone};
use std::{fs, path::Path};
use wheatstone::numeric::{random::Random, simd::REGISTERS};

const SIZE: (usize, usize) = (160, 120);

/// Disparity of the scene: a wall, and a box before it.
fn truth(x: usize, y: usize) -> usize {
    if (50..110).contains(&x) && (30..90).contains(&y) { 14 } else { 6 }
}

/// A textured pair of that scene, the right picture so many rows lower.
fn pair(folder: &Path, rows_lower: usize) {
    let mut random = Random::new(7);
    let (width, height) = (SIZE.0 + 40, SIZE.1 + 20);
    let noise: Vec<f64> = (0..width * height).map(|_| random.uniform(0.0, 255.0)).collect();
    // Texture of some pixels' size, as lenses show it.
    let smooth = |x: usize, y: usize| {
        let around = (0..9).map(|k| noise[(y + k / 3) * width + x + k % 3]);
        (around.sum::<f64>() / 9.0).round() as u8
    };
    let left = image::GrayImage::from_fn(SIZE.0 as u32, SIZE.1 as u32, |x, y| {
        image::Luma([smooth(x as usize + 20, y as usize + 8)])
    });
    let right = image::GrayImage::from_fn(SIZE.0 as u32, SIZE.1 as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let row = (y + 8 - rows_lower).saturating_sub(8);
        // What is nearest is seen.
        let seen = [14, 6].into_iter().find(|d| truth((x + d).min(SIZE.0 - 1), row) == *d);
        image::Luma([smooth(x + seen.unwrap_or(6) + 20, y + 8 - rows_lower)])
    });
    left.save(folder.join("left.png")).unwrap();
    right.save(folder.join("right.png")).unwrap();
}

/// The numbers of a `.npy` file of float32.
fn numbers(path: &Path) -> Vec<f32> {
    let bytes = fs::read(path).unwrap();
    let words = &bytes[bytes.len() - 4 * SIZE.0 * SIZE.1..];
    let head = String::from_utf8_lossy(&bytes[..bytes.len() - words.len()]).into_owned();
    assert!(head.contains("'<f4'") && head.contains("(120, 160)"), "{head}");
    words.as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect()
}

#[test]
fn a_pair_becomes_three_arrays_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    pair(at, 0);
    let (printed, told) =
        done(at, &["match", "left.png", "right.png", "--range", "0:24", "-o", "out", "--json"]);
    assert!(!told.contains("warning"), "{told}");
    let printed: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert!(printed["confident"].as_f64().unwrap() > 0.6, "{printed}");
    let [disparity, confidence, sigma] = ["disparity", "confidence", "sigma"]
        .map(|name| numbers(&at.join(format!("out/{name}.npy"))));
    let (mut confident, mut right) = (0, 0);
    for place in 0..SIZE.0 * SIZE.1 {
        assert_eq!(disparity[place].is_nan(), confidence[place] == 0.0);
        if confidence[place] > 0.9 {
            confident += 1;
            let expected = truth(place % SIZE.0, place / SIZE.0) as f32;
            right += usize::from((disparity[place] - expected).abs() < 1.0);
            assert!(sigma[place] > 0.0 && sigma[place] < 1.0);
        }
    }
    assert!(100 * right >= 98 * confident, "{right} of {confident}");
    let seen = image::open(at.join("out/disparity.png")).unwrap().to_luma8();
    assert!(seen.get_pixel(80, 60).0[0] > seen.get_pixel(20, 20).0[0], "the box is nearer");
    // The same bits in the narrowest registers.
    let narrow = ["match", "left.png", "right.png", "--range", "0:24", "-o", "narrow"];
    let narrow = command(at, &narrow).env(REGISTERS, "128").output().unwrap();
    assert!(narrow.status.success(), "{}", said(&narrow));
    for name in ["disparity", "confidence", "sigma"].map(|name| format!("{name}.npy")) {
        let read = |folder: &str| fs::read(at.join(folder).join(&name)).unwrap();
        assert!(read("out") == read("narrow"), "{name}");
    }
    // Filled: a disparity everywhere, of which what was filled in has no confidence.
    done(at, &["match", "left.png", "right.png", "--range", "0:24", "-o", "out", "--fill"]);
    assert!(numbers(&at.join("out/disparity.npy")).iter().all(|value| value.is_finite()));
}

#[test]
fn what_is_no_rectified_pair_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let matched = |left: &str, right: &str, range: &str| {
        let range = format!("--range={range}");
        said(&wheatstone(at, &["match", left, right, &range, "-o", "out"]))
    };
    pair(at, 3);
    let told = matched("left.png", "right.png", "0:24");
    assert!(told.contains("3.0 rows lower"), "{told}");
    pair(at, 0);
    let told = matched("right.png", "left.png", "0:24");
    assert!(told.contains("the pictures are exchanged"), "{told}");
    let told = matched("left.png", "left.png", "0:24");
    assert!(told.contains("both pictures are the same"), "{told}");
    let told = matched("left.png", "right.png", "30:60");
    assert!(told.contains("nothing in common within the range"), "{told}");
    for (name, level, how) in [("night.png", 4, "dark"), ("noon.png", 250, "overexposed")] {
        let (width, height) = (SIZE.0 as u32, SIZE.1 as u32);
        image::GrayImage::from_pixel(width, height, image::Luma([level]))
            .save(at.join(name))
            .unwrap();
        let told = matched("left.png", name, "0:24");
        assert!(told.contains(&format!("; {name} is {how}: {level} of 255 grey levels")), "{told}");
    }
    image::GrayImage::new(100, 100).save(at.join("other.png")).unwrap();
    let sizes = refused(at, &["match", "left.png", "other.png", "--range", "0:9", "-o", "out"]);
    assert!(sizes.contains("160 x 120 pixels and the right one 100 x 100"), "{sizes}");
    for range in ["9:2", "a:b", "7"] {
        refused(at, &["match", "left.png", "right.png", &format!("--range={range}"), "-o", "out"]);
    }
    let outside = refused(at, &["match", "left.png", "right.png", "--range", "500:600", "-o", "o"]);
    assert!(outside.contains("lead out of a picture 160 pixels wide"), "{outside}");
    assert!(!at.join("o").exists());
}
