//! Means over wide windows.

use std::ops::Range;

/// Pixels from the centre to the side of the windows, which are cut off at the border of the picture.
pub(crate) const RADIUS: usize = 10;

/// Of some rows below each other, sums along each row's windows.
pub(crate) struct Neighbourhood {
    width: usize,
    /// Columns of the window about each pixel of a row.
    columns: Vec<f32>,
    /// The picture's row that is the first of these.
    first: usize,
    /// Of pixels that have a disparity.
    counts: Vec<f32>,
    /// Of their correlations, negative ones counted as zero.
    sums: Vec<f32>,
}

impl Neighbourhood {
    pub(crate) fn new(width: usize) -> Self {
        let columns = (0..width).map(|x| window(x, width).len() as f32).collect();
        Self { width, columns, first: 0, counts: Vec::new(), sums: Vec::new() }
    }

    /// Forgets all rows; the next one is row `first` of the picture.
    pub(crate) fn restart(&mut self, first: usize) {
        self.first = first;
        self.counts.clear();
        self.sums.clear();
    }

    /// Takes in the next row.
    pub(crate) fn push(&mut self, disparity: &[f32], correlation: &[f32]) {
        let is_known = |x: usize| !disparity[x].is_nan();
        let width = self.width;
        sum_along(width, |x| if is_known(x) { 1.0 } else { 0.0 }, &mut self.counts);
        sum_along(
            width,
            |x| if is_known(x) { correlation[x].max(0.0) } else { 0.0 },
            &mut self.sums,
        );
    }

    /// Of a row's pixels, over 21 x 21 pixels, of which all rows were taken in: the share that has a disparity, and the mean correlation
    /// of those.
    pub(crate) fn means(&self, y: usize, height: usize, known: &mut [f32], means: &mut [f32]) {
        let rows = window(y, height);
        known.fill(0.0);
        means.fill(0.0);
        for row in rows.clone() {
            let all = (row - self.first) * self.width..(row - self.first + 1) * self.width;
            add(known, &self.counts[all.clone()]);
            add(means, &self.sums[all]);
        }
        let all = rows.len() as f32;
        for ((known, mean), columns) in known.iter_mut().zip(means).zip(&self.columns) {
            *mean /= known.max(1.0);
            *known /= all * columns;
        }
    }
}

/// The pixels of a window about one of `count`.
pub(crate) fn window(at: usize, count: usize) -> Range<usize> {
    at.saturating_sub(RADIUS)..(at + RADIUS + 1).min(count)
}

/// Sums over windows of one row.
fn sum_along(width: usize, value: impl Fn(usize) -> f32, out: &mut Vec<f32>) {
    let mut sum: f32 = (0..RADIUS.min(width)).map(&value).sum();
    out.extend((0..width).map(|x| {
        let next = if x + RADIUS < width { value(x + RADIUS) } else { 0.0 };
        let last = if x > RADIUS { value(x - RADIUS - 1) } else { 0.0 };
        sum += next - last;
        sum
    }));
}

fn add(to: &mut [f32], values: &[f32]) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_over_windows() {
        let (width, height) = (37, 25);
        let is_known = |x: usize, y: usize| !(x * 7 + y * 3).is_multiple_of(5);
        let correlation = |x: usize, y: usize| ((y * width + x) % 11) as f32 / 8.0 - 0.3;
        let mut found = Neighbourhood::new(width);
        found.restart(0);
        for y in 0..height {
            let disparity: Vec<f32> =
                (0..width).map(|x| if is_known(x, y) { 1.0 } else { f32::NAN }).collect();
            let correlation: Vec<f32> = (0..width).map(|x| correlation(x, y)).collect();
            found.push(&disparity, &correlation);
        }
        for (x, y) in [(0, 0), (18, 12), (36, 24), (5, 20), (30, 3)] {
            let places = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
            let near =
                |&(u, v): &(usize, usize)| u.abs_diff(x) <= RADIUS && v.abs_diff(y) <= RADIUS;
            let near: Vec<_> = places.filter(near).collect();
            let known: Vec<_> = near.iter().filter(|(u, v)| is_known(*u, *v)).collect();
            let sum: f32 = known.iter().map(|(u, v)| correlation(*u, *v).max(0.0)).sum();
            let [mut shares, mut means] = [vec![0.0; width], vec![0.0; width]];
            found.means(y, height, &mut shares, &mut means);
            assert!((shares[x] - known.len() as f32 / near.len() as f32).abs() < 1e-5);
            assert!((means[x] - sum / known.len() as f32).abs() < 1e-5);
        }
    }
}
