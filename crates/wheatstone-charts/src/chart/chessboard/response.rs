//! Where four squares may meet: peaks of the response of Bennett and Lasenby (2014,
//! doi:10.1016/j.cviu.2013.10.008), in whole numbers, on as many pixels at once as registers hold.

use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Their ring: sixteen places five pixels from the middle, clockwise from the top.
const RING: [(isize, isize); 16] = [
    (0, -5),
    (2, -5),
    (3, -3),
    (5, -2),
    (5, 0),
    (5, 2),
    (3, 3),
    (2, 5),
    (0, 5),
    (-2, 5),
    (-3, 3),
    (-5, 2),
    (-5, 0),
    (-5, -2),
    (-3, -3),
    (-2, -5),
];
/// What the ring reaches, in pixels.
const REACH: usize = 5;
/// A peak is the highest of so many pixels to each side.
const AROUND: usize = 2;
/// Peaks nearer than this to the border have too little about them: the ring, the neighbours, and a saddle's window of
/// five pixels.
const MARGIN: usize = REACH + AROUND + 2;
/// Responses are kept five times as large, which makes the mean of the five pixels in the middle a whole number.
const FOLD: i16 = 5;
/// The least response: `calib-targets` recommends 15, for noise and small contrast.
const LEAST: i16 = 15 * FOLD;
/// Neighbours that must answer too: a single pixel does not make a corner.
const LEAST_NEIGHBOURS: usize = 2;
/// Rows that are worked on together: with their responses they fit a core's own cache.
const BAND: usize = 64;

/// A place where four squares may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    /// Column and row.
    pub(super) place: [usize; 2],
    /// The middle of the response about it.
    pub(super) centre: [f32; 2],
    /// The response: 8 times the contrast of sharp squares.
    pub(super) strength: f32,
}

/// The peaks of a picture given row by row, from the top.
pub(super) fn peaks(values: &[u8], width: usize, height: usize) -> Vec<Peak> {
    if width.min(height) <= 2 * MARGIN {
        return Vec::new();
    }
    let starts: Vec<usize> = (MARGIN..height - MARGIN).step_by(BAND).collect();
    let bands = starts.into_par_iter().map(|first| {
        let rows = first..(first + BAND).min(height - MARGIN);
        let responses = Responses::new(values, width, rows.start - AROUND..rows.end + AROUND);
        rows.flat_map(|row| responses.peaks(row)).collect::<Vec<_>>()
    });
    bands.collect::<Vec<_>>().concat()
}

/// The responses of some rows.
struct Responses {
    first: usize,
    width: usize,
    values: Vec<i16>,
}

impl Responses {
    fn new(picture: &[u8], width: usize, rows: std::ops::Range<usize>) -> Self {
        let mut values = vec![0; width * rows.len()];
        let first = rows.start;
        on_widest(Respond { picture, width, rows, values: &mut values });
        Self { first, width, values }
    }

    fn row(&self, row: usize) -> &[i16] {
        &self.values[(row - self.first) * self.width..][..self.width]
    }

    fn peaks(&self, row: usize) -> Vec<Peak> {
        let mut found = Vec::new();
        let inside = &self.row(row)[MARGIN..self.width - MARGIN];
        // Almost nowhere is there any.
        for (index, some) in inside.chunks(32).enumerate() {
            if some.iter().fold(i16::MIN, |most, value| most.max(*value)) <= LEAST {
                continue;
            }
            let columns = MARGIN + 32 * index..;
            let strong = columns.zip(some).filter(|(_, value)| **value > LEAST);
            found.extend(strong.filter_map(|(column, value)| self.peak(column, row, *value)));
        }
        found
    }

    /// The peak at a place with this response, if it is one.
    fn peak(&self, column: usize, row: usize, value: i16) -> Option<Peak> {
        let (mut neighbours, mut sum, mut across, mut down) = (0, 0, 0, 0);
        for y in row - AROUND..=row + AROUND {
            let line = &self.row(y)[column - AROUND..=column + AROUND];
            if line.iter().any(|other| *other > value) {
                return None;
            }
            for (x, other) in line.iter().enumerate() {
                let weight = i32::from((*other).max(0));
                neighbours += usize::from(weight > 0);
                sum += weight;
                across += weight * (x as i32 - AROUND as i32);
                down += weight * (y as i32 - row as i32);
            }
        }
        // It counts itself.
        (neighbours > LEAST_NEIGHBOURS).then(|| Peak {
            place: [column, row],
            centre: [
                column as f32 + across as f32 / sum as f32,
                row as f32 + down as f32 / sum as f32,
            ],
            strength: f32::from(value) / f32::from(FOLD),
        })
    }
}

struct Respond<'a> {
    picture: &'a [u8],
    width: usize,
    rows: std::ops::Range<usize>,
    values: &'a mut [i16],
}

impl WithSimd for Respond<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut sums = vec![0; self.width - 2 * REACH];
        for (row, out) in self.rows.zip(self.values.chunks_exact_mut(self.width)) {
            let out = &mut out[REACH..self.width - REACH];
            respond(self.picture, self.width, row, &mut sums, out);
        }
    }
}

/// One row of responses: how unlike neighbouring quarters of the ring are, less how unlike opposite ones are, less how
/// unlike the ring is to its middle. No sum leaves 16 bits: it is -30 600 at least.
#[inline(always)]
fn respond(picture: &[u8], width: usize, row: usize, sums: &mut [i16], out: &mut [i16]) {
    let count = out.len();
    let shifted = |(across, down): (isize, isize)| {
        let start = (row as isize + down) * width as isize + REACH as isize + across;
        &picture[start as usize..][..count]
    };
    sums.fill(0);
    out.fill(0);
    for quarter in 0..4 {
        let [a, b, c, d] = [0, 8, 4, 12].map(|turn| shifted(RING[quarter + turn]));
        let pixels = a.iter().zip(b).zip(c.iter().zip(d));
        for ((sum, out), ((a, b), (c, d))) in sums.iter_mut().zip(out.iter_mut()).zip(pixels) {
            let [a, b, c, d] = [*a, *b, *c, *d].map(i16::from);
            *out += (a + b - c - d).abs() - (a - b).abs() - (c - d).abs();
            *sum += a + b + c + d;
        }
    }
    let [middle, above, below] = [(0, 0), (0, -1), (0, 1)].map(shifted);
    let [left, right] = [(-1, 0), (1, 0)].map(shifted);
    let beside = above.iter().zip(below).zip(left.iter().zip(right));
    for (((sum, out), middle), ((above, below), (left, right))) in
        sums.iter().zip(out.iter_mut()).zip(middle).zip(beside)
    {
        let [m, a, b, l, r] = [*middle, *above, *below, *left, *right].map(i16::from);
        *out = FOLD * *out - (FOLD * *sum - 16 * (m + a + b + l + r)).abs();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares of grey `light` on `dark` that meet at (x, y), one left above, the other right below.
    fn squares(size: (usize, usize), at: (usize, usize), dark: u8, light: u8) -> Vec<u8> {
        let value = |x: usize, y: usize| if (x < at.0) == (y < at.1) { light } else { dark };
        (0..size.1).flat_map(|y| (0..size.0).map(move |x| value(x, y))).collect()
    }

    #[test]
    fn a_corner_is_one_peak_of_known_strength() {
        // Across the borders of bands, and at every lane of a register.
        for at in [(30, 40), (61, 72), (62, 73), (63, 74), (90, 136)] {
            let picture = squares((120, 150), at, 30, 200);
            let found = peaks(&picture, 120, 150);
            assert!(!found.is_empty());
            for peak in &found {
                let apart =
                    [at.0 as f32 - 0.5 - peak.centre[0], at.1 as f32 - 0.5 - peak.centre[1]];
                assert!(apart[0].abs() < 0.6 && apart[1].abs() < 0.6, "{at:?}: {peak:?}");
                // Of 8 x 170, the places that fall on edges take a part.
                assert!(peak.strength > 300.0 && peak.strength <= 1360.0, "{peak:?}");
            }
        }
    }

    #[test]
    fn edges_stripes_and_flat_ground_have_no_peaks() {
        let picture = |value: fn(usize, usize) -> u8| -> Vec<u8> {
            (0..100).flat_map(|y| (0..100).map(move |x| value(x, y))).collect()
        };
        for value in [
            (|_, _| 90) as fn(usize, usize) -> u8,
            |x, _| if x < 50 { 0 } else { 255 },
            |x, y| if x + y < 90 { 255 } else { 0 },
            |x, _| if x % 16 < 8 { 255 } else { 0 },
            |x, y| if (x, y) == (50, 50) { 255 } else { 0 },
        ] {
            assert_eq!(peaks(&picture(value), 100, 100), []);
        }
        for (width, height) in [(0, 0), (18, 400), (400, 18)] {
            assert_eq!(peaks(&vec![0; width * height], width, height), []);
        }
    }

    #[test]
    fn responses_are_the_sum_that_the_paper_writes() {
        let mut random = wheatstone_numeric::random::Random::new(5);
        let picture: Vec<u8> = (0..60 * 50).map(|_| random.uniform(0.0, 256.0) as u8).collect();
        let responses = Responses::new(&picture, 60, 5..45);
        for row in 5..45 {
            for column in 5..55 {
                let at = |(x, y): (isize, isize)| {
                    f64::from(
                        picture[(row as isize + y) as usize * 60 + (column as isize + x) as usize],
                    )
                };
                let ring = RING.map(at);
                let sum: f64 = (0..4)
                    .map(|n| (ring[n] + ring[n + 8] - ring[n + 4] - ring[n + 12]).abs())
                    .sum();
                let difference: f64 = (0..8).map(|n| (ring[n] - ring[n + 8]).abs()).sum();
                let middle =
                    [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)].map(at).iter().sum::<f64>() / 5.0;
                let mean = ring.iter().sum::<f64>() / 16.0;
                let expected = sum - difference - 16.0 * (mean - middle).abs();
                let found = f64::from(responses.row(row)[column]) / 5.0;
                assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
            }
        }
    }
}
