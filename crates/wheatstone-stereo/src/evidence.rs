//! What speaks for a disparity, in numbers.

use crate::{
    agreement::{Agreement, AgreementRow},
    bands::Candidates,
    field::{Field, MARGIN},
    left_right,
    registers::{FLOATS, Floats, each, floats, lanes, plus, times},
    search_range::SearchRange,
    warp::Warped,
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Pixels from the centre to the side of the window in which neighbours are compared.
const RADIUS: usize = 2;
/// Differences from neighbours beyond this, in pixels, say no more; a neighbour without disparity differs by as much.
const MOST_SCATTER: f32 = 2.0;

/// What the confidence of every pixel of the left picture is computed from, row by row. NaN where there is no disparity.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evidence {
    /// By how much the second best disparity costs more, in units of the aggregated cost.
    pub gap: Vec<f32>,
    /// By how much the best other disparity's cost is worse before aggregation, mean over 5 x 5 pixels of the surface.
    /// Where it is not positive, neighbours alone speak for the disparity.
    pub lead: Vec<f32>,
    /// How far from the pixel the right picture's match of its match lies, in pixels.
    pub left_right: Vec<f32>,
    /// The mean difference from the disparities of 5 x 5 pixels, each cut at 2, in pixels.
    pub scatter: Vec<f32>,
    /// The share of 9 x 9 pixels that have a disparity.
    pub known: Vec<f32>,
    /// The correlation of both pictures over 9 x 9 pixels, -1 to 1.
    pub correlation: Vec<f32>,
    /// The root mean square of the gradient along the row over 9 x 9 pixels, in grey levels per pixel.
    pub texture: Vec<f32>,
}

impl Evidence {
    fn new(pixels: usize) -> Self {
        let map = || vec![f32::NAN; pixels];
        Self {
            gap: map(),
            lead: map(),
            left_right: map(),
            scatter: map(),
            known: map(),
            correlation: map(),
            texture: map(),
        }
    }

    /// Of all pixels.
    pub(crate) fn of(found: &Found<'_>) -> Self {
        let width = found.disparity.width;
        let mut all = Self::new(width * found.disparity.height);
        let Self { gap, lead, left_right, scatter, known, correlation, texture } = &mut all;
        let [a, b, c, d, e, f, g] = [gap, lead, left_right, scatter, known, correlation, texture]
            .map(|map| map.par_chunks_mut(width));
        let rows = a.zip(b).zip(c).zip(d).zip(e).zip(f).zip(g);
        found.for_each_row(rows, |row, ((((((a, b), c), d), e), f), g)| {
            a.copy_from_slice(&row.gap[..width]);
            b.copy_from_slice(&row.lead[..width]);
            c.copy_from_slice(&row.left_right[..width]);
            d.copy_from_slice(&row.scatter[..width]);
            e.copy_from_slice(&row.known[..width]);
            f.copy_from_slice(&row.correlation[..width]);
            g.copy_from_slice(&row.texture[..width]);
        });
        all.forget_where_none();
        all
    }

    /// Rows have NaN in the gap alone.
    fn forget_where_none(&mut self) {
        let Self { gap, lead, left_right, scatter, known, correlation, texture } = self;
        for map in [lead, left_right, scatter, known, correlation, texture] {
            for (value, gap) in map.iter_mut().zip(&*gap) {
                *value = if gap.is_nan() { f32::NAN } else { *value };
            }
        }
    }
}

/// What evidence is taken from.
pub(crate) struct Found<'a> {
    pub(crate) disparity: &'a Field,
    pub(crate) warped: &'a Warped,
    pub(crate) candidates: &'a Candidates,
    /// Of all candidates: see [`Clarity`](crate::winner::Clarity).
    pub(crate) lead: &'a Field,
    pub(crate) range: SearchRange,
}

impl Found<'_> {
    /// Hands the evidence of each row, filled up to whole registers, to `work`, with that row's item of `outs`. Returns residuals as
    /// [`agreement`](crate::agreement) has them.
    pub(crate) fn for_each_row<T: Send>(
        &self,
        outs: impl IndexedParallelIterator<Item = T>,
        work: impl Fn(&Evidence, T) + Sync,
    ) -> Field {
        let (width, height) = (self.disparity.width, self.disparity.height);
        let mut residuals = Field::new(width, height, 0.0);
        residuals.par_pixels_mut().zip(outs).enumerate().for_each_init(
            || {
                (
                    Agreement::new(self.disparity, self.warped),
                    Evidence::new(width.next_multiple_of(FLOATS)),
                )
            },
            |(agreement, evidence), (y, (residual, out))| {
                self.row(y, agreement, residual, evidence);
                work(evidence, out);
            },
        );
        residuals
    }

    fn row(
        &self,
        y: usize,
        agreement: &mut Agreement<'_>,
        residual: &mut [f32],
        evidence: &mut Evidence,
    ) {
        let Evidence { gap, lead, left_right, scatter, known, correlation, texture } = evidence;
        let (disparity, lead_of) = (self.disparity, self.lead);
        on_widest(NeighbourRow { disparity, lead_of, y, scatter, lead });
        agreement.compute(y, AgreementRow { residual, correlation, texture, known });
        let disparity = self.disparity.pixels(y);
        let row = self.candidates.row(y, disparity.len());
        for x in 0..disparity.len() {
            gap[x] = f32::from(row.clarity[x].gap);
            left_right[x] = left_right::residual(x, row.disparity[x], row.right, self.range);
        }
        for (gap, disparity) in gap.iter_mut().zip(disparity) {
            *gap = if disparity.is_nan() { f32::NAN } else { *gap };
        }
    }
}

/// What neighbours say, for one row.
struct NeighbourRow<'a> {
    disparity: &'a Field,
    lead_of: &'a Field,
    y: usize,
    scatter: &'a mut [f32],
    lead: &'a mut [f32],
}

impl WithSimd for NeighbourRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let pieces = self.scatter.chunks_mut(FLOATS).zip(self.lead.chunks_mut(FLOATS));
        for (piece, (scatter, lead)) in pieces.enumerate() {
            let at = MARGIN + piece * FLOATS;
            let sums = neighbours([self.disparity, self.lead_of], self.y, at);
            scatter.copy_from_slice(&sums[0][..scatter.len()]);
            lead.copy_from_slice(&sums[1][..lead.len()]);
        }
    }
}

/// The scatter and the mean lead around eight pixels.
#[inline(always)]
fn neighbours([disparity, lead]: [&Field; 2], y: usize, at: usize) -> [Floats; 2] {
    const NEIGHBOURS: usize = (2 * RADIUS + 1) * (2 * RADIUS + 1) - 1;
    let last = disparity.height as isize - 1;
    let centre = floats(disparity.row(y), at);
    let (mut differences, mut leads, mut count) = ([0.0; FLOATS], [0.0; FLOATS], [0.0; FLOATS]);
    for down in -(RADIUS as isize)..=RADIUS as isize {
        let row = (y as isize + down).clamp(0, last) as usize;
        for column in at - RADIUS..=at + RADIUS {
            let (values, lead) =
                (floats(disparity.row(row), column), floats(lead.row(row), column));
            // No comparison with NaN holds.
            let difference = lanes(values, centre, |value, centre| (value - centre).abs());
            let near = each(difference, |d| if d < MOST_SCATTER { 1.0 } else { 0.0 });
            let cut = each(difference, |d| if d < MOST_SCATTER { d } else { MOST_SCATTER });
            differences = lanes(differences, cut, plus);
            leads = lanes(leads, lanes(near, lead, times), plus);
            count = lanes(count, near, plus);
        }
    }
    let scatter = each(differences, |sum| sum / NEIGHBOURS as f32);
    [scatter, lanes(leads, count, |sum, count| sum / count)]
}
