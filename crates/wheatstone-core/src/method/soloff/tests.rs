use super::*;
use crate::{
    camera::pinhole::Pinhole,
    method::{
        AnyReconstructor,
        fitted_cameras::tests::{rig, staged},
    },
};
use wheatstone_numeric::{progress::Silent, random::Random};

#[test]
fn there_are_soloffs_nineteen_terms_and_planes_take_depth_away() {
    assert_eq!(all_powers().len(), 19);
    let mut random = Random::new(4);
    let mut levels = |heights: &[f64]| -> Vec<u8> {
        let points: Vec<[f64; 3]> = (0..200)
            .map(|index| {
                let height = heights[index % heights.len()];
                [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), height]
            })
            .collect();
        let kept = determined(&points);
        (0..3).map(|z| kept.iter().filter(|powers| powers[2] == z).count() as u8).collect()
    };
    assert_eq!(levels(&[-1.0, 0.0, 0.4, 1.0]), [10, 6, 3]);
    assert_eq!(levels(&[-1.0, 0.1, 1.0]), [10, 6, 3]);
    assert_eq!(levels(&[-1.0, 1.0]), [10, 6, 0]);
    assert_eq!(levels(&[-1.0, -0.999, 1.0]), [10, 6, 0]);
}

#[test]
fn an_exact_polynomial_is_recovered_and_its_slopes_agree_with_differences() {
    let rig = rig(vec![Pinhole { focal: [690.0; 2], principal: [320.0, 240.0] }; 3]);
    let data = staged(&rig, 0.3, (0.0, 1), |world| world);
    let Ok(Fit { reconstructor: AnyReconstructor::Soloff(fitted), .. }) =
        Soloff {}.fit(&data, 0, &Silent)
    else {
        panic!("not fitted")
    };
    let truth = Point3::new(6.0, -7.0, 90.0);
    let step = 1e-6;
    let mut pixels = Vec::new();
    for camera in &fitted.cameras {
        let at = fitted.scaled(truth);
        let (pixel, slopes) = camera.project(at);
        for axis in 0..3 {
            let (mut ahead, mut behind) = (at, at);
            ahead[axis] += step;
            behind[axis] -= step;
            let difference = (camera.project(ahead).0 - camera.project(behind).0) / (2.0 * step);
            assert!((difference - slopes.column(axis)).norm() < 1e-5);
        }
        pixels.push(Some(pixel));
    }
    assert!((fitted.locate(&pixels).unwrap().point - truth).norm() < 1e-7);
    pixels[1] = None;
    assert!((fitted.locate(&pixels).unwrap().point - truth).norm() < 1e-7);
    pixels[2] = None;
    assert!(fitted.locate(&pixels).is_none());
}

#[test]
fn broken_numbers_are_refused() {
    let rig = rig(vec![Pinhole { focal: [690.0; 2], principal: [320.0, 240.0] }; 2]);
    let data = staged(&rig, 0.3, (0.0, 1), |world| world);
    let Ok(Fit { reconstructor: AnyReconstructor::Soloff(fitted), .. }) =
        Soloff {}.fit(&data, 0, &Silent)
    else {
        panic!("not fitted")
    };
    assert!(fitted.is_consistent());
    let text = serde_json::to_string(&fitted).unwrap();
    let back: SoloffReconstructor = serde_json::from_str(&text).unwrap();
    assert_eq!(back, fitted);
    let odd = text.replacen('{', "{\"other\": 1,", 1);
    assert!(serde_json::from_str::<SoloffReconstructor>(&odd).is_err());
    let mut broken = fitted.clone();
    broken.half[1] = 0.0;
    assert!(!broken.is_consistent());
    let mut broken = fitted.clone();
    broken.cameras[0].terms.pop();
    assert!(!broken.is_consistent());
}
