//! The cameras of a model as another program can hold them: exactly where it can, otherwise fitted to the
//! model's own map, with what is lost.
//!
//! A model whose cameras have a map from world to pixel is followed at points of the volume that it was
//! fitted to. Those that have none (networks, interpolation) only say where matched pixels meet: a rig
//! is fitted to the pixels and places of the model's own points, then to places that the model finds for
//! the pixels of that rig, so that no noise of the measured pixels is in it. The loss is judged at other
//! points: how far the rig's pixel of a point lies from the model's.
//!
//! Of several lenses the one with the fewest terms is taken whose loss is next to the least. Terms that follow
//! the model a little nearer where it was shown points do what they like elsewhere in the picture; a lens that
//! has a pole or a fold there is none at all.

mod exact;
mod known_pose;
mod lens_fit;
mod samples;

pub use exact::exact;

use super::{Error, Form, Optics, Rig, RigCamera};
use exact::named;
use known_pose::distortion;
use lens_fit::{Distances, cannot_follow, distances, follow};
use samples::{Samples, areas, of_model, of_rig};
use serde::Serialize;
use wheatstone_core::{
    Calibration, Result,
    camera::{
        picture_domain::{Area, has_rays, undistorts, without_margin},
        pinhole::Pinhole,
    },
    geometry::Pose,
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
    /// Which lens of the model folds, though the form has its terms.
    pub fold: Option<Fold>,
}

/// A lens that folds (or has a pole, or a jump) where no point was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fold {
    /// The camera, counted from 0: the first of which it is so.
    pub camera: usize,
    /// Whether that is in its picture, so that another lens was fitted; otherwise it is in the tenth beyond, and the lens is
    /// as it was.
    pub is_within: bool,
}

/// A model's cameras in one of several forms: without loss where any of them allows it and the lens does not fold in
/// the picture, otherwise the simplest that comes nearly as near as any. Picture sizes are the model's.
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
    let mut fold = None;
    if let Some(rig) = exact(model) {
        // A model that came from a file has no points of its own to be followed at.
        if model.data.world.is_empty() {
            return approximate_rig(&rig, forms, progress);
        }
        if let Some(rig) = within(&rig, forms) {
            fold = folds(model, &rig);
            if fold.is_none_or(|fold| !fold.is_within) {
                return Ok(Approximation { rig, loss: None, fold });
            }
        }
    }
    let (optics, loss) = nearest(&of_model(model, 0), &of_model(model, 1), forms, progress)?;
    Ok(Approximation { rig: named(model, optics), loss: Some(loss), fold })
}

/// Which camera's lens does not hold where it must, if one does not.
fn folds(model: &Calibration, rig: &Rig) -> Option<Fold> {
    let areas = areas(model);
    let of = |beyond: bool| {
        let mut cameras = rig.cameras.iter().zip(&areas).enumerate();
        cameras.position(|(index, (camera, [picture, shown]))| {
            // Where the size is not known there is a picture beyond what was seen.
            let is_known = !beyond && model.picture_size(index).is_some();
            let picture = if is_known { without_margin(*picture) } else { *picture };
            !is_usable(&camera.optics, [picture, *shown])
        })
    };
    let within = of(false).map(|camera| Fold { camera, is_within: true });
    within.or_else(|| of(true).map(|camera| Fold { camera, is_within: false }))
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
        return Ok(Approximation { rig, loss: None, fold: None });
    }
    let (optics, loss) = nearest(&of_rig(rig, 0), &of_rig(rig, 1), forms, progress)?;
    let mut near = rig.clone();
    for (camera, optics) in near.cameras.iter_mut().zip(optics) {
        camera.optics = optics;
    }
    Ok(Approximation { rig: near, loss: Some(loss), fold: None })
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

/// A lens with fewer terms may lose so many pixels more than the best, or this share of the noise of a pixel:
/// nobody sees that.
const UNSEEN: f64 = 0.02;
const UNSEEN_OF_NOISE: f64 = 0.05;

/// Or this share of the least loss. A model that is no lens at all, such as Soloff's polynomials, is off any
/// lens by so much that distortion shows in a few hundredths of it.
const SHARE_OF_LOSS: f64 = 0.03;

/// Cameras that are off by more than this share of the picture's width are others. A fisheye beyond 100 degrees whose
/// distortion no pinhole camera has was fitted by one that stood elsewhere.
const OTHERS: f64 = 0.1;

/// Cameras of one form beside the model.
struct Candidate {
    form: Form,
    optics: Vec<Optics>,
    off: Distances,
    /// Whether they hold all over their pictures.
    is_whole: bool,
}

/// The simplest of the forms that follow nearly best.
fn nearest(
    lesson: &Samples,
    exam: &Samples,
    forms: &[Form],
    progress: &dyn Progress,
) -> Result<(Vec<Optics>, Loss)> {
    let (mut candidates, mut why) = (Vec::new(), None);
    // A fit that fails speaks of points and methods, which who converts has not; and cameras that have poses see no mirrored
    // world, whatever a lens that cannot follow them makes of it.
    let is_told =
        |error: &Error| lesson.own.is_none() && matches!(error, Error::Unsupported { .. });
    for form in forms.iter().flat_map(|form| simpler(*form)) {
        progress.check()?;
        let anew = follow(lesson, form, progress);
        if let Err(Error::Cancelled) = anew {
            return Err(Error::Cancelled);
        }
        let bent = anew.as_ref().ok().and_then(|anew| {
            let folds = anew.iter().zip(&lesson.areas).any(|(o, area)| !holds_over(o, area[0]));
            let own = anew.iter().map(|optics| optics.pose().zip(optics.pinhole()));
            with_poses(lesson, &own.collect::<Option<Vec<_>>>()?, form).filter(|_| folds)
        });
        let own = lesson.own.as_ref().and_then(|own| with_poses(lesson, own, form));
        for optics in own.into_iter().chain(bent).map(Ok).chain([anew]) {
            match optics.and_then(|optics| Candidate::judged(form, optics, lesson, exam)) {
                Ok(candidate) => candidates.push(candidate),
                Err(other) => why = why.or(Some(other).filter(is_told)),
            }
        }
    }
    let widest = lesson.areas.iter().map(|[picture, _]| picture[2] - picture[0]);
    let most = OTHERS * widest.fold(0.0, f64::max);
    candidates.retain(|found| found.off.worst() <= most);
    let least = candidates.iter().map(|found| found.off.worst()).fold(f64::INFINITY, f64::min);
    let noise = lesson.noise.iter().copied().fold(f64::INFINITY, f64::min);
    let noise = if noise.is_finite() { noise } else { 0.0 };
    let more = UNSEEN.max(UNSEEN_OF_NOISE * noise).max(SHARE_OF_LOSS * least);
    candidates.retain(|found| found.off.worst() <= least + more);
    // The first that holds in the corners too, where a fisheye may be dark.
    let first = candidates.iter().position(|found| found.is_whole).unwrap_or(0);
    candidates
        .into_iter()
        .nth(first)
        .map(Candidate::with_loss)
        .ok_or_else(|| why.unwrap_or_else(cannot_follow))
}

/// Cameras whose poses and pinholes are known, behind a lens of this form.
fn with_poses(samples: &Samples, own: &[(Pose, Pinhole)], form: Form) -> Option<Vec<Optics>> {
    let cameras = own.iter().zip(&samples.pairs).zip(&samples.areas);
    cameras.map(|((own, pairs), [picture, _])| distortion(*own, pairs, form, *picture)).collect()
}

/// Whether a camera can be used all over the area.
fn holds_over(optics: &Optics, area: Area) -> bool {
    match optics {
        Optics::Brown(camera) => undistorts(&camera.model, area),
        Optics::KannalaBrandt(camera) => has_rays(&camera.model, area),
        Optics::Linear(_) => true,
    }
}

/// Whether it can be used where it must. A fisheye has no light in the corners of its picture, and rays that no
/// undistorted picture holds: it is asked only where points were seen.
fn is_usable(optics: &Optics, [picture, shown]: [Area; 2]) -> bool {
    let is_fisheye = matches!(optics, Optics::KannalaBrandt(_));
    holds_over(optics, if is_fisheye { shown } else { picture })
}

/// A form and what it holds that is simpler, the simplest first.
fn simpler(form: Form) -> Vec<Form> {
    match form {
        Form::Brown(most) => [0, 1, 2, 4, 5, 8, 12]
            .into_iter()
            .filter(|count| *count <= most)
            .map(Form::Brown)
            .collect(),
        Form::KannalaBrandt(most) => (0..=most).map(Form::KannalaBrandt).collect(),
        Form::Linear => vec![Form::Linear],
    }
}

impl Candidate {
    /// Refuses cameras that cannot be used where the model was shown points.
    fn judged(form: Form, optics: Vec<Optics>, lesson: &Samples, exam: &Samples) -> Result<Self> {
        let off = distances(exam, &optics)?;
        let mut cameras = optics.iter().zip(&lesson.areas);
        let is_usable = cameras.clone().all(|(optics, areas)| is_usable(optics, *areas));
        let is_whole = cameras.all(|(optics, [picture, _])| holds_over(optics, *picture));
        is_usable.then_some(Self { form, optics, off, is_whole }).ok_or_else(cannot_follow)
    }

    fn with_loss(self) -> (Vec<Optics>, Loss) {
        let all = self.off.cameras.concat();
        let loss = Loss {
            form: match self.form {
                Form::Brown(0) => "pinhole without distortion".into(),
                Form::Brown(1) => "pinhole with 1 distortion coefficient".into(),
                Form::Brown(count) => format!("pinhole with {count} distortion coefficients"),
                Form::KannalaBrandt(0) => "fisheye without distortion".into(),
                Form::KannalaBrandt(1) => "fisheye with 1 distortion coefficient".into(),
                Form::KannalaBrandt(count) => {
                    format!("fisheye with {count} distortion coefficients")
                }
                Form::Linear => "projection matrix".into(),
            },
            rms: root_mean_square(&all),
            largest: all.iter().copied().fold(0.0, f64::max),
            points: all.len(),
        };
        (self.optics, loss)
    }
}
