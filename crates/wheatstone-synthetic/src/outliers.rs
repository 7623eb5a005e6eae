//! Gross errors put into correspondences, and which rows have them.

use std::str::FromStr;
use wheatstone_core::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
};
use wheatstone_numeric::random::Random;

/// A gross error of a correspondence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GrossError {
    /// One camera's pixel moved by up to so many pixels along x and along y, evenly spread.
    Shift(f64),
    /// One camera's pixel moved by exactly so many pixels, in any direction.
    Jump(f64),
    /// One camera's pixel anywhere in the part of its picture in which it observes points.
    Anywhere,
    /// Two points exchanged in one camera: a mismatch.
    Mismatch,
    /// The world places of two points exchanged: both mislabelled, in all cameras.
    Mislabel,
    /// A place in the world anywhere in the box of all places.
    Misplace,
}

/// Which points may get a gross error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Region {
    /// Any.
    #[default]
    All,
    /// Only those nearest to the top left corner of the first camera's picture: as many again stay good.
    Corner,
    /// Only those of this view.
    View(usize),
}

impl FromStr for GrossError {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let unknown = || Error::Setting {
            setting: "gross error".into(),
            value: text.into(),
            need: "`shift:PIXELS`, `jump:PIXELS`, `anywhere`, `mismatch`, `mislabel` or `misplace`"
                .into(),
        };
        let size = |digits: &str| digits.parse().ok().filter(|s: &f64| s.is_finite() && *s >= 0.0);
        match text.split_once(':') {
            Some(("shift", digits)) => size(digits).map(Self::Shift).ok_or_else(unknown),
            Some(("jump", digits)) => size(digits).map(Self::Jump).ok_or_else(unknown),
            None if text == "anywhere" => Ok(Self::Anywhere),
            None if text == "mismatch" => Ok(Self::Mismatch),
            None if text == "mislabel" => Ok(Self::Mislabel),
            None if text == "misplace" => Ok(Self::Misplace),
            _ => Err(unknown()),
        }
    }
}

/// The data with gross errors, and the rows that have one, in rising order. `errors` says how many
/// rows get which; no row gets two. Exchanges take pairs of rows: of an odd number the last is left
/// out, as are errors for which the region has no rows left.
#[must_use]
pub fn with_gross_errors(
    data: &Dataset,
    errors: &[(GrossError, usize)],
    region: Region,
    seed: u64,
) -> (Dataset, Vec<usize>) {
    let mut random = Random::new(seed);
    let wanted = errors.iter().map(|(_, count)| count).sum();
    let mut free = candidates(data, region, wanted);
    random.shuffle(&mut free);
    let (mut spoilt, mut rows) = (data.clone(), Vec::new());
    for (error, count) in errors {
        let pairs = matches!(error, GrossError::Mismatch | GrossError::Mislabel);
        let count = if pairs { count / 2 * 2 } else { *count };
        let mut chosen = free.split_off(free.len().saturating_sub(count));
        if pairs {
            for two in chosen.chunks_exact(2) {
                exchange(&mut spoilt, *error, (two[0], two[1]), &mut random);
            }
            chosen.truncate(chosen.len() / 2 * 2);
        } else {
            chosen.iter().for_each(|row| spoil(&mut spoilt, data, *error, *row, &mut random));
        }
        rows.extend(chosen);
    }
    rows.sort_unstable();
    (spoilt, rows)
}

/// Rows of a region that all cameras saw and whose place is known.
fn candidates(data: &Dataset, region: Region, wanted: usize) -> Vec<usize> {
    let all = data.correspondences.iter().enumerate();
    let mut rows: Vec<usize> = all
        .filter(|(_, c)| c.world.is_some() && c.seen_by() == data.cameras)
        .filter(|(_, c)| !matches!(region, Region::View(view) if view != c.view))
        .map(|(row, _)| row)
        .collect();
    if region == Region::Corner {
        let from_corner = |row: &usize| {
            let pixel = data.correspondences[*row].pixels.first().copied().flatten();
            pixel.map_or(f64::INFINITY, |p| p.x + p.y)
        };
        rows.sort_by(|a, b| from_corner(a).total_cmp(&from_corner(b)));
        rows.truncate(2 * wanted);
    }
    rows
}

fn exchange(
    spoilt: &mut Dataset,
    error: GrossError,
    (first, second): (usize, usize),
    random: &mut Random,
) {
    let rows = &mut spoilt.correspondences;
    if error == GrossError::Mislabel {
        (rows[first].world, rows[second].world) = (rows[second].world, rows[first].world);
    } else {
        let camera = random.below(spoilt.cameras);
        let pixel = rows[first].pixels[camera];
        rows[first].pixels[camera] = rows[second].pixels[camera];
        rows[second].pixels[camera] = pixel;
    }
}

fn spoil(spoilt: &mut Dataset, data: &Dataset, error: GrossError, row: usize, random: &mut Random) {
    let camera = random.below(data.cameras);
    let changed = &mut spoilt.correspondences[row];
    if error == GrossError::Misplace {
        let within = |axis: usize, random: &mut Random| {
            let (low, high) = extent(data.known().map(|(world, _)| world[axis]));
            random.uniform(low, high)
        };
        changed.world = Some(Point3::new(within(0, random), within(1, random), within(2, random)));
    } else if let Some(pixel) = &mut changed.pixels[camera] {
        *pixel = match error {
            GrossError::Shift(size) => Pixel::new(
                pixel.x + random.uniform(-size, size),
                pixel.y + random.uniform(-size, size),
            ),
            GrossError::Jump(size) => {
                let angle = random.uniform(0.0, std::f64::consts::TAU);
                Pixel::new(pixel.x + size * libm::cos(angle), pixel.y + size * libm::sin(angle))
            }
            _ => {
                let seen = data.seen_by_camera(camera);
                let (left, right) = extent(seen.iter().map(|(_, p)| p.x));
                let (top, bottom) = extent(seen.iter().map(|(_, p)| p.y));
                Pixel::new(random.uniform(left, right), random.uniform(top, bottom))
            }
        };
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Noise, Rig, Stage, chart_correspondences};
    use wheatstone_charts::chart::line_grid::LineGrid;

    #[test]
    fn only_the_named_rows_change_and_as_many_as_asked() {
        let rig = Rig::named("paper", 2).unwrap();
        let views = Stage::default().views().unwrap();
        let chart = LineGrid::default().into();
        let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), Some(400));
        for name in ["shift:20", "jump:400", "anywhere", "mismatch", "mislabel", "misplace"] {
            let error: GrossError = name.parse().unwrap();
            let (spoilt, rows) = with_gross_errors(&data, &[(error, 20)], Region::All, 3);
            let rows_that_differ: Vec<usize> = (0..data.correspondences.len())
                .filter(|row| data.correspondences[*row] != spoilt.correspondences[*row])
                .collect();
            assert_eq!(rows, rows_that_differ, "{name}");
            assert_eq!(rows.len(), 20, "{name}");
            let again = with_gross_errors(&data, &[(error, 20)], Region::All, 3);
            assert_eq!(again, (spoilt, rows), "{name}");
        }
        let in_view = with_gross_errors(&data, &[(GrossError::Anywhere, 9)], Region::View(2), 1).1;
        assert!(in_view.iter().all(|row| data.correspondences[*row].view == 2));
        assert!("shift".parse::<GrossError>().is_err() && "jump:x".parse::<GrossError>().is_err());
    }
}
