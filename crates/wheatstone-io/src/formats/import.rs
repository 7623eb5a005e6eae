//! A model file from another program's calibration.

use super::{Optics, Rig};
use wheatstone_core::{
    Calibration, Error, Result,
    calibration::{FORMAT, VERSION},
    dataset::{Dataset, volume::Volume},
    evaluate::{Ellipsoids, Evaluation},
    geometry::{Point3, ProjectionMatrix, Vector3},
    method::{
        AnyMethod, AnyReconstructor, CameraUncertainty, FittedCamera, FittedCameras,
        dlt::DltReconstructor,
    },
};

pub use wheatstone_core::calibration::Imported;

/// A model on which points can be located. It carries no data of its own: nothing is known of how well it
/// was fitted or where, so that it calls every place `outside`, and its pixels are believed to be off by
/// what `imported` says.
///
/// # Errors
///
/// [`Error::Unsupported`] for fewer than two cameras, or lenses of different kinds.
pub fn calibration(rig: &Rig, imported: Imported) -> Result<Calibration> {
    let refuse = |what: String, hint: &str| {
        Err(Error::Unsupported { format: "model".into(), what, hint: hint.into() })
    };
    if rig.cameras.len() < 2 {
        return refuse(
            format!("{} camera", rig.cameras.len()),
            "triangulation needs two; name the files of all cameras",
        );
    }
    let (method, reconstructor) = match reconstructor(rig, imported.pixel_sigma) {
        Some(found) => found,
        None => {
            return refuse(
                "cameras with lenses of different kinds".into(),
                "use only pinholes, only fisheyes, or only projection matrices",
            );
        }
    };
    let unit = rig.unit.clone().unwrap_or_else(|| "mm".into());
    let data = Dataset {
        unit: unit.clone(),
        cameras: rig.cameras.len(),
        views: Vec::new(),
        correspondences: Vec::new(),
    };
    let centres: Option<Vec<Point3>> = rig.cameras.iter().map(|c| centre(&c.optics)).collect();
    let viewpoint = centres.map(|centres| {
        let sum: Vector3 = centres.iter().map(|centre| centre.coords).sum();
        Point3::from(sum / centres.len() as f64)
    });
    Ok(Calibration {
        format: FORMAT.into(),
        version: VERSION,
        program: concat!("wheatstone ", env!("CARGO_PKG_VERSION")).into(),
        unit: unit.clone(),
        method: AnyMethod::named(method)?,
        seed: 0,
        reconstructor,
        choice: None,
        viewpoint,
        volume: Volume::of(&data),
        training: unjudged(unit),
        validation: None,
        ellipsoids: Ellipsoids::NORMAL,
        curve: Vec::new(),
        outliers: Vec::new(),
        stage: Vec::new(),
        stage_covariance: None,
        point_noise: None,
        covariance_scale: None,
        placed: None,
        findings: Vec::new(),
        sizes: Vec::new(),
        data: (&data).into(),
        start: None,
        imported: Some(imported),
        source: None,
    })
}

/// Of no points at all.
fn unjudged(unit: String) -> Evaluation {
    Evaluation {
        unit,
        n: 0,
        located: 0,
        rms: 0.0,
        mean: 0.0,
        median: 0.0,
        p95: 0.0,
        mean_percent: 0.0,
        rms_xyz: [0.0; 3],
    }
}

fn reconstructor(rig: &Rig, sigma: f64) -> Option<(&'static str, AnyReconstructor)> {
    let of = |optics: &[&Optics]| -> Option<(&'static str, AnyReconstructor)> {
        let brown: Option<Vec<_>> = optics
            .iter()
            .map(
                |optics| {
                    if let Optics::Brown(camera) = optics { Some(camera.clone()) } else { None }
                },
            )
            .collect();
        if let Some(cameras) = brown {
            return Some(("brown", with_noise(cameras, sigma).into()));
        }
        let fisheye: Option<Vec<_>> = optics
            .iter()
            .map(
                |o| if let Optics::KannalaBrandt(camera) = o { Some(camera.clone()) } else { None },
            )
            .collect();
        if let Some(cameras) = fisheye {
            return Some(("kannala-brandt", with_noise(cameras, sigma).into()));
        }
        let matrices: Option<Vec<ProjectionMatrix>> = optics
            .iter()
            .map(|o| if let Optics::Linear(matrix) = o { Some(*matrix) } else { None })
            .collect();
        Some(("dlt", DltReconstructor::known(matrices?, sigma).into()))
    };
    of(&rig.cameras.iter().map(|camera| &camera.optics).collect::<Vec<_>>())
}

fn with_noise<L>(cameras: Vec<FittedCamera<L>>, sigma: f64) -> FittedCameras<L> {
    let uncertainty = cameras.iter().map(|_| CameraUncertainty::known(sigma)).collect();
    FittedCameras { cameras, uncertainty, pixel_sigma: sigma }
}

/// Where a camera stands.
fn centre(optics: &Optics) -> Option<Point3> {
    match optics {
        Optics::Linear(matrix) => matrix.centre(),
        other => other.pose().map(|pose| Point3::from(pose.inverse().translation)),
    }
}
