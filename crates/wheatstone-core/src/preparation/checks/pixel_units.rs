//! Pixels of a camera in another measure in some views: the picture resized, flipped, or x and y
//! exchanged.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    pairs::Pair,
    views::LEAST,
};
use crate::geometry::Pixel;
use wheatstone_numeric::statistics::median;

pub(super) struct PixelUnits;

/// How far above the good level a cell must be before a free scale may explain it.
const CLEARLY: f64 = 5.0;

impl Fault for PixelUnits {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        evidence.suspicious().into_iter().flat_map(|cell| self.of_picture(evidence, cell)).collect()
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        [false, true].into_iter().filter_map(|swap| measured(evidence, picture, swap)).collect()
    }
}

/// Per axis: seen = scale * expected + offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measure {
    pub(super) scale: [f64; 2],
    pub(super) offset: [f64; 2],
    pub(super) exchanged: bool,
}

impl Measure {
    /// The pixel in the measure of the other views.
    pub(super) fn undone(&self, pixel: Pixel) -> Pixel {
        let pixel = if self.exchanged { Pixel::new(pixel.y, pixel.x) } else { pixel };
        Pixel::new(
            (pixel.x - self.offset[0]) / self.scale[0],
            (pixel.y - self.offset[1]) / self.scale[1],
        )
    }
}

/// The line through most points, by the median of slopes between far points (Theil 1950, Sen 1968,
/// doi:10.1080/01621459.1968.10480934).
fn line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = sorted.len() / 2;
    let slopes: Vec<f64> = (0..half)
        .map(|index| (sorted[index], sorted[index + half]))
        .filter(|(a, b)| b.0 - a.0 > 1e-9)
        .map(|(a, b)| (b.1 - a.1) / (b.0 - a.0))
        .collect();
    let slope = median(&slopes);
    let rest: Vec<f64> = sorted.iter().map(|(x, y)| y - slope * x).collect();
    (!slopes.is_empty() && slope != 0.0).then(|| (slope, median(&rest)))
}

/// What the measure is called, in words, and the scales that are meant; `None` where it is none that people make.
fn naming(measure: &Measure) -> Option<(&'static str, String, [f64; 2])> {
    let [sx, sy] = measure.scale;
    let one = |scale: f64| (scale - 1.0).abs() < 0.01;
    let minus = |scale: f64| (scale + 1.0).abs() < 0.02;
    if measure.exchanged {
        let (code, what) = ("pixel-axes-swapped", "x and y of the pixels are exchanged");
        return (one(sx) && one(sy)).then(|| (code, what.into(), [1.0, 1.0]));
    }
    if one(sx) && minus(sy) {
        return Some(("v-axis-up", "y of the pixels points up".into(), [1.0, -1.0]));
    }
    if minus(sx) && one(sy) {
        let what = "the picture is mirrored left to right";
        return Some(("picture-mirrored", what.into(), [-1.0, 1.0]));
    }
    if minus(sx) && minus(sy) {
        let what = "the picture is turned by 180 degrees";
        return Some(("picture-turned", what.into(), [-1.0, -1.0]));
    }
    let changed = |scale: f64| (scale - 1.0).abs() > 0.02;
    let resized = (changed(sx) || changed(sy))
        && sx > 0.0
        && sy > 0.0
        && (0.05..20.0).contains(&sx)
        && (0.05..20.0).contains(&sy);
    resized.then(|| {
        let [x, y] = [clean(sx), clean(sy)];
        let what = if (x - y).abs() < 0.01 {
            format!("the picture is resized by a factor of {x:.4}")
        } else {
            format!("the picture is resized by factors of {x:.4} in x and {y:.4} in y")
        };
        ("picture-resized", what, [x, y])
    })
}

/// The ratio of small whole numbers that is meant, where one is near: the smaller they are the farther.
fn clean(scale: f64) -> f64 {
    for below in 1..=9_u32 {
        let above = (scale * f64::from(below)).round();
        let ratio = above / f64::from(below);
        let near = if below <= 4 && above <= 4.0 { 6e-3 } else { 2e-3 };
        if above > 0.0 && (scale / ratio - 1.0).abs() < near {
            return ratio;
        }
    }
    scale
}

/// What is meant explains pixels as well as what was measured, if it leaves no more than this times as much: four numbers
/// more follow what other views say wrongly of this one.
const AS_WELL: f64 = 1.5;

/// The offset that goes with a scale: of points that were seen where others expect them.
fn offset_of(points: &[(f64, f64)], scale: f64) -> f64 {
    median(&points.iter().map(|(x, y)| y - scale * x).collect::<Vec<f64>>())
}

/// The offsets that programs make of a picture, where those of both axes are near, and whether no other is as likely:
/// flips move by whole pixels; resizing keeps the middle or the corner of the first pixel.
fn usual_offset(found: [f64; 2], scales: [f64; 2]) -> Option<([f64; 2], bool)> {
    /// The other views say it to this, in pixels of the larger picture; nobody cuts off less.
    const NEAR: f64 = 2.0;
    /// The middle is what programs keep: the corner must fit so many times better. With half of that it is clear.
    const CLEARLY: f64 = 4.0;
    /// A whole number is clear that is nearer than this.
    const CLEARLY_WHOLE: f64 = 0.3;
    if scales.iter().all(|scale| scale.abs() == 1.0) {
        let usual = [0, 1].map(|axis| if scales[axis] > 0.0 { 0.0 } else { found[axis].round() });
        let is_clear = (0..2).all(|axis| (found[axis] - usual[axis]).abs() < CLEARLY_WHOLE);
        return Some((usual, is_clear));
    }
    let gap = |usual: &[f64; 2]| {
        let gaps = [0, 1].map(|axis| (usual[axis] - found[axis]).abs() / scales[axis].max(1.0));
        gaps[0].max(gaps[1])
    };
    let (corner, middle) = ([0.0; 2], scales.map(|scale| 0.5 * (scale - 1.0)));
    let is_corner = CLEARLY * gap(&corner) < gap(&middle);
    let (usual, other) = if is_corner { (corner, middle) } else { (middle, corner) };
    let is_clear = 0.5 * CLEARLY * gap(&usual) < gap(&other);
    (gap(&usual) <= NEAR).then_some((usual, is_clear))
}

fn measured(evidence: &Evidence, cell: (usize, usize), exchanged: bool) -> Option<Proposal> {
    let (points, _, other) = evidence.at(cell.0, cell.1)?;
    let along = |axis: usize| {
        let pairs = points.pairs.iter().filter_map(|(world, pixel)| {
            let expected = other.project(*world)?;
            Some((expected[axis], if exchanged { pixel[1 - axis] } else { pixel[axis] }))
        });
        pairs.collect::<Vec<_>>()
    };
    let seen = [along(0), along(1)];
    let (x, y) = (line(&seen[0])?, line(&seen[1])?);
    let fitted = Measure { scale: [x.0, y.0], offset: [x.1, y.1], exchanged };
    // A lens or a stage makes a cell seem a little larger or smaller too.
    if evidence.excess(cell) < CLEARLY || points.pairs.len() < 2 * LEAST {
        return None;
    }
    let (code, what, scale) = naming(&fitted)?;
    let found = [0, 1].map(|axis| offset_of(&seen[axis], scale[axis]));
    let offset = usual_offset(found, scale);
    let measure = Measure { scale, offset: offset.map_or(found, |(usual, _)| usual), exchanged };
    let left_by = |undo: Measure| {
        evidence.explained(cell, |_, (world, pixel)| Some((world, undo.undone(pixel))))
    };
    let (mut left, mut undo) = (left_by(measure), measure);
    if left > evidence.most_left(cell) {
        let measured = left_by(fitted);
        if left > AS_WELL * measured || !evidence.accepts(cell, left) {
            (left, undo) = (measured, fitted);
        }
    }
    if !evidence.accepts(cell, left) {
        return None;
    }
    let figures = vec![
        ("scale of x".into(), fitted.scale[0]),
        ("scale of y".into(), fitted.scale[1]),
        ("offset of x, px".into(), fitted.offset[0]),
        ("offset of y, px".into(), fitted.offset[1]),
    ];
    let mut found = proposal(evidence, cell, (code, what), (left, undo), figures);
    let is_as_found = |axis: usize| undo.scale[axis] == fitted.scale[axis];
    // Behind water the other views may be wrong by pixels of where this one is: then it is explained less well than those.
    let is_clear = left <= 1.0 && offset.is_some_and(|(_, is_clear)| is_clear);
    found.is_estimate = !is_clear || is_as_found(0) || is_as_found(1);
    // Where every camera observes it elsewhere or larger, it is: those explanations come first.
    let present = evidence.present(cell.0);
    if present.len() > 1 && evidence.suspects(cell.0).len() == present.len() {
        found.freedom = Freedom::Each;
    }
    Some(found)
}

/// What the cells' pixels would be in the measure of the other views.
pub(super) fn proposal(
    evidence: &Evidence,
    cell: (usize, usize),
    (code, what): (&'static str, String),
    (left, undo): (f64, Measure),
    figures: Vec<(String, f64)>,
) -> Proposal {
    let points = &evidence.cells[cell.0][cell.1];
    let change = |(row, (_, pixel)): (&usize, &Pair)| Change::Pixel {
        row: *row,
        camera: cell.1,
        to: Some(undo.undone(*pixel)),
    };
    Proposal {
        freedom: Freedom::Scale,
        left,
        cells: vec![cell],
        key: what.clone(),
        figures,
        changes: points.rows.iter().zip(&points.pairs).map(change).collect(),
        ..Proposal::itself(
            code,
            Severity::Fatal,
            what,
            "take all pictures of a camera in one size and with one pixel origin, or let these be corrected",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flips_move_the_axis_that_they_turn_by_whole_pixels() {
        assert_eq!(usual_offset([0.1, 1023.2], [1.0, -1.0]), Some(([0.0, 1023.0], true)));
        assert_eq!(usual_offset([0.9, 1023.0], [1.0, -1.0]), Some(([0.0, 1023.0], false)));
        assert_eq!(usual_offset([1279.1, 1022.6], [-1.0, -1.0]), Some(([1279.0, 1023.0], false)));
    }
}
