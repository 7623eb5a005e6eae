//! The dip that a line leaves in the grey values across it.

use super::level::View;
use nalgebra::Vector2;
use wheatstone_core::geometry::Pixel;

/// Samples on either side of a profile's middle: fine enough that no step passes 1 px on the
/// level where a line is measured.
const HALF: usize = 12;
/// Samples at either end that make the ground level.
const ENDS: usize = 3;
/// Least depth of a dip in grey levels: a line of 30 levels, one pixel wide, keeps 11 after blur;
/// noise of 2 levels keeps 0.7.
const LEAST_DEPTH: f64 = 2.5;
/// Moves of a profile until the dip must be in its middle; two or three are usual.
const TURNS: usize = 6;
/// Shares of the depth at which the chord across the dip is halved. Their mean uses the whole of
/// both flanks, and stays off the bottom and the ground, where flanks are flat.
const CHORDS: [f64; 3] = [0.35, 0.5, 0.65];

/// A dip across a line. Lengths are shares of the vector along which it was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dip {
    /// Its middle.
    pub(super) offset: f64,
    /// Grey levels below the ground.
    pub(super) depth: f64,
    /// Its width at half depth.
    pub(super) width: f64,
}

/// How to look for a dip, in shares of the vector along which it is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// How far the profile reaches to either side of the dip.
    pub(super) reach: f64,
    /// How far from the expected place the dip may be.
    pub(super) search: f64,
    /// How near to the profile's middle the dip must be in the end, in samples.
    pub(super) settled: f64,
}

/// The dip nearest to `expected` of the way from `centre` along `across`, where there is one.
pub(super) fn dip(
    view: View,
    centre: Pixel,
    across: Vector2<f64>,
    expected: f64,
    window: Window,
) -> Option<Dip> {
    let step = window.reach / HALF as f64;
    let mut middle = expected;
    // The profile moves until the dip is in its middle: off it, the ground is measured nearer to
    // one flank than to the other, and the dip's own tail tilts it.
    for turn in 0..TURNS {
        let ends = [middle - window.reach, middle + window.reach];
        if !ends.iter().all(|end| view.contains(centre + across * *end, 0.0)) {
            return None;
        }
        let values: [f64; 2 * HALF + 1] = std::array::from_fn(|i| {
            view.sample(centre + across * (middle + step * (i as f64 - HALF as f64)))
        });
        let lowest = descend(&values);
        let found = measure(&values, lowest);
        let moved = found.map_or(lowest as f64, |found| found.offset) - HALF as f64;
        middle += step * moved;
        if (middle - expected).abs() > window.search {
            return None;
        }
        if moved.abs() < window.settled || turn + 1 == TURNS {
            return found.map(|found| Dip { offset: middle, width: found.width * step, ..found });
        }
    }
    None
}

/// The minimum nearest to the middle, looking past what noise does to three samples.
fn descend(values: &[f64; 2 * HALF + 1]) -> usize {
    let mut at = HALF;
    loop {
        let near = at.saturating_sub(3)..(at + 4).min(values.len());
        let lower = near.min_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(at);
        if values[lower] >= values[at] {
            return at;
        }
        at = lower;
    }
}

/// The dip about the minimum `lowest`; lengths in samples.
fn measure(values: &[f64; 2 * HALF + 1], lowest: usize) -> Option<Dip> {
    let last = values.len() - 1;
    let left = values[..ENDS].iter().sum::<f64>() / ENDS as f64;
    let right = values[last + 1 - ENDS..].iter().sum::<f64>() / ENDS as f64;
    // Uneven light is a slope of the ground; without it the flanks would not be alike.
    let middle_of_ends = (ENDS as f64 - 1.0) / 2.0;
    let slope = (right - left) / (last as f64 - 2.0 * middle_of_ends);
    let ground = |i: usize| left + slope * (i as f64 - middle_of_ends);
    let darkness = values.map(|v| -v);
    let darkness: [f64; 2 * HALF + 1] = std::array::from_fn(|i| darkness[i] + ground(i));
    let depth = darkness[lowest];
    // An edge is no line: both sides must be clearly lighter.
    if depth < LEAST_DEPTH || left.min(right) - values[lowest] < 0.5 * depth {
        return None;
    }
    let (mut offset, mut width) = (0.0, 0.0);
    for share in CHORDS {
        let level = share * depth;
        let right = (lowest..last).find(|i| darkness[i + 1] < level)?;
        let left = (1..=lowest).rev().find(|i| darkness[i - 1] < level)?;
        let rest = |inner: usize, outer: usize| {
            (darkness[inner] - level) / (darkness[inner] - darkness[outer])
        };
        let (low, high) =
            (left as f64 - rest(left, left - 1), right as f64 + rest(right, right + 1));
        offset += (low + high) / 2.0 / CHORDS.len() as f64;
        if share == 0.5 {
            width = high - low;
        }
    }
    Some(Dip { offset, depth, width })
}
