//! Scenes through every optics, reconstructed by models that were fitted to charts.

use wheatstone_charts::{chart::line_grid::LineGrid, imaging::ColourImage};
use wheatstone_core::{
    Calibration, Error, geometry::Pixel, method::AnyMethod, preparation::Prepared,
};
use wheatstone_numeric::{progress::Silent, random::Random, statistics::percentile};
use wheatstone_reconstruction::{PairReconstructor, Reconstruction, ReconstructionSettings};
use wheatstone_synthetic::{Noise, Rig, Scene, Sensor, Stage, chart_correspondences};

const SIZES: [[u32; 2]; 2] = [[640, 480]; 2];

fn fitted(rig: &Rig, method: &str) -> Calibration {
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(rig, &chart, &views, (Noise::Normal(0.1), 0), None);
    let method = AnyMethod::named(method).unwrap();
    Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent).unwrap()
}

fn pictures(rig: &Rig, scene: &Scene) -> [ColourImage; 2] {
    let mut random = Random::new(5);
    [0, 1].map(|camera| {
        let picture = scene.render(&rig.cameras[camera], Sensor::default(), &mut random);
        ColourImage::from_gray(picture)
    })
}

/// How a cloud compares with the scene.
#[derive(Debug)]
struct Judged {
    points: usize,
    /// Percent of the distance.
    median: f64,
    /// The share of points that are off by more than ten standard deviations.
    gross: f64,
    /// The shares of errors along X, Y and Z within one and two standard deviations.
    covered: [f64; 2],
}

fn judged(rig: &Rig, scene: &Scene, found: &Reconstruction) -> Judged {
    let cloud = &found.cloud;
    let (mut errors, mut inside, mut gross, mut all) = (Vec::new(), [0; 2], 0, 0);
    // Enough for shares of a percent.
    for index in (0..cloud.len()).step_by(11) {
        let [x, y] = cloud.pixels[0][index].map(f64::from);
        let Some(truth) = scene.place(&rig.cameras[0], Pixel::new(x, y)) else { continue };
        let off = [0, 1, 2].map(|axis| f64::from(cloud.points[index][axis]) - truth[axis]);
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
        covered: inside.map(|inside| inside as f64 / (3 * all) as f64),
    }
}

fn reconstructed(rig: &Rig, method: &str, scene: &Scene) -> Reconstruction {
    let model = fitted(rig, method);
    let made = PairReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
    let [first, second] = pictures(rig, scene);
    made.reconstruct([&first, &second]).unwrap()
}

#[test]
fn clouds_of_every_optics_are_where_the_scene_is() {
    // The largest median error in percent of the distance, and the least shares within one and two standard deviations.
    // Behind a wavy window what a map has wrong is a part of the noise that it assumes of pixels, which a cloud leaves out.
    for (name, method, most, least) in [
        ("paper", "brown", 0.16, [0.63, 0.92]),
        ("water", "neural-camera", 0.18, [0.61, 0.91]),
        ("glass", "neural-camera", 0.19, [0.63, 0.92]),
        ("fisheye", "kannala-brandt", 0.58, [0.63, 0.92]),
        ("bump", "neural-camera", 0.24, [0.57, 0.87]),
        ("paper", "network", 0.31, [0.60, 0.92]),
    ] {
        let rig = Rig::named(name, 2).unwrap();
        let scene = Scene::before(&rig, 1);
        let found = reconstructed(&rig, method, &scene);
        assert!(found.fault.is_none(), "{name}: {:?}", found.fault);
        let told = judged(&rig, &scene, &found);
        assert!(told.points > 15_000 && told.median < most, "{name} {method}: {told:?}");
        assert!(told.gross < 0.003, "{name} {method}: {told:?}");
        for (covered, (least, most)) in
            told.covered.into_iter().zip(least.into_iter().zip([0.75, 0.98]))
        {
            assert!(covered > least && covered < most, "{name} {method}: {told:?}");
        }
    }
}

#[test]
fn pictures_of_another_size_are_refused() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let model = fitted(&rig, "brown");
    let made = PairReconstructor::new(&model, ReconstructionSettings::new(SIZES), &Silent).unwrap();
    let small =
        ColourImage::from_gray(wheatstone_charts::imaging::GrayImage::from_fn(320, 240, |x, y| {
            (x + y) as f32
        }));
    let refused = made.reconstruct([&small, &small]);
    assert!(matches!(refused, Err(Error::Mismatch { .. })));
    let far =
        ReconstructionSettings { depths: Some([5.0, 2.0]), ..ReconstructionSettings::new(SIZES) };
    assert!(matches!(PairReconstructor::new(&model, far, &Silent), Err(Error::Setting { .. })));
}
