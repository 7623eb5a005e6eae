//! Methods, charts, camera models and formats of other crates take part like the built-in ones.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
};
use wheatstone::{
    AnyCamera, AnyChart, AnyMethod, Calibration, CameraModel, Capture, Chart, ChartSearch,
    Correspondence, Dataset, Detection, DetectionSettings, Error, Fit, FnProgress, Format, Given,
    GrayImage, InputFile, LineGrid, Located, Locator, Method, OutputFile, Pixel, Point3, Pose,
    PosedCamera, Prepared, Progress, Reconstructor, Result, Silent,
    capture::{CameraPictures, CapturedView},
    chart::Shape,
    compare, cross_validate,
    detection::detect_in,
    formats::{Content, Layout},
    geometry::Vector3,
    method::AnyReconstructor,
    nalgebra::Matrix3,
    numeric::random::Random,
    synthetic::{Noise, Rig, Sensor, Stage, chart_correspondences, render},
};

/// The paper's rig before a grid at seven distances.
fn seven_views(rig: &Rig) -> Dataset {
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    chart_correspondences(rig, &chart, &views, (Noise::Normal(0.1), 0), None)
}

/// Triangulates with the linear cameras of another method, and says so.
#[derive(Clone)]
struct Borrowed;

#[derive(Clone)]
struct Map(AnyReconstructor);

impl Method for Borrowed {
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        let fit = AnyMethod::named("dlt")?.fit(train, seed, progress)?;
        Ok(Fit::of(AnyReconstructor::custom("borrowed", Map(fit.reconstructor))))
    }

    fn summary(&self) -> &'static str {
        "linear cameras of another method"
    }
}

impl Reconstructor for Map {
    fn cameras(&self) -> usize {
        self.0.cameras()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let point = self.0.locate(pixels)?.point;
        Some(Located::without_rays(point, Matrix3::identity()))
    }
}

#[test]
fn a_method_of_another_crate_is_judged_and_located_with() {
    let data = seven_views(&Rig::named("paper", 2).unwrap());
    let (own, dlt) = (AnyMethod::custom("borrowed", Borrowed), AnyMethod::named("dlt").unwrap());
    assert_eq!(own.name(), "borrowed");
    assert_eq!(own.preset("default").unwrap(), own);
    assert!(matches!(own.preset("paper"), Err(Error::UnknownName { .. })));
    let table = compare(&[own.clone(), dlt], &data, None, 0, &Silent).unwrap();
    assert_eq!(table.methods[0].method, "borrowed");
    assert_eq!(table.methods[0].rms, table.methods[1].rms);
    assert!(cross_validate(&own, &data, 0, &Silent).unwrap().is_some());

    let model =
        Calibration::fit(&own, &Prepared::as_given(data.clone()), 0, true, &Silent).unwrap();
    assert!(model.validation.is_some());
    assert_eq!(model.clone(), model);
    let pixels = &data.correspondences[0].pixels;
    let columns: Vec<Vec<f64>> =
        pixels.iter().flatten().flat_map(|pixel| [vec![pixel.x], vec![pixel.y]]).collect();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let mut locator = Locator::new(&*model.reconstructor, Some(&model.volume));
    let batch = locator.locate_columns(&columns, &Silent).unwrap();
    assert_eq!(batch.get(0).unwrap().point, model.reconstructor.locate(pixels).unwrap().point);
    assert_eq!(batch.sigma()[0], [1.0]);
}

#[test]
fn a_map_of_another_crate_is_not_saved_and_the_error_says_why() {
    let data = seven_views(&Rig::named("paper", 2).unwrap());
    let own = AnyMethod::custom("borrowed", Borrowed);
    let model = Calibration::fit(&own, &Prepared::as_given(data), 0, false, &Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = model.save(&folder.path().join("model.json")).unwrap_err();
    assert!(error.to_string().contains("the fitted map `borrowed`, which is not part"), "{error}");
    assert!(error.hint().is_some());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let error = serde_json::to_string(&model.method).unwrap_err();
    assert!(error.to_string().contains("`borrowed` is not part of this library"), "{error}");
}

#[test]
fn columns_that_do_not_fit_are_refused_and_work_is_stopped() {
    let data = seven_views(&Rig::named("paper", 2).unwrap());
    let dlt = AnyMethod::named("dlt").unwrap();
    let model = Calibration::fit(&dlt, &Prepared::as_given(data), 0, false, &Silent).unwrap();
    let mut locator = Locator::new(&*model.reconstructor, None);
    let one: &[f64] = &[300.0];
    let mut refused = |columns: &[&[f64]]| locator.locate_columns(columns, &Silent).unwrap_err();
    assert!(matches!(refused(&[one, one]), Error::Mismatch { .. }));
    assert!(matches!(refused(&[one, one, one, &[]]), Error::Setting { .. }));
    let many = vec![300.0; 200_000];
    let stop = FnProgress::new(|_, _, _| ControlFlow::Break(()));
    let stopped = locator.locate_columns(&[&many, &many, &many, &many], &stop);
    assert!(matches!(stopped, Err(Error::Cancelled)));
}

/// One black disc on a board that fills the picture.
#[derive(Clone)]
struct Disc {
    radius: f64,
}

impl Chart for Disc {
    fn points(&self) -> Vec<Point3> {
        vec![Point3::origin()]
    }

    fn shapes(&self) -> Vec<Shape> {
        vec![Shape::Disc([0.0, 0.0], self.radius)]
    }

    fn board(&self) -> [f64; 4] {
        [-500.0, -500.0, 500.0, 500.0]
    }

    fn reflectance(&self, [x, y]: [f64; 2], _size: [f64; 2]) -> Option<f64> {
        Some(if x * x + y * y < self.radius * self.radius { 0.0 } else { 1.0 })
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let (mut sum, mut weight) = (Vector3::zeros(), 0.0);
        for y in 0..image.height() {
            for (x, value) in image.row(y).iter().enumerate().filter(|(_, value)| **value < 60.0) {
                let dark = f64::from(60.0 - value);
                sum += dark * Vector3::new(x as f64, y as f64, 0.0);
                weight += dark;
            }
        }
        if weight == 0.0 {
            return ChartSearch::NotFound("nothing is dark".into());
        }
        let at = Pixel::new(sum.x / weight, sum.y / weight);
        ChartSearch::Found(vec![Detection { points: vec![(0, at)], sigmas: Vec::new() }])
    }

    fn validate(&self) -> Result<()> {
        Ok(())
    }
}

/// A capture of this chart at these places; its pictures have names, but no files.
fn capture(chart: &AnyChart, places: &[Pose]) -> Capture {
    let camera = |name: &str| CameraPictures {
        name: name.into(),
        pictures: (0..places.len())
            .map(|view| Some(PathBuf::from(format!("{name}/{view}"))))
            .collect(),
    };
    let view = |(index, pose): (usize, &Pose)| CapturedView {
        name: index.to_string(),
        world_from_chart: Some(*pose),
        sigma: None,
    };
    Capture {
        path: "memory".into(),
        unit: "cm".into(),
        chart: chart.clone(),
        cameras: ["left", "right"].map(camera).into(),
        views: places.iter().enumerate().map(view).collect(),
    }
}

#[test]
fn a_chart_of_another_crate_is_drawn_and_found_in_pictures_from_memory() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let chart = AnyChart::custom("disc", Disc { radius: 2.0 });
    let place = |x: f64| Pose { translation: Vector3::new(x, 1.0, 90.0), ..Pose::default() };
    let places = [place(-5.0), place(4.0)];
    let sensor = Sensor { vignetting: 0.0, uneven_light: 0.0, clutter: false, ..Sensor::default() };
    let read = |path: &Path| {
        let text = path.to_string_lossy();
        let (camera, view) = text.split_once('/').unwrap();
        let camera = &rig.cameras[usize::from(camera == "right")];
        let place = &places[view.parse::<usize>().unwrap()];
        Ok(render(camera, &chart, place, sensor, &mut Random::new(0)))
    };
    let capture = capture(&chart, &places);
    let found = detect_in(&capture, DetectionSettings::default(), &read, &Silent).unwrap();
    assert_eq!(found.dataset.correspondences.len(), 2);
    for (row, place) in found.dataset.correspondences.iter().zip(&places) {
        for (camera, pixel) in rig.cameras.iter().zip(&row.pixels) {
            let truth = camera.project(Point3::from(place.translation)).unwrap();
            assert!((pixel.unwrap() - truth).norm() < 0.2, "{pixel:?} {truth}");
        }
    }
}

/// The equisolid fisheye: the distance from the principal point is `2 f sin(angle / 2)`.
#[derive(Clone)]
struct Equisolid {
    focal: f64,
    principal: [f64; 2],
}

impl CameraModel for Equisolid {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let [x, y] = &mut self.principal;
        vec![&mut self.focal, x, y]
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        // sin(angle / 2) is the distance from the axis over the root of 2 d (d + z).
        let distance = point.coords.norm();
        let scale = 2.0 * self.focal / (2.0 * distance * (distance + point.z)).sqrt();
        let [x, y] = self.principal;
        (point.z > 0.0).then(|| Pixel::new(x + scale * point.x, y + scale * point.y))
    }
}

#[test]
fn a_camera_model_of_another_crate_projects_and_its_pictures_are_fitted() {
    let mut rig = Rig::named("fisheye", 2).unwrap();
    for camera in &mut rig.cameras {
        let model = Equisolid { focal: 260.0, principal: [319.5, 239.5] };
        *camera = PosedCamera { model: AnyCamera::custom("equisolid", model), ..camera.clone() };
    }
    let camera = &rig.cameras[0];
    let world = Point3::new(8.0, -5.0, 80.0);
    let ray = camera.ray(camera.project(world).unwrap()).unwrap();
    assert!((world - ray.origin).cross(&ray.direction).norm() < 1e-6);

    let method = AnyMethod::named("kannala-brandt").unwrap();
    let prepared = Prepared::as_given(seven_views(&rig));
    let model = Calibration::fit(&method, &prepared, 0, false, &Silent).unwrap();
    let seen = model.reconstructor.project(0, world).unwrap();
    assert!((seen - camera.project(world).unwrap()).norm() < 0.2);
}

#[test]
fn a_changed_copy_of_a_foreign_camera_is_another_one() {
    let first = AnyCamera::custom("equisolid", Equisolid { focal: 260.0, principal: [0.0, 0.0] });
    let mut second = first.clone();
    assert_eq!(first, second);
    *second.parameters_mut()[0] = 300.0;
    assert_ne!(first, second);
    let point = Point3::new(10.0, 0.0, 80.0);
    assert!(first.project(point).unwrap().x < second.project(point).unwrap().x);
    assert!(serde_json::to_string(&first).is_err());
    assert!(serde_json::from_str::<AnyCamera>(r#"{"type": "custom"}"#).is_err());
}

/// `x1 y1 x2 y2` a line.
const SPACED: Format = Format {
    name: "spaced",
    about: "pixels of two cameras, four numbers a line",
    layout: Layout::File("txt"),
    content: Content::Points {
        read: Some(read_spaced),
        write: Some(write_spaced),
        known_only: false,
    },
};

fn read_spaced(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let mut rows = Vec::new();
    for line in files.first().map_or(Ok(""), InputFile::text)?.lines() {
        let cells: Vec<f64> = line.split(' ').filter_map(|cell| cell.parse().ok()).collect();
        let pixels = cells.chunks(2).map(|pair| Some(Pixel::new(pair[0], pair[1]))).collect();
        rows.push(Correspondence { view: 0, id: None, pixels, world: None, board: None });
    }
    let unit = given.unit().into();
    Ok(Dataset { unit, cameras: 2, views: Vec::new(), correspondences: rows })
}

fn write_spaced(data: &Dataset, _: &Given) -> Result<Vec<OutputFile>> {
    let line = |row: &Correspondence| {
        let cells = row.pixels.iter().flatten().map(|pixel| format!("{} {}", pixel.x, pixel.y));
        cells.collect::<Vec<_>>().join(" ") + "\n"
    };
    let text: String = data.correspondences.iter().map(line).collect();
    Ok(vec![OutputFile { name: String::new(), bytes: text.into_bytes() }])
}

#[test]
fn a_format_of_another_crate_writes_and_reads() {
    let data = seven_views(&Rig::named("paper", 2).unwrap());
    let mut written = SPACED.write_points(&data, &Given::default()).unwrap();
    let file = InputFile { path: "points.txt".into(), bytes: written.remove(0).bytes };
    let read = SPACED.read_points(&[file], &Given::default()).unwrap();
    assert_eq!(read.correspondences.len(), data.correspondences.len());
    assert_eq!(read.correspondences[5].pixels, data.correspondences[5].pixels);
}
