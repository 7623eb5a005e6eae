//! The cameras of a model as another program can hold them: exactly where it can, otherwise fitted to the
//! model's own map, with what is lost.
//!
//! A model whose cameras have a map from world to pixel is followed at points of the volume that it was
//! fitted to. Those that have none (networks, interpolation) only say where matched pixels meet: a rig
//! is fitted to the pixels and places of the model's own points, then to places that the model finds for
//! the pixels of that rig, so that no noise of the measured pixels is in it. The loss is judged at other
//! points: how far the rig's pixel of a point lies from the model's.

use super::{
    Error, Form, Optics, Rig, RigCamera,
    samples::{Samples, of_model, of_rig},
};
use serde::Serialize;
use wheatstone_core::{
    Calibration, Result,
    dataset::{Correspondence, Dataset},
    error::{Hint, Remedy},
    geometry::{Pixel, Point3},
    method::{
        AnyReconstructor, Method, Reconstructor, brown::Brown, dlt::Dlt,
        kannala_brandt::KannalaBrandt,
    },
};
use wheatstone_numeric::{progress::Progress, statistics::root_mean_square};

/// What a fitted rig does not say as the model does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// What was fitted.
    pub form: String,
    /// Root mean square distance of the rig's pixels from the model's, over all cameras.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
    /// Pixels that were compared.
    pub points: usize,
}

/// A rig, and what was lost on the way to it; nothing where it says the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Approximation {
    /// The cameras.
    pub rig: Rig,
    /// How far they are from where they come from.
    pub loss: Option<Loss>,
}

/// The cameras of a model, where they are of a kind that a rig has.
#[must_use]
pub fn exact(model: &Calibration) -> Option<Rig> {
    let optics: Vec<Optics> = match &model.reconstructor {
        AnyReconstructor::Brown(fitted) => {
            fitted.cameras.iter().cloned().map(Optics::Brown).collect()
        }
        AnyReconstructor::KannalaBrandt(fitted) => {
            fitted.cameras.iter().cloned().map(Optics::KannalaBrandt).collect()
        }
        AnyReconstructor::Dlt(fitted) => {
            fitted.matrices().iter().copied().map(Optics::Linear).collect()
        }
        _ => return None,
    };
    Some(named(model, optics))
}

/// Cameras with the names and sizes that the model knows.
fn named(model: &Calibration, optics: Vec<Optics>) -> Rig {
    let imported = model.imported.as_ref();
    let camera = |(index, optics): (usize, Optics)| {
        let name = imported.and_then(|imported| imported.cameras.get(index).cloned());
        RigCamera {
            name: name.unwrap_or_else(|| format!("camera{}", index + 1)),
            size: model.picture_size(index),
            optics,
        }
    };
    let cameras = optics.into_iter().enumerate().map(camera).collect();
    Rig { unit: Some(model.unit.clone()), cameras }
}

/// A model's cameras in one of several forms: without loss where any of them allows it, otherwise the one
/// that comes nearest.
///
/// # Errors
///
/// [`Error::Unsupported`] where the world is left-handed or no form can follow the model,
/// [`Error::Cancelled`].
pub fn approximate(
    model: &Calibration,
    forms: &[Form],
    progress: &dyn Progress,
) -> Result<Approximation> {
    if let Some(rig) = exact(model) {
        // A model that came from a file has no points of its own to be followed at.
        if model.data.world.is_empty() {
            return approximate_rig(&rig, forms, progress);
        }
        if let Some(rig) = within(&rig, forms) {
            return Ok(Approximation { rig, loss: None });
        }
    }
    let (optics, loss) = nearest(&of_model(model, 0), &of_model(model, 1), forms, progress)?;
    Ok(Approximation { rig: named(model, optics), loss: Some(loss) })
}

/// The same for cameras that came from a file, followed all over their pictures.
///
/// # Errors
///
/// As [`approximate`].
pub fn approximate_rig(
    rig: &Rig,
    forms: &[Form],
    progress: &dyn Progress,
) -> Result<Approximation> {
    if let Some(rig) = within(rig, forms) {
        return Ok(Approximation { rig, loss: None });
    }
    let (optics, loss) = nearest(&of_rig(rig, 0), &of_rig(rig, 1), forms, progress)?;
    let mut near = rig.clone();
    for (camera, optics) in near.cameras.iter_mut().zip(optics) {
        camera.optics = optics;
    }
    Ok(Approximation { rig: near, loss: Some(loss) })
}

/// The rig with each camera in a form that holds it, if there is one for each.
fn within(rig: &Rig, forms: &[Form]) -> Option<Rig> {
    let camera = |camera: &RigCamera| {
        let optics = forms.iter().find_map(|form| camera.optics.in_form(*form))?;
        Some(RigCamera { optics, ..camera.clone() })
    };
    let cameras = rig.cameras.iter().map(camera).collect::<Option<Vec<_>>>()?;
    Some(Rig { unit: rig.unit.clone(), cameras })
}

/// More coefficients must make the loss smaller than this share of it: what is simple travels better. A
/// model that is no lens at all, such as Soloff's polynomials, is off any lens by so much that distortion
/// shows in a few hundredths of it.
const WORTHWHILE: f64 = 0.97;

/// The form that follows best; of nearly equal ones the first and simplest.
fn nearest(
    lesson: &Samples,
    exam: &Samples,
    forms: &[Form],
    progress: &dyn Progress,
) -> Result<(Vec<Optics>, Loss)> {
    let mut best: Option<(Vec<Optics>, Loss)> = None;
    let mut why = None;
    for form in forms.iter().flat_map(|form| simpler(*form)) {
        progress.check()?;
        match follow(lesson, exam, form, progress) {
            Ok(found) => {
                let better = |best: &(Vec<Optics>, Loss)| found.1.rms < WORTHWHILE * best.1.rms;
                if best.as_ref().is_none_or(better) {
                    best = Some(found);
                }
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(other) => why = why.or(Some(other)),
        }
    }
    best.ok_or_else(|| why.unwrap_or_else(cannot_follow))
}

fn cannot_follow() -> Error {
    Error::Unsupported {
        format: "this format".into(),
        what: "anything like this model".into(),
        hint: Hint::new(
            "`opencv-fisheye`, `kalibr`, `colmap` and `anipose` hold fisheyes; for other models fit a parametric one, such as `brown`",
            Remedy::Method,
        ),
    }
}

/// A form and what it holds that is simpler, the simplest first.
fn simpler(form: Form) -> Vec<Form> {
    match form {
        Form::Brown(most) => {
            [0, 4, 5, 8, 12].into_iter().filter(|count| *count <= most).map(Form::Brown).collect()
        }
        other => vec![other],
    }
}

/// The best cameras of one form, and how far they are off.
fn follow(
    lesson: &Samples,
    exam: &Samples,
    form: Form,
    progress: &dyn Progress,
) -> Result<(Vec<Optics>, Loss)> {
    let mut optics = fit(&lesson.pairs, form, progress)?;
    if let Some((locate, points)) = &lesson.intersection {
        // Twice is enough: the second rig differs from the first by a hundredth of the loss.
        for _ in 0..2 {
            let pairs = met(*locate, &optics, points);
            optics = fit(&pairs, form, progress)?;
        }
    }
    let pairs = match &exam.intersection {
        Some((locate, points)) => met(*locate, &optics, points),
        None => exam.pairs.clone(),
    };
    let mut distances = Vec::new();
    for (camera, pairs) in optics.iter().zip(&pairs) {
        for (world, pixel) in pairs {
            let at = camera.project(*world).ok_or_else(cannot_follow)?;
            distances.push((at - pixel).norm());
        }
    }
    let loss = Loss {
        form: match form {
            Form::Brown(count) => format!("pinhole with {count} coefficients"),
            Form::KannalaBrandt => "fisheye".into(),
            Form::Linear => "projection matrix".into(),
        },
        rms: root_mean_square(&distances),
        largest: distances.iter().copied().fold(0.0, f64::max),
        points: distances.len(),
    };
    if distances.is_empty() || !loss.rms.is_finite() {
        return Err(cannot_follow());
    }
    Ok((optics, loss))
}

/// Where the model meets the pixels at which a rig observes points, with those pixels, a camera each.
fn met(
    locate: &dyn Reconstructor,
    optics: &[Optics],
    points: &[Point3],
) -> Vec<Vec<(Point3, Pixel)>> {
    let mut pairs = vec![Vec::with_capacity(points.len()); optics.len()];
    for point in points {
        let pixels: Vec<Option<Pixel>> =
            optics.iter().map(|camera| camera.project(*point)).collect();
        let Some(found) = locate.locate(&pixels) else { continue };
        for (pairs, pixel) in pairs.iter_mut().zip(pixels) {
            pairs.extend(pixel.map(|pixel| (found.point, pixel)));
        }
    }
    pairs
}

/// Cameras of one form that see points nearest to their pixels.
fn fit(pairs: &[Vec<(Point3, Pixel)>], form: Form, progress: &dyn Progress) -> Result<Vec<Optics>> {
    let data = dataset(pairs);
    let brown = |count: usize| Brown {
        radial: match count {
            0..4 => 0,
            4 => 2,
            _ => 3,
        },
        tangential: count >= 4,
        rational: count >= 8,
        prism: count >= 12,
        tilt: false,
        choose: false,
    };
    let fitted = match form {
        Form::Brown(count) => brown(count).fit(&data, 0, progress),
        Form::KannalaBrandt => KannalaBrandt { terms: 4, choose: false }.fit(&data, 0, progress),
        Form::Linear => Dlt::default().fit(&data, 0, progress),
    }?;
    let (optics, mirrored): (Vec<Optics>, bool) = match fitted.reconstructor {
        AnyReconstructor::Brown(found) => {
            let mirrored = found.cameras.iter().any(|camera| camera.mirrored);
            (found.cameras.into_iter().map(Optics::Brown).collect(), mirrored)
        }
        AnyReconstructor::KannalaBrandt(found) => {
            let mirrored = found.cameras.iter().any(|camera| camera.mirrored);
            (found.cameras.into_iter().map(Optics::KannalaBrandt).collect(), mirrored)
        }
        AnyReconstructor::Dlt(found) => {
            (found.matrices().iter().copied().map(Optics::Linear).collect(), false)
        }
        _ => (Vec::new(), false),
    };
    if mirrored {
        return Err(Error::Unsupported {
            format: "this format".into(),
            what: "a left-handed world, or a camera that sees a mirrored world".into(),
            hint: "reverse one axis of the world (Z to -Z in the data), then fit again; `dlt` holds it".into(),
        });
    }
    Ok(optics)
}

/// Every pair a point that one camera saw.
fn dataset(pairs: &[Vec<(Point3, Pixel)>]) -> Dataset {
    let mut correspondences = Vec::new();
    for (camera, pairs) in pairs.iter().enumerate() {
        for (world, pixel) in pairs {
            let mut pixels = vec![None; camera + 1];
            pixels[camera] = Some(*pixel);
            correspondences.push(Correspondence {
                view: 0,
                id: None,
                pixels,
                world: Some(*world),
                board: None,
            });
        }
    }
    for row in &mut correspondences {
        row.pixels.resize(pairs.len(), None);
    }
    Dataset { unit: String::new(), cameras: pairs.len(), views: Vec::new(), correspondences }
}
