//! Methods that fit cameras with a lens, in worlds of their own lenses.

use crate::staged::{rig, staged};
use wheatstone_core::{
    Error,
    camera::{brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt, tsai::Tsai},
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Vector3},
    method::{AnyMethod, AnyReconstructor, Reconstructor},
};
use wheatstone_numeric::{progress::Silent, random::Random};

fn fit(method: &str, data: &Dataset) -> AnyReconstructor {
    AnyMethod::named(method).unwrap().fit_checked(data, 0, &Silent).unwrap().reconstructor
}

/// The largest distance of a located point from its known place.
fn worst(fitted: &AnyReconstructor, data: &Dataset) -> f64 {
    let error = |(world, row): (Point3, &Correspondence)| {
        (fitted.locate(&row.pixels).unwrap().point - world).norm()
    };
    data.known().map(error).fold(0.0, f64::max)
}

fn mirrored(fitted: &AnyReconstructor) -> Vec<bool> {
    match fitted {
        AnyReconstructor::Brown(f) => f.cameras.iter().map(|c| c.mirrored).collect(),
        AnyReconstructor::KannalaBrandt(f) => f.cameras.iter().map(|c| c.mirrored).collect(),
        AnyReconstructor::Tsai(f) => f.cameras.iter().map(|c| c.mirrored).collect(),
        _ => Vec::new(),
    }
}

/// Data of each method's own lens in a world of its own, and how wide that lens observes.
fn each(
    count: usize,
    (sigma, seed): (f64, u64),
    world: impl Fn(Point3) -> Point3 + Copy,
) -> [(&'static str, Dataset); 3] {
    let noise = (sigma, seed);
    let brown = rig(vec![BrownConrady::default(); count]);
    let fisheye = rig(vec![KannalaBrandt::default(); count]);
    let tsai = rig(vec![Tsai::default(); count]);
    [
        ("brown", staged(&brown, 0.4, noise, world)),
        ("kannala-brandt", staged(&fisheye, 2.0, noise, world)),
        ("tsai", staged(&tsai, 0.4, noise, world)),
    ]
}

#[test]
fn exact_points_are_found_again_wherever_the_world_begins() {
    let far = |p: Point3| p + Vector3::new(5000.0, -300.0, 900.0);
    for count in 2..=4 {
        for (method, data) in each(count, (0.0, 1), far) {
            let fitted = fit(method, &data);
            assert!(fitted.is_consistent() && fitted.cameras() == count);
            assert_eq!(mirrored(&fitted), vec![false; count], "{method}");
            let worst = worst(&fitted, &data);
            assert!(worst < 1e-6 * 95.0, "{method}, {count} cameras: {worst}");
        }
    }
}

#[test]
fn left_handed_worlds_and_mirrors_are_noticed() {
    for (method, mut data) in each(2, (0.0, 2), |p| Point3::new(p.x, p.y, 200.0 - p.z)) {
        let fitted = fit(method, &data);
        assert_eq!(mirrored(&fitted), [true, true], "{method}");
        assert!(worst(&fitted, &data) < 1e-6 * 95.0, "{method}");
        assert!(fitted.is_consistent());
        // A mirror before the second camera as well: its picture is reversed once more.
        for row in &mut data.correspondences {
            row.pixels[1] = row.pixels[1].map(|p| Pixel::new(639.0 - p.x, p.y));
        }
        let fitted = fit(method, &data);
        assert_eq!(mirrored(&fitted), [true, false], "{method}");
        assert!(worst(&fitted, &data) < 1e-6 * 95.0, "{method}");
    }
}

#[test]
fn any_two_cameras_locate_a_point_and_one_does_not() {
    for (method, mut data) in each(3, (0.0, 3), |p| p) {
        for (index, row) in data.correspondences.iter_mut().enumerate() {
            row.pixels[index % 3] = None;
        }
        let fitted = fit(method, &data);
        assert!(worst(&fitted, &data) < 1e-6 * 95.0, "{method}");
        let mut pixels = data.correspondences[0].pixels.clone();
        pixels[1] = None;
        assert_eq!(fitted.locate(&pixels), None, "{method}");
    }
}

#[test]
fn too_few_points_and_flat_ones_are_refused() {
    for (method, data) in each(2, (0.1, 4), |p| p) {
        let fit = |keep: &dyn Fn(usize) -> bool| {
            let data = data.subset(|index, _| keep(index));
            AnyMethod::named(method).unwrap().fit_checked(&data, 0, &Silent)
        };
        let need = if method == "tsai" { 7 } else { 6 };
        for got in [5, 6, 7] {
            match fit(&|index| index % 29 == 0 && index / 29 < got) {
                Ok(_) => assert!(got >= need, "{method} from {got} points"),
                Err(Error::TooFew { method: by, need: told, got: counted, .. }) => {
                    assert!(got < need && by == method && told == need && counted == got);
                }
                Err(other) => panic!("{method} from {got} points: {other}"),
            }
        }
        let flat = fit(&|index| index < 30).map(|_| ());
        assert!(matches!(flat, Err(Error::Degenerate { .. })), "{method}: {flat:?}");
        // Deep as a whole, but one camera saw a single plane of it.
        let mut half = data.clone();
        half.correspondences.iter_mut().skip(30).for_each(|row| row.pixels[1] = None);
        let flat = AnyMethod::named(method).unwrap().fit_checked(&half, 0, &Silent);
        assert!(matches!(flat.map(|_| ()), Err(Error::Degenerate { .. })), "{method}");
    }
}

#[test]
fn reported_sigmas_are_those_of_repeated_measurement() {
    const SIGMA: f64 = 0.2;
    const DRAWS: usize = 200;
    for ((method, data), (_, exact)) in
        each(2, (SIGMA, 5), |p| p).into_iter().zip(each(2, (0.0, 5), |p| p))
    {
        let fitted = fit(method, &data);
        let mut random = Random::new(6);
        for row in exact.correspondences.iter().step_by(90) {
            let (mut sums, mut squares, mut told) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            for _ in 0..DRAWS {
                let noisy = |p: Pixel| p.map(|value| value + SIGMA * random.normal());
                let mut noisy = noisy;
                let pixels: Vec<_> = row.pixels.iter().map(|p| p.map(&mut noisy)).collect();
                let located = fitted.locate(&pixels).unwrap();
                for axis in 0..3 {
                    let value = located.point[axis] - row.world.unwrap()[axis];
                    sums[axis] += value / DRAWS as f64;
                    squares[axis] += value * value / DRAWS as f64;
                    told[axis] += located.covariance[(axis, axis)] / DRAWS as f64;
                }
            }
            for axis in 0..3 {
                let scatter = (squares[axis] - sums[axis] * sums[axis]).sqrt();
                let ratio = told[axis].sqrt() / scatter;
                assert!((0.8..1.2).contains(&ratio), "{method} axis {axis}: {ratio}");
            }
        }
    }
}

#[test]
fn a_crooked_file_is_noticed() {
    for (method, data) in each(2, (0.1, 7), |p| p) {
        let fitted = fit(method, &data);
        let text = serde_json::to_string(&fitted).unwrap();
        assert_eq!(serde_json::from_str::<AnyReconstructor>(&text).unwrap(), fitted);
        if let AnyReconstructor::Brown(mut brown) = fitted {
            brown.cameras[0].camera_from_world.rotation[(0, 0)] += 0.1;
            assert!(!brown.is_consistent());
            brown.cameras.truncate(1);
            assert!(!brown.is_consistent());
        }
    }
}
