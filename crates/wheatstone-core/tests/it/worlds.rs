//! Charts that fill the fields of view of made rigs.

use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::dataset::Dataset;
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
