//! Cameras of a model, made ready once; pictures of theirs to clouds.

use crate::{
    cloud::Cloud,
    consensus::{Candidate, consensus},
    matches::Matches,
    pair::RectifiedPair,
    points::PointEstimator,
    seen::{Found, Seen, read},
    settings::ReconstructionSettings,
};
use rayon::prelude::*;
use std::ops::Range;
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Calibration, Error, Result, geometry::Point3, rectification::VirtualPair};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{DisparityMap, PairFault};

/// Rows of a picture that are worked out together: what is between disparities and points stays in little memory.
const BAND: usize = 64;

/// Two or more cameras of a model, made ready to reconstruct what they see.
///
/// The left camera of the first two is the *reference*: its picture is matched with those of all others. Where several
/// pairs have a disparity, those that agree are triangulated together.
pub struct SceneReconstructor<'a> {
    /// The reference camera with each other one.
    pairs: Vec<RectifiedPair<'a>>,
    estimator: PointEstimator<'a>,
    settings: ReconstructionSettings,
}

/// What pictures show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reconstruction {
    /// Disparities of the left rectified picture, of the first two cameras.
    pub map: DisparityMap,
    /// Depths of the same pixels along the axis of the left virtual camera, in the model's unit; NaN for pixels
    /// without a point in the cloud.
    pub depth: Vec<f32>,
    /// The points.
    pub cloud: Cloud,
    /// What makes all of it worthless, if something does, and between which two cameras.
    pub fault: Option<([usize; 2], PairFault)>,
}

impl<'a> SceneReconstructor<'a> {
    /// Of two or more cameras of a model of any method.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for settings without sense, or more disparities than can be searched;
    /// [`Error::Mismatch`] where the model was fitted to pictures of another size; those of
    /// [`wheatstone_core::rectification::Rectification::of`].
    pub fn new(
        model: &'a Calibration,
        settings: ReconstructionSettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        settings.check()?;
        for (camera, size) in settings.cameras.iter().zip(&settings.sizes) {
            if let Some(known) = model.picture_size(*camera).filter(|known| known != size) {
                return Err(other_size(PICTURES, known, *size));
            }
        }
        let of = |cameras: [usize; 2], reference: Option<usize>| {
            RectifiedPair::new(model, cameras, reference, &settings, progress)
        };
        let first = of([settings.cameras[0], settings.cameras[1]], None)?;
        let reference = first.cameras[0];
        let mut pairs = vec![first];
        for other in &settings.cameras[2..] {
            pairs.push(of([reference, *other], Some(reference))?);
        }
        let cameras = std::iter::once(reference).chain(pairs.iter().map(|pair| pair.cameras[1]));
        let mut shown = Matches::new(cameras.collect());
        for (index, pair) in pairs.iter().enumerate() {
            for (reference, other) in pair.lattice() {
                let of_pair = |own: usize| (own == index).then_some(other);
                shown.push(reference, (0..pairs.len()).map(of_pair));
            }
        }
        let estimator = PointEstimator::new(model, &shown);
        Ok(Self { pairs, estimator, settings })
    }

    /// The virtual cameras of the first two: the left one's frame is that of depths, its picture that of disparities.
    #[must_use]
    pub fn pair(&self) -> &VirtualPair {
        &self.pairs[0].rectification.pair
    }

    /// Where the virtual camera of one of the settings' cameras stands in the world.
    #[must_use]
    pub fn centre(&self, camera: usize) -> Option<Point3> {
        let of = |pair: &RectifiedPair<'_>| {
            let side = pair.rectification.pair.cameras.iter().position(|own| *own == camera)?;
            Some(pair.rectification.pair.centres()[side])
        };
        self.pairs.iter().find_map(of)
    }

    /// What was wanted.
    #[must_use]
    pub fn settings(&self) -> &ReconstructionSettings {
        &self.settings
    }

    /// The disparities of the first two cameras that are searched, in pixels.
    #[must_use]
    pub fn disparities(&self) -> Range<i32> {
        self.pairs[0].range.clone()
    }

    /// The points that pictures show, in the order of the settings' cameras.
    ///
    /// Cameras that have next to nothing in common with the reference are left out, but for the second one.
    /// Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for pictures of another size or number, [`Error::Setting`] for a range of depths that leads
    /// out of them.
    pub fn reconstruct(&self, pictures: &[&ColourImage]) -> Result<Reconstruction> {
        self.check(pictures)?;
        let pictures_of =
            |pair: &RectifiedPair<'_>| pair.cameras.map(|own| pictures[self.order(own)]);
        let (map, fault) = self.pairs[0].disparities(pictures_of(&self.pairs[0]))?;
        let mut fault = fault.map(|fault| (self.pairs[0].cameras, fault));
        let mut others = Vec::new();
        for pair in &self.pairs[1..] {
            let (map, found) = pair.disparities(pictures_of(pair))?;
            let is_empty = matches!(found, Some(PairFault::NothingInCommon { .. }));
            fault = fault.or(found.filter(|_| !is_empty).map(|found| (pair.cameras, found)));
            others.push((!is_empty).then_some(map));
        }
        let reference = pictures[self.order(self.pairs[0].cameras[0])];
        let maps: Vec<_> =
            std::iter::once(Some(&map)).chain(others.iter().map(Option::as_ref)).collect();
        let (cloud, depth) = self.located(&maps, reference);
        Ok(Reconstruction { map, depth, cloud, fault })
    }

    /// The points of disparities that another matcher found in the rectified pictures of the first two cameras, those of
    /// the left one.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for disparities of another size than the rectified pictures, and as
    /// [`SceneReconstructor::reconstruct`] for pictures.
    pub fn locate(&self, map: DisparityMap, pictures: &[&ColourImage]) -> Result<Reconstruction> {
        self.check(pictures)?;
        let found = [map.width, map.height].map(|side| side as u32);
        if found != self.pair().size {
            return Err(other_size("size of the disparities", self.pair().size, found));
        }
        let mut maps = vec![None; self.pairs.len()];
        maps[0] = Some(&map);
        let (cloud, depth) = self.located(&maps, pictures[self.order(self.pairs[0].cameras[0])]);
        Ok(Reconstruction { map, depth, cloud, fault: None })
    }

    /// Whether pictures are those that the settings tell.
    fn check(&self, pictures: &[&ColourImage]) -> Result<()> {
        if pictures.len() != self.settings.cameras.len() {
            let [model, data] = [self.settings.cameras.len(), pictures.len()];
            let what = "number of pictures";
            return Err(Error::Mismatch { what, model: model.to_string(), data: data.to_string() });
        }
        for (picture, size) in pictures.iter().zip(&self.settings.sizes) {
            let found = [picture.gray.width() as u32, picture.gray.height() as u32];
            if found != *size {
                return Err(other_size(PICTURES, *size, found));
            }
        }
        Ok(())
    }

    /// Which of the settings' cameras one is.
    fn order(&self, camera: usize) -> usize {
        self.settings.cameras.iter().position(|own| *own == camera).unwrap_or(0)
    }

    /// All points, and their depths.
    fn located(
        &self,
        maps: &[Option<&DisparityMap>],
        reference: &ColourImage,
    ) -> (Cloud, Vec<f32>) {
        let [width, height] = self.pair().size.map(|side| side as usize);
        let mut depth = vec![f32::NAN; width * height];
        let mut cloud =
            Cloud { pixels: vec![Vec::new(); self.settings.cameras.len()], ..Cloud::default() };
        for first in (0..height).step_by(BAND) {
            let rows = first * width..height.min(first + BAND) * width;
            let seen = self.agreed(self.seen(maps, rows));
            let mut matches = Matches::new(self.cameras());
            for (index, reference) in seen.reference.iter().enumerate() {
                let others = seen.found.iter().map(|pair| pair[index]);
                matches.push(*reference, others.map(|found| found.map(|found| found.at)));
            }
            for (index, point) in self.estimator.locate(&matches).into_iter().enumerate() {
                let Some(point) = point else { continue };
                let sigmas = [0, 1, 2].map(|axis| point.covariance[(axis, axis)].sqrt());
                let is_sure = |most: f64| sigmas.iter().all(|sigma| *sigma <= most);
                let z = self.pair().rectified_from_world.transform(point.place).z;
                if z <= 0.0 || !self.settings.most_sigma.is_none_or(is_sure) {
                    continue;
                }
                depth[seen.places[index] as usize] = z as f32;
                cloud.points.push([0, 1, 2].map(|axis| point.place[axis] as f32));
                cloud.sigmas.push(sigmas.map(|sigma| sigma as f32));
                cloud.confidence.push(seen.confidence[index]);
                cloud.colours.push(reference.nearest(seen.reference[index]));
                for (side, camera) in matches.cameras.iter().enumerate() {
                    let pixel = matches.pixel(side, index).map(|value| value as f32);
                    cloud.pixels[self.order(*camera)].push(pixel);
                }
                cloud.trust.push(point.trust);
                cloud.places.push(seen.places[index]);
            }
        }
        (cloud, depth)
    }

    /// The reference camera, and the others.
    fn cameras(&self) -> Vec<usize> {
        let others = self.pairs.iter().map(|pair| pair.cameras[1]);
        std::iter::once(self.pairs[0].cameras[0]).chain(others).collect()
    }

    /// What the pairs match with these pixels of the left rectified picture, where that is confident enough.
    fn seen(&self, maps: &[Option<&DisparityMap>], places: Range<usize>) -> Seen {
        let width = self.pair().size[0] as usize;
        let matched = |place: usize| {
            let at = ((place % width) as f64, (place / width) as f64);
            let reference = self.pairs[0].reference(at)?;
            if self.settings.region.is_some_and(|region| !holds(region, reference)) {
                return None;
            }
            let (mut found, mut missed) = (Vec::with_capacity(maps.len()), 0);
            for (index, (pair, map)) in self.pairs.iter().zip(maps).enumerate() {
                let at = if index == 0 { Some(at) } else { pair.place(reference) };
                let own = at.zip(*map).and_then(|(at, map)| self.found(pair, at, map));
                let is_in_view = || at.zip(*map).is_some_and(|(at, _)| pair.shows(at));
                missed += usize::from(own.is_none() && is_in_view());
                found.push(own);
            }
            let is_any = found.iter().any(Option::is_some);
            is_any.then_some((place as u32, reference, missed, found))
        };
        let rows: Vec<_> = places.into_par_iter().filter_map(matched).collect();
        let mut seen = Seen::new(self.pairs.len());
        for (place, reference, missed, found) in rows {
            let sure = found.iter().flatten().map(|found| found.confidence).fold(0.0, f32::max);
            seen.push((place, reference, sure), &found);
            seen.missed.push(missed);
        }
        seen
    }

    /// What one pair matches with a pixel of its reference camera's rectified picture.
    fn found(&self, pair: &RectifiedPair<'_>, at: (f64, f64), map: &DisparityMap) -> Option<Found> {
        let wanted = self.settings.least_confidence;
        // Two that agree are more than each.
        let least = if self.pairs.len() == 1 { wanted } else { CANDIDATE.min(wanted) };
        let read = read(map, at).filter(|read| read.confidence >= least)?;
        let sigma = read.sigma * pair.resampling(at, read.disparity);
        let at = pair.matched(at, (read.disparity, sigma))?;
        Some(Found { at, confidence: read.confidence })
    }

    /// What of it the pairs agree on.
    fn agreed(&self, seen: Seen) -> Seen {
        if self.pairs.len() == 1 {
            return seen;
        }
        let candidates: Vec<Vec<Option<Candidate>>> =
            (0..self.pairs.len()).map(|pair| self.candidates(&seen, pair)).collect();
        let mut agreed = Seen::new(self.pairs.len());
        for (index, place) in seen.places.iter().enumerate() {
            let of_pixel: Vec<_> = candidates.iter().map(|pair| pair[index]).collect();
            let (kept, probability) = consensus(&of_pixel, seen.missed[index]);
            let kept = kept.into_iter().zip(&seen.found);
            let found: Vec<_> = kept.map(|(kept, pair)| pair[index].filter(|_| kept)).collect();
            if probability as f32 >= self.settings.least_confidence {
                agreed.push((*place, seen.reference[index], probability as f32), &found);
            }
        }
        agreed
    }

    /// The depths that one pair sees.
    fn candidates(&self, seen: &Seen, pair: usize) -> Vec<Option<Candidate>> {
        let nearness = |deviations: f64| -> Vec<f64> {
            let mut pixels = [<[Vec<f64>; 2]>::default(), <[Vec<f64>; 2]>::default()];
            for (reference, found) in seen.reference.iter().zip(&seen.found[pair]) {
                for axis in 0..2 {
                    let other = found.map_or(f64::NAN, |found| {
                        found.at.pixel[axis] + deviations * found.at.deviation[axis]
                    });
                    pixels[0][axis].push(reference[axis]);
                    pixels[1][axis].push(other);
                }
            }
            let [x, y, z] = self.estimator.places(&self.pairs[pair].cameras, &pixels);
            let to_rectified = self.pair().rectified_from_world;
            let places = x.into_iter().zip(y).zip(z).map(|((x, y), z)| Point3::new(x, y, z));
            places.map(|place| to_rectified.transform(place).z.recip()).collect()
        };
        let (found, moved) = (nearness(0.0), nearness(1.0));
        let each = found.into_iter().zip(moved).zip(&seen.found[pair]);
        each.map(|((nearness, moved), found)| {
            let sigma = (moved - nearness).abs();
            let confidence = f64::from(found.as_ref()?.confidence);
            sigma.is_finite().then_some(Candidate { nearness, sigma, confidence })
        })
        .collect()
    }
}

/// Of several pairs, disparities that are at least so confident count.
const CANDIDATE: f32 = 0.5;

fn holds([left, top, width, height]: [u32; 4], pixel: [f64; 2]) -> bool {
    let inside = |at: f64, from: u32, length: u32| {
        at >= f64::from(from) - 0.5 && at < f64::from(from) + f64::from(length) - 0.5
    };
    inside(pixel[0], left, width) && inside(pixel[1], top, height)
}

const PICTURES: &str = "size of the pictures";

fn other_size(what: &'static str, known: [u32; 2], found: [u32; 2]) -> Error {
    let text = |[width, height]: [u32; 2]| format!("{width} x {height}");
    Error::Mismatch { what, model: text(known), data: text(found) }
}
