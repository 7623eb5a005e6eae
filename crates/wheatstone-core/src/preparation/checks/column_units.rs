//! One column of the table in another unit, in all views: charts, pixels or the angle of view are impossible as it is.

use super::{
    board::Board,
    chart_size::places,
    coverage::{THIN, thickness, thickness_if},
    evidence::Evidence,
    finding::{Proposal, Severity},
    pairs::{Pair, extent},
    unit_ratios::{tidy, unit_ratios},
    views::LEAST,
};
use crate::geometry::{Point3, ProjectionMatrix};
use wheatstone_numeric::statistics::median;

/// Columns that may have a unit of their own, and their names.
pub(super) const COLUMNS: [([bool; 3], &str); 3] =
    [([true, false, false], "X"), ([false, true, false], "Y"), ([false, false, true], "Z")];

/// Some of a place's coordinates divided by a ratio of units.
pub(super) fn in_unit(evidence: &Evidence, which: [bool; 3], ratio: f64, scaled: Point3) -> Point3 {
    let mut world = evidence.frame.world(scaled);
    for axis in 0..3 {
        if which[axis] {
            world[axis] /= ratio;
        }
    }
    evidence.frame.scaled(world)
}

/// A column in another unit: which coordinates, by what ratio, and their name.
type Stretch = ([bool; 3], f64, &'static str);

fn stretches() -> impl Iterator<Item = Stretch> {
    unit_ratios()
        .flat_map(|ratio| COLUMNS.into_iter().map(move |(which, name)| (which, ratio, name)))
}

/// A column in another unit in all views. Two columns differ from the third as the third does from them: the pixels do
/// not tell which unit was meant, and two outvote one.
pub(super) fn units_throughout(evidence: &Evidence) -> Option<Proposal> {
    by_lattice(evidence)
        .or_else(|| by_pixels(evidence))
        .or_else(|| by_pixel_shape(evidence))
        .or_else(|| by_field_of_view(evidence))
}

/// Charts that stand askew are lattices of one pitch only in their own unit.
fn by_lattice(evidence: &Evidence) -> Option<Proposal> {
    let places: Vec<Vec<Point3>> = evidence
        .views
        .iter()
        .map(|view| {
            let known =
                view.rows.iter().filter_map(|row| evidence.data.correspondences[*row].world);
            known.map(|world| evidence.frame.scaled(world)).collect()
        })
        .filter(|places: &Vec<Point3>| places.len() >= LEAST)
        .collect();
    let boards = |map: &dyn Fn(Point3) -> Point3| -> Vec<Board> {
        let of = |view: &Vec<Point3>| {
            let board = Board::find(&view.iter().map(|place| map(*place)).collect::<Vec<_>>())?;
            // Of a lattice of which most is missing no pitch is told.
            let is_full = 2 * view.len() >= board.counts[0] * board.counts[1];
            is_full.then_some(board)
        };
        places.iter().filter_map(of).collect()
    };
    let alike = |map: &dyn Fn(Point3) -> Point3| of_one_pitch(&boards(map));
    // Charts of odd makes are no lattices at all; a few views may have another fault, and of lattices of which many
    // points are missing some are taken for others. Levels of a table without views may be several charts in one, and
    // lie on a plane once they are squeezed.
    if evidence.data.views.len() < 3 || places.len() < 3 || 3 * alike(&|place| place) > places.len()
    {
        return None;
    }
    let score = |(which, ratio, _): &Stretch| {
        alike(&|place: Point3| in_unit(evidence, *which, *ratio, place))
    };
    let scored = stretches().map(|stretch| (score(&stretch), stretch));
    // Of equal ones the first: they are in the order in which people mix them.
    let (count, best) = scored.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    let share = count as f64 / places.len() as f64;
    let figures = vec![("share of views that are lattices of one pitch then".into(), share)];
    let (which, ratio, _) = best;
    let then = boards(&|place| in_unit(evidence, which, ratio, place));
    (share > 0.85 && stand_askew(&then)).then(|| proposal(evidence, best, figures))
}

/// How many of the charts are lattices of the pitch that most have.
fn of_one_pitch(boards: &[Board]) -> usize {
    let pitches: Vec<[f64; 2]> =
        boards.iter().map(|Board { pitch: [a, b], .. }| [a.min(*b), a.max(*b)]).collect();
    if pitches.is_empty() {
        return 0;
    }
    let usual = [0, 1].map(|k| median(&pitches.iter().map(|pitch| pitch[k]).collect::<Vec<_>>()));
    let near = |pitch: &&[f64; 2]| (0..2).all(|k| (pitch[k] / usual[k] - 1.0).abs() < 5e-3);
    pitches.iter().filter(near).count()
}

/// Whether some charts stand askew to others: of charts that all stand alike, as plates on a stage do, a unit changes
/// all pitches by as much, and what is no lattice in any unit (levels, rows that are displaced) may look like one once
/// it is squeezed.
fn stand_askew(boards: &[Board]) -> bool {
    /// In degrees, between the normals or the rows of two charts.
    const ASKEW: f64 = 2.0;
    let Some((first, others)) = boards.split_first() else { return false };
    let least = libm::cos(ASKEW.to_radians());
    others.iter().any(|board| {
        let rows = first.along.iter().map(|axis| axis.dot(&board.along[0]).abs());
        // Columns of one may be called rows in another.
        rows.fold(0.0, f64::max) < least || first.normal().dot(&board.normal()).abs() < least
    })
}

/// Deviation of pixels from squares beyond which the world may be stretched: simulated lenses, behind glass and water too,
/// deviate by 0.03. And the share of it that the right unit leaves: anamorphic lenses deviate by more, but no ratio of
/// units undoes that.
const OBLONG: f64 = 0.12;
const SQUARE: f64 = 0.1;

/// A stretched world before cameras that look along its axes only makes their pixels oblong, or askew where they look a
/// little aside: some camera's are not square, and all are once it is put right.
fn by_pixel_shape(evidence: &Evidence) -> Option<Proposal> {
    let cameras = pairs_of_cameras(evidence);
    let before = largest_deviation(&shapes(evidence, &cameras, ([false; 3], 1.0))?);
    if before < OBLONG {
        return None;
    }
    let worst = |stretch: Stretch| {
        let (which, ratio, _) = stretch;
        // Of a slab no camera is known well.
        let thick = thickness_if(evidence, |place| in_unit(evidence, which, ratio, place))?;
        let shapes = (thick >= THIN).then(|| shapes(evidence, &cameras, (which, ratio)))??;
        let left = largest_deviation(&shapes) / before;
        (left < SQUARE).then_some((left, stretch))
    };
    // Of those that do, the one that changes least: a world that is squeezed to nothing is no better.
    let change = |(_, (_, ratio, _)): &(f64, Stretch)| libm::log(*ratio).abs();
    let least = |a: &(f64, Stretch), b: &(f64, Stretch)| {
        change(a).total_cmp(&change(b)).then(a.0.total_cmp(&b.0))
    };
    let (left, best) = stretches().filter_map(worst).min_by(least)?;
    let figures = vec![("deviation of pixels from squares, of that before".into(), left)];
    // Where nothing tells how deep points lie, X in one unit looks like Y in the inverse.
    Some(Proposal { is_estimate: true, ..proposal(evidence, best, figures) })
}

/// Half of the angle that points fill, in degrees: beyond the widest lenses without distortion (61 degrees: 12 mm before
/// 36 by 24 mm), and as far as most go.
const WIDEST: f64 = 65.0;
const USUAL: f64 = 50.0;

/// Points that lie too near one another along the cameras' axes look as through lenses that are wider than any without
/// distortion: all cameras are such, and none is once it is put right.
fn by_field_of_view(evidence: &Evidence) -> Option<Proposal> {
    let cameras = pairs_of_cameras(evidence);
    let before = shapes(evidence, &cameras, ([false; 3], 1.0))?;
    let narrowest = before.iter().map(|shape| shape.half_angle).fold(f64::INFINITY, f64::min);
    if narrowest < WIDEST {
        return None;
    }
    let is_usual = |(which, ratio, _): &Stretch| {
        shapes(evidence, &cameras, (*which, *ratio)).is_some_and(|shapes| {
            let are_usual = shapes.iter().all(|shape| shape.half_angle < USUAL);
            are_usual && largest_deviation(&shapes) < OBLONG
        })
    };
    let figures = vec![("degrees from each camera's axis that the points reach".into(), narrowest)];
    // Nothing tells by how much: the first is the ratio that is mixed up most.
    let best = stretches().find(is_usual)?;
    Some(Proposal { is_estimate: true, ..proposal(evidence, best, figures) })
}

/// Places and pixels of each camera, of views that agree: one that is elsewhere bends a camera as well.
fn pairs_of_cameras(evidence: &Evidence) -> Vec<Vec<Pair>> {
    let of = |camera: usize| {
        let cells = evidence.cells.iter().map(|view| &view[camera]);
        cells.filter(|cell| !cell.suspicious).flat_map(|cell| &cell.pairs).copied().collect()
    };
    (0..evidence.data.cameras).map(of).collect()
}

/// Each camera where some coordinates are divided by a ratio; `None` where one of the cameras is none.
fn shapes(
    evidence: &Evidence,
    cameras: &[Vec<Pair>],
    (which, ratio): ([bool; 3], f64),
) -> Option<Vec<Shape>> {
    let read = |(place, pixel): &Pair| (in_unit(evidence, which, ratio, *place), *pixel);
    let shape = |pairs: &Vec<Pair>| Shape::of(&pairs.iter().map(read).collect::<Vec<_>>());
    cameras.iter().map(shape).collect()
}

/// The largest deviation from squares among cameras.
fn largest_deviation(shapes: &[Shape]) -> f64 {
    shapes.iter().map(|shape| shape.deviation).fold(0.0, f64::max)
}

/// The columns of points at random places that might be in another unit in all rows, and nothing would show it: to
/// cameras that look along an axis, points farther apart along it look as through a lens of another focal length.
pub(super) fn unseen_columns(evidence: &Evidence) -> Vec<&'static str> {
    if evidence.views.iter().any(|view| view.board.is_some()) {
        return Vec::new();
    }
    let cameras = pairs_of_cameras(evidence);
    let is_seen = |which: [bool; 3]| {
        [0.1, 10.0].into_iter().all(|ratio| {
            let found = shapes(evidence, &cameras, (which, ratio));
            found.is_none_or(|found| largest_deviation(&found) > OBLONG)
        })
    };
    let unseen = COLUMNS.into_iter().filter(|(which, _)| !is_seen(*which));
    unseen.map(|(_, name)| name).collect()
}

/// A distortion-free camera.
struct Shape {
    /// Of its pixels from squares: skew, or the logarithm of the ratio of its focal lengths.
    deviation: f64,
    /// How far from its axis its points are, in degrees.
    half_angle: f64,
}

impl Shape {
    /// `None` for points that no such camera explains, however the world is stretched.
    fn of(pairs: &[Pair]) -> Option<Self> {
        /// Of the picture: room for a lens.
        const EXPLAINED: f64 = 0.01;
        let (matrix, error) = without_gross_errors(pairs)?;
        let (inner, rotation, translation) = matrix.decompose()?;
        let [x, y] = [inner[(0, 0)], inner[(1, 1)]];
        let deviation = libm::log(x / y).abs().max(inner[(0, 1)].abs() / y);
        let angle = |(place, _): &Pair| {
            let seen = rotation * place.coords + translation;
            libm::atan2(seen.xy().norm(), seen.z.abs()).to_degrees()
        };
        let half_angle = pairs.iter().map(angle).fold(0.0, f64::max);
        let is_explained = error < EXPLAINED * extent(pairs);
        is_explained.then_some(Self { deviation, half_angle })
    }
}

/// A matrix fitted to all pairs but those that err by many times the median, and that median in pixels: one wrong pixel
/// bends a camera as another unit does.
fn without_gross_errors(pairs: &[Pair]) -> Option<(ProjectionMatrix, f64)> {
    const ROUNDS: usize = 4;
    const GROSS: f64 = 5.0;
    let mut kept = pairs.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let matrix = ProjectionMatrix::fit(&kept)?;
        let error = |(place, pixel): &Pair| {
            matrix.project(*place).map_or(f64::INFINITY, |seen| (seen - pixel).norm())
        };
        let errors: Vec<f64> = pairs.iter().map(error).collect();
        let typical = median(&errors);
        let sound = pairs.iter().zip(&errors).filter(|(_, error)| **error <= GROSS * typical);
        let sound: Vec<Pair> = sound.map(|(pair, _)| *pair).collect();
        let is_settled = sound.len() == kept.len();
        (kept, found) = (sound, Some((matrix, typical)));
        if is_settled {
            break;
        }
    }
    found
}

/// The share of its error that each camera is left with at most in the right unit.
const EXPLAINED: f64 = 0.2;

/// No camera fits, and all do once it is put right.
fn by_pixels(evidence: &Evidence) -> Option<Proposal> {
    // In a stretched world half of the views and more agree on no camera, or on a bad one.
    let bad = |camera: usize| {
        let sound = evidence.cells.iter().filter(|view| !view[camera].suspicious).count();
        let typical = evidence.seen[camera].as_ref().map_or(f64::INFINITY, |seen| seen.typical);
        // Whole pixels leave 0.4.
        typical > 0.45 || 5 * sound <= 3 * evidence.views.len()
    };
    // A slab may be one by its unit alone.
    let thin = thickness(evidence).is_some_and(|share| share < THIN);
    if !thin && !(0..evidence.data.cameras).all(bad) {
        return None;
    }
    let cameras: Vec<usize> = (0..evidence.data.cameras).collect();
    let before: Vec<f64> = cameras
        .iter()
        .map(|camera| evidence.overall(*camera, None, |_, _, pair| Some(pair)))
        .collect::<Option<_>>()?;
    if before.iter().any(|error| EXPLAINED * error < evidence.floor()) {
        return None;
    }
    let mut best: Option<(f64, Stretch)> = None;
    for stretch in stretches() {
        let (which, ratio, _) = stretch;
        let read = |_: usize, _: usize, (place, pixel): Pair| {
            Some((in_unit(evidence, which, ratio, place), pixel))
        };
        let mut worst: f64 = 0.0;
        for camera in &cameras {
            let left = evidence.overall(*camera, None, read).unwrap_or(f64::INFINITY);
            worst = worst.max(left / before[*camera]);
            if worst > EXPLAINED {
                break;
            }
        }
        if worst <= EXPLAINED && best.as_ref().is_none_or(|(least, _)| worst < *least) {
            best = Some((worst, stretch));
        }
    }
    let (left, stretch) = best?;
    let figures = vec![("error left, of that before".into(), left)];
    // Of two units that both explain the pixels well, the better one is not always the true one.
    Some(Proposal { is_estimate: true, ..proposal(evidence, stretch, figures) })
}

fn proposal(
    evidence: &Evidence,
    (which, ratio, name): Stretch,
    mut figures: Vec<(String, f64)>,
) -> Proposal {
    let all: Vec<(usize, usize)> = (0..evidence.views.len())
        .flat_map(|view| (0..evidence.data.cameras).map(move |camera| (view, camera)))
        .collect();
    let changes = (0..evidence.views.len())
        .flat_map(|view| places(evidence, view, |place| in_unit(evidence, which, ratio, place)));
    figures.insert(0, ("scale".into(), ratio));
    Proposal {
        cells: all.clone(),
        also: all,
        figures,
        changes: changes.collect(),
        ..Proposal::itself(
            "units-mixed",
            Severity::Fatal,
            format!(
                "the column {name} is {} times what the other two ask for: another unit",
                tidy(ratio)
            ),
            "give all world coordinates in one unit, or let this column be brought to the unit of the other two",
        )
    }
}
