//! From a pair of pictures to what stands about the robot: edges and corners, found in both pictures
//! along the calibration's curves, located by its map, and told from the floor.

mod epipolar_curves;
mod heading_filter;
mod curve;
mod edge_matches;
mod ground;
mod health;

pub use curve::{Curve, Waypoint};
pub use edge_matches::EdgeMatch;
pub use epipolar_curves::EpipolarCurves;
pub use ground::LocatedEdge;
pub use heading_filter::FloorDirection;
pub(crate) use heading_filter::quarter;
pub use health::{Health, HealthWarning};

use super::scene::Scene;
use nalgebra::Matrix3;
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{
    Calibration, Result,
    geometry::{Pixel, PixelColumns, Point3, columns_of},
    method::{Located, Locator},
};
use wheatstone_numeric::progress::Progress;
use wheatstone_reconstruction::features::{
    Corner, CornerMatch, Edges, Gradient, corners, match_corners,
};

/// What makes sense of pairs of pictures.
pub struct Observer<'a> {
    calibration: &'a Calibration,
    /// The calibration's map, made ready for the thousand pairs of pixels that every look shows.
    locator: Locator<'a>,
    epipolar_curves: EpipolarCurves,
    size: [usize; 2],
    health: Health,
    /// See [`Observer::map_error`].
    map_error: Option<f64>,
}

/// A corner of something, located.
#[derive(Clone, Copy, Debug)]
pub struct SeenCorner {
    /// Where it was seen.
    pub matched: CornerMatch,
    /// Where it is, in the robot's frame, in centimetres.
    pub point: Point3,
    /// The covariance of that, in square centimetres.
    pub covariance: Matrix3<f64>,
}

/// What a pair of pictures shows.
#[derive(Clone, Debug, Default)]
pub struct Observation {
    /// Of the ground.
    pub scene: Scene,
    /// The corners that both cameras saw: what own motion is found from.
    pub corners: Vec<SeenCorner>,
    /// The edges.
    pub edges: Vec<LocatedEdge>,
    /// Which way the floor's edges run, where they have a common direction.
    pub floor_direction: Option<FloorDirection>,
    /// What is wrong with the pictures.
    pub complaint: Option<HealthWarning>,
}

/// Standard deviation of a matched place across its edge, in pixels: half again what rendered corners
/// and edges scatter by.
const PLACED: f64 = 0.15;

/// More corners than own motion needs.
const MOST_CORNERS: usize = 220;

/// Beside its curve a corner is sought up to this many pixels, and as many of the calibration's own
/// errors.
const ASIDE: f64 = 1.0;
const ASIDE_ERRORS: f64 = 4.0;

impl<'a> Observer<'a> {
    /// With a calibration, for pictures of this size.
    ///
    /// # Errors
    ///
    /// Those of [`EpipolarCurves::new`].
    pub fn new(
        calibration: &'a Calibration,
        size: [usize; 2],
        progress: &dyn Progress,
    ) -> Result<Self> {
        let epipolar_curves = EpipolarCurves::new(calibration, size, progress)?;
        let map_error = map_error(calibration);
        let floor_error = match map_error {
            Some(_) => epipolar_curves.own_error(calibration),
            None => calibration.training.rms,
        };
        let health = Health::new(calibration, &epipolar_curves, floor_error);
        let locator = Locator::new(&*calibration.reconstructor, None);
        Ok(Self { calibration, locator, epipolar_curves, size, health, map_error })
    }

    /// How far a map errs at its own points that does not tell what the pixels' noise does to a point, in
    /// centimetres, root mean square; `None` for maps that do.
    #[must_use]
    pub fn map_error(&self) -> Option<f64> {
        self.map_error
    }

    /// The calibration's curves.
    #[must_use]
    pub fn epipolar_curves(&self) -> &EpipolarCurves {
        &self.epipolar_curves
    }

    /// What a pair of pictures shows.
    #[must_use]
    pub fn observe(&mut self, pictures: &[GrayImage; 2]) -> Observation {
        let [first, second] = [0, 1].map(|camera| {
            let gradient = Gradient::new(&pictures[camera]);
            let (edges, corners) =
                rayon::join(|| Edges::new(&gradient), || corners(&gradient, MOST_CORNERS));
            (gradient, edges, corners)
        });
        let aside = ASIDE + ASIDE_ERRORS * self.health.own_error();
        let matched = corners_along(&self.epipolar_curves, &first.2, (&second.2, &second.0), aside);
        let edges = self.located_edges(edge_matches::match_edges(
            &self.epipolar_curves,
            &first.1,
            &second.1,
        ));
        let corners = self.located_corners(&matched);
        let seen = health::Observed {
            corners: [first.2.len(), second.2.len()],
            edges: [first.1.all.len(), second.1.all.len()],
            greys: [0, 1].map(|camera| mean_grey(&pictures[camera])),
            matched: &corners,
            placed: &self.placed(&edges),
        };
        let look_aside = |aside: f64| {
            corners_along(&self.epipolar_curves, &first.2, (&second.2, &second.0), aside)
        };
        let (trust, complaint) = self.health.judge(&seen, &look_aside);
        let strips = ground::strips(&self.epipolar_curves, &edges, self.size);
        let obstacles = ground::obstacles(&edges, &strips);
        let clear = strips.into_iter().flatten().map(|strip| strip.stretch).collect();
        let scene = Scene { obstacles, clear, trust };
        let floor_direction = heading_filter::floor_direction(&edges);
        let corners = self.for_motion(corners);
        Observation { scene, corners, edges, floor_direction, complaint }
    }

    fn located_corners(&mut self, matched: &[CornerMatch]) -> Vec<SeenCorner> {
        let pairs = matched.iter().map(|corner| Some(([corner.first, corner.second], 1.0)));
        let located = self.located(&pairs.collect::<Vec<_>>());
        let corner = |(matched, located): (&CornerMatch, Option<(Point3, Matrix3<f64>)>)| {
            let (point, covariance) = located?;
            Some(SeenCorner { matched: *matched, point, covariance })
        };
        matched.iter().zip(located).filter_map(corner).collect()
    }

    /// The corners that tell the robot's motion. Where the map errs by more than at its own points, all points
    /// err alike, and count only as far as there are few others.
    fn for_motion(&self, mut corners: Vec<SeenCorner>) -> Vec<SeenCorner> {
        // Squared errors, in those at the map's own points: no more than that, and at most.
        const SURE: f64 = 2.0;
        const MOST: f64 = 6.0;
        const ENOUGH: usize = 12;
        let Some(error) = self.map_error else { return corners };
        let mut squares: Vec<f64> = corners.iter().map(|seen| seen.covariance.trace()).collect();
        squares.sort_by(f64::total_cmp);
        let needed = squares.get(ENOUGH - 1).copied().unwrap_or(f64::INFINITY);
        let most = (error * error) * (needed / (error * error)).clamp(SURE, MOST);
        corners.retain(|seen| seen.covariance.trace() <= most);
        corners
    }

    /// The points that tell where the floor is: by the map, or by the lines of sight where these know better.
    fn placed(&self, edges: &[LocatedEdge]) -> Vec<Point3> {
        let place = |edge: &LocatedEdge| {
            let (point, _) = edge.at?;
            let (first, second) = (edge.matched.edge.at, edge.matched.other?);
            match self.map_error {
                Some(_) => self.epipolar_curves.curve(first).point_near(second),
                None => Some(point),
            }
        };
        edges.iter().filter_map(place).collect()
    }

    fn located_edges(&mut self, matched: Vec<EdgeMatch>) -> Vec<LocatedEdge> {
        let pair =
            |matched: &EdgeMatch| Some(([matched.edge.at, matched.other?], matched.crossing));
        let located = self.located(&matched.iter().map(pair).collect::<Vec<_>>());
        let edge = |(matched, at): (EdgeMatch, Option<(Point3, Matrix3<f64>)>)| LocatedEdge {
            matched,
            at: at.filter(|(point, _)| curve::above_floor(*point)),
        };
        let mut edges: Vec<LocatedEdge> = matched.into_iter().zip(located).map(edge).collect();
        ground::fill_in(&self.epipolar_curves, &mut edges);
        edges
    }

    /// Where pairs of pixels point, and how sure that is if they were placed along the curve with
    /// [`PLACED`] over a cosine, their crossing. A map without a noise of pixels knows but the spread about
    /// its own points: how far it is from the lines of sight that the curves were made of tells what it
    /// errs by elsewhere.
    fn located(
        &mut self,
        pairs: &[Option<([Pixel; 2], f64)>],
    ) -> Vec<Option<(Point3, Matrix3<f64>)>> {
        let rows: Vec<Vec<Option<Pixel>>> =
            pairs.iter().flatten().map(|(pair, _)| pair.map(Some).to_vec()).collect();
        let columns = columns_of(&rows, 2);
        let columns = PixelColumns::new(columns.iter().map(|[x, y]| [&x[..], &y[..]]).collect());
        let batch = self.locator.locate(&columns);
        let map = &self.calibration.reconstructor;
        let mut rows = 0..rows.len();
        let located = |pair: &Option<([Pixel; 2], f64)>| {
            let ([first, second], crossing) = (*pair)?;
            let Located { point, covariance, .. } = batch.get(rows.next()?)?;
            // Behind the robot, or beyond all walls.
            if !(1.0..2000.0).contains(&point.z) {
                return None;
            }
            // Maps without a noise of pixels have bars of their own; edges are found no better than charts.
            let sigma = map.pixel_sigma(0, first, point);
            let worse = PLACED / (sigma.unwrap_or(PLACED).max(0.01) * crossing.max(0.1));
            let covariance = covariance * worse.max(1.0).powi(2);
            if sigma.is_some() {
                return Some((point, covariance));
            }
            let off = point - self.epipolar_curves.curve(first).point_near(second)?;
            Some((point, covariance + off * off.transpose()))
        };
        pairs.iter().map(located).collect()
    }
}

/// Corners found in the second picture beside the calibration's curves.
fn corners_along(
    curves: &EpipolarCurves,
    first: &[Corner],
    second: (&[Corner], &Gradient),
    aside: f64,
) -> Vec<CornerMatch> {
    match_corners(&|pixel: Pixel| curves.curve(pixel).seen(), first, second, aside)
}

/// See [`Observer::map_error`].
fn map_error(calibration: &Calibration) -> Option<f64> {
    let rows = calibration.data.restored();
    let (world, pixel) = rows.known().find_map(|(world, row)| Some((world, row.pixels[0]?)))?;
    let tells = calibration.reconstructor.pixel_sigma(0, pixel, world).is_some();
    (!tells).then_some(calibration.training.rms)
}

/// Mean grey level of a picture.
fn mean_grey(picture: &GrayImage) -> f64 {
    let values = picture.values();
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len().max(1) as f64
}
