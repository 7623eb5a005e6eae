//! Cameras of one form, fitted to the pixels at which a model observes points.

use super::samples::Samples;
use crate::formats::{Error, Form, Optics};
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    method::{
        AnyReconstructor, Method, Reconstructor, brown::Brown, dlt::Dlt,
        kannala_brandt::KannalaBrandt,
    },
};
use wheatstone_numeric::{progress::Progress, statistics::root_mean_square};

/// World points and their pixels in one camera.
pub(super) type Pairs = Vec<(Point3, Pixel)>;

/// How far cameras are from the model that they follow, in pixels.
#[derive(Clone, Debug)]
pub(super) struct Distances {
    /// Of all points, a camera each.
    pub(super) cameras: Vec<Vec<f64>>,
}

impl Distances {
    /// Root mean square of the worst camera.
    pub(super) fn worst(&self) -> f64 {
        self.cameras.iter().map(|all| root_mean_square(all)).fold(0.0, f64::max)
    }
}

/// Refuses what no form follows.
pub(super) fn cannot_follow() -> Error {
    Error::Unsupported {
        format: "this format".into(),
        what: "cameras like these".into(),
        hint: wheatstone_core::error::Hint::new(
            "`opencv-fisheye`, `kalibr`, `colmap` and `anipose` hold fisheyes; for other models fit a parametric one, such as `brown`",
            wheatstone_core::error::Remedy::Method,
        ),
    }
}

/// The best cameras of one form.
pub(super) fn follow(
    samples: &Samples,
    form: Form,
    progress: &dyn Progress,
) -> Result<Vec<Optics>> {
    let mut optics = fit(&samples.pairs, form, progress)?;
    if let Some((locate, points)) = &samples.intersection {
        // Twice is enough: the second rig differs from the first by a hundredth of the loss.
        for _ in 0..2 {
            let pairs = met(*locate, &optics, points);
            optics = fit(&pairs, form, progress)?;
        }
    }
    Ok(optics)
}

/// How far they are off at other points than those that they were fitted to.
pub(super) fn distances(exam: &Samples, optics: &[Optics]) -> Result<Distances> {
    let pairs = match &exam.intersection {
        Some((locate, points)) => met(*locate, optics, points),
        None => exam.pairs.clone(),
    };
    let of_camera = |(camera, pairs): (&Optics, &Pairs)| {
        let distance = |(world, pixel): &(Point3, Pixel)| {
            Ok((camera.project(*world).ok_or_else(cannot_follow)? - pixel).norm())
        };
        pairs.iter().map(distance).collect::<Result<Vec<f64>>>()
    };
    let cameras = optics.iter().zip(&pairs).map(of_camera).collect::<Result<Vec<_>>>()?;
    let found = Distances { cameras };
    let is_known = found.cameras.iter().all(|all| !all.is_empty()) && found.worst().is_finite();
    is_known.then_some(found).ok_or_else(cannot_follow)
}

/// Where the model meets the pixels at which a rig observes points, with those pixels, a camera each.
fn met(locate: &dyn Reconstructor, optics: &[Optics], points: &[Point3]) -> Vec<Pairs> {
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

/// Which terms come with so many of them, the most useful first.
pub(super) fn terms(count: usize) -> Brown {
    Brown {
        radial: match count {
            0 => 0,
            1 => 1,
            2..5 => 2,
            _ => 3,
        },
        tangential: count >= 4,
        rational: count >= 8,
        prism: count >= 12,
        choose: false,
        ..Brown::default()
    }
}

/// Cameras of one form that see points nearest to their pixels.
fn fit(pairs: &[Pairs], form: Form, progress: &dyn Progress) -> Result<Vec<Optics>> {
    let data = dataset(pairs);
    let fitted = match form {
        Form::Brown(count) => terms(count).fit(&data, 0, progress),
        Form::KannalaBrandt(terms) => {
            KannalaBrandt { terms, choose: false, ..KannalaBrandt::default() }
                .fit(&data, 0, progress)
        }
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
fn dataset(pairs: &[Pairs]) -> Dataset {
    let mut correspondences = Vec::new();
    for (camera, pairs_of_camera) in pairs.iter().enumerate() {
        for (world, pixel) in pairs_of_camera {
            let mut pixels = vec![None; pairs.len()];
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
    Dataset { unit: String::new(), cameras: pairs.len(), views: Vec::new(), correspondences }
}
