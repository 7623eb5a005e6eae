//! Charts that fill the fields of view of made rigs.

use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    dataset::Dataset,
    geometry::Pixel,
    method::{LocatedBatch, Reconstructor},
};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences};

/// A chart that fills the rig's field of view.
pub(crate) fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into()
}

/// It at each distance of a stage.
pub(crate) fn charts(rig: &Rig, stage: Stage, noise: Noise, most: usize) -> Dataset {
    let views = stage.views().unwrap();
    chart_correspondences(rig, &chart(rig), &views, (noise, 100), Some(most))
}

/// A rig with a chart, and that chart at each distance of a stage.
pub(crate) fn world(name: &str, cameras: usize) -> (Rig, AnyChart, Dataset) {
    let rig = Rig::named(name, cameras).unwrap();
    let chart = chart(&rig);
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 3), Some(400));
    (rig, chart, train)
}

/// The largest gap of points, in standard deviations; of standard deviations, those of residuals among them,
/// as a share; of residuals, in pixels.
pub(crate) fn gaps(
    map: &dyn Reconstructor,
    rows: &[Vec<Option<Pixel>>],
    places: &LocatedBatch,
) -> [f64; 3] {
    let mut gaps = [0.0_f64; 3];
    for (index, row) in rows.iter().enumerate() {
        let Some(exact) = map.locate(row) else {
            assert!(places.point[0][index].is_nan() && places.covariance[0][index].is_nan());
            continue;
        };
        for axis in 0..3 {
            let sigma = exact.covariance[(axis, axis)].sqrt();
            gaps[0] = gaps[0].max((places.point[axis][index] - exact.point[axis]).abs() / sigma);
            let own = places.covariance[[0, 3, 5][axis]][index].sqrt();
            gaps[1] = gaps[1].max((own / sigma - 1.0).abs());
        }
        let told = (places.residual[index], places.residual_sigma[index]);
        assert_eq!(told.0.is_nan(), exact.residual.is_none());
        if let Some(exact) = exact.residual {
            gaps[1] = gaps[1].max((told.1 / exact.sigma - 1.0).abs());
            gaps[2] = gaps[2].max((told.0 - exact.rms).abs());
        }
    }
    gaps
}
