//! The paper's data, made again.

use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    Result,
    dataset::Dataset,
    evaluate::{Evaluation, evaluate, viewpoint},
    geometry::{Point3, Pose},
    method::Reconstructor,
};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

/// Whole pixels: the paper measured no finer.
pub(super) const NOISE: Noise = Noise::Quantised;

/// Pairs that are learned, and points elsewhere.
pub(super) struct Data {
    pub(super) rig: Rig,
    pub(super) chart: AnyChart,
    pub(super) train: Dataset,
    /// In the trained range.
    pub(super) exam: Dataset,
    /// At 150 to 200 cm.
    pub(super) beyond: Dataset,
    from: Option<Point3>,
}

impl Data {
    /// Of a rig, with this noise of pixels.
    pub(super) fn new(rig: &str, noise: Noise) -> Result<Self> {
        let rig = Rig::named(rig, 2)?;
        let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
        let views = Stage::default().views()?;
        let train = chart_correspondences(&rig, &chart, &views, (noise, 1), Some(400));
        let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 2), 1000);
        let beyond = random_correspondences(&rig, &chart, (150.0, 200.0), (noise, 3), 1000);
        let from = viewpoint(&train);
        Ok(Self { rig, chart, train, exam, beyond, from })
    }

    /// The same pixels, with points in another frame.
    pub(super) fn moved(mut self, other_from_world: &Pose) -> Self {
        for data in [&mut self.train, &mut self.exam, &mut self.beyond] {
            for row in &mut data.correspondences {
                row.world = row.world.map(|point| other_from_world.transform(point));
            }
        }
        self.from = viewpoint(&self.train);
        self
    }

    pub(super) fn errors(&self, map: &dyn Reconstructor, data: &Dataset) -> Result<Evaluation> {
        evaluate(map, data, self.from)
    }

    pub(super) fn percent(&self, map: &dyn Reconstructor, data: &Dataset) -> f64 {
        self.errors(map, data).map_or(f64::NAN, |found| found.mean_percent)
    }
}
