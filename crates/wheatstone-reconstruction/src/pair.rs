//! Two cameras of a model, made ready once; pairs of pictures to clouds.

use crate::{
    cloud::Cloud,
    matches::{Matches, source, stretch},
    points::PointEstimator,
    remap::rectified,
    settings::{ReconstructionSettings, whole},
};
use std::ops::Range;
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{
    Calibration, Error, Result,
    geometry::Pixel,
    rectification::{PairSettings, Rectification, Table, VirtualPair},
};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{
    DisparityMap, EpipolarCurves, MatchError, Matcher, PairFault, Picture, pair_fault,
};

/// Two cameras of a model, made ready to reconstruct what they see.
pub struct PairReconstructor<'a> {
    rectification: Rectification<'a>,
    tables: [Table; 2],
    range: Range<i32>,
    /// Where rows are no epipolar lines.
    curves: Option<EpipolarCurves>,
    estimator: PointEstimator<'a>,
    settings: ReconstructionSettings,
}

/// What a pair of pictures shows.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reconstruction {
    /// Disparities of the left rectified picture.
    pub map: DisparityMap,
    /// Depths of the same pixels along the axis of the left virtual camera, in the model's unit; NaN for pixels
    /// without a point in the cloud.
    pub depth: Vec<f32>,
    /// The points.
    pub cloud: Cloud,
    /// What makes all of it worthless, if something does.
    pub fault: Option<PairFault>,
}

impl<'a> PairReconstructor<'a> {
    /// Of two cameras of a model of any method.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for settings without sense, or more disparities than can be searched;
    /// [`Error::Mismatch`] where the model was fitted to pictures of another size; those of [`Rectification::of`].
    pub fn new(
        model: &'a Calibration,
        settings: ReconstructionSettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        settings.check()?;
        let mut sizes =
            vec![
                None;
                model.volume.cameras().max(settings.cameras[0].max(settings.cameras[1]) + 1)
            ];
        for (camera, size) in settings.cameras.into_iter().zip(settings.sizes) {
            if let Some(known) = model.picture_size(camera).filter(|known| *known != size) {
                return Err(other_size(known, size));
            }
            sizes[camera] = Some(size);
        }
        let wanted = PairSettings { cameras: settings.cameras, sizes, ..PairSettings::default() };
        let rectification = Rectification::of(model, &wanted, progress)?;
        let range = disparities(&rectification, settings.depths)?;
        let tables = [0, 1].map(|side| rectification.table(side));
        let curves = curves(&rectification, &range)?;
        let shown = lattice(&tables, curves.as_ref(), &range);
        let estimator = PointEstimator::new(model, rectification.pair.cameras, &shown);
        Ok(Self { rectification, tables, range, curves, estimator, settings })
    }

    /// The virtual cameras: the left one's frame is that of depths, its picture that of disparities.
    #[must_use]
    pub fn pair(&self) -> &VirtualPair {
        &self.rectification.pair
    }

    /// What was wanted.
    #[must_use]
    pub fn settings(&self) -> &ReconstructionSettings {
        &self.settings
    }

    /// The disparities that are searched, in pixels.
    #[must_use]
    pub fn disparities(&self) -> Range<i32> {
        self.range.clone()
    }

    /// The points that a pair of pictures shows, in the order of the settings' cameras.
    ///
    /// Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for pictures of another size, [`Error::Setting`] for a range of depths that leads out of them.
    pub fn reconstruct(&self, pictures: [&ColourImage; 2]) -> Result<Reconstruction> {
        for (picture, size) in pictures.into_iter().zip(self.settings.sizes) {
            let found = [picture.gray.width() as u32, picture.gray.height() as u32];
            if found != size {
                return Err(other_size(size, found));
            }
        }
        let sides = if self.is_exchanged() { [pictures[1], pictures[0]] } else { pictures };
        let (map, fault) = self.disparities_of(sides)?;
        let (cloud, depth) = self.locate(&map, sides[0]);
        Ok(Reconstruction { map, depth, cloud, fault })
    }

    /// Disparities of the left and the right camera's picture, and what makes them worthless.
    fn disparities_of(
        &self,
        sides: [&ColourImage; 2],
    ) -> Result<(DisparityMap, Option<PairFault>)> {
        let made = self.rectified(sides);
        let [left, right] = [self.picture(&made[0])?, self.picture(&made[1])?];
        let matcher = Matcher::new(self.range.clone());
        let search = |matcher: &Matcher, left: &Picture<'_>, right: &Picture<'_>| {
            let map = match &self.curves {
                Some(curves) => matcher.compute_along(left, right, curves),
                None => matcher.compute(left, right),
            };
            map.map_err(refused)
        };
        let map = search(&matcher, &left, &right)?;
        let density = map.density(CONFIDENT);
        if density < DOUBTFUL {
            // Cameras that are turned to each other see a wrong scene in exchanged pictures, less clearly than the right one.
            let made = self.rectified([sides[1], sides[0]]);
            let coarse = matcher.clone().refining(false);
            let other = search(&coarse, &self.picture(&made[0])?, &self.picture(&made[1])?)?;
            if other.density(CONFIDENT) > LEAST_DENSITY.max(CLEARLY * density) {
                return Ok((map, Some(PairFault::Exchanged)));
            }
        }
        let bend = self.curves.as_ref().map_or(0.0, EpipolarCurves::largest);
        let fault = pair_fault(&matcher, [&left, &right], &map, bend).map_err(refused)?;
        Ok((map, fault))
    }

    fn rectified(&self, sides: [&ColourImage; 2]) -> [Vec<u8>; 2] {
        [0, 1].map(|side| rectified(&self.tables[side], &sides[side].gray.stretched()))
    }

    fn picture<'p>(&self, pixels: &'p [u8]) -> Result<Picture<'p>> {
        Picture::new(self.tables[0].width, self.tables[0].height, pixels).map_err(refused)
    }

    /// Whether the first camera of the settings is the right one of the virtual pair.
    fn is_exchanged(&self) -> bool {
        self.rectification.pair.cameras != self.settings.cameras
    }

    fn locate(&self, map: &DisparityMap, left: &ColourImage) -> (Cloud, Vec<f32>) {
        let (matches, places, sigma) = self.confident(map);
        let located = self.estimator.locate(&matches, &sigma);
        let mut depth = vec![f32::NAN; map.disparity.len()];
        let mut cloud = Cloud::default();
        let first = usize::from(self.is_exchanged());
        for (index, (point, place)) in located.into_iter().zip(places).enumerate() {
            let Some(point) = point else { continue };
            let sigmas = [0, 1, 2].map(|axis| point.covariance[(axis, axis)].sqrt());
            let is_sure = |most: f64| sigmas.iter().all(|sigma| *sigma <= most);
            if !self.settings.most_sigma.is_none_or(is_sure) {
                continue;
            }
            let seen = self.pair().rectified_from_world.transform(point.place);
            if seen.z <= 0.0 {
                continue;
            }
            depth[place as usize] = seen.z as f32;
            let pixels = [&matches.left, &matches.right].map(|[x, y]| [x[index], y[index]]);
            cloud.points.push([0, 1, 2].map(|axis| point.place[axis] as f32));
            cloud.sigmas.push(sigmas.map(|sigma| sigma as f32));
            cloud.confidence.push(map.confidence[place as usize]);
            cloud.colours.push(left.nearest(pixels[0]));
            cloud.pixels[first].push(pixels[0].map(|value| value as f32));
            cloud.pixels[1 - first].push(pixels[1].map(|value| value as f32));
            cloud.trust.push(point.trust);
            cloud.places.push(place);
        }
        (cloud, depth)
    }

    /// By how much standard deviations of disparities grow, as rectified pictures are not as they were taken: their pixels
    /// share noise with each other, the more the farther they are drawn apart.
    fn resampling(&self, (x, y): (f64, f64), disparity: f64) -> f64 {
        let sides = [stretch(&self.tables[0], x, y), stretch(&self.tables[1], x - disparity, y)];
        let stretched = sides.map(|side| side.unwrap_or(1.0).max(1.0));
        RESAMPLED * (0.5 * (stretched[0] + stretched[1])).sqrt()
    }

    /// Matches that are confident enough and lie in the region, where in the rectified picture, and the standard
    /// deviations of their disparities in pixels.
    fn confident(&self, map: &DisparityMap) -> (Matches, Vec<u32>, Vec<f32>) {
        let (mut matches, mut places) = (Matches::default(), Vec::new());
        let mut sigmas = Vec::new();
        for place in 0..map.disparity.len() {
            let is_taken = map.confidence[place] >= self.settings.least_confidence
                && map.confidence[place] > 0.0
                && map.sigma[place].is_finite();
            if !is_taken {
                continue;
            }
            let at = ((place % map.width) as f64, (place / map.width) as f64);
            let found =
                matched(&self.tables, self.curves.as_ref(), at, f64::from(map.disparity[place]));
            let Some([left, right, along]) = found else { continue };
            let first = if self.is_exchanged() { right } else { left };
            if self.settings.region.is_none_or(|region| holds(region, first)) {
                matches.push(left, right, along);
                places.push(place as u32);
                let own = f64::from(map.sigma[place]);
                sigmas.push((own * self.resampling(at, f64::from(map.disparity[place]))) as f32);
            }
        }
        (matches, places, sigmas)
    }
}

/// A disparity of this confidence is hardly ever wrong.
const CONFIDENT: f32 = 0.9;
/// The share of confident pixels below which a pair may be an exchanged one: then it is at least a tenth where the
/// pictures are exchanged back, and clearly more.
const DOUBTFUL: f64 = 0.6;
const LEAST_DENSITY: f64 = 0.1;
const CLEARLY: f64 = 1.3;

/// Cubic interpolation takes noise away between pixels, which the matcher takes for pictures with less of it: the factor
/// by which its standard deviations are then too small, as measured on rendered scenes.
const RESAMPLED: f64 = 1.15;

/// The left and the right pixel in the cameras' own pictures, and how the right one moves with the disparity.
fn matched(
    tables: &[Table; 2],
    curves: Option<&EpipolarCurves>,
    (x, y): (f64, f64),
    disparity: f64,
) -> Option<[[f64; 2]; 3]> {
    let right = |disparity: f64| {
        let lower = |curves: &EpipolarCurves| curves.at(x as f32, y as f32, disparity as f32);
        source(&tables[1], x - disparity, y + f64::from(curves.map_or(0.0, lower)))
    };
    let (ahead, behind) = (right(disparity + 0.5)?, right(disparity - 0.5)?);
    let along = [0, 1].map(|axis| ahead[axis] - behind[axis]);
    Some([source(&tables[0], x, y)?, right(disparity)?, along])
}

fn holds([left, top, width, height]: [u32; 4], pixel: [f64; 2]) -> bool {
    let inside = |at: f64, from: u32, length: u32| {
        at >= f64::from(from) - 0.5 && at < f64::from(from) + f64::from(length) - 0.5
    };
    inside(pixel[0], left, width) && inside(pixel[1], top, height)
}

/// The share of the disparities that a model was shown by which the search goes beyond them, at either end, and the
/// least number of pixels of that.
const MARGIN: f64 = 0.15;
const LEAST_MARGIN: f64 = 4.0;

/// The disparities of a range of depths, or of those that the model was fitted to.
fn disparities(made: &Rectification, depths: Option<[f64; 2]>) -> Result<Range<i32>> {
    let pair = &made.pair;
    // Where a point at infinity is.
    let infinite = pair.principal[0][0] - pair.principal[1][0];
    if let Some([near, far]) = depths {
        return whole([far, near].map(|depth| infinite + pair.focal * pair.baseline / depth));
    }
    let Some(shown) = &made.leftover.model else {
        return Err(Error::Setting {
            setting: "range of depths".into(),
            value: "none".into(),
            need: "the nearest and the farthest depth, as the model carries no points".into(),
        });
    };
    let [least, most] = shown.disparity;
    let margin = (MARGIN * (most - least)).max(LEAST_MARGIN);
    whole([(least - margin).max(infinite.min(least)), most + margin])
}

/// From so many rows on a search along rows suffers.
const MOST_VERTICAL: f32 = 0.25;

/// The epipolar curves of a pair whose rows are none.
fn curves(made: &Rectification, range: &Range<i32>) -> Result<Option<EpipolarCurves>> {
    let size = made.pair.size.map(|side| side as usize);
    let lower = |x: f32, y: f32, disparity: f32| {
        let left = Pixel::new(f64::from(x), f64::from(y));
        made.vertical_difference(left, f64::from(disparity)).map(|lower| lower as f32)
    };
    let curves = EpipolarCurves::new((size[0], size[1]), range.clone(), lower).map_err(refused)?;
    Ok((curves.largest() > MOST_VERTICAL).then_some(curves))
}

/// Matches over the whole picture and all disparities, for tables that are made beforehand.
fn lattice(tables: &[Table; 2], curves: Option<&EpipolarCurves>, range: &Range<i32>) -> Matches {
    const STEP: usize = 16;
    const DISPARITIES: i32 = 6;
    let mut shown = Matches::default();
    for y in (0..tables[0].height).step_by(STEP) {
        for x in (0..tables[0].width).step_by(STEP) {
            for index in 0..=DISPARITIES {
                let share = f64::from(index) / f64::from(DISPARITIES);
                let disparity = f64::from(range.start) + share * f64::from(range.end - range.start);
                if let Some([left, right, along]) =
                    matched(tables, curves, (x as f64, y as f64), disparity)
                {
                    shown.push(left, right, along);
                }
            }
        }
    }
    shown
}

fn other_size(known: [u32; 2], found: [u32; 2]) -> Error {
    let text = |[width, height]: [u32; 2]| format!("{width} x {height}");
    Error::Mismatch { what: "size of the pictures", model: text(known), data: text(found) }
}

/// What the matcher cannot do, and the way out.
fn refused(error: MatchError) -> Error {
    Error::Setting {
        setting: "range of depths".into(),
        value: error.to_string(),
        need: "depths that both cameras see".into(),
    }
}
