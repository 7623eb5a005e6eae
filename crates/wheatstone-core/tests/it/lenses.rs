//! Lenses of parts: derivatives, the way there and back, and OpenCV's tilted sensor.

use nalgebra::{Matrix3, Vector3};
use wheatstone_core::{
    camera::{
        AdjustableCamera, AnyCamera, CameraModel, brown_conrady::BrownConrady,
        kannala_brandt::KannalaBrandt, pinhole::Pinhole, tsai::Tsai,
    },
    geometry::{Pixel, Point3},
};

/// Lenses with one kind of terms each, and with all.
fn browns() -> Vec<BrownConrady> {
    let ideal = BrownConrady::ideal(Pinhole { focal: [700.0, 720.0], principal: [319.5, 239.5] });
    let full = BrownConrady {
        radial: [-0.23, 0.12, -0.02],
        tangential: [1e-3, -5e-4],
        rational: [0.1, -0.03, 0.01],
        prism: [1e-3, -2e-3, 5e-4, 3e-3],
        tilt: [0.1, -0.2],
        ..ideal
    };
    let upright = BrownConrady { tilt: [0.0; 2], ..full };
    vec![
        ideal,
        BrownConrady { radial: full.radial, ..ideal },
        BrownConrady { tangential: full.tangential, ..ideal },
        BrownConrady { rational: full.rational, ..ideal },
        BrownConrady { prism: full.prism, ..ideal },
        BrownConrady { tilt: full.tilt, ..ideal },
        upright,
        full,
    ]
}

fn tsais() -> [Tsai; 3] {
    [0.2, -0.1, 0.0].map(|kappa| Tsai { kappa, ..Tsai::default() })
}

/// A camera without derivatives of its own.
#[derive(Clone)]
struct ByDifferences<C>(C);

impl<C: AdjustableCamera> CameraModel for ByDifferences<C> {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.0.parameters_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        self.0.project(point)
    }
}

impl<C: AdjustableCamera> AdjustableCamera for ByDifferences<C> {}

fn slopes_agree_with_differences(camera: &impl AdjustableCamera) {
    let mut plain = camera.clone();
    let count = plain.parameters_mut().len();
    for (x, y) in [(0.0, 0.0), (1e-9, 0.0), (10.0, -20.0), (-30.0, 15.0), (0.3, 0.2)] {
        let point = Point3::new(x, y, 80.0);
        let (mut slopes, mut steps) = (vec![[0.0; 2]; count], vec![[0.0; 2]; count]);
        let (pixel, by_point) = camera.project_with_slopes(point, &mut slopes).unwrap();
        // Slopes by the angles of an upright sensor take another way to the same pixel.
        assert!((pixel - camera.project(point).unwrap()).norm() < 1e-12 * pixel.coords.norm());
        let (_, own) = camera.project_with_jacobian(point).unwrap();
        assert!((own - by_point).norm() < 1e-12 * own.norm());
        let differences = ByDifferences(camera.clone());
        let (_, wanted) = differences.project_with_slopes(point, &mut steps).unwrap();
        assert!((by_point - wanted).norm() < 1e-6, "{point}: {by_point}{wanted}");
        for (index, (slope, step)) in slopes.iter().zip(&steps).enumerate() {
            let gap = (slope[0] - step[0]).abs().max((slope[1] - step[1]).abs());
            assert!(gap < 1e-5, "{point}, parameter {index}: {slope:?} against {step:?}");
        }
        // Who asks for fewer gets the first.
        let mut few = [[0.0; 2]; 5];
        let (again, _) = camera.project_with_slopes(point, &mut few).unwrap();
        assert!((again - pixel).norm() < 1e-12 * pixel.coords.norm());
        for (few, all) in few.iter().zip(&slopes).flat_map(|(few, all)| few.iter().zip(all)) {
            assert!((few - all).abs() <= 1e-12 * (1.0 + all.abs()));
        }
    }
}

#[test]
fn slopes_are_those_of_the_projection() {
    browns().iter().for_each(slopes_agree_with_differences);
    tsais().iter().for_each(slopes_agree_with_differences);
    slopes_agree_with_differences(&KannalaBrandt::default());
}

#[test]
fn rays_come_back_to_their_pixels() {
    let mut all: Vec<AnyCamera> = browns().into_iter().map(Into::into).collect();
    all.extend(tsais().map(Into::into));
    all.push(KannalaBrandt::default().into());
    for camera in all {
        for (x, y) in [(0.0, 0.0), (500.0, 100.0), (319.5, 239.5), (320.0, 240.0), (639.0, 479.0)] {
            let pixel = Pixel::new(x, y);
            let back = camera.project(camera.ray(pixel).unwrap().at(7.0)).unwrap();
            assert!((back - pixel).norm() < 1e-8, "{camera:?}: {back}");
        }
    }
}

/// `computeTiltProjectionMatrix` of OpenCV's calib3d, matrix by matrix.
fn tilt_of_opencv([x, y]: [f64; 2]) -> Matrix3<f64> {
    let (cx, sx, cy, sy) = (libm::cos(x), libm::sin(x), libm::cos(y), libm::sin(y));
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cx, sx, 0.0, -sx, cx);
    let about_y = Matrix3::new(cy, 0.0, -sy, 0.0, 1.0, 0.0, sy, 0.0, cy);
    let turned = about_y * about_x;
    let depth = turned[(2, 2)];
    let projected =
        Matrix3::new(depth, 0.0, -turned[(0, 2)], 0.0, depth, -turned[(1, 2)], 0.0, 0.0, 1.0);
    projected * turned
}

#[test]
fn sensors_tilt_as_opencvs_do() {
    for tilt in [[0.0, 0.0], [0.1, 0.0], [0.0, -0.1], [0.15, -0.2], [-0.4, 0.3]] {
        for upright in browns().into_iter().filter(|lens| lens.tilt == [0.0; 2]) {
            let tilted = BrownConrady { tilt, ..upright };
            let flat = BrownConrady {
                pinhole: Pinhole { focal: [1.0; 2], principal: [0.0; 2] },
                ..upright
            };
            for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.4, 0.1), (0.05, 0.35)] {
                let point = Point3::new(x, y, 1.0);
                let bent = flat.project(point).unwrap();
                let met = tilt_of_opencv(tilt) * Vector3::new(bent.x, bent.y, 1.0);
                let wanted = tilted.pinhole.pixel(met.x / met.z, met.y / met.z);
                let found = tilted.project(point).unwrap();
                assert!((found - wanted).norm() < 1e-10, "{tilt:?}: {found} {wanted}");
            }
        }
    }
}

#[test]
fn a_sensor_on_edge_shows_nothing() {
    for tilt in [[2.0, 0.0], [0.0, -2.0], [f64::NAN, 0.0], [f64::INFINITY, 0.0]] {
        let lens = BrownConrady { tilt, ..BrownConrady::default() };
        assert_eq!(lens.project(Point3::new(0.1, 0.1, 1.0)), None);
        assert_eq!(lens.ray(Pixel::new(300.0, 200.0)), None);
    }
}

#[test]
fn nothing_is_seen_beyond_the_fold_even_where_the_polynomial_rises_again() {
    let lens = BrownConrady { radial: [-0.5, 0.1, 0.0], ..BrownConrady::default() };
    // 1 + 3 k1 s + 5 k2 s^2 is negative for s between 1 and 2, and positive beyond.
    let at = |s: f64| lens.project(Point3::new(s.sqrt(), 0.0, 1.0));
    assert!(at(0.9).is_some() && at(1.5).is_none() && at(2.5).is_none());
    let folded = Tsai { kappa: -0.2, ..Tsai::default() };
    assert!(folded.project(Point3::new(0.9, 0.0, 1.0)).is_none());
}

#[test]
fn a_fisheye_sees_behind_itself_but_not_beyond_the_fold() {
    let wide = KannalaBrandt { coefficients: [0.0; 4], ..KannalaBrandt::default() };
    assert!(wide.project(Point3::new(10.0, 0.0, -1.0)).is_some());
    assert!(wide.project(Point3::new(0.0, 0.0, -1.0)).is_none());
    let folded = KannalaBrandt { coefficients: [-0.2, 0.0, 0.0, 0.0], ..wide };
    // 1 + 3 k1 t^2 is 0 at t = 1.29 rad.
    assert!(folded.project(Point3::new(libm::tan(1.28), 0.0, 1.0)).is_some());
    assert!(folded.project(Point3::new(libm::tan(1.30), 0.0, 1.0)).is_none());
}

#[test]
fn cameras_of_old_files_have_neither_prism_nor_tilt() {
    let old = r#"{"pinhole":{"focal":[700.0,700.0],"principal":[319.5,239.5]},
        "radial":[-0.2,0.05,0.0],"tangential":[0.001,-0.0005]}"#;
    assert_eq!(serde_json::from_str::<BrownConrady>(old).unwrap(), BrownConrady::default());
    for lens in browns() {
        let text = serde_json::to_string(&lens).unwrap();
        assert_eq!(text.contains("tilt"), lens.tilt != [0.0; 2]);
        assert_eq!(serde_json::from_str::<BrownConrady>(&text).unwrap(), lens);
    }
}
