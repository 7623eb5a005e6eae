//! Scenes: exact places, and pictures that agree between cameras.

use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Point3},
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_synthetic::{Rig, Scene, Sensor, write_scene};

/// A sensor that adds nothing: the same light everywhere, no blur, no noise.
const IDEAL: Sensor = Sensor {
    blur: 0.0,
    read_noise: 0.0,
    shot_noise: 0.0,
    vignetting: 0.0,
    uneven_light: 0.0,
    clutter: false,
};

/// Pixels of a lattice over a camera's picture, with the places that they show.
fn lattice(scene: &Scene, camera: &PosedCamera, step: usize) -> Vec<(Pixel, Point3)> {
    let pixels = (0..camera.height)
        .step_by(step)
        .flat_map(|y| (0..camera.width).step_by(step).map(move |x| Pixel::new(x as f64, y as f64)));
    pixels.filter_map(|pixel| Some((pixel, scene.place(camera, pixel)?))).collect()
}

#[test]
fn a_place_falls_on_the_pixel_that_shows_it_and_lies_in_the_range() {
    for name in Rig::NAMES {
        let rig = Rig::named(name, 8).unwrap();
        let scene = Scene::before(&rig, 3);
        for camera in &rig.cameras {
            let shown = lattice(&scene, camera, 23);
            // The corners of a fisheye's picture see past the scene.
            assert!(shown.len() > 28 * 21 * 3 / 4, "{name}: {}", shown.len());
            for (pixel, place) in shown {
                let back = camera.project(place).unwrap();
                assert!((back - pixel).norm() < 1e-6, "{name}: {pixel} shows {place}, at {back}");
                assert!((Scene::RANGE[0]..=Scene::RANGE[1]).contains(&place.z), "{name}: {place}");
            }
        }
    }
}

/// Places that two cameras see at least two pixels from where another body begins, with the grey values
/// of both pictures.
fn seen_by_both(scene: &Scene, rig: &Rig, images: &[GrayImage]) -> Vec<[f64; 2]> {
    let [first, second] = [&rig.cameras[0], &rig.cameras[1]];
    let mut grey = Vec::new();
    for (pixel, place) in lattice(scene, first, 7) {
        let Some(other) = second.project_visible(place) else { continue };
        let around = [[0.0, 0.0], [2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]];
        let is_smooth = around.iter().all(|[x, y]| {
            let beside = scene.place(second, Pixel::new(other.x + x, other.y + y));
            beside.is_some_and(|beside| (beside - place).norm() < 3.0 * rig.chart_pitch() / 5.0)
        });
        if is_smooth {
            let value = f64::from(images[0].at(pixel.x as isize, pixel.y as isize));
            grey.push([value, f64::from(images[1].sample(other))]);
        }
    }
    grey
}

#[test]
fn two_cameras_see_a_place_in_the_same_grey() {
    for name in Rig::NAMES {
        let mut rig = Rig::named(name, 2).unwrap();
        let scene = Scene::before(&rig, 1);
        // The upper part of the pictures is enough, and quick.
        rig.cameras.iter_mut().for_each(|camera| camera.height = 160);
        let picture = |camera| scene.render(camera, IDEAL, &mut Random::new(1));
        let images: Vec<_> = rig.cameras.iter().map(picture).collect();
        let grey = seen_by_both(&scene, &rig, &images);
        assert!(grey.len() > 600, "{name}: {}", grey.len());
        let count = grey.len() as f64;
        let mean = [0, 1].map(|side| grey.iter().map(|pair| pair[side]).sum::<f64>() / count);
        let product = |a: usize, b: usize| {
            grey.iter().map(|pair| (pair[a] - mean[a]) * (pair[b] - mean[b])).sum::<f64>() / count
        };
        let correlation = product(0, 1) / (product(0, 0) * product(1, 1)).sqrt();
        assert!(correlation > 0.97, "{name}: {correlation}");
        assert!(product(0, 0).sqrt() > 12.0, "{name}: {}", product(0, 0).sqrt());
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_one_another_scene() {
    let rig = Rig::named("paper", 2).unwrap();
    let picture = |seed: u64| {
        let scene = Scene::before(&rig, seed);
        let image = scene.render(&rig.cameras[0], Sensor::default(), &mut Random::new(seed));
        (image, lattice(&scene, &rig.cameras[0], 40))
    };
    let (first, places) = picture(1);
    assert_eq!((first.clone(), places.clone()), picture(1));
    let (other_image, other_places) = picture(2);
    assert!(first != other_image && places != other_places);
}

#[test]
fn a_blank_patch_is_of_one_grey_and_changes_nothing_else() {
    let rig = Rig::named("paper", 2).unwrap();
    let textured = Scene::before(&rig, 1);
    let scene = textured.clone().with_blank_patch();
    let camera = &rig.cameras[0];
    let [before, after] =
        [&textured, &scene].map(|scene| scene.render(camera, IDEAL, &mut Random::new(1)));
    let mut blank = Vec::new();
    for (pixel, place) in lattice(&scene, camera, 3) {
        assert!(!textured.is_blank(place));
        let around = [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]].map(|[x, y]| {
            let beside = scene.place(camera, Pixel::new(pixel.x + x, pixel.y + y));
            beside.is_some_and(|beside| scene.is_blank(beside))
        });
        let (x, y) = (pixel.x as isize, pixel.y as isize);
        if around == [true; 4] && scene.is_blank(place) {
            blank.push(after.at(x, y));
        } else if around == [false; 4] {
            assert_eq!(before.at(x, y), after.at(x, y), "{pixel}");
        }
    }
    assert!(blank.len() > 500, "{}", blank.len());
    assert!(blank.iter().all(|value| *value == blank[0]), "{blank:?}");
}

#[test]
fn files_hold_what_the_scene_says() {
    let rig = Rig::named("fisheye", 3).unwrap();
    let scene = Scene::before(&rig, 1);
    let folder = std::env::temp_dir().join(format!("wheatstone-scene-{}", std::process::id()));
    write_scene(&folder, (&rig, &scene), (Sensor::default(), 1), &Silent).unwrap();
    let bytes = std::fs::read(folder.join("scene/camera2_points.npy")).unwrap();
    assert!(folder.join("scene/camera3.png").exists());
    std::fs::remove_dir_all(&folder).unwrap();
    let camera = &rig.cameras[1];
    let body = bytes.len() - camera.width * camera.height * 24;
    let heading = String::from_utf8_lossy(&bytes[10..body]);
    assert!(heading.contains("'descr': '<f8'") && heading.contains("(480, 640, 3)"), "{heading}");
    let number =
        |index: usize| f64::from_le_bytes(bytes[body + 8 * index..][..8].try_into().unwrap());
    for (x, y) in [(0, 0), (320, 240), (639, 100), (200, 400)] {
        let first = 3 * (y * camera.width + x);
        let written = [0, 1, 2].map(|axis| number(first + axis));
        match scene.place(camera, Pixel::new(x as f64, y as f64)) {
            Some(place) => assert_eq!(written, <[f64; 3]>::from(place)),
            None => assert!(written.iter().all(|value| value.is_nan()), "{written:?}"),
        }
    }
}
