//! What speaks for a disparity, in numbers.

use crate::{
    agreement::{Agreement, AgreementRow},
    bands::Candidates,
    buffers::{Buffer, Pool},
    coefficients::QUANTITIES,
    field::{Field, MARGIN},
    neighbourhood::{Neighbourhood, window},
    registers::{FLOATS, Floats, each, floats, lanes, plus, times},
    warp::Warped,
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Pixels from the centre to the side of the window in which neighbours are compared.
const RADIUS: usize = 2;
/// Differences from neighbours beyond this, in pixels, say no more; a neighbour without disparity differs by as much.
const MOST_SCATTER: f32 = 2.0;

/// Rows that one thread takes at a time. Those beside them that wide windows reach are compared twice.
pub(crate) const BAND: usize = 64;

/// What the confidence of every pixel of the left picture is computed from: a number a pixel each, row by row.
///
/// - `gap`: by how much the second best disparity costs more, in units of the aggregated cost.
/// - `lead`: by how much the best other disparity's cost is worse before aggregation, mean over 5 x 5 pixels of the
///   surface. Where it is not positive, neighbours alone speak for the disparity.
/// - `left_right`: how far from the pixel the right picture's match of its match lies, in pixels.
/// - `scatter`: the mean difference from the disparities of 5 x 5 pixels, each cut at 2, in pixels.
/// - `known`: the share of 9 x 9 pixels that have a disparity.
/// - `correlation`: of both pictures over 9 x 9 pixels, -1 to 1.
/// - `texture`: the root mean square of the gradient along the row over 9 x 9 pixels, in grey levels per pixel.
/// - `surface`: the natural logarithm of the number of pixels of its surface.
/// - `border`: how far from the left border of the right picture the match lies, in pixels.
/// - `wide_known`: the share of 21 x 21 pixels that have a disparity.
/// - `wide_correlation`: the mean correlation of those, negative ones counted as zero.
#[derive(Debug)]
pub struct Evidence {
    pub(crate) gap: Buffer<f32>,
    pub(crate) lead: Buffer<f32>,
    pub(crate) left_right: Buffer<f32>,
    pub(crate) scatter: Buffer<f32>,
    pub(crate) known: Buffer<f32>,
    pub(crate) correlation: Buffer<f32>,
    pub(crate) texture: Buffer<f32>,
    pub(crate) surface: Buffer<f32>,
    pub(crate) border: Buffer<f32>,
    pub(crate) wide_known: Buffer<f32>,
    pub(crate) wide_correlation: Buffer<f32>,
}

impl Evidence {
    fn new(pool: &Pool<f32>, pixels: usize) -> Self {
        let map = || pool.filled(pixels, f32::NAN);
        Self {
            gap: map(),
            lead: map(),
            left_right: map(),
            scatter: map(),
            known: map(),
            correlation: map(),
            texture: map(),
            surface: map(),
            border: map(),
            wide_known: map(),
            wide_correlation: map(),
        }
    }

    /// All maps, each with its name. NaN where there is no disparity.
    #[must_use]
    pub fn named(&self) -> [(&'static str, &[f32]); QUANTITIES] {
        [
            ("gap", &self.gap),
            ("lead", &self.lead),
            ("left_right", &self.left_right),
            ("scatter", &self.scatter),
            ("known", &self.known),
            ("correlation", &self.correlation),
            ("texture", &self.texture),
            ("surface", &self.surface),
            ("border", &self.border),
            ("wide_known", &self.wide_known),
            ("wide_correlation", &self.wide_correlation),
        ]
    }

    fn maps_mut(&mut self) -> [&mut [f32]; QUANTITIES] {
        [
            &mut self.gap,
            &mut self.lead,
            &mut self.left_right,
            &mut self.scatter,
            &mut self.known,
            &mut self.correlation,
            &mut self.texture,
            &mut self.surface,
            &mut self.border,
            &mut self.wide_known,
            &mut self.wide_correlation,
        ]
    }

    /// Of all pixels.
    pub(crate) fn of(found: &Found<'_>) -> Self {
        let Field { width, height, .. } = *found.disparity;
        let mut all = Self::new(found.disparity.pool(), width * height);
        let mut rows: Vec<_> = (0..height.div_ceil(BAND)).map(|_| Vec::new()).collect();
        for map in all.maps_mut() {
            let bands = map.chunks_mut(BAND * width);
            rows.iter_mut().zip(bands).for_each(|(rows, band)| rows.push(band));
        }
        found.for_each_band(rows.into_par_iter(), |evidence, rows| {
            for (out, (_, map)) in rows.into_iter().zip(evidence.named()) {
                for ((out, value), gap) in out.iter_mut().zip(map).zip(&*evidence.gap) {
                    *out = if gap.is_nan() { f32::NAN } else { *value };
                }
            }
        });
        all
    }
}

/// What evidence is taken from.
pub(crate) struct Found<'a> {
    pub(crate) disparity: &'a Field,
    /// See [`left_right`](crate::left_right).
    pub(crate) left_right: &'a Field,
    /// Logarithms of the pixels of surfaces.
    pub(crate) surface: &'a Field,
    pub(crate) warped: &'a Warped,
    pub(crate) candidates: &'a Candidates,
    /// Of all candidates: see [`Clarity`](crate::winner::Clarity).
    pub(crate) lead: &'a Field,
}

impl Found<'_> {
    /// Hands the evidence of each band of rows to `work`, with that band's item of `outs`; behind the last row it means
    /// nothing, and where there is no disparity, the gap alone is NaN. Returns residuals as [`agreement`](crate::agreement) has them.
    pub(crate) fn for_each_band<T: Send>(
        &self,
        outs: impl IndexedParallelIterator<Item = T>,
        work: impl Fn(&Evidence, T) + Sync,
    ) -> Field {
        let mut residuals = self.disparity.like(0.0);
        residuals.par_bands_mut(BAND).zip(outs).enumerate().for_each_init(
            || Band::new(self),
            |band, (number, (mut residuals, out))| {
                let first = number * BAND;
                band.compare(first, &mut residuals);
                (0..residuals.len()).for_each(|row| band.row(first + row, row));
                work(&band.evidence, out);
            },
        );
        residuals
    }
}

/// Rows below each other, and memory for what is found of them.
struct Band<'a> {
    found: &'a Found<'a>,
    agreement: Agreement<'a>,
    neighbourhood: Neighbourhood,
    evidence: Evidence,
    /// Of one row beside them.
    beside: [Vec<f32>; 4],
}

impl<'a> Band<'a> {
    fn new(found: &'a Found<'a>) -> Self {
        let width = found.disparity.width;
        Self {
            found,
            agreement: Agreement::new(found.disparity, found.warped),
            neighbourhood: Neighbourhood::new(width),
            evidence: Evidence::new(found.disparity.pool(), BAND * width),
            beside: [(); 4].map(|()| vec![0.0; width]),
        }
    }

    /// Compares both pictures in the rows from `first` on and in those beside them.
    fn compare(&mut self, first: usize, residuals: &mut [&mut [f32]]) {
        let Field { width, height, .. } = *self.found.disparity;
        let top = window(first, height).start;
        self.neighbourhood.restart(top);
        for y in top..window(first + residuals.len() - 1, height).end {
            let [residual, correlation, texture, known] = &mut self.beside;
            let Evidence { known: shares, correlation: correlations, texture: textures, .. } =
                &mut self.evidence;
            let own = y.checked_sub(first).filter(|row| *row < residuals.len());
            let out = match own {
                Some(row) => {
                    let all = row * width..(row + 1) * width;
                    AgreementRow {
                        residual: residuals[row],
                        correlation: &mut correlations[all.clone()],
                        texture: &mut textures[all.clone()],
                        known: &mut shares[all],
                    }
                }
                None => AgreementRow { residual, correlation, texture, known },
            };
            let AgreementRow { correlation, .. } = self.agreement.compute(y, out);
            self.neighbourhood.push(self.found.disparity.pixels(y), correlation);
        }
    }

    /// What is left of row `y`, which is number `row` of these.
    fn row(&mut self, y: usize, row: usize) {
        let Found { disparity, lead: lead_of, candidates, .. } = *self.found;
        let Field { width, height, .. } = *disparity;
        let all = row * width..(row + 1) * width;
        let Evidence { gap, lead, left_right, scatter, surface, border, .. } = &mut self.evidence;
        let (scatter, lead) = (&mut scatter[all.clone()], &mut lead[all.clone()]);
        on_widest(NeighbourRow { disparity, lead_of, y, scatter, lead });
        surface[all.clone()].copy_from_slice(self.found.surface.pixels(y));
        left_right[all.clone()].copy_from_slice(self.found.left_right.pixels(y));
        let (gap, border) = (&mut gap[all.clone()], &mut border[all.clone()]);
        let (disparity, clarity) = (disparity.pixels(y), candidates.row(y, width).clarity);
        for x in 0..width {
            gap[x] = if disparity[x].is_nan() { f32::NAN } else { f32::from(clarity[x].gap) };
            border[x] = x as f32 - disparity[x];
        }
        let Evidence { wide_known, wide_correlation, .. } = &mut self.evidence;
        let (known, correlation) = (&mut wide_known[all.clone()], &mut wide_correlation[all]);
        self.neighbourhood.means(y, height, known, correlation);
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
