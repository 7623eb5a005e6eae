//! What an error is made of: the pixels' noise, a lens that a method takes for another, charts that stood
//! elsewhere than was written down, and points beyond those that were shown.
//!
//! What the noise makes of a point follows from the cameras alone: the trace of the propagated
//! covariance, with cameras and noise from the most flexible fit there is, so that a method's own misfit
//! is not called noise. What a whole view is off by, as a rigid body, and equally so for the method and
//! for that flexible fit, is the stage's doing. What points beyond the others err more than points among
//! them do, allowing for how the error grows with their noise, is extrapolation. The rest is the lens.

mod roughness;

use crate::{
    Result,
    dataset::Dataset,
    geometry::{Point3, ProjectionMatrix, Vector3},
    method::{
        AnyReconstructor, Method, Reconstructor,
        neural_camera::{NeuralCamera, NeuralCameraReconstructor},
    },
};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector6};
use roughness::within_views;
use serde::Serialize;
use wheatstone_numeric::{progress::Progress, statistics::root_mean_square};

/// The error of one point that a fit has not seen.
#[derive(Clone, Copy, Debug)]
pub struct HeldOut {
    /// The point's place among the dataset's correspondences.
    pub row: usize,
    /// Located minus true, in world units.
    pub difference: Vector3,
    /// Whether it lies beyond the points that were fitted.
    pub beyond: bool,
}

/// One cause's part in the error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Part {
    /// Share in the mean square error, 0..=1; the parts' shares sum to 1.
    pub share: f64,
    /// Root mean square, in world units, of the error that this cause makes alone.
    pub rms: f64,
}

/// A mean square error divided among its causes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Budget {
    /// Where the chart's points were found in the pictures.
    pub detector: Part,
    /// What the method takes the cameras for, and how well its numbers are determined.
    pub lens_model: Part,
    /// Where the chart stood.
    pub stage: Part,
    /// Points beyond those that were fitted.
    pub extrapolation: Part,
    /// The whole error over what the pixels' noise alone allows.
    pub ratio_to_floor: f64,
    /// Standard deviation of a pixel coordinate, as the flexible fit observes it.
    pub pixel_noise: f64,
}

/// The most flexible cameras that the data allow, and the pixel noise that they leave.
#[derive(Clone, Debug)]
pub struct Reference {
    cameras: NeuralCameraReconstructor,
    /// Standard deviation of a pixel coordinate, a camera.
    sigma: Vec<f64>,
    /// That, over what the fit could not explain.
    calmer: f64,
}

impl Reference {
    /// Fits it to all points of `train`.
    ///
    /// # Errors
    ///
    /// Those of [`Method::fit`] for the neural camera.
    pub fn fit(train: &Dataset, progress: &dyn Progress) -> Result<Option<Self>> {
        let fit = NeuralCamera::default().fit(train, 0, progress)?.reconstructor;
        Ok(match fit {
            AnyReconstructor::NeuralCamera(cameras) => Some(Self::of(cameras, train)),
            _ => None,
        })
    }

    /// From cameras that were fitted to `train`. A chart that stood elsewhere spoils what they explain,
    /// but smoothly over each picture of it: where what remains after that is less than what the fit
    /// could not explain, the difference is no noise of the pixels.
    #[must_use]
    pub fn of(cameras: NeuralCameraReconstructor, train: &Dataset) -> Self {
        let fitted = cameras.pixel_noise();
        let calmest = |(camera, sigma): (usize, &f64)| {
            // A flexible fit to charts that contradict each other is rough itself; a plain one is not.
            let plain = ProjectionMatrix::fit(&train.seen_by_camera(camera));
            let plain = |world| plain.as_ref().and_then(|camera| camera.project(world));
            let flexible = |world| Some(cameras.project(camera, world)?.0);
            [within_views(flexible, camera, train), within_views(plain, camera, train)]
                .into_iter()
                .flatten()
                .fold(*sigma, f64::min)
        };
        let sigma: Vec<f64> = fitted.iter().enumerate().map(calmest).collect();
        let calmer = root_mean_square(&sigma) / root_mean_square(&fitted);
        Self { cameras, sigma, calmer }
    }

    /// The cameras.
    #[must_use]
    pub fn cameras(&self) -> &NeuralCameraReconstructor {
        &self.cameras
    }

    /// The covariance of a point that the noise alone makes.
    fn noise(&self, data: &Dataset, row: usize) -> Option<Matrix3<f64>> {
        let row = data.correspondences.get(row)?;
        let world = row.world?;
        let mut information = Matrix3::zeros();
        for (camera, sigma) in self.sigma.iter().enumerate() {
            if row.pixels.get(camera).copied().flatten().is_some() {
                let (_, slopes) = self.cameras.project(camera, world)?;
                information += slopes.transpose() * slopes / (sigma * sigma);
            }
        }
        let covariance = information.try_inverse()?;
        (covariance.trace() > 0.0 && covariance.trace().is_finite()).then_some(covariance)
    }

    /// The mean square of what the reference's own fit adds to that.
    fn doubt(&self, data: &Dataset, row: usize, noise: f64) -> f64 {
        let located = data.correspondences.get(row).and_then(|r| self.cameras.locate(&r.pixels));
        let whole = located.map_or(0.0, |found| found.covariance.trace());
        (whole * self.calmer * self.calmer - noise).max(0.0)
    }
}

/// A point of the budget.
struct Entry {
    world: Point3,
    view: usize,
    difference: Vector3,
    /// The reference's error on the same point, held out alike.
    reference: Option<Vector3>,
    noise: Matrix3<f64>,
    doubt: f64,
    beyond: bool,
}

/// Sums over points.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    points: f64,
    squares: f64,
    noise: f64,
    /// Variance of the sum of squares, were all of it noise: twice the trace of each covariance's square.
    chance: f64,
}

/// What is larger than chance makes it by fewer standard deviations than this is not called a cause.
const CLEAR: f64 = 3.0;

/// Mean squares of a displaced view's error at the end, over that among the others, are at most this: of
/// seven planes at equal distances the last is missed by a parabola through the others with 4.2 times
/// the variance of one displacement, the middle one with 1.4 times; by a line with 1.9 and 1.2.
const AT_THE_END: f64 = 3.0;

impl Sums {
    fn of<'a>(entries: impl Iterator<Item = &'a Entry>) -> Self {
        entries.fold(Self::default(), |sums, entry| Self {
            points: sums.points + 1.0,
            squares: sums.squares + entry.difference.norm_squared(),
            noise: sums.noise + entry.noise.trace(),
            chance: sums.chance + 2.0 * entry.noise.norm_squared(),
        })
    }
}

impl Budget {
    /// Divides the errors of a method on `data`. `reference_errors` are those of the reference on the
    /// same points, held out in the same way; where there are none, nothing is said of the stage.
    /// `None` where no point can be judged.
    #[must_use]
    pub fn of(
        data: &Dataset,
        errors: &[HeldOut],
        reference_errors: &[HeldOut],
        reference: &Reference,
    ) -> Option<Self> {
        let entries = entries(data, errors, reference_errors, reference);
        let all = Sums::of(entries.iter());
        let among = Sums::of(entries.iter().filter(|entry| !entry.beyond));
        let beyond = Sums::of(entries.iter().filter(|entry| entry.beyond));
        if all.points == 0.0 || all.squares == 0.0 {
            return None;
        }
        let clear = |excess: f64, sums: &Sums| {
            if excess > CLEAR * sums.chance.sqrt() { excess } else { 0.0 }
        };
        let unexplained = clear(among.squares - among.noise, &among);
        let staged = common_to_views(&entries, data, false).clamp(0.0, unexplained);
        let per = |sum: f64, of: f64| if of > 0.0 { sum / of } else { 0.0 };
        let growth = if unexplained > staged { growth(&entries) } else { 0.0 };
        let lens_of = |entries: &mut dyn Iterator<Item = &Entry>| -> f64 {
            entries.map(|entry| libm::pow(entry.noise.trace(), growth)).sum()
        };
        let lens_per_growth =
            per(unexplained - staged, lens_of(&mut entries.iter().filter(|entry| !entry.beyond)));
        let lens_beyond =
            lens_per_growth * lens_of(&mut entries.iter().filter(|entry| entry.beyond));
        // Views at the end lean on those before them, and are off by more than these.
        let like_among = per(staged, among.points) * beyond.points;
        let staged_beyond =
            common_to_views(&entries, data, true).clamp(like_among, AT_THE_END * like_among);
        let expected = beyond.noise + lens_beyond + staged_beyond;
        let squares = [
            all.noise,
            unexplained - staged + lens_beyond,
            staged + staged_beyond,
            clear(beyond.squares - expected, &beyond),
        ];
        let sum: f64 = squares.iter().sum();
        let part = |index: usize| {
            let share = squares[index] / sum;
            Part { share, rms: (share * all.squares / all.points).sqrt() }
        };
        Some(Self {
            detector: part(0),
            lens_model: part(1),
            stage: part(2),
            extrapolation: part(3),
            ratio_to_floor: (all.squares / all.noise).sqrt(),
            pixel_noise: root_mean_square(&reference.sigma),
        })
    }
}

/// How the error that a lens makes grows over the points that are not beyond the others: the power of
/// the noise's mean square with which its own rises. 1 for an error of so many pixels, which grows into
/// the world as the noise does; 0 for one that is the same in the world everywhere.
fn growth(entries: &[Entry]) -> f64 {
    // Groups of equally many points along the noise; with few in each, chance would rule.
    const GROUPS: usize = 5;
    let mut among: Vec<&Entry> = entries.iter().filter(|entry| !entry.beyond).collect();
    among.sort_by(|a, b| a.noise.trace().total_cmp(&b.noise.trace()));
    let size = among.len().div_ceil(GROUPS).max(1);
    let places: Vec<(f64, f64)> = among
        .chunks(size)
        .map(|group| Sums::of(group.iter().copied()))
        .filter(|sums| sums.squares - sums.noise > CLEAR * sums.chance.sqrt())
        .map(|sums| {
            let (noise, excess) = (sums.noise / sums.points, sums.squares / sums.points);
            (libm::log(noise), libm::log(excess - noise))
        })
        .collect();
    let count = places.len() as f64;
    let middle = |of: fn(&(f64, f64)) -> f64| places.iter().map(of).sum::<f64>() / count;
    let (x, y) = (middle(|place| place.0), middle(|place| place.1));
    let (product, square) = places.iter().fold((0.0, 0.0), |(product, square), place| {
        (product + (place.0 - x) * (place.1 - y), square + (place.0 - x).powi(2))
    });
    // With nothing to tell by, a lens errs by pixels.
    if places.len() < 3 || square == 0.0 { 1.0 } else { (product / square).clamp(0.0, 1.0) }
}

fn entries(
    data: &Dataset,
    errors: &[HeldOut],
    reference_errors: &[HeldOut],
    reference: &Reference,
) -> Vec<Entry> {
    let mut second = vec![None; data.correspondences.len()];
    for error in reference_errors {
        if let Some(place) = second.get_mut(error.row) {
            *place = Some(error.difference);
        }
    }
    let entry = |error: &HeldOut| {
        let row = data.correspondences.get(error.row)?;
        let noise = reference.noise(data, error.row)?;
        Some(Entry {
            world: row.world?,
            view: row.view,
            difference: error.difference,
            reference: second[error.row],
            noise,
            doubt: reference.doubt(data, error.row, noise.trace()),
            beyond: error.beyond,
        })
    };
    errors.iter().filter_map(entry).collect()
}

/// The sum of squares, over the points that are beyond the others or over those that are not, of what
/// method and reference both say that whole views are displaced and turned by; less what chance makes of
/// it. Where there are no views, nothing.
fn common_to_views(entries: &[Entry], data: &Dataset, beyond: bool) -> f64 {
    if data.views.len() < 2 {
        return 0.0;
    }
    (0..data.views.len())
        .filter_map(|view| {
            let of_view = |entry: &&Entry| entry.view == view && entry.beyond == beyond;
            let members: Vec<(&Entry, Vector3)> = entries
                .iter()
                .filter(of_view)
                .filter_map(|entry| Some((entry, entry.reference?)))
                .collect();
            common_to_view(&members)
        })
        .sum()
}

/// For one view. With a rigid body's six motions as columns of A, the motions that explain two sets of
/// errors a and b best have the product `a'A (A'A)^-1 A'b`; of noise with covariance N in both it would
/// be the trace of `(A'A)^-1 A'N A`.
fn common_to_view(members: &[(&Entry, Vector3)]) -> Option<f64> {
    let count = members.len() as f64;
    // Six numbers are fitted to three of each point; a few points determine them badly.
    if members.len() < 6 {
        return None;
    }
    let centre = members.iter().map(|(entry, _)| entry.world.coords).sum::<Vector3>() / count;
    let arms: Vec<Vector3> = members.iter().map(|(entry, _)| entry.world.coords - centre).collect();
    let size = (arms.iter().map(Vector3::norm_squared).sum::<f64>() / count).sqrt();
    let (mut matrix, mut chance) = (Matrix6::zeros(), Matrix6::zeros());
    let (mut own, mut other) = (Vector6::zeros(), Vector6::zeros());
    let mut doubt = 0.0;
    for ((entry, reference), arm) in members.iter().zip(&arms) {
        let mut motions = Matrix3x6::zeros();
        motions.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        motions.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm / size).cross_matrix());
        matrix += motions.transpose() * motions;
        chance += motions.transpose() * entry.noise * motions;
        own += motions.transpose() * entry.difference;
        other += motions.transpose() * reference;
        // A fit without this view is less sure of it than the fit to all that was asked.
        doubt += 2.0 * entry.doubt;
    }
    let inverse = matrix.try_inverse()?;
    Some(own.dot(&(inverse * other)) - (inverse * chance).trace() - doubt)
}
