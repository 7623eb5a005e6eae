//! Error bars of cameras that were fitted to charts held by hand.

use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    cleaning::poses::{self, Lenses, Placing},
    geometry::{Point3, Pose},
    method::AnyMethod,
    progress::Silent,
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

/// Few views, so that what is not known of the cameras is most of an error.
const VIEWS: usize = 6;

/// How often charts are held at the same places and seen with other noise.
const TIMES: u64 = 60;

fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: 0.75 * rig.chart_pitch(), columns: 11, rows: 9, ..LineGrid::default() }.into()
}

/// Sigmas told over scatter of points located with pixels free of noise, which err as the cameras do: the
/// root of the mean squared distance in units of the covariance, whatever was taken up by the frame.
fn told(method: &str, rig: &str, lenses: Lenses) -> f64 {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = chart(&rig);
    let placements =
        HandHeld { views: VIEWS, ..HandHeld::default() }.placements(&chart, 4).unwrap();
    let (mut clean, mut places) =
        hand_held_correspondences(&rig, &chart, &placements, (Noise::None, 0));
    let both: Vec<bool> = clean.correspondences.iter().map(|row| row.seen_by() == 2).collect();
    clean = clean.subset(|row, _| both[row]);
    places =
        places.into_iter().zip(both).filter(|(_, both)| *both).map(|(place, _)| place).collect();
    let method = AnyMethod::named(method).unwrap().preset("fixed").unwrap();
    let (mut squares, mut expected) = (0.0, 0.0);
    for seed in 0..TIMES {
        let (data, _) = hand_held_correspondences(&rig, &chart, &placements, (NOISE, seed));
        let placing = Placing { lenses, all_terms: true, ..Placing::default() };
        let data = poses::solve(&data, placing, &Silent).unwrap().data;
        let fit = method.fit_checked(&data, 0, &Silent).unwrap().reconstructor;
        let located: Vec<_> = clean
            .correspondences
            .iter()
            .zip(&places)
            .filter_map(|(row, world)| Some((fit.locate(&row.pixels)?, *world)))
            .collect();
        let pairs: Vec<(Point3, Point3)> = located.iter().map(|(l, w)| (l.point, *w)).collect();
        let aligned = Pose::aligning(&pairs).unwrap();
        for ((located, world), row) in located.iter().zip(&clean.correspondences) {
            squares += (aligned.transform(located.point) - world).norm_squared();
            // These pixels are exact: their part of the covariance is taken off.
            let mut normal = nalgebra::Matrix3::zeros();
            for (camera, pixel) in row.pixels.iter().enumerate() {
                let sigma = fit.pixel_sigma(camera, pixel.unwrap(), *world).unwrap();
                let slopes = rig.cameras[camera].project_with_jacobian(*world).unwrap().1;
                normal += slopes.transpose() * slopes / (sigma * sigma);
            }
            expected += located.covariance.trace() - normal.try_inverse().unwrap().trace();
        }
    }
    (expected / squares).sqrt()
}

#[test]
fn sigmas_are_those_of_repeated_fits() {
    let ratio = told("kannala-brandt", "fisheye", Lenses::KannalaBrandt);
    assert!((0.9..1.1).contains(&ratio), "{ratio:.3}");
}
