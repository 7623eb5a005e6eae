//! From a model and what lies beside it to a report.

use super::{
    Report, Validation, budget,
    cameras::{Stand, stand},
    grid::Grid,
    material::{Material, Wording},
    pictures,
    points::{EvaluatedPoints, Scene, dataset, judge, remembered},
    preparation::{finding, outlier, stage},
    sections::{
        Accuracy, CameraFigures, Curve, CurveFigure, DepthBand, ErrorBarPoint, MethodFigures,
        PointFigures, ViewFigures,
    },
    verdict,
};
use nalgebra::Matrix3;
use wheatstone_core::{
    Calibration, Result,
    camera::{PosedCamera, picture_domain::bounding},
    dataset::Dataset,
    evaluate::{Comparison, PointError, floor, summarise},
    geometry::{Point3, Vector3},
};
use wheatstone_numeric::{
    progress::Progress,
    statistics::{median, root_mean_square},
};

impl Report {
    /// Judges a model and draws everything that can be drawn of it.
    ///
    /// # Errors
    ///
    /// Those of reading pictures, and [`wheatstone_core::Error::Cancelled`].
    pub fn of(material: &Material, progress: &dyn Progress) -> Result<Self> {
        let model = material.model;
        let data = dataset(&model.data);
        let areas = areas(material, &data);
        let stands: Vec<Option<Stand>> = areas
            .iter()
            .enumerate()
            .map(|(camera, (area, _))| stand(&model.reconstructor, &data, camera, *area))
            .collect();
        let forward: Vector3 = stands.iter().flatten().map(Stand::forward).sum();
        let forward = (forward.norm() > 0.0).then(|| forward.normalize());
        let scene = Scene::new(&data, model, forward);
        let EvaluatedPoints { judgement, points, views } =
            judge(model, &scene, material.held_out, progress)?;
        let mut report = Self {
            command: material.command.clone(),
            method: Some(method_name(model)),
            settings: serde_json::to_value(&model.method).unwrap_or_default(),
            seed: Some(model.seed),
            judgement,
            views,
            methods: methods(material),
            learning: learning(model),
            error_bars: error_bars(&points),
            accuracy: accuracy(&scene, &points, material.truth),
            depth: depth_bands(&data, &points, material.truth),
            point_views: data.views.clone(),
            outliers: model.outliers.iter().map(outlier).collect(),
            stage: model.stage.iter().map(stage).collect(),
            placed: model.placed.clone(),
            findings: model.findings.iter().map(finding).collect(),
            ..Self::empty(&material.title, &model.unit)
        };
        report.cameras = (0..data.cameras)
            .map(|index| camera(material, (index, areas[index]), &stands[index], &points))
            .collect();
        if let Some(seen) = &material.seen {
            let faults = (&report.outliers[..], &report.findings[..]);
            let gallery = pictures::gallery(seen, &points, faults, progress)?;
            (report.pictures, report.crops) = (gallery.pictures, gallery.crops);
            report.outlier_crops = gallery.outlier_crops;
        }
        if let Some(budget) = budget::of_model(model, (&data, &points), judgement, progress)? {
            report.budget = budget::shares(&budget);
            // Where the true cameras are not known, the pixel noise that the most flexible fit leaves tells.
            if let Some(accuracy) = report.accuracy.as_mut().filter(|all| all.floor_rms.is_none()) {
                accuracy.floor_rms = Some(accuracy.rms / budget.ratio_to_floor);
            }
        }
        report.points = points;
        report.verdict = verdict::of(&report, model.choice.as_ref(), material.wording);
        Ok(report)
    }

    /// What a comparison alone tells.
    #[must_use]
    pub fn of_comparison(
        comparison: &Comparison,
        title: &str,
        command: Option<String>,
        wording: Wording,
    ) -> Self {
        let mut report = Self {
            command,
            methods: compared(comparison),
            views: views_of_chosen(comparison),
            budget: comparison.budget.as_ref().map(budget::shares).unwrap_or_default(),
            judgement: Validation::HeldOut,
            ..Self::empty(title, &comparison.unit)
        };
        report.verdict = verdict::of_comparison(&report, comparison, wording);
        report
    }
}

fn method_name(model: &Calibration) -> String {
    match &model.choice {
        Some(choice) => format!("{}, chosen by auto", choice.chosen),
        None => model.method.name().into(),
    }
}

/// Each camera's picture, or where its points lie, and whether it is the picture.
fn areas(material: &Material, data: &Dataset) -> Vec<([f64; 4], bool)> {
    // Pixel (0, 0) is the middle of the first one.
    let picture = |size: [usize; 2]| -> ([f64; 4], bool) {
        ([-0.5, -0.5, size[0] as f64 - 0.5, size[1] as f64 - 0.5], true)
    };
    let of_points = |camera: usize| {
        let pixels = data.correspondences.iter().filter_map(|row| row.pixels[camera]);
        let area = bounding(pixels).filter(|[left, _, right, _]| left < right);
        (area.unwrap_or([0.0, 0.0, 1.0, 1.0]), false)
    };
    let known = |camera: usize| {
        if let Some(seen) = &material.seen {
            let of_camera = seen.found.pictures.iter().find_map(|view| view.get(camera)?.as_ref());
            let (width, height) = image::image_dimensions(&of_camera?.path).ok()?;
            return Some([width as usize, height as usize]);
        }
        material.truth?.get(camera).map(|camera| [camera.width, camera.height])
    };
    (0..data.cameras)
        .map(|camera| known(camera).map_or_else(|| of_points(camera), picture))
        .collect()
}

fn camera(
    material: &Material,
    (index, (area, area_is_picture)): (usize, ([f64; 4], bool)),
    stand: &Option<Stand>,
    points: &[PointFigures],
) -> CameraFigures {
    let pixels = points.iter().filter_map(|p| Some((p.pixels[index]?, p)));
    let seen: Vec<([f64; 2], f64)> = pixels.clone().map(|(pixel, _)| (pixel, 1.0)).collect();
    let errors: Vec<([f64; 2], f64)> =
        pixels.clone().filter_map(|(pixel, p)| Some((pixel, p.error()?))).collect();
    let misses: Vec<f64> =
        pixels.filter_map(|(_, p)| p.located.as_ref()?.misses[index]).flatten().collect();
    let name = material.seen.map(|seen| seen.capture.cameras[index].name.clone());
    CameraFigures {
        name: name.unwrap_or_else(|| format!("camera {}", index + 1)),
        area,
        area_is_picture,
        centre: stand.as_ref().map(|stand| stand.centre.into()),
        corners: stand.iter().flat_map(|stand| stand.corners.map(Into::into)).collect(),
        seen: seen.len(),
        miss_rms: (!misses.is_empty()).then(|| root_mean_square(&misses)),
        coverage: Grid::of(area, &seen),
        errors: Grid::of(area, &errors),
    }
}

fn accuracy(
    scene: &Scene,
    points: &[PointFigures],
    truth: Option<&[PosedCamera]>,
) -> Option<Accuracy> {
    let from = scene.viewpoint.unwrap_or(Point3::origin());
    let judged = points.iter().enumerate().filter_map(|(row, point)| {
        let (world, found) = (point.world?, point.located.as_ref()?.point);
        let working_distance = (Point3::from(world) - from).norm();
        let difference = Point3::from(found) - Point3::from(world);
        Some((PointError { row, difference, working_distance }, point.predicted()))
    });
    let (errors, predicted): (Vec<PointError>, Vec<Option<f64>>) = judged.unzip();
    let n = wheatstone_core::evaluate::judged(scene.data);
    let found = summarise(&errors, n, &scene.data.unit).ok()?;
    let distances: Vec<f64> = errors.iter().map(|error| error.working_distance).collect();
    let predicted: Option<Vec<f64>> = predicted.into_iter().collect();
    Some(Accuracy {
        n,
        located: found.located,
        rms: found.rms,
        median: found.median,
        p95: found.p95,
        mean_percent: found.mean_percent,
        rms_xyz: found.rms_xyz,
        working_distance: median(&distances),
        predicted_rms: predicted.map(|all| root_mean_square(&all)),
        floor_rms: truth.and_then(|cameras| Some(floor(cameras, scene.data).ok()?.rms)),
    })
}

/// More bands than this are too narrow to tell apart in the figure.
const MOST_BANDS: usize = 12;

/// Points a band at least: the rms of fewer is uncertain by more than a fifth.
const LEAST_IN_BAND: usize = 12;

fn depth_bands(
    data: &Dataset,
    points: &[PointFigures],
    truth: Option<&[PosedCamera]>,
) -> Vec<DepthBand> {
    let mut judged: Vec<(f64, usize)> = points
        .iter()
        .enumerate()
        .filter(|(_, point)| point.error().is_some())
        .filter_map(|(index, point)| Some((point.located.as_ref()?.depth, index)))
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let bands = (judged.len() / LEAST_IN_BAND).clamp(1, MOST_BANDS);
    let band = |members: &[(f64, usize)]| {
        let of = |value: fn(&PointFigures) -> Option<f64>| -> Vec<f64> {
            members.iter().filter_map(|(_, index)| value(&points[*index])).collect()
        };
        let predicted = of(PointFigures::predicted);
        let inside: std::collections::BTreeSet<usize> = members.iter().map(|m| m.1).collect();
        let floor = truth.and_then(|cameras| {
            Some(floor(cameras, &data.subset(|index, _| inside.contains(&index))).ok()?.rms)
        });
        DepthBand {
            depth: members.iter().map(|member| member.0).sum::<f64>() / members.len() as f64,
            points: members.len(),
            rms: root_mean_square(&of(PointFigures::error)),
            predicted_rms: (predicted.len() == members.len()).then(|| root_mean_square(&predicted)),
            floor_rms: floor,
        }
    };
    let size = judged.len().div_ceil(bands).max(1);
    judged.chunks(size).map(band).collect()
}

/// The share of true places within ellipsoids of rising size, where the ellipsoids are sound.
fn error_bars(points: &[PointFigures]) -> Vec<ErrorBarPoint> {
    let mut held: Vec<f64> = points.iter().filter_map(needed_share).collect();
    held.sort_by(f64::total_cmp);
    // Fewer points make steps, not a curve.
    const LEAST: usize = 20;
    if held.len() < LEAST {
        return Vec::new();
    }
    let shares = (1..20).map(|step| f64::from(step) * 0.05);
    let shares = [0.01].into_iter().chain(shares).chain([0.99]);
    let actual = |nominal: f64| held.partition_point(|q| *q <= nominal) as f64 / held.len() as f64;
    shares.map(|nominal| ErrorBarPoint { nominal, actual: actual(nominal) }).collect()
}

/// How much an ellipsoid must promise to just reach the point's true place: the chi-square
/// distribution of three degrees of freedom at the squared Mahalanobis distance.
fn needed_share(point: &PointFigures) -> Option<f64> {
    let located = point.located.as_ref()?;
    let [xx, xy, xz, yy, yz, zz] = located.covariance?;
    let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let error = Point3::from(point.world?) - Point3::from(located.point);
    let square = error.dot(&covariance.cholesky()?.solve(&error));
    let half = square / 2.0;
    let tail = (4.0 * half / std::f64::consts::PI).sqrt() * libm::exp(-half);
    Some(libm::erf(half.sqrt()) - tail)
}

fn methods(material: &Material) -> Vec<MethodFigures> {
    if let Some(comparison) = material.comparison {
        return compared(comparison);
    }
    let Some(choice) = &material.model.choice else { return Vec::new() };
    let row = |(method, rms): &(String, f64)| MethodFigures {
        method: method.clone(),
        rms: Some(*rms),
        median: None,
        p95: None,
        ratio_to_floor: None,
        located: None,
        chosen: *method == choice.chosen,
        problem: None,
    };
    choice.held_out_rms.iter().map(row).collect()
}

fn compared(comparison: &Comparison) -> Vec<MethodFigures> {
    let row = |row: &wheatstone_core::evaluate::MethodScore| MethodFigures {
        method: row.method.clone(),
        rms: row.rms,
        median: row.median,
        p95: row.p95,
        ratio_to_floor: row.ratio_to_floor,
        located: Some([row.located, row.n]),
        chosen: comparison.chosen.as_ref() == Some(&row.method),
        problem: row.problem.clone(),
    };
    comparison.methods.iter().map(row).collect()
}

/// What each held-out view came to for the method that is to be trusted.
fn views_of_chosen(comparison: &Comparison) -> Vec<ViewFigures> {
    let chosen =
        comparison.methods.iter().find(|row| comparison.chosen.as_ref() == Some(&row.method));
    chosen.map_or_else(Vec::new, |row| remembered(&row.folds))
}

fn learning(model: &Calibration) -> Option<CurveFigure> {
    let points: Vec<[f64; 2]> = model
        .curve
        .iter()
        .map(|point| [point.epoch as f64, point.mean_square_error.sqrt()])
        .collect();
    (points.len() > 1).then(|| CurveFigure {
        across: "epochs".into(),
        up: "rms error of the outputs, scaled".into(),
        curves: vec![Curve { name: "points that are fitted".into(), points }],
        levels: Vec::new(),
    })
}

impl Validation {
    /// What the points are called in the page.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::HeldOut => "held-out points",
            Self::Fitted => "fitted points",
            Self::Nothing => "no points",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LocatedFigures;

    #[test]
    fn ellipsoids_promise_by_the_chi_square_distribution() {
        let point = |distance: f64| PointFigures {
            view: 0,
            id: None,
            pixels: Vec::new(),
            world: Some([1.0, 2.0, 3.0 + distance]),
            located: Some(LocatedFigures {
                point: [1.0, 2.0, 3.0],
                covariance: Some([4.0, 0.0, 0.0, 4.0, 0.0, 4.0]),
                residual: None,
                misses: Vec::new(),
                depth: 3.0,
            }),
        };
        // Quantiles of three degrees of freedom, from any table.
        for (square, share) in [(2.366, 0.5), (6.251, 0.9), (7.815, 0.95), (11.345, 0.99)] {
            let needed = needed_share(&point(2.0 * f64::sqrt(square))).unwrap();
            assert!((needed - share).abs() < 1e-4, "{needed} for {share}");
        }
    }
}
