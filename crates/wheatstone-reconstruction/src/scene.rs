//! Cameras of a model, made ready once; pictures of theirs to clouds.

use crate::{
    cloud::Cloud,
    consensus::agreed,
    contradiction::Verdict,
    dense,
    pair::RectifiedPair,
    pair_check::PairCheck,
    reconstruction::Reconstruction,
    rims::drop_rims,
    scene_points::{ScenePoints, cameras},
    seen::{Found, Seen},
    settings::{PICTURES, ReconstructionSettings, other_size},
    sparse::{self, Features},
};
use rayon::prelude::*;
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Calibration, Error, Result, geometry::Pixel};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{DisparityMap, Matcher, PairFault, PairJudgement};

/// Rows of a picture that are worked out together, between looks at whether to go on.
const BAND: usize = 32;

/// Two or more cameras of a model, made ready to reconstruct what they see.
///
/// The left camera of the first two is the *reference*: its picture is matched with those of all others. Where several
/// pairs have a disparity, those that agree are triangulated together.
pub struct SceneReconstructor<'a> {
    pub(crate) model: &'a Calibration,
    /// The reference camera with each other one.
    pub(crate) pairs: Vec<RectifiedPair<'a>>,
    points: ScenePoints<'a>,
    /// Its memory serves all pairs.
    pub(crate) matcher: Matcher,
    pub(crate) settings: ReconstructionSettings,
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
        settings.check_region(reference)?;
        let mut pairs = vec![first];
        for other in &settings.cameras[2..] {
            pairs.push(of([reference, *other], Some(reference))?);
        }
        let points = if settings.sparse {
            ScenePoints::of_pixels(model, &pairs)
        } else {
            ScenePoints::of_pictures(model, &pairs)
        };
        let matcher = Matcher::new(pairs[0].range.clone());
        Ok(Self { model, pairs, points, matcher, settings })
    }

    /// What was wanted.
    #[must_use]
    pub fn settings(&self) -> &ReconstructionSettings {
        &self.settings
    }

    /// The points that pictures show, in the order of the settings' cameras.
    ///
    /// Cameras that have next to nothing in common with the reference are left out, but for the second one.
    /// Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for pictures of another size or number, [`Error::Setting`] for a range of depths that leads
    /// out of them, [`Error::Cancelled`].
    pub fn reconstruct(
        &self,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Reconstruction> {
        self.settings.check_pictures(pictures)?;
        let reference = self.reference(pictures);
        if self.settings.sparse {
            let features = Features::of(reference);
            let Searched { mut of_pairs, checks } =
                self.searched(pictures, progress, |pair, pictures| {
                    sparse::search(pair, pictures, &features)
                })?;
            let seen =
                |of_pairs: &[_]| sparse::seen(&self.pairs, &features, of_pairs, &self.settings);
            let mut all = seen(&of_pairs);
            let verdict = Verdict::of_pixels(&self.pairs, &self.points, (&all, &checks));
            if let Some(pair) = verdict.left_out(&self.pairs) {
                of_pairs[pair] = None;
                all = seen(&of_pairs);
            }
            let found = self.of_features(&self.points, all, reference)?;
            let left_out = self.left_out(&of_pairs);
            return Ok(Reconstruction { left_out, ..found }.judged(verdict, checks));
        }
        let Searched { of_pairs, checks } = self.maps(pictures, progress)?;
        self.of_maps((of_pairs, checks), reference, progress)
    }

    /// The disparities of each pair.
    pub(crate) fn maps(
        &self,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Searched<DisparityMap>> {
        self.settings.check_pictures(pictures)?;
        self.searched(pictures, progress, |pair, pictures| {
            pair.disparities(&self.matcher, pictures)
        })
    }

    /// The points of disparities of each pair, with what was found when the pictures were compared.
    pub(crate) fn of_maps(
        &self,
        (mut maps, checks): (Vec<Option<DisparityMap>>, Vec<PairCheck>),
        reference: &ColourImage,
        progress: &dyn Progress,
    ) -> Result<Reconstruction> {
        let mut of_pairs: Vec<_> = maps.iter().map(Option::as_ref).collect();
        let verdict = self.verdict(&of_pairs, &checks);
        if let Some(pair) = verdict.left_out(&self.pairs) {
            of_pairs[pair] = None;
        }
        let (mut cloud, mut depth) = self.dense(&of_pairs, reference, progress)?;
        if self.pairs.len() > 1 {
            drop_rims(&mut cloud, &mut depth, (&self.pairs[0], &self.settings));
        }
        let left_out = self.left_out(&of_pairs);
        let map = maps.swap_remove(0).ok_or_else(nothing)?;
        let found = Reconstruction::of(map, depth, cloud);
        Ok(Reconstruction { left_out, ..found }.judged(verdict, checks))
    }

    /// What the maps of all pairs say of each other.
    pub(crate) fn verdict(&self, maps: &[Option<&DisparityMap>], checks: &[PairCheck]) -> Verdict {
        Verdict::of_maps(&self.pairs, &self.points, (maps, checks), &self.settings)
    }

    /// Cameras of which nothing was found.
    pub(crate) fn left_out<T>(&self, of_pairs: &[Option<T>]) -> Vec<usize> {
        let pairs = self.pairs.iter().zip(of_pairs).filter(|(_, found)| found.is_none());
        pairs.map(|(pair, _)| pair.cameras[1]).collect()
    }

    /// The reference camera's picture.
    pub(crate) fn reference<'p>(&self, pictures: &[&'p ColourImage]) -> &'p ColourImage {
        pictures[self.order(self.pairs[0].cameras[0])]
    }

    /// What each pair finds.
    fn searched<T>(
        &self,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
        search: impl Fn(&RectifiedPair<'_>, [&ColourImage; 2]) -> Result<(T, PairJudgement)>,
    ) -> Result<Searched<T>> {
        let mut all = Searched { of_pairs: Vec::new(), checks: Vec::new() };
        for (index, pair) in self.pairs.iter().enumerate() {
            progress.check()?;
            let both = pair.cameras.map(|camera| pictures[self.order(camera)]);
            let (own, mut judged) = search(pair, both)?;
            // Rectified for two cameras the same picture no longer looks the same.
            if both[0].gray == both[1].gray {
                judged.fault = Some(PairFault::SamePicture);
            }
            // Of the first two there would be nothing left.
            let is_left_out = index > 0 && judged.is_empty;
            all.of_pairs.push((!is_left_out).then_some(own));
            all.checks.push(PairCheck { is_left_out, ..PairCheck::new(pair, judged) });
        }
        Ok(all)
    }

    /// The points of disparities that another matcher found in the rectified pictures of the first two cameras, those of
    /// the left one. Those at depths that are not searched are left out, of the map as well.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for disparities of another size than the rectified pictures, and as
    /// [`SceneReconstructor::reconstruct`] for pictures.
    pub fn locate(
        &self,
        mut map: DisparityMap,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Reconstruction> {
        self.settings.check_pictures(pictures)?;
        let found = [map.width, map.height].map(|side| side as u32);
        if found != self.pair().size {
            return Err(other_size("size of the disparities", self.pair().size, found));
        }
        self.drop_unsearched(&mut map);
        let mut maps = vec![None; self.pairs.len()];
        maps[0] = Some(map);
        let found = self.of_maps((maps, Vec::new()), self.reference(pictures), progress)?;
        // The others were not looked at.
        Ok(Reconstruction { left_out: Vec::new(), ..found })
    }

    /// Takes out what lies at depths that are not searched.
    fn drop_unsearched(&self, map: &mut DisparityMap) {
        for (at, disparity) in map.disparity.iter_mut().enumerate() {
            if !self.pairs[0].searches(f64::from(*disparity)) {
                *disparity = f32::NAN;
                (map.confidence[at], map.sigma[at]) = (0.0, f32::NAN);
            }
        }
    }

    /// The points of pixels that were matched by somebody else, one row a point: a pixel of each of the settings' cameras
    /// that sees it, with this standard deviation along x and y in pixels. Left out are rows without a pixel of the
    /// reference camera (the left one of the first two) or whose pixel the left rectified picture does not show, and
    /// pixels beside their epipolar curves or at depths that are not searched.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for rows of another number of cameras, and as [`SceneReconstructor::reconstruct`] for pictures.
    pub fn locate_matches(
        &self,
        rows: &[Vec<Option<Pixel>>],
        sigma: f64,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Reconstruction> {
        self.settings.check_pictures(pictures)?;
        let cameras = self.settings.cameras.len();
        if let Some(row) = rows.iter().find(|row| row.len() != cameras) {
            let (model, data) = (cameras.to_string(), row.len().to_string());
            return Err(Error::Mismatch { what: "number of cameras", model, data });
        }
        let order = self.order(self.pairs[0].cameras[0]);
        let rows: Vec<_> = rows.iter().filter_map(|row| Some((row[order]?, row))).collect();
        let of_pair = |pair: &RectifiedPair<'_>| -> Vec<Option<Found>> {
            let order = self.order(pair.cameras[1]);
            let found = |(pixel, row): &(Pixel, &Vec<_>)| pair.given(*pixel, row[order]?, sigma);
            rows.par_iter().map(found).collect()
        };
        let mut found: Vec<_> = self.pairs.iter().map(|pair| Some(of_pair(pair))).collect();
        let pixels: Vec<[f64; 2]> = rows.iter().map(|(pixel, _)| [pixel.x, pixel.y]).collect();
        let places = sparse::places(&self.pairs[0], &pixels, &self.settings);
        let seen = |found: &[Option<Vec<Option<Found>>>]| {
            let seen = sparse::at_pixels(&self.pairs, &pixels, found, places.iter().copied());
            Seen { pixel_sigma: Some(sigma), ..seen }
        };
        let mut all = seen(&found);
        /// From so many rows on it pays to make the map ready for them.
        const MANY: usize = 20_000;
        let made_ready =
            (rows.len() > MANY).then(|| ScenePoints::of_pixels(self.model, &self.pairs));
        let points = made_ready.as_ref().unwrap_or(&self.points);
        progress.check()?;
        let verdict = Verdict::of_pixels(&self.pairs, points, (&all, &[]));
        if let Some(pair) = verdict.left_out(&self.pairs) {
            found[pair] = None;
            all = seen(&found);
        }
        let located = self.of_features(points, all, pictures[order])?;
        let left_out = self.left_out(&found);
        Ok(Reconstruction { left_out, ..located }.judged(verdict, Vec::new()))
    }

    /// The points of single pixels.
    fn of_features(
        &self,
        points: &ScenePoints<'_>,
        seen: Seen,
        reference: &ColourImage,
    ) -> Result<Reconstruction> {
        let map = sparse::map(&self.pairs[0], &seen).ok_or_else(nothing)?;
        let (cloud, depths) = self.located(points, seen, reference);
        let mut depth = self.unknown_depths();
        set_depths(&mut depth, &cloud, &depths);
        Ok(Reconstruction::of(map, depth, cloud))
    }

    /// The points of maps, and their depths as a picture.
    fn dense(
        &self,
        maps: &[Option<&DisparityMap>],
        reference: &ColourImage,
        progress: &dyn Progress,
    ) -> Result<(Cloud, Vec<f32>)> {
        let of_row = |y: usize| {
            let lattices = &self.points.lattices;
            let seen = dense::seen((&self.pairs, lattices), maps, y, &self.settings);
            self.located(&self.points, seen, reference)
        };
        let height = self.pair().size[1] as usize;
        let (mut cloud, mut depth) = (self.no_points(), self.unknown_depths());
        for first in (0..height).step_by(BAND) {
            progress.check()?;
            let rows = first..height.min(first + BAND);
            let of_rows: Vec<_> = rows.into_par_iter().map(of_row).collect();
            for (row, depths) in of_rows {
                set_depths(&mut depth, &row, &depths);
                cloud.append(row);
            }
        }
        Ok((cloud, depth))
    }

    fn no_points(&self) -> Cloud {
        Cloud { pixels: vec![Vec::new(); self.settings.cameras.len()], ..Cloud::default() }
    }

    /// Of all pixels of the left rectified picture.
    fn unknown_depths(&self) -> Vec<f32> {
        let [width, height] = self.pair().size.map(|side| side as usize);
        vec![f32::NAN; width * height]
    }

    /// Which of the settings' cameras one is.
    pub(crate) fn order(&self, camera: usize) -> usize {
        self.settings.cameras.iter().position(|own| *own == camera).unwrap_or(0)
    }

    /// The points that the pairs agree on, and the depth of each.
    fn located(
        &self,
        points: &ScenePoints<'_>,
        seen: Seen,
        reference: &ColourImage,
    ) -> (Cloud, Vec<f32>) {
        let (mut cloud, mut depths) = (self.no_points(), Vec::new());
        let cameras = cameras(&self.pairs);
        let seen = agreed(&self.pairs, &points.map, seen, self.settings.least_confidence);
        for (index, point) in points.locate(&cameras, &seen).into_iter().enumerate() {
            let Some(point) = point else { continue };
            let sigmas = [0, 1, 2].map(|axis| point.covariance[(axis, axis)].sqrt());
            let is_sure = |most: f64| sigmas.iter().all(|sigma| *sigma <= most);
            let z = self.pair().rectified_from_world.transform(point.place).z;
            if z <= 0.0 || !self.settings.most_sigma.is_none_or(is_sure) {
                continue;
            }
            depths.push(z as f32);
            cloud.points.push(point.place.into());
            cloud.sigmas.push(sigmas.map(|sigma| sigma as f32));
            cloud.confidence.push(seen.confidence[index]);
            cloud.colours.push(reference.nearest(seen.reference[index]));
            for (side, camera) in cameras.iter().enumerate() {
                let pixel = seen.pixel(side, index).map(|value| value as f32);
                cloud.pixels[self.order(*camera)].push(pixel);
            }
            cloud.trust.push(point.trust);
            cloud.places.push(seen.places[index]);
        }
        (cloud, depths)
    }
}

/// Writes the depths of a cloud's points where they belong.
fn set_depths(depth: &mut [f32], cloud: &Cloud, depths: &[f32]) {
    for (place, own) in cloud.places.iter().zip(depths) {
        depth[*place as usize] = *own;
    }
}

/// What all pairs found.
pub(crate) struct Searched<T> {
    pub(crate) of_pairs: Vec<Option<T>>,
    pub(crate) checks: Vec<PairCheck>,
}

/// Of pictures without a pixel.
fn nothing() -> Error {
    Error::Degenerate {
        problem: "the rectified pictures are empty".into(),
        hint: "give a larger range of depths".into(),
    }
}
