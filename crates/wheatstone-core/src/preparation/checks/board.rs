//! The chart as a view's world places show it: its plane, its lattice, and the ways in which labels
//! on it get mixed up.

use crate::geometry::{Point3, Vector3, principal_axes};
use wheatstone_numeric::statistics::median;

/// A plane lattice of world places.
#[derive(Clone, Debug)]
pub(super) struct Board {
    /// The lattice's middle.
    pub(super) centre: Point3,
    /// Unit vectors along columns and rows.
    pub(super) along: [Vector3; 2],
    /// Distances of neighbours along them.
    pub(super) pitch: [f64; 2],
    /// Points along them.
    pub(super) counts: [usize; 2],
}

/// How labels may be mixed up: where the point really is whose label says `place`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mixing {
    /// Turned by so many quarters.
    Turned(u8),
    /// Mirrored along columns (0) or rows (1).
    Reversed(usize),
    /// Rows for columns, about the middle or about a corner of the lattice.
    Transposed([i8; 2]),
    /// The same, mirrored at the other diagonal about the middle.
    AntiTransposed,
    /// Listed column by column where row by row was meant, or the other way round.
    Relisted(bool),
    /// Labels one column or row on.
    Shifted([i8; 2]),
}

impl Mixing {
    /// All of them.
    pub(super) fn all() -> Vec<Self> {
        let mut all = vec![
            Self::Turned(2),
            Self::Turned(1),
            Self::Turned(3),
            Self::Reversed(0),
            Self::Reversed(1),
            Self::AntiTransposed,
            Self::Relisted(false),
            Self::Relisted(true),
        ];
        let corners = [[0, 0], [-1, -1], [1, 1], [-1, 1], [1, -1]];
        all.extend(corners.map(Self::Transposed));
        all.extend([[1, 0], [-1, 0], [0, 1], [0, -1]].map(Self::Shifted));
        all
    }
}

impl Board {
    /// Of the places of one view; `None` where they are no plane lattice.
    pub(super) fn find(places: &[Point3]) -> Option<Self> {
        if places.len() < 6 {
            return None;
        }
        let (middle, axes, spread) = principal_axes(places);
        if spread[2] > 1e-2 * spread[1] || spread[1] < 1e-3 * spread[0] {
            return None;
        }
        let flat: Vec<[f64; 2]> = places
            .iter()
            .map(|p| [(p - middle).dot(&axes[0]), (p - middle).dot(&axes[1])])
            .collect();
        let (angle, nearest) = direction(&flat)?;
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let mut along = [axes[0] * cosine + axes[1] * sine, axes[1] * cosine - axes[0] * sine];
        // Columns run as the world's first axis that tells them apart does: only a convention.
        if along[1].x.abs() > along[0].x.abs() {
            along.swap(0, 1);
        }
        for axis in &mut along {
            if axis[axis.iamax()] < 0.0 {
                *axis = -*axis;
            }
        }
        let mut centre = middle;
        let (mut pitch, mut counts) = ([0.0; 2], [0; 2]);
        for axis in 0..2 {
            let values: Vec<f64> = places.iter().map(|p| (p - middle).dot(&along[axis])).collect();
            let (distance, count, offset) = levels(values, nearest)?;
            pitch[axis] = distance;
            counts[axis] = count;
            centre += along[axis] * offset;
        }
        Some(Self { centre, along, pitch, counts })
    }

    /// Where the point really is whose label says `place`. `None` where that label has no such point.
    pub(super) fn mixed(&self, place: Point3, how: Mixing) -> Option<Point3> {
        let own = [0, 1].map(|axis| (place - self.centre).dot(&self.along[axis]));
        let height = (place - self.centre) - self.along[0] * own[0] - self.along[1] * own[1];
        let half = [0, 1].map(|a| self.pitch[a] * (self.counts[a] as f64 - 1.0) / 2.0);
        let [a, b] = own;
        let at = match how {
            Mixing::Turned(1) => [-b, a],
            Mixing::Turned(3) => [b, -a],
            Mixing::Turned(_) => [-a, -b],
            Mixing::Reversed(0) => [-a, b],
            Mixing::Reversed(_) => [a, -b],
            Mixing::AntiTransposed => [-b, -a],
            Mixing::Transposed(corner) => {
                let [x, y] = [0, 1].map(|axis| half[axis] * f64::from(corner[axis]));
                [x + (b - y), y + (a - x)]
            }
            Mixing::Shifted(by) => {
                [a + self.pitch[0] * f64::from(by[0]), b + self.pitch[1] * f64::from(by[1])]
            }
            Mixing::Relisted(other) => self.relisted([a, b], half, other)?,
        };
        Some(self.centre + self.along[0] * at[0] + self.along[1] * at[1] + height)
    }

    fn relisted(&self, own: [f64; 2], half: [f64; 2], other: bool) -> Option<[f64; 2]> {
        let [columns, rows] = self.counts;
        let label = |axis: usize| {
            let value = ((own[axis] + half[axis]) / self.pitch[axis]).round();
            (value >= 0.0 && value < self.counts[axis] as f64).then_some(value as usize)
        };
        let (column, row) = (label(0)?, label(1)?);
        let (column, row) = if other {
            let index = column * rows + row;
            (index % columns, index / columns)
        } else {
            let index = row * columns + column;
            (index / rows, index % rows)
        };
        Some([column as f64 * self.pitch[0] - half[0], row as f64 * self.pitch[1] - half[1]])
    }

    /// The normal of the plane.
    pub(super) fn normal(&self) -> Vector3 {
        self.along[0].cross(&self.along[1])
    }
}

/// The angle of the lattice in its plane, modulo a quarter turn, and the distance of neighbours.
fn direction(flat: &[[f64; 2]]) -> Option<(f64, f64)> {
    let mut near = Vec::with_capacity(flat.len());
    // Fifty points tell the direction.
    for point in flat.iter().step_by(flat.len().div_ceil(50)) {
        let gap = |other: &[f64; 2]| [other[0] - point[0], other[1] - point[1]];
        let square = |v: &[f64; 2]| v[0] * v[0] + v[1] * v[1];
        let closest = flat
            .iter()
            .map(gap)
            .filter(|v| square(v) > 0.0)
            .min_by(|a, b| square(a).total_cmp(&square(b)))?;
        near.push((closest, square(&closest).sqrt()));
    }
    let lengths: Vec<f64> = near.iter().map(|(_, length)| *length).collect();
    let typical = median(&lengths);
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (v, length) in near {
        if (length / typical - 1.0).abs() < 0.1 {
            let angle = 4.0 * libm::atan2(v[1], v[0]);
            sine += libm::sin(angle);
            cosine += libm::cos(angle);
        }
    }
    Some((libm::atan2(sine, cosine) / 4.0, typical))
}

/// Distance of levels, how many there are, and their middle; `None` where they are not even.
fn levels(mut values: Vec<f64>, nearest: f64) -> Option<(f64, usize, f64)> {
    values.sort_unstable_by(f64::total_cmp);
    let mut means: Vec<(f64, f64)> = Vec::new();
    for value in values {
        match means.last_mut() {
            Some((sum, count)) if value - *sum / *count < 0.25 * nearest => {
                *sum += value;
                *count += 1.0;
            }
            _ => means.push((value, 1.0)),
        }
    }
    let at: Vec<f64> = means.iter().map(|(sum, count)| sum / count).collect();
    let gaps: Vec<f64> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if gaps.is_empty() {
        return None;
    }
    // Whole rows may be missing, but most neighbours are there.
    let pitch = median(&gaps);
    let even = gaps.iter().all(|gap| {
        let steps = gap / pitch;
        (steps - steps.round()).abs() < 0.1 && steps > 0.5
    });
    let (low, high) = (*at.first()?, *at.last()?);
    even.then(|| (pitch, ((high - low) / pitch).round() as usize + 1, (low + high) / 2.0))
}
