//! Two cameras of a model, rectified once: the disparities that pictures of theirs show.

use crate::{
    features::EpipolarCurve,
    matches::{MatchedPixel, Shown, Source},
    seen::Found,
    settings::{ReconstructionSettings, whole},
    sharpness::rectified,
};
use nalgebra::{Matrix4, Vector3};
use std::ops::Range;
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{
    Calibration, Error, Result,
    geometry::{Pixel, Pose},
    rectification::{PairSettings, Rectification, Table},
};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{
    CONFIDENT, DisparityMap, EpipolarCurves, MatchError, Matcher, PairJudgement, Picture,
    judge_pair,
};

/// Two cameras of a model, rectified.
///
/// Disparities are those of the *reference* camera's picture. Where that is the right camera of the virtual pair, both
/// rectified pictures are mirrored: then it is the left one, and disparities are the same.
pub(crate) struct RectifiedPair<'a> {
    pub(crate) rectification: Rectification<'a>,
    /// The reference camera, and the other one.
    pub(crate) cameras: [usize; 2],
    pub(crate) is_mirrored: bool,
    /// Of the reference camera and of the other one, mirrored where pictures are.
    tables: [Table; 2],
    pub(crate) range: Range<i32>,
    /// Where rows are no epipolar lines.
    curves: Option<EpipolarCurves>,
}

impl<'a> RectifiedPair<'a> {
    /// Of two cameras; `reference` is one of them, or none: then it is the left one.
    pub(crate) fn new(
        model: &'a Calibration,
        cameras: [usize; 2],
        reference: Option<usize>,
        settings: &ReconstructionSettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let most = settings.cameras.iter().copied().max().unwrap_or_default();
        let mut sizes = vec![None; model.volume.cameras().max(most + 1)];
        for (camera, size) in settings.cameras.iter().zip(&settings.sizes) {
            sizes[*camera] = Some(*size);
        }
        let wanted = PairSettings { cameras, sizes, ..PairSettings::default() };
        let rectification = Rectification::of(model, &wanted, progress)?;
        let [left, right] = rectification.pair.cameras;
        let is_mirrored = reference == Some(right);
        let range = search_range(&rectification, settings.depths)?;
        let (cameras, tables) = if is_mirrored {
            ([right, left], [1, 0].map(|side| mirrored(rectification.table(side))))
        } else {
            ([left, right], [0, 1].map(|side| rectification.table(side)))
        };
        let curves = curves(&rectification, is_mirrored, &range)?;
        Ok(Self { rectification, cameras, is_mirrored, tables, range, curves })
    }

    /// Disparities of the reference camera's picture, and what is said of the pair. Pictures are those of `cameras`.
    pub(crate) fn disparities(
        &self,
        matcher: &Matcher,
        pictures: [&ColourImage; 2],
    ) -> Result<(DisparityMap, PairJudgement)> {
        let matcher = matcher.clone().range(self.range.clone());
        let rectified = self.rectified(pictures);
        let map = self.search(&matcher, &rectified).map_err(refused)?;
        let [first, second] = pictures;
        let exchanged = || {
            let coarse = matcher.clone().refining(false);
            Ok(self.search(&coarse, &self.rectified([second, first]))?.density(CONFIDENT))
        };
        let judged = self.judged(&rectified, map.density(CONFIDENT), exchanged)?;
        Ok((map, judged))
    }

    fn search(
        &self,
        matcher: &Matcher,
        [left, right]: &[Vec<u8>; 2],
    ) -> Result<DisparityMap, MatchError> {
        let (left, right) = (self.picture(left)?, self.picture(right)?);
        match &self.curves {
            Some(curves) => matcher.compute_along(&left, &right, curves),
            None => matcher.compute(&left, &right),
        }
    }

    /// Judges rectified pictures of which a share is matched; `exchanged` gives the share the other way round.
    pub(crate) fn judged(
        &self,
        [left, right]: &[Vec<u8>; 2],
        matched: f64,
        exchanged: impl FnOnce() -> Result<f64, MatchError>,
    ) -> Result<PairJudgement> {
        let bend = self.curves.as_ref().map_or(0.0, EpipolarCurves::bend);
        let found = || {
            let (left, right) = (self.picture(left)?, self.picture(right)?);
            judge_pair([&left, &right], self.range.clone(), (matched, bend), exchanged)
        };
        found().map_err(refused)
    }

    /// By how many rows the rectified pictures of cameras that stand as they did may be beside each other: what the model
    /// has wrong at the points that it was fitted to, with their noise, and what curves bend.
    pub(crate) fn expected_offset(&self) -> f32 {
        let measured = self.rectification.leftover.measured.as_ref();
        let bend = self.curves.as_ref().map_or(0.0, EpipolarCurves::bend);
        measured.map_or(0.0, |left| left.vertical.rms as f32) + bend
    }

    pub(crate) fn rectified(&self, pictures: [&ColourImage; 2]) -> [Vec<u8>; 2] {
        rectified(&self.tables, pictures)
    }

    fn picture<'p>(&self, pixels: &'p [u8]) -> Result<Picture<'p>, MatchError> {
        Picture::new(self.tables[0].width, self.tables[0].height, pixels)
    }

    /// The other camera's pixel of a disparity of this standard deviation; `None` where a table shows nothing.
    pub(crate) fn matched(
        &self,
        at: (f64, f64),
        (disparity, sigma): (f64, f64),
    ) -> Option<MatchedPixel> {
        let shown = self.shown(at, disparity)?;
        Some(shown.matched(sigma))
    }

    /// What both cameras show at a rectified pixel and a disparity; `None` where a table shows nothing.
    pub(crate) fn shown(&self, (x, y): (f64, f64), disparity: f64) -> Option<Shown> {
        let lower = |disparity: f64| self.lower((x, y), disparity);
        Some(Shown {
            reference: Source::of(&self.tables[0], x, y)?,
            other: Source::of(&self.tables[1], x - disparity, y + lower(disparity))?,
            bend: lower(disparity + 0.5) - lower(disparity - 0.5),
        })
    }

    /// By how many rows the epipolar curve of a rectified pixel leads down at a disparity.
    pub(crate) fn lower(&self, (x, y): (f64, f64), disparity: f64) -> f64 {
        let at = |curves: &EpipolarCurves| curves.at(x as f32, y as f32, disparity as f32);
        self.curves.as_ref().map_or(0.0, |curves| f64::from(at(curves)))
    }

    /// Where the other camera shows what the reference camera's own picture shows at a pixel: from the largest disparity
    /// to the least, [`CURVE_STEP`] between places.
    pub(crate) fn curve(&self, pixel: Pixel) -> EpipolarCurve {
        let Some(at) = self.place([pixel.x, pixel.y]) else {
            return EpipolarCurve::new(0, Vec::new());
        };
        let pieces = (f64::from(self.range.end - 1 - self.range.start) / CURVE_STEP).ceil();
        let place = |number: usize| {
            let [x, y] = self.matched(at, (self.disparity(number as f64), 1.0))?.pixel;
            Some(Pixel::new(x, y))
        };
        let mut places = (0..=pieces as usize).map(place).enumerate();
        // Where the other camera's picture begins; farther places are found until it ends.
        let Some((first, start)) = places.find_map(|(number, place)| Some((number, place?))) else {
            return EpipolarCurve::new(0, Vec::new());
        };
        let rest = places.map_while(|(_, place)| place);
        EpipolarCurve::new(first, std::iter::once(start).chain(rest).collect())
    }

    /// What the other camera has so far along the curve of a pixel, with a standard deviation along it in pixels.
    pub(crate) fn on_curve(
        &self,
        pixel: Pixel,
        (along, sigma): (f64, f64),
        confidence: f32,
    ) -> Option<Found> {
        let (at, disparity) = (self.place([pixel.x, pixel.y])?, self.disparity(along));
        // By how many pixels a larger disparity moves it.
        let [dx, dy] = self.matched(at, (disparity, 1.0))?.deviation;
        let sigma = sigma / (dx * dx + dy * dy).sqrt();
        let at = self.matched(at, (disparity, sigma))?;
        Some(Found { at, disparity, sigma, confidence, doubt: 1.0, point: None })
    }

    /// What the other camera has at a pixel that was matched by somebody else, if that is near its epipolar curve.
    pub(crate) fn given(&self, pixel: Pixel, other: Pixel, sigma: f64) -> Option<Found> {
        let place = self.curve(pixel).nearest(other)?;
        // Hardly any right ones are farther off, with the noise of both pixels.
        let is_near = place.aside.abs() < 5.0 * sigma + MOST_CURVE_ERROR;
        let along = place.piece as f64 + place.share;
        let found = is_near.then(|| self.on_curve(pixel, (along, sigma), 1.0))??;
        let at = MatchedPixel { pixel: [other.x, other.y], ..found.at };
        Some(Found { at, ..found })
    }

    /// The disparity so far along a curve.
    fn disparity(&self, along: f64) -> f64 {
        f64::from(self.range.end - 1) - along * CURVE_STEP
    }

    /// The pixel of the reference camera's rectified picture, counted row by row, that shows a pixel of its own picture.
    pub(crate) fn rectified_pixel(&self, pixel: [f64; 2]) -> Option<u32> {
        let (x, y) = self.place(pixel)?;
        let (x, y) = (x.round(), y.round());
        let (width, height) = (self.tables[0].width, self.tables[0].height);
        let inside = x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
        inside.then(|| (y as usize * width + x as usize) as u32)
    }

    /// Whether both cameras show the place, in the middle of the depths.
    pub(crate) fn shows(&self, at: (f64, f64)) -> bool {
        let middle = 0.5 * f64::from(self.range.start + self.range.end);
        self.shown(at, middle).is_some()
    }

    /// The reference camera's own pixel that a rectified pixel shows.
    pub(crate) fn reference(&self, (x, y): (f64, f64)) -> Option<[f64; 2]> {
        Some(Source::of(&self.tables[0], x, y)?.pixel)
    }

    /// Where the rectified picture of the reference camera shows a pixel of its own picture.
    pub(crate) fn place(&self, pixel: [f64; 2]) -> Option<(f64, f64)> {
        let side = usize::from(self.is_mirrored);
        let at = self.rectification.rectified(side, Pixel::new(pixel[0], pixel[1]))?;
        let x = if self.is_mirrored { (self.tables[0].width - 1) as f64 - at.x } else { at.x };
        Some((x, at.y))
    }

    /// The largest disparity that is searched, and the least of those where the map is worth asking. Farther points are
    /// searched, too; what the map says of nearer ones goes on there: against truth, error bars of extrapolated points
    /// held as well from half a pixel of parallax as from twenty.
    pub(crate) fn finite_disparities(&self) -> [f64; 2] {
        /// Nearer points have so many pixels more than those at infinity. Of farther ones the map's derivatives are worth
        /// little: they are differences over an eighth of a pixel.
        const LEAST_PARALLAX: f64 = 4.0;
        let infinite = infinite(&self.rectification);
        let [start, last] = [self.range.start, self.range.end - 1].map(f64::from);
        let least = start.max(infinite + LEAST_PARALLAX);
        [least, last.max(least + 1.0)]
    }

    /// Whether a disparity that somebody else found is one of those that are searched, of a point in front of the cameras.
    pub(crate) fn searches(&self, disparity: f64) -> bool {
        /// Matching to a fraction of a pixel leads so far beyond whole disparities.
        const REFINED: f64 = 1.0;
        let [start, last] = [self.range.start, self.range.end - 1].map(f64::from);
        // Many matchers write 0 where there is no match: that would be a point at infinity.
        let infinite = infinite(&self.rectification).min(start);
        disparity > infinite.max(start - REFINED) && disparity <= last + REFINED
    }

    /// Where the virtual camera of one of the pair's cameras looks at a pixel of that camera's own picture, in the world.
    pub(crate) fn direction(&self, camera: usize, pixel: Pixel) -> Option<Vector3<f64>> {
        let pair = &self.rectification.pair;
        let side = pair.cameras.iter().position(|own| *own == camera)?;
        let at = self.rectification.rectified(side, pixel)?;
        let [cx, cy] = pair.principal[side];
        let direction = Vector3::new(at.x - cx, at.y - cy, pair.focal);
        Some(pair.rectified_from_world.inverse().rotation * direction.normalize())
    }

    /// What the cameras have at a pixel of the rectified picture and a disparity, in their pictures or beyond them.
    pub(crate) fn match_at(&self, at: Vector3<f64>) -> Option<([f64; 2], MatchedPixel)> {
        let lower = self.lower((at.x, at.y), at.z);
        let source = |own: usize, x: f64, y: f64| {
            let (side, x) = if self.is_mirrored {
                (1 - own, (self.tables[0].width - 1) as f64 - x)
            } else {
                (own, x)
            };
            let at = self.rectification.source(side, Pixel::new(x, y))?;
            Some([at.x, at.y])
        };
        let reference = source(0, at.x, at.y)?;
        let pixel = source(1, at.x - at.z, at.y + lower)?;
        Some((reference, MatchedPixel { pixel, deviation: [0.0; 2], direction: [0.0; 2] }))
    }

    /// From x, y and disparity of the rectified picture to the world, as an ideal pair would have it.
    pub(crate) fn world_from_pair(&self) -> Matrix4<f64> {
        let pair = &self.rectification.pair;
        let Pose { rotation, translation } = pair.rectified_from_world.inverse();
        let mut world_from_rectified = rotation.to_homogeneous();
        world_from_rectified.fixed_view_mut::<3, 1>(0, 3).copy_from(&translation);
        world_from_rectified * pair.depth_matrix() * self.left_from_reference()
    }

    /// From x of the mirrored right picture to that of the left one.
    fn left_from_reference(&self) -> Matrix4<f64> {
        let mut left = Matrix4::identity();
        if self.is_mirrored {
            (left[(0, 0)], left[(0, 2)]) = (-1.0, 1.0);
            left[(0, 3)] = (self.tables[0].width - 1) as f64;
        }
        left
    }

    /// Matches over the whole picture and all disparities, for maps that are made ready beforehand: pixels of the
    /// reference camera and what the other one has.
    pub(crate) fn lattice(&self) -> Vec<([f64; 2], MatchedPixel)> {
        const STEP: usize = 16;
        const DISPARITIES: i32 = 6;
        let mut shown = Vec::new();
        for y in (0..self.tables[0].height).step_by(STEP) {
            for x in (0..self.tables[0].width).step_by(STEP) {
                for index in 0..=DISPARITIES {
                    let share = f64::from(index) / f64::from(DISPARITIES);
                    let count = f64::from(self.range.end - self.range.start);
                    let disparity = f64::from(self.range.start) + share * count;
                    let at = (x as f64, y as f64);
                    shown.extend(self.reference(at).zip(self.matched(at, (disparity, 1.0))));
                }
            }
        }
        shown
    }
}

/// Pixels of disparity from one place of an epipolar curve to the next: what is matched along curves counts in these.
const CURVE_STEP: f64 = 4.0;

/// How far a curve of a good calibration is off, in pixels: as many rows as pairs may be off that are not at fault.
const MOST_CURVE_ERROR: f64 = 0.5;

/// The table of a picture that is mirrored after it was rectified.
fn mirrored(mut table: Table) -> Table {
    let rows = table.x.chunks_mut(table.width).chain(table.y.chunks_mut(table.width));
    rows.for_each(<[f32]>::reverse);
    table
}

/// The share of the disparities that a model was shown by which the search goes beyond them, at either end, and the
/// least number of pixels of that.
const MARGIN: f64 = 0.15;
const LEAST_MARGIN: f64 = 4.0;

/// The disparities of a range of depths, or of those that the model was fitted to.
fn search_range(made: &Rectification, depths: Option<[f64; 2]>) -> Result<Range<i32>> {
    let pair = &made.pair;
    let infinite = infinite(made);
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

/// The disparity of points at infinity.
fn infinite(made: &Rectification) -> f64 {
    let [[left, _], [right, _]] = made.pair.principal;
    left - right
}

/// From so many rows on a search along rows finds less.
const LEAST_BEND: f32 = 0.25;

/// The epipolar curves of a pair whose rows are none.
fn curves(
    made: &Rectification,
    is_mirrored: bool,
    range: &Range<i32>,
) -> Result<Option<EpipolarCurves>> {
    let [width, height] = made.pair.size.map(|side| side as usize);
    let lower = |x: f32, y: f32, disparity: f32| {
        let (x, y, disparity) = (f64::from(x), f64::from(y), f64::from(disparity));
        let lower = if is_mirrored {
            // What the left picture shows higher, the right one shows lower, to first order.
            let left = Pixel::new((width - 1) as f64 - x + disparity, y);
            -made.vertical_difference(left, disparity)?
        } else {
            made.vertical_difference(Pixel::new(x, y), disparity)?
        };
        Some(lower as f32)
    };
    let curves = EpipolarCurves::new((width, height), range.clone(), lower).map_err(refused)?;
    Ok((curves.bend() > LEAST_BEND).then_some(curves))
}

/// What the matcher cannot do, and the way out.
pub(crate) fn refused(error: MatchError) -> Error {
    Error::Setting {
        setting: "range of depths".into(),
        value: error.to_string(),
        need: "depths that both cameras see".into(),
    }
}
