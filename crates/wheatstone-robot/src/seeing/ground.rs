//! From located edges to what they say of the ground: which stand out from the floor, and how far along
//! each line of sight the floor is free.

use super::{edge_matches::EdgeMatch, epipolar_curves::EpipolarCurves};
use crate::{
    Ground,
    scene::{ScenePoint, Stretch},
};
use nalgebra::{Matrix2, Matrix3};
use wheatstone_core::geometry::{Pixel, Point3};

/// A place on an edge that was located, in the robot's frame.
#[derive(Clone, Copy, Debug)]
pub struct LocatedEdge {
    /// What was matched.
    pub matched: EdgeMatch,
    /// Where it is; none where it was not found in the other picture.
    pub at: Option<(Point3, Matrix3<f64>)>,
}

impl LocatedEdge {
    /// How high above the floor it is, in centimetres.
    #[must_use]
    pub fn height(&self) -> Option<f64> {
        self.at.map(|(point, _)| -point.y)
    }
}

/// Below this height above the floor a point may be of the floor, in centimetres, and as a share of its
/// distance; what stands on the floor is at least [`crate::world::LOWEST_OBSTACLE`] high.
const FLOOR: f64 = 3.0;
const FLOOR_SHARE: f64 = 0.015;

/// Whether a point is of the floor, as far as its height tells.
#[must_use]
pub(crate) fn is_floor(point: Point3) -> bool {
    -point.y < FLOOR + FLOOR_SHARE * distance(point)
}

fn distance(point: Point3) -> f64 {
    Ground::new(point.x, point.z).coords.norm()
}

/// Floor farther than this is too uncertain to go by, in centimetres.
const FARTHEST: f64 = 350.0;

/// And so is what stands on it from here on: a pixel amiss is a hand's breadth there, and the robot comes
/// nearer before it must know.
const FARTHEST_OBSTACLE: f64 = 200.0;

/// What stands out from the floor.
#[must_use]
pub(crate) fn obstacles(edges: &[LocatedEdge], strips: &[Option<Strip>]) -> Vec<ScenePoint> {
    let point = |edge: &LocatedEdge| {
        let (point, covariance) = edge.at?;
        let covariance = Matrix2::new(
            covariance[(0, 0)],
            covariance[(0, 2)],
            covariance[(2, 0)],
            covariance[(2, 2)],
        );
        let place = Ground::new(point.x, point.z);
        let near = distance(point) < FARTHEST_OBSTACLE;
        let stands = near && has_foot(edge.matched.edge.at.x, distance(point), strips);
        (stands && !is_floor(point)).then_some(ScenePoint { place, covariance, height: -point.y })
    };
    let mut all: Vec<ScenePoint> = edges.iter().filter_map(point).collect();
    all.extend(strips.iter().flatten().filter_map(|strip| strip.foot));
    all.iter().filter(|point| has_company(point, &all)).copied().collect()
}

/// Whether floor that is seen beside a column of the picture ends about where something is to stand: what
/// stands hides the floor behind it, and a mistaken match does not.
fn has_foot(column: f64, distance: f64, strips: &[Option<Strip>]) -> bool {
    // Wider than an edge's blur and the eyes' difference.
    const BESIDE: usize = 3;
    let strip = (column / STRIP) as usize;
    let beside = strip.saturating_sub(BESIDE)..(strip + BESIDE + 1).min(strips.len());
    let near = |end: Ground| (end.coords.norm() - distance).abs() < STANDS + FLOOR_SHARE * distance;
    let ends = |strip: &Strip| near(strip.foot.map_or(strip.stretch.to, |foot| foot.place));
    strips[beside].iter().any(|strip| strip.as_ref().is_none_or(ends))
}

/// How far aside of its strip a foot may be, in square centimetres: a strip's width a metre off.
const ASIDE: f64 = 0.1;

/// What stands at a place and ends a stretch of floor.
fn foot(place: Ground, stretch: &Stretch) -> Option<ScenePoint> {
    let along = (stretch.to - stretch.from).try_normalize(1e-6)?;
    let near = place.coords.norm() < FARTHEST_OBSTACLE;
    let spread = along * along.transpose() * (stretch.sigma * stretch.sigma);
    let covariance = spread + Matrix2::identity() * ASIDE;
    near.then_some(ScenePoint { place, covariance, height: 0.0 })
}

/// Whether others say the same: an obstacle's edges are found every few pixels along, a mistaken match
/// is found once or twice.
fn has_company(point: &ScenePoint, all: &[ScenePoint]) -> bool {
    const NEAR: f64 = 2.5;
    const OTHERS: usize = 3;
    let reach = NEAR + 1.5 * point.covariance.trace().sqrt();
    let near = |other: &&ScenePoint| (other.place - point.place).norm() < reach;
    // The point itself is one of them.
    all.iter().filter(near).take(OTHERS + 1).count() > OTHERS
}

/// Columns of the picture that share one line of sight.
const STRIP: f64 = 4.0;

/// What some columns of the picture show of the floor.
pub(crate) struct Strip {
    /// How far it is free.
    pub stretch: Stretch,
    /// Where what ends it stands.
    foot: Option<ScenePoint>,
}

/// How far the floor is free, for each strip of columns; none where none of it is seen.
#[must_use]
pub(crate) fn strips(
    epipolar_curves: &EpipolarCurves,
    edges: &[LocatedEdge],
    [width, height]: [usize; 2],
) -> Vec<Option<Strip>> {
    let mut columns: Vec<Vec<Shown>> = vec![Vec::new(); (width as f64 / STRIP) as usize + 1];
    for edge in edges {
        // Sampled every four pixels, an edge that lies may miss a strip: it counts for both beside, where it
        // would be there if it went on straight. The foot of a face aslant would else lie too far off.
        let (at, along) = (edge.matched.edge.at, edge.matched.edge.along());
        let strip = (at.x / STRIP) as usize;
        let lies = along.x.abs() > 0.5;
        let slope = if lies { along.y / along.x } else { 0.0 };
        for number in strip.saturating_sub(usize::from(lies))..=strip + usize::from(lies) {
            if let Some(column) = columns.get_mut(number) {
                column.push(Shown { row: at.y + slope * (middle(number) - at.x), edge });
            }
        }
    }
    let shown = |(number, edges): (usize, &mut Vec<Shown>)| {
        edges.sort_by(|a, b| b.row.total_cmp(&a.row));
        let bottom = Pixel::new(middle(number), height as f64 - 1.0);
        strip(epipolar_curves, edges, (epipolar_curves.floor(bottom)?, bottom.x))
    };
    columns.iter_mut().enumerate().map(shown).collect()
}

/// The column in the middle of a strip.
fn middle(strip: usize) -> f64 {
    (strip as f64 + 0.5) * STRIP
}

/// An edge where a strip shows it.
#[derive(Clone, Copy)]
struct Shown<'a> {
    row: f64,
    edge: &'a LocatedEdge,
}

/// Floor longer than this without an edge is no floor, in centimetres: tiles are smaller.
const BARE: f64 = 60.0;

/// An obstacle's edge over the floor's last one stands on it if it is no farther off, in centimetres.
const STANDS: f64 = 8.0;

/// Goes up a strip of the picture from edge to edge, as long as they are the floor's.
fn strip(
    epipolar_curves: &EpipolarCurves,
    edges: &[Shown],
    (from, column): (Ground, f64),
) -> Option<Strip> {
    let mut last: Option<(f64, f64)> = None;
    // Where the first edge after that is, if it is on the floor, of which that is not sure.
    let mut maybe: Option<Ground> = None;
    let mut limit = f64::INFINITY;
    let mut blocked = false;
    for Shown { row, edge } in edges {
        match edge.at {
            Some((point, covariance)) if is_floor(point) => {
                last = Some((*row, covariance.trace().sqrt()));
                maybe = None;
            }
            Some((point, _)) => {
                limit = distance(point);
                blocked = true;
                break;
            }
            // One that the curve runs along may be the floor's: it neither tells nor hides anything.
            None if edge.matched.floor.is_some() => maybe = maybe.or(edge.matched.floor),
            // One that neighbours on its chain explain as the floor's would have been filled in.
            None => {
                blocked = true;
                break;
            }
        }
    }
    let (row, sigma) = last?;
    let to = epipolar_curves.floor(Pixel::new(column, row))?;
    // Of a floor another edge would follow; a bare face goes on to the picture's top.
    let bare = !blocked
        && epipolar_curves
            .floor(Pixel::new(column, 0.0))
            .is_none_or(|top| (top - to).norm() > BARE);
    let start = from.coords.norm();
    let reach = to.coords.norm().min(limit).min(FARTHEST);
    if reach <= start {
        return None;
    }
    let direction = (to - from).try_normalize(1e-6)?;
    // From the bottom of the picture the line of sight leads straight over the floor.
    let length = (to - from).norm() - (to.coords.norm() - reach);
    let reaches = limit <= to.coords.norm() + STANDS;
    // Below a bare face the last edge of all is its foot, though the curve runs along it.
    let beyond = maybe.filter(|_| bare && !reaches);
    let blocked = (bare || reaches) && beyond.is_none();
    let stretch = Stretch { from, to: from + direction * length, sigma, blocked };
    let foot = beyond.or(blocked.then_some(stretch.to)).and_then(|at| foot(at, &stretch));
    (length > 0.0).then_some(Strip { stretch, foot })
}

/// Gives edges that the second picture does not show, but that lie on a chain between others that were
/// found on the floor, a place on the floor.
pub(crate) fn fill_in(epipolar_curves: &EpipolarCurves, edges: &mut [LocatedEdge]) {
    // Tiles' edges are longer than this; feet of obstacles that the curve runs along are found at
    // their corners.
    const NEAR: f64 = 30.0;
    let known: Vec<(u32, Pixel, bool, Matrix3<f64>)> = edges
        .iter()
        .filter_map(|edge| {
            let (point, covariance) = edge.at?;
            Some((edge.matched.edge.chain, edge.matched.edge.at, is_floor(point), covariance))
        })
        .collect();
    let mut by_chain: std::collections::BTreeMap<u32, Vec<usize>> =
        std::collections::BTreeMap::new();
    for (index, entry) in known.iter().enumerate() {
        by_chain.entry(entry.0).or_default().push(index);
    }
    for edge in edges.iter_mut().filter(|edge| edge.at.is_none()) {
        let own = edge.matched.edge;
        let Some(members) = by_chain.get(&own.chain) else { continue };
        let near: Vec<usize> = members
            .iter()
            .copied()
            .filter(|index| (known[*index].1 - own.at).norm() < NEAR)
            .collect();
        let floor = near.iter().filter(|index| known[**index].2).count();
        if near.len() < 2 || 10 * floor < 9 * near.len() {
            continue;
        }
        if let Some(ground) = epipolar_curves.floor(own.at) {
            edge.at = Some((Point3::new(ground.x, 0.0, ground.y), known[near[0]].3));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cameras::cameras;
    use nalgebra::Vector2;
    use wheatstone_core::{
        Calibration,
        dataset::{Correspondence, Dataset},
        method::AnyMethod,
        preparation::Prepared,
    };
    use wheatstone_numeric::progress::Silent;
    use wheatstone_reconstruction::features::Edge;

    const SIZE: [usize; 2] = [640, 480];

    /// Of the robot's own cameras, fitted to points that they see without error.
    fn epipolar_curves() -> EpipolarCurves {
        let cameras = cameras().unwrap();
        let along =
            |from: f64, step: f64, count: i32| (0..count).map(move |i| from + step * f64::from(i));
        let mut correspondences = Vec::new();
        for z in along(40.0, 25.0, 6) {
            for (x, y) in
                along(-40.0, 10.0, 9).flat_map(|x| along(-20.0, 5.0, 6).map(move |y| (x, y)))
            {
                let point = Point3::new(x, y, z);
                let pixels = cameras.iter().map(|camera| camera.project(point)).collect();
                let world = Some(point);
                correspondences.push(Correspondence {
                    view: 0,
                    id: None,
                    pixels,
                    world,
                    board: None,
                });
            }
        }
        let data = Dataset { unit: "cm".into(), cameras: 2, views: Vec::new(), correspondences };
        let method = AnyMethod::named("dlt").unwrap();
        let calibration = Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent);
        EpipolarCurves::new(&calibration.unwrap(), SIZE, &Silent).unwrap()
    }

    /// The row in which a column shows where a wall aslant stands on the floor: `beyond` says how far behind its
    /// foot a place on the floor is.
    fn foot_row(
        epipolar_curves: &EpipolarCurves,
        column: f64,
        beyond: impl Fn(Ground) -> f64,
    ) -> Option<f64> {
        let at = |row: f64| {
            epipolar_curves.floor(Pixel::new(column, row)).map_or(f64::INFINITY, &beyond)
        };
        let (mut above, mut below) = (0.0, SIZE[1] as f64 - 1.0);
        while below - above > 1e-6 {
            let middle = 0.5 * (above + below);
            *(if at(middle) > 0.0 { &mut above } else { &mut below }) = middle;
        }
        (at(below).abs() < 1e-3).then_some(below)
    }

    #[test]
    fn floor_ends_at_the_foot_of_a_face_aslant_though_its_edge_is_seen_beside_the_strip() {
        let epipolar_curves = epipolar_curves();
        // The ground line z = 100 + 2.5 x, seen at some forty degrees.
        let beyond = |place: Ground| (place.y - 100.0 - 2.5 * place.x) / libm::hypot(1.0, 2.5);
        // An edge so many pixels above a place on the floor, and so high above it.
        let located = |foot: Pixel, along: Vector2<f64>, [above, height]: [f64; 2]| {
            let at = Pixel::new(foot.x, foot.y - above);
            let towards_light = Vector2::new(along.y, -along.x).normalize();
            let edge = Edge { at, towards_light, contrast: 1.0, grey: 1.0, chain: 0 };
            let ground = epipolar_curves.floor(foot).unwrap();
            let place = Point3::new(ground.x, -height, ground.y);
            let matched = EdgeMatch { edge, other: Some(at), crossing: 1.0, floor: None };
            LocatedEdge { matched, at: Some((place, Matrix3::identity() * 0.01)) }
        };
        let row = |column: f64| foot_row(&epipolar_curves, column, beyond);
        let (mut edges, mut seen) = (Vec::new(), Vec::new());
        for number in 0..SIZE[0] / STRIP as usize {
            // Anywhere in its strip, and of every third strip not at all.
            let column = (number as f64 + [0.02, 0.95, 0.5, 0.3][number % 4]) * STRIP;
            let (Some(here), Some(there)) = (row(column), row(column + 1.0)) else { continue };
            if !(30.0..400.0).contains(&here) {
                continue;
            }
            let foot = Pixel::new(column, here);
            edges.push(located(Pixel::new(column, here + 60.0), Vector2::x(), [0.0, 0.0]));
            edges.push(located(foot, Vector2::x(), [25.0, 10.0]));
            if number % 3 != 0 {
                edges.push(located(foot, Vector2::new(1.0, there - here), [0.0, 0.0]));
            }
            seen.push(number);
        }
        let strips = strips(&epipolar_curves, &edges, SIZE);
        // Those at both ends have a neighbour on one side only.
        let within = &seen[1..seen.len() - 1];
        assert!(within.len() > 50, "{}", within.len());
        for number in within {
            let to = strips[*number].as_ref().unwrap().stretch.to;
            let (end, column) = (beyond(to), middle(*number));
            // Never beyond the face; nearer by no more than what it is nearer beside the strip.
            assert!(end < 0.1 && end > -0.012 * to.coords.norm(), "{end} cm at column {column}");
        }
    }
}
