//! Pixels that somebody else matched.

use crate::optics::fitted;
use nalgebra::Vector2;
use wheatstone_charts::imaging::{ColourImage, GrayImage};
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Point3},
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_reconstruction::{ReconstructionSettings, SceneReconstructor};
use wheatstone_synthetic::Rig;

const SIZE: [u32; 2] = [640, 480];

/// Pictures that show nothing.
fn gray(count: usize) -> Vec<ColourImage> {
    let [width, height] = SIZE.map(|side| side as usize);
    vec![ColourImage::from_gray(GrayImage::from_fn(width, height, |_, _| 90.0)); count]
}

#[test]
fn matches_of_somebody_else_are_located() {
    let rig = Rig::named("water", 3).unwrap();
    let model = fitted(&rig, "neural-camera");
    let settings = ReconstructionSettings::new(vec![SIZE; 3]);
    let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
    let mut random = Random::new(3);
    let (mut rows, mut places) = (Vec::new(), Vec::new());
    while rows.len() < 500 {
        let place = [(-12.0, 12.0), (-9.0, 9.0), (60.0, 105.0)].map(|(a, b)| random.uniform(a, b));
        let mut seen = |camera: &PosedCamera| {
            let noise = Vector2::new(random.normal(), random.normal()) * 0.2;
            camera.project_visible(place.into()).map(|pixel| pixel + noise)
        };
        let mut row: Vec<Option<Pixel>> = rig.cameras.iter().map(&mut seen).collect();
        if row.iter().any(Option::is_none) {
            continue;
        }
        match rows.len() % 5 {
            // The third camera sees only some of them, and one match in five is beside its curve.
            0 => row[2] = None,
            1 => row[1] = row[1].map(|pixel| pixel + Vector2::new(0.0, 6.0)),
            _ => {}
        }
        rows.push(row);
        places.push(place);
    }
    let pictures = gray(3);
    let pictures: Vec<&ColourImage> = pictures.iter().collect();
    let found = made.locate_matches(&rows, 0.2, &pictures, &Silent).unwrap();
    let cloud = &found.cloud;
    // Those that share a pixel of the rectified picture are one.
    assert!((480..=500).contains(&cloud.len()), "{}", cloud.len());
    let mut inside = [0; 2];
    for index in 0..cloud.len() {
        let own = |place: &&[f64; 3]| {
            let off = [0, 1, 2].map(|axis| (place[axis] - cloud.points[index][axis]).powi(2));
            off.iter().sum::<f64>()
        };
        let place = places.iter().min_by(|a, b| own(a).total_cmp(&own(b))).unwrap();
        assert!(own(&place).sqrt() < 2.0);
        for ((truth, found), sigma) in
            place.iter().zip(cloud.points[index]).zip(cloud.sigmas[index])
        {
            let ratio = (found - truth).abs() / f64::from(sigma);
            inside[0] += usize::from(ratio < 1.0);
            inside[1] += usize::from(ratio < 2.0);
        }
        // What lies beside its curve is left out, and the third camera alone says where the point is.
        assert!(cloud.pixels[1][index][0].is_finite() || cloud.pixels[2][index][0].is_finite());
    }
    let missing = cloud.pixels[1].iter().filter(|pixel| pixel[0].is_nan()).count();
    assert!((90..=100).contains(&missing), "{missing}");
    let [one, two] = inside.map(|inside| inside as f64 / (3 * cloud.len()) as f64);
    assert!((0.6..0.8).contains(&one) && two > 0.9, "{one} {two}");
    let short = vec![vec![None; 2]];
    assert!(made.locate_matches(&short, 0.2, &pictures, &Silent).is_err());
}

#[test]
fn matches_that_contradict_each_other_are_left_out() {
    let rig = Rig::named("paper", 3).unwrap();
    let model = fitted(&rig, "brown");
    let settings = ReconstructionSettings::new(vec![SIZE; 3]);
    let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
    let reference = rig.cameras[0].centre();
    let mut random = Random::new(4);
    let mut rows = Vec::new();
    while rows.len() < 100 {
        let place = [(-12.0, 12.0), (-9.0, 9.0), (60.0, 95.0)].map(|(a, b)| random.uniform(a, b));
        let place = Point3::from(place);
        // Of every other one the third camera sees what lies behind it.
        let behind = if rows.len() % 2 == 0 { place } else { place + 0.1 * (place - reference) };
        let row: Vec<_> = std::iter::zip(&rig.cameras, [place, place, behind])
            .map(|(camera, place)| camera.project_visible(place))
            .collect();
        if row.iter().all(Option::is_some) {
            rows.push(row);
        }
    }
    let pictures = gray(3);
    let pictures: Vec<&ColourImage> = pictures.iter().collect();
    let found = made.locate_matches(&rows, 0.2, &pictures, &Silent).unwrap();
    for pixel in &found.cloud.pixels[0] {
        let first = |row: &Vec<Option<Pixel>>| {
            let own = row[0].unwrap();
            (own.x - f64::from(pixel[0])).abs() + (own.y - f64::from(pixel[1])).abs()
        };
        let row = (0..100).min_by(|a, b| first(&rows[*a]).total_cmp(&first(&rows[*b]))).unwrap();
        assert!(row % 2 == 0, "{row}");
    }
    assert!((48..=50).contains(&found.cloud.len()), "{}", found.cloud.len());
}
