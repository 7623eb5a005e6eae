//! A method of one's own: the mean of the nearest fitted points. It cannot interpolate between views.
#![expect(clippy::print_stdout, reason = "an example prints")]

use wheatstone::{
    AnyMethod, Calibration, Dataset, Fit, LineGrid, Located, Locator, Method, Pixel, Point3,
    Prepared, Progress, Reconstructor, Result, Silent, compare,
    geometry::Vector3,
    method::AnyReconstructor,
    nalgebra::Matrix3,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

#[derive(Clone)]
struct Nearest {
    count: usize,
}

#[derive(Clone)]
struct Table {
    count: usize,
    rows: Vec<(Vec<Option<Pixel>>, Point3)>,
}

impl Method for Nearest {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        progress.check()?;
        let rows = train.known().map(|(world, row)| (row.pixels.clone(), world)).collect();
        Ok(Fit::of(AnyReconstructor::custom("nearest", Table { count: self.count, rows })))
    }
    fn summary(&self) -> &'static str {
        "mean of the nearest fitted points"
    }
}

impl Reconstructor for Table {
    fn cameras(&self) -> usize {
        self.rows.first().map_or(0, |(pixels, _)| pixels.len())
    }
    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let squared = |row: &[Option<Pixel>]| -> Option<f64> {
            row.iter().zip(pixels).map(|(a, b)| Some(((*a)? - (*b)?).norm_squared())).sum()
        };
        let near = self.rows.iter().filter_map(|(row, point)| Some((squared(row)?, point.coords)));
        let mut near: Vec<(f64, Vector3)> = near.collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(self.count);
        let count = near.len() as f64;
        let mean = near.iter().map(|(_, point)| point).sum::<Vector3>() / count;
        let scatter = near.iter().map(|(_, point)| (point - mean) * (point - mean).transpose());
        let covariance = scatter.sum::<Matrix3<f64>>() / count;
        (count > 0.0).then(|| Located::without_rays(mean.into(), covariance))
    }
}

pub(crate) fn main() -> Result<()> {
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views()?;
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 0), None);
    let own = AnyMethod::custom("nearest", Nearest { count: 8 });
    for row in compare(&[own.clone(), AnyMethod::named("dlt")?], &data, None, 0, &Silent)?.methods {
        println!("{:8} {:.3} cm rms on views left out", row.method, row.rms.unwrap_or(f64::NAN));
    }
    let model = Calibration::fit(&own, &Prepared::as_given(data), 0, false, &Silent)?;
    let columns: [&[f64]; 4] = [&[300.0, 320.0], &[220.0, 240.0], &[290.0, 310.0], &[220.0, 240.0]];
    let batch = Locator::new(&*model.reconstructor, None).locate_columns(&columns, &Silent)?;
    println!("{:.1?}", batch.point);
    Ok(())
}
