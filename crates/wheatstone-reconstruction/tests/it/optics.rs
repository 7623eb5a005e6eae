//! Scenes through every optics, reconstructed by models that were fitted to charts.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, OnceLock},
};
use wheatstone_charts::{
    chart::line_grid::LineGrid,
    imaging::{ColourImage, GrayImage},
};
use wheatstone_core::{
    Calibration, Error, geometry::Pixel, method::AnyMethod, preparation::Prepared,
};
use wheatstone_numeric::{progress::Silent, random::Random, statistics::percentile};
use wheatstone_reconstruction::{
    FrameFusion, Reconstruction, ReconstructionSettings, SceneReconstructor,
};
use wheatstone_synthetic::{Noise, Rig, Scene, Sensor, Stage, chart_correspondences};

const SIZE: [u32; 2] = [640, 480];
pub(crate) const SIZES: [[u32; 2]; 2] = [SIZE; 2];

pub(crate) fn fitted(rig: &Rig, method: &str) -> Calibration {
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(rig, &chart, &views, (Noise::Normal(0.1), 0), None);
    let method = AnyMethod::named(method).unwrap();
    Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent).unwrap()
}

/// Pictures that were rendered, by cameras and scene.
static RENDERED: Mutex<BTreeMap<String, Arc<OnceLock<Vec<ColourImage>>>>> =
    Mutex::new(BTreeMap::new());

/// What the cameras of a rig show of a scene. It is rendered once, as that takes longer than to match it, and many tests
/// look at the same.
pub(crate) fn pictures(rig: &Rig, scene: &Scene) -> Vec<ColourImage> {
    let key = format!("{:?} {scene:?}", rig.cameras);
    let rendered = RENDERED.lock().unwrap().entry(key).or_default().clone();
    let render = || {
        let mut random = Random::new(5);
        let seen = |camera| scene.render(camera, Sensor::default(), &mut random);
        rig.cameras.iter().map(seen).map(ColourImage::from_gray).collect()
    };
    rendered.get_or_init(render).clone()
}

/// How a cloud compares with the scene.
#[derive(Debug)]
struct Judged {
    points: usize,
    /// Percent of the distance.
    median: f64,
    /// The share of points that are off by more than ten standard deviations.
    gross: f64,
    /// The share of points that are off by more than two percent of the distance.
    far: f64,
    /// The shares of errors along X, Y and Z within one and two standard deviations.
    covered: [f64; 2],
}

/// `order` says which of the pixels are those of `camera`.
fn judged(
    (rig, scene): (&Rig, &Scene),
    (camera, order): (usize, usize),
    found: &Reconstruction,
) -> Judged {
    let cloud = &found.cloud;
    let (mut errors, mut inside, mut gross, mut all) = (Vec::new(), [0; 2], 0, 0);
    // All of them: gross errors are some hundreds in a picture.
    for index in 0..cloud.len() {
        let [x, y] = cloud.pixels[order][index].map(f64::from);
        let Some(truth) = scene.place(&rig.cameras[camera], Pixel::new(x, y)) else { continue };
        let off = [0, 1, 2].map(|axis| cloud.points[index][axis] - truth[axis]);
        let ratios = [0, 1, 2].map(|axis| off[axis].abs() / f64::from(cloud.sigmas[index][axis]));
        let size = off.iter().map(|off| off * off).sum::<f64>().sqrt();
        errors.push(100.0 * size / truth.coords.norm());
        gross += usize::from(ratios[2] > 10.0);
        all += 1;
        for (inside, bound) in inside.iter_mut().zip([1.0, 2.0]) {
            *inside += ratios.iter().filter(|ratio| **ratio < bound).count();
        }
    }
    Judged {
        points: all,
        median: percentile(&errors, 0.5),
        gross: gross as f64 / all as f64,
        far: errors.iter().filter(|error| **error > 2.0).count() as f64 / all as f64,
        covered: inside.map(|inside| inside as f64 / (3 * all) as f64),
    }
}

fn reconstructed(rig: &Rig, method: &str, scene: &Scene) -> Reconstruction {
    let model = fitted(rig, method);
    let made =
        SceneReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
    let pictures = pictures(rig, scene);
    made.reconstruct(&[&pictures[0], &pictures[1]], &Silent).unwrap()
}

#[test]
fn clouds_of_every_optics_are_where_the_scene_is() {
    // The largest median error in percent of the distance, and the least shares within one and two standard deviations.
    // Behind a wavy window what a map has wrong is a part of the noise that it assumes of pixels, which a cloud leaves out.
    for (name, method, most, least) in [
        ("paper", "brown", 0.16, [0.63, 0.92]),
        ("water", "neural-camera", 0.18, [0.63, 0.92]),
        ("glass", "neural-camera", 0.19, [0.63, 0.92]),
        ("fisheye", "kannala-brandt", 0.58, [0.63, 0.92]),
        ("bump", "neural-camera", 0.24, [0.61, 0.91]),
        ("tube", "neural-camera", 0.2, [0.63, 0.92]),
        ("mirror", "neural-camera", 0.5, [0.63, 0.92]),
        ("paper", "network", 0.31, [0.60, 0.92]),
    ] {
        let rig = Rig::named(name, 2).unwrap();
        let scene = Scene::before(&rig, 1);
        let found = reconstructed(&rig, method, &scene);
        assert!(found.fault.is_none(), "{name}: {:?}", found.fault);
        let told = judged((&rig, &scene), (0, 0), &found);
        assert!(told.points > 165_000 && told.median < most, "{name} {method}: {told:?}");
        assert!(told.gross < 0.003, "{name} {method}: {told:?}");
        for (covered, (least, most)) in
            told.covered.into_iter().zip(least.into_iter().zip([0.75, 0.98]))
        {
            assert!(covered > least && covered < most, "{name} {method}: {told:?}");
        }
    }
}

#[test]
fn cameras_look_where_they_do_and_those_of_a_network_too() {
    let rig = Rig::named("paper", 2).unwrap();
    for method in ["brown", "network"] {
        let model = fitted(&rig, method);
        let made =
            SceneReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
        for (camera, truth) in rig.cameras.iter().enumerate() {
            for (x, y) in [(0.0, 0.0), (639.0, 0.0), (320.0, 240.0), (0.0, 479.0)] {
                let found = made.direction(camera, Pixel::new(x, y)).unwrap();
                let ray = truth.ray(Pixel::new(x, y)).unwrap();
                let off = found.cross(&ray.direction.normalize()).norm();
                assert!(off < 0.01 && found.dot(&ray.direction) > 0.0, "{method}: {off}");
            }
            let view = made.view(camera).unwrap();
            let off = (view.translation - truth.centre().coords).norm();
            assert!(off < 1.0, "{method}: {off}");
        }
    }
}

/// What some of the cameras make of a scene.
fn seen_by(
    cameras: &[usize],
    model: &Calibration,
    (rig, scene): (&Rig, &Scene),
    pictures: &[ColourImage],
) -> Judged {
    let mut settings = ReconstructionSettings::new(vec![SIZE; cameras.len()]);
    settings.cameras = cameras.to_vec();
    let made = SceneReconstructor::new(model, settings, &Silent).unwrap();
    let seen: Vec<&ColourImage> = cameras.iter().map(|camera| &pictures[*camera]).collect();
    let found = made.reconstruct(&seen, &Silent).unwrap();
    assert!(found.fault.is_none(), "{:?}", found.fault);
    assert!(found.cloud.pixels.len() == cameras.len());
    judged((rig, scene), (0, 0), &found)
}

#[test]
fn a_camera_of_half_the_resolution_leaves_error_bars_as_they_should_be() {
    let rig = Rig::named("paper", 2).unwrap();
    let scene = Scene::before(&rig, 1);
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let mut data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 0), None);
    for row in &mut data.correspondences {
        let halved = |pixel: Pixel| Pixel::new(0.5 * pixel.x - 0.25, 0.5 * pixel.y - 0.25);
        row.pixels[1] = row.pixels[1].map(halved);
    }
    let method = AnyMethod::named("brown").unwrap();
    let model = Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent).unwrap();
    let mut pictures = pictures(&rig, &scene);
    let whole = pictures[1].gray.clone();
    let half = GrayImage::from_fn(320, 240, |x, y| {
        let [x, y] = [2 * x, 2 * y].map(|at| at as isize);
        0.25 * (whole.at(x, y) + whole.at(x + 1, y) + whole.at(x, y + 1) + whole.at(x + 1, y + 1))
    });
    pictures[1] = ColourImage::from_gray(half);
    let settings = ReconstructionSettings::new([SIZE, [320, 240]]);
    let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
    let found = made.reconstruct(&[&pictures[0], &pictures[1]], &Silent).unwrap();
    let told = judged((&rig, &scene), (0, 0), &found);
    assert!((0.63..0.75).contains(&told.covered[0]), "{told:?}");
    assert!((0.92..0.98).contains(&told.covered[1]), "{told:?}");
}

#[test]
fn four_cameras_are_better_than_two() {
    let rig = Rig::named("paper", 4).unwrap();
    let model = fitted(&rig, "brown");
    // Points that are far off are few, at edges of depth: those of one scene alone say little. The shares of
    // four cameras, and of the two pairs.
    let mut far = [0.0; 3];
    for seed in [2, 3] {
        let scene = Scene::before(&rig, seed);
        let pictures = pictures(&rig, &scene);
        let with = |cameras: &[usize]| seen_by(cameras, &model, (&rig, &scene), &pictures);
        let four = with(&[0, 1, 2, 3]);
        far[0] += four.far;
        for (pair, far) in [[0, 1], [0, 2]].iter().zip(&mut far[1..]) {
            let two = with(pair);
            assert!(four.points > two.points, "{pair:?}: {two:?}, {four:?}");
            assert!(four.median < 0.75 * two.median, "{pair:?}: {two:?}, {four:?}");
            *far += two.far;
        }
        assert!(four.far < 0.001 && (0.63..0.75).contains(&four.covered[0]), "{four:?}");
        assert!((0.91..0.98).contains(&four.covered[1]), "{four:?}");
    }
    assert!(far[0] < 0.45 * far[1].min(far[2]), "{far:?}");
}

#[test]
fn pictures_of_another_size_are_refused() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let model = fitted(&rig, "brown");
    let made =
        SceneReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
    let small = ColourImage::from_gray(GrayImage::from_fn(320, 240, |x, y| (x + y) as f32));
    let refused = made.reconstruct(&[&small, &small], &Silent);
    assert!(matches!(refused, Err(Error::Mismatch { .. })));
    let far =
        ReconstructionSettings { depths: Some([5.0, 2.0]), ..ReconstructionSettings::new(SIZES) };
    assert!(matches!(SceneReconstructor::new(&model, far, &Silent), Err(Error::Setting { .. })));
}

#[test]
fn corners_and_edges_are_where_the_scene_is() {
    // The largest median error in percent of the distance.
    for (name, method, most) in [
        ("paper", "brown", 0.19),
        ("water", "neural-camera", 0.20),
        ("glass", "neural-camera", 0.23),
        ("fisheye", "kannala-brandt", 0.50),
        ("tube", "neural-camera", 0.21),
        ("mirror", "neural-camera", 0.45),
    ] {
        let rig = Rig::named(name, 2).unwrap();
        let scene = Scene::before(&rig, 1);
        let model = fitted(&rig, method);
        let settings =
            ReconstructionSettings { sparse: true, ..ReconstructionSettings::new(SIZES) };
        let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
        let pictures = pictures(&rig, &scene);
        let found = made.reconstruct(&[&pictures[0], &pictures[1]], &Silent).unwrap();
        assert!(found.fault.is_none(), "{name}: {:?}", found.fault);
        let told = judged((&rig, &scene), (0, 0), &found);
        assert!(found.cloud.len() > 3000 && told.median < most, "{name}: {told:?}");
        assert!(told.gross < 0.01, "{name}: {told:?}");
        let [one, two] = told.covered;
        assert!((0.6..0.76).contains(&one) && (0.9..0.98).contains(&two), "{name}: {told:?}");
        // Each of a feature of its own, which its map has too.
        let known = found.map.disparity.iter().filter(|value| value.is_finite()).count();
        assert!(known >= found.cloud.len());
    }
}

#[test]
fn frames_of_one_scene_are_better_than_one() {
    let rig = Rig::named("paper", 2).unwrap();
    let scene = Scene::before(&rig, 1);
    let model = fitted(&rig, "brown");
    let made =
        SceneReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
    let frame = |seed: u64| -> Vec<ColourImage> {
        let mut random = Random::new(seed);
        let seen = |camera| scene.render(camera, Sensor::default(), &mut random);
        rig.cameras.iter().map(seen).map(ColourImage::from_gray).collect()
    };
    let fused = |count: u64| {
        let mut fusion = FrameFusion::new(&made);
        for seed in 0..count {
            let frame = frame(seed);
            assert!(fusion.add(&[&frame[0], &frame[1]], &Silent).unwrap().is_none());
        }
        let found = fusion.finish(&Silent).unwrap();
        judged((&rig, &scene), (0, 0), &found)
    };
    let (one, four) = (fused(1), fused(4));
    assert!(four.points > one.points && four.median < 0.85 * one.median, "{one:?}, {four:?}");
    assert!((0.63..0.74).contains(&four.covered[0]), "{four:?}");
    assert!((0.92..0.98).contains(&four.covered[1]) && four.far < 0.003, "{four:?}");
    let nothing = FrameFusion::new(&made).finish(&Silent);
    assert!(matches!(nothing, Err(Error::Degenerate { .. })));
}
