//! What speaks for a disparity, in numbers.

use crate::{
    agreement::{Agreement, AgreementRow},
    bands::Candidates,
    coefficients::QUANTITIES,
    field::{Field, MARGIN},
    left_right,
    neighbourhood::{Neighbourhood, window},
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

/// Rows that one thread takes at a time. Those beside them that wide windows reach are compared twice.
pub(crate) const BAND: usize = 64;

/// What the confidence of every pixel of the left picture is computed from.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evidence {
    /// A number a pixel, row by row, in the order of [`Evidence::NAMES`]. NaN where there is no disparity.
    pub maps: [Vec<f32>; QUANTITIES],
}

impl Evidence {
    /// What the maps are:
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
    pub const NAMES: [&str; QUANTITIES] = [
        "gap",
        "lead",
        "left_right",
        "scatter",
        "known",
        "correlation",
        "texture",
        "surface",
        "border",
        "wide_known",
        "wide_correlation",
    ];

    fn new(pixels: usize) -> Self {
        Self { maps: std::array::from_fn(|_| vec![f32::NAN; pixels]) }
    }

    /// The map `scatter`.
    pub(crate) fn scatter(&self) -> &[f32] {
        let [_, _, _, scatter, ..] = &self.maps;
        scatter
    }

    /// Of all pixels.
    pub(crate) fn of(found: &Found<'_>) -> Self {
        let Field { width, height, .. } = *found.disparity;
        let mut bands = vec![Self::new(0); height.div_ceil(BAND)];
        found.for_each_band(bands.par_iter_mut(), |evidence, band| band.clone_from(evidence));
        let mut maps: [Vec<f32>; QUANTITIES] = std::array::from_fn(|map| {
            let all = bands.iter().flat_map(|band: &Self| &band.maps[map]).copied();
            all.take(width * height).collect()
        });
        let [gap, others @ ..] = &mut maps;
        for map in others {
            for (value, gap) in map.iter_mut().zip(&*gap) {
                *value = if gap.is_nan() { f32::NAN } else { *value };
            }
        }
        Self { maps }
    }
}

/// What evidence is taken from.
pub(crate) struct Found<'a> {
    pub(crate) disparity: &'a Field,
    /// Logarithms of the pixels of surfaces.
    pub(crate) surface: &'a Field,
    pub(crate) warped: &'a Warped,
    pub(crate) candidates: &'a Candidates,
    /// Of all candidates: see [`Clarity`](crate::winner::Clarity).
    pub(crate) lead: &'a Field,
    pub(crate) range: SearchRange,
}

impl Found<'_> {
    /// Hands the evidence of each band of rows to `work`, with that band's item of `outs`; behind the last row it means
    /// nothing, and where there is no disparity, the gap alone is NaN. Returns residuals as [`agreement`](crate::agreement) has them.
    pub(crate) fn for_each_band<T: Send>(
        &self,
        outs: impl IndexedParallelIterator<Item = T>,
        work: impl Fn(&Evidence, T) + Sync,
    ) -> Field {
        let mut residuals = Field::new(self.disparity.width, self.disparity.height, 0.0);
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
            evidence: Evidence::new(BAND * width),
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
            let [_, _, _, _, shares, correlations, textures, ..] = &mut self.evidence.maps;
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
        let Found { disparity, surface, candidates, lead: lead_of, range, .. } = *self.found;
        let Field { width, height, .. } = *disparity;
        let all = row * width..(row + 1) * width;
        let maps = self.evidence.maps.each_mut().map(|map| &mut map[all.clone()]);
        let [gap, lead, left_right, scatter, .., surfaces, border, wide_known, wide_correlation] =
            maps;
        on_widest(NeighbourRow { disparity, lead_of, y, scatter, lead });
        self.neighbourhood.means(y, height, wide_known, wide_correlation);
        surfaces.copy_from_slice(surface.pixels(y));
        let (disparity, searched) = (disparity.pixels(y), candidates.row(y, width));
        for x in 0..width {
            let is_known = !disparity[x].is_nan();
            gap[x] = if is_known { f32::from(searched.clarity[x].gap) } else { f32::NAN };
            left_right[x] = left_right::residual(x, searched.disparity[x], searched.right, range);
            border[x] = x as f32 - disparity[x];
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
