//! The points in compact form: 26 bytes each where there are two cameras.

use super::value::SceneCloud;
use crate::text::base64;
use serde::Serialize;

/// Points that stay smooth to turn with a graphics card.
const MOST_POINTS: usize = 400_000;

/// Size of the page, in bytes, that it stays below.
const MOST_BYTES: usize = 15_000_000;

/// Of these, what scripts, styles, words and the drawing that does not move may take.
const OTHER_BYTES: usize = 1_100_000;

/// Columns of little-endian numbers, in base 64; `None` where nothing is known.
#[derive(Serialize)]
pub(super) struct Columns {
    /// Points in the columns.
    count: usize,
    /// Points of the cloud.
    all: usize,
    /// Whether the points are evenly chosen from all, and so their numbers are known.
    even: bool,
    /// X, Y and Z from the frame's centre: the upper three bytes of 32-bit numbers. Other than parts of
    /// a box, they stay fine where a few points lie far away.
    places: String,
    /// Red, green, blue.
    colours: Option<String>,
    /// Three logarithms of ten bits each, X lowest.
    sigmas: Option<Column>,
    confidence: Option<Column>,
    /// x and y in turn, for each camera.
    pixels: Vec<[Column; 2]>,
}

/// Numbers as parts of a range.
#[derive(Serialize)]
struct Column {
    low: f32,
    high: f32,
    values: String,
}

/// Bytes that a point takes.
fn bytes(cloud: &SceneCloud) -> usize {
    let part = |empty: bool, bytes: usize| if empty { 0 } else { bytes };
    9 + part(cloud.colours.is_empty(), 3)
        + part(cloud.sigmas.is_empty(), 4)
        + part(cloud.confidence.is_empty(), 2)
        + 4 * cloud.pixels.len()
}

/// Which points are shown: all with a finite place, or as many of them as the page may hold, evenly
/// chosen.
pub(super) fn shown(cloud: &SceneCloud) -> Vec<usize> {
    let is_finite = |index: &usize| cloud.points[*index].iter().all(|value| value.is_finite());
    let all: Vec<usize> = (0..cloud.points.len()).filter(is_finite).collect();
    // Base 64 makes four bytes of three.
    let most = MOST_POINTS.min((MOST_BYTES - OTHER_BYTES) / 4 * 3 / bytes(cloud));
    let count = all.len().min(most);
    (0..count).map(|index| all[index * all.len() / count]).collect()
}

/// The range of the finite numbers among these; from 0 to 1 where there are none.
fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    let finite = values.filter(|value| value.is_finite()).map(|value| (value, value));
    finite.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((0.0, 1.0))
}

/// 16 bits each: 0 is the least, 65 534 the largest, 65 535 no number.
fn linear(values: impl Iterator<Item = f32> + Clone) -> Column {
    let (low, high) = range(values.clone());
    let width = (f64::from(high) - f64::from(low)).max(f64::MIN_POSITIVE);
    let code = |value: f32| {
        let share = (f64::from(value) - f64::from(low)) / width;
        if value.is_finite() { (share * 65_534.0).round() as u16 } else { u16::MAX }
    };
    let bytes: Vec<u8> = values.flat_map(|value| code(value).to_le_bytes()).collect();
    Column { low, high, values: base64(&bytes) }
}

/// Standard deviations: of each ten bits 0 is the logarithm of the least, 1021 that of the largest,
/// 1022 is nought, 1023 no number.
fn logarithmic(sigmas: impl Iterator<Item = [f32; 3]> + Clone) -> Column {
    let (low, high) = range(sigmas.clone().flatten().filter(|sigma| *sigma > 0.0));
    let log = |value: f32| libm::log(f64::from(value));
    let (start, width) = (log(low), (log(high) - log(low)).max(1e-9));
    let code = |sigma: f32| match sigma {
        0.0 => 1022,
        sigma if sigma.is_finite() && sigma > 0.0 => {
            ((log(sigma) - start) / width * 1021.0).round() as u32
        }
        _ => 1023,
    };
    let joined = |[x, y, z]: [f32; 3]| code(x) | (code(y) << 10) | (code(z) << 20);
    let bytes: Vec<u8> = sigmas.flat_map(|sigma| joined(sigma).to_le_bytes()).collect();
    Column { low, high, values: base64(&bytes) }
}

/// The upper three bytes of a 32-bit number, rounded.
fn upper(value: f64) -> [u8; 3] {
    let [_, low, middle, high] = (value as f32).to_bits().wrapping_add(0x80).to_le_bytes();
    [low, middle, high]
}

impl Columns {
    /// Of the points that are shown, from the centre of the frame.
    pub(super) fn of(cloud: &SceneCloud, shown: &[usize], centre: [f64; 3]) -> Self {
        let places = shown.iter().flat_map(|index| {
            (0..3).flat_map(move |axis| upper(f64::from(cloud.points[*index][axis]) - centre[axis]))
        });
        let all = shown.iter().copied();
        let colours =
            all.clone().flat_map(|index| cloud.colours.get(index).copied().unwrap_or([128; 3]));
        let sigmas =
            all.clone().map(|index| cloud.sigmas.get(index).copied().unwrap_or([f32::NAN; 3]));
        let confidence =
            all.clone().map(|index| cloud.confidence.get(index).copied().unwrap_or(f32::NAN));
        let pixels = |camera: &Vec<[f32; 2]>| {
            [0, 1].map(|axis| {
                linear(all.clone().map(|index| camera.get(index).map_or(f32::NAN, |it| it[axis])))
            })
        };
        let is_finite = |point: &[f32; 3]| point.iter().all(|value| value.is_finite());
        Self {
            count: shown.len(),
            all: cloud.points.len(),
            even: cloud.points.iter().all(is_finite),
            places: base64(&places.collect::<Vec<u8>>()),
            colours: (!cloud.colours.is_empty()).then(|| base64(&colours.collect::<Vec<u8>>())),
            sigmas: (!cloud.sigmas.is_empty()).then(|| logarithmic(sigmas)),
            confidence: (!cloud.confidence.is_empty()).then(|| linear(confidence)),
            pixels: cloud.pixels.iter().map(pixels).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::{Engine, engine::general_purpose::STANDARD};

    fn codes(column: &Column, bytes: usize) -> Vec<u32> {
        let all = STANDARD.decode(&column.values).unwrap();
        let one =
            |part: &[u8]| part.iter().rev().fold(0, |sum, byte| (sum << 8) | u32::from(*byte));
        all.chunks(bytes).map(one).collect()
    }

    #[test]
    fn numbers_come_back_within_a_step() {
        let values = [3.0, f32::NAN, -1.0, 0.25];
        let column = linear(values.into_iter());
        let read = codes(&column, 2);
        assert_eq!((column.low, column.high, read[1]), (-1.0, 3.0, 65_535));
        for (value, code) in [(3.0, read[0]), (-1.0, read[2]), (0.25, read[3])] {
            let back = -1.0 + f64::from(code) / 65_534.0 * 4.0;
            assert!((back - value).abs() < 4.0 / 65_534.0, "{value}: {back}");
        }
        let sigmas = [[0.01, 100.0, 0.5], [0.0, f32::NAN, -1.0]];
        let column = logarithmic(sigmas.into_iter());
        let read = codes(&column, 4);
        assert_eq!((read[0] & 1023, (read[0] >> 10) & 1023), (0, 1021));
        let back = 0.01 * libm::exp(f64::from(read[0] >> 20) / 1021.0 * libm::log(1e4));
        assert!((back / 0.5 - 1.0).abs() < libm::log(1e4) / 2000.0, "{back}");
        assert_eq!(read[1], 1022 | (1023 << 10) | (1023 << 20));
        for value in [1234.567, -1e-7, 0.0, 3e38] {
            let [low, middle, high] = upper(value);
            let back = f64::from(f32::from_le_bytes([0, low, middle, high]));
            assert!((back - value).abs() <= 8e-6 * value.abs(), "{value}: {back}");
        }
    }

    #[test]
    fn samples_are_even_and_leave_out_what_has_no_place() {
        let mut cloud = SceneCloud { points: vec![[0.0; 3]; 1_000_000], ..SceneCloud::default() };
        let chosen = shown(&cloud);
        assert_eq!((chosen.len(), chosen[0]), (400_000, 0));
        assert!(chosen.windows(2).all(|pair| (2..=3).contains(&(pair[1] - pair[0]))));
        cloud.points.truncate(10);
        cloud.points[3][1] = f32::INFINITY;
        assert_eq!(shown(&cloud), [0, 1, 2, 4, 5, 6, 7, 8, 9]);
        cloud.points.clear();
        assert!(shown(&cloud).is_empty());
    }
}
