//! Gross outliers - mislabelled and mismatched points - found before any method is fitted.
//!
//! A front end that knows nothing of the method to come: each camera is asked which of its pixels do
//! not belong to the points they are said to show, whatever its optics. It starts from the points
//! that a robust polynomial agrees with, then grows: a neural camera is fitted to the accepted
//! points, every pixel is judged anew by the covariance of its prediction and by its neighbours, until
//! the set stands. Judging by neighbours: Westerweel & Scarano 2005 (doi:10.1007/s00348-005-0016-6).

mod decision;
mod misplaced;
mod start;

use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    method::{AnyReconstructor, Method, neural_camera::NeuralCamera},
};
use decision::{Decision, Fitted, Verdict};
use misplaced::misplaced;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_numeric::{
    progress::{Muted, Progress},
    random::Random,
};

/// A point that at least one camera did not see where it was said to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlier {
    /// Its place in [`Dataset::correspondences`].
    pub row: usize,
    /// Its view's name; empty where there is none.
    pub view: String,
    /// Its name within the view, where it has one.
    pub id: Option<String>,
    /// The cameras whose pixel is wrong, in rising order: all that saw it where its place in the
    /// world is.
    pub cameras: Vec<usize>,
    /// How far the worst of these pixels is from where its camera should see the point, in pixels.
    pub residual: f64,
}

/// What a screening found.
#[derive(Clone, Debug, PartialEq)]
pub struct Screening {
    /// The outliers, in the order of their rows.
    pub outliers: Vec<Outlier>,
    /// The chance of a good pixel to be called an outlier.
    pub level: f64,
    /// Standard deviation of one coordinate of the good pixels, in pixels, a camera; NaN for a
    /// camera that could not be screened.
    pub pixel_sigma: Vec<f64>,
}

/// Good pixels called outliers that are expected in a whole data set of well-behaved noise.
const FALSE_ALARMS: f64 = 0.01;

/// Fewest points of a camera: with less than two for each of a camera's eleven numbers an outlier
/// cannot be told from the camera it makes up.
const POINTS_NEEDED: usize = 24;

/// Points to which a camera is fitted, at most: predictions are then far better than the noise, and
/// time stays within seconds.
const MOST_FITTED: usize = 2000;

/// Where more than this share would be accused, the minority that agrees may be the bad ones: nobody is.
/// Half the rows bad makes up to 0.55 of a camera's pixels.
const MOST_ACCUSED: f64 = 0.6;

/// Times that a camera is fitted and its pixels judged anew, at most. Three or four are the rule.
const ROUNDS: usize = 12;

/// How far, in standard deviations of the noise, a prediction may be off for its pixel to be taken into
/// the next fit. Without a limit, a camera fitted to the middle of the picture admits anything at
/// its edge.
const FIRST_REACH: f64 = 8.0;

impl Screening {
    /// The data without the outliers' pixels. Points that no camera is left for disappear; the order
    /// of the others stays.
    #[must_use]
    pub fn clean(&self, data: &Dataset) -> Dataset {
        let gone: BTreeSet<usize> = self.outliers.iter().map(|outlier| outlier.row).collect();
        self.masked(data).subset(|row, point| !gone.contains(&row) || point.seen_by() > 0)
    }

    /// The same with all points, those of which no pixel is left too.
    pub(super) fn masked(&self, data: &Dataset) -> Dataset {
        let mut masked = data.clone();
        for outlier in &self.outliers {
            let Some(row) = masked.correspondences.get_mut(outlier.row) else { continue };
            for camera in &outlier.cameras {
                if let Some(pixel) = row.pixels.get_mut(*camera) {
                    *pixel = None;
                }
            }
        }
        masked
    }

    /// Without what a camera says of a view of which it accuses more than a quarter of the points.
    pub(super) fn without_whole_views(&self, data: &Dataset) -> Self {
        let mut seen: BTreeMap<(usize, usize), [usize; 2]> = BTreeMap::new();
        let mut count = |row: &Correspondence, camera: usize, which: usize| {
            seen.entry((row.view, camera)).or_default()[which] += 1;
        };
        for (_, row) in data.known() {
            let cameras = (0..data.cameras).filter(|camera| row.pixels[*camera].is_some());
            cameras.for_each(|camera| count(row, camera, 0));
        }
        for outlier in &self.outliers {
            let row = &data.correspondences[outlier.row];
            outlier.cameras.iter().for_each(|camera| count(row, *camera, 1));
        }
        let mut spared = self.clone();
        for outlier in &mut spared.outliers {
            let view = data.correspondences[outlier.row].view;
            outlier.cameras.retain(|camera| {
                let [seen, accused] = seen[&(view, *camera)];
                4 * accused <= seen
            });
        }
        spared.outliers.retain(|outlier| !outlier.cameras.is_empty());
        spared
    }

    /// The outliers of both.
    pub(super) fn joined(self, other: Self) -> Self {
        let mut all: BTreeMap<usize, Outlier> = BTreeMap::new();
        for outlier in self.outliers.into_iter().chain(other.outliers) {
            let known = all
                .entry(outlier.row)
                .or_insert_with(|| Outlier { cameras: Vec::new(), ..outlier.clone() });
            known.cameras.extend(&outlier.cameras);
            known.cameras.sort_unstable();
            known.cameras.dedup();
            known.residual = known.residual.max(outlier.residual);
        }
        Self {
            outliers: all.into_values().collect(),
            level: other.level,
            pixel_sigma: other.pixel_sigma,
        }
    }
}

/// Finds the outliers among the points whose place in the world is known. Where a camera has too few
/// points, points that determine no camera, or fewer than four in ten that agree, it accuses none of
/// its pixels.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub fn screen(data: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Screening> {
    let pixels: usize = data.known().map(|(_, point)| point.seen_by()).sum();
    let level = FALSE_ALARMS / pixels.max(1) as f64;
    let screened: Vec<Result<Screened>> = (0..data.cameras)
        .into_par_iter()
        .map(|camera| PosedObservations::of(data, camera).screened(level, (seed, camera), progress))
        .collect();
    let screened = screened.into_iter().collect::<Result<Vec<_>>>()?;
    let mut found: Vec<(usize, usize, f64)> = Vec::new();
    for (camera, one) in screened.iter().enumerate() {
        found.extend(one.accused.iter().map(|(row, residual)| (*row, camera, *residual)));
    }
    let accused: BTreeSet<usize> = found.iter().map(|(row, _, _)| *row).collect();
    let unsure = screened.iter().flat_map(|one| one.rest.iter().filter(|row| row.is_unsure));
    let lost = misplaced(data, &accused, &unsure.map(|row| row.row).collect());
    for (camera, one) in screened.iter().enumerate() {
        let lost = one.rest.iter().filter(|row| lost.contains(&row.row));
        found.extend(lost.map(|row| (row.row, camera, row.residual)));
    }
    found.sort_by_key(|(row, camera, _)| (*row, *camera));
    let outliers = found.chunk_by(|a, b| a.0 == b.0).map(|pixels| {
        let row = pixels[0].0;
        let point = &data.correspondences[row];
        Outlier {
            row,
            view: data.views.get(point.view).cloned().unwrap_or_default(),
            id: point.id.clone(),
            cameras: pixels.iter().map(|(_, camera, _)| *camera).collect(),
            residual: pixels.iter().map(|(_, _, residual)| *residual).fold(0.0, f64::max),
        }
    });
    Ok(Screening {
        outliers: outliers.collect(),
        level,
        pixel_sigma: screened.iter().map(|one| one.pixel_sigma).collect(),
    })
}

/// What one camera saw of the known points.
struct PosedObservations {
    /// Where each is in [`Dataset::correspondences`].
    rows: Vec<usize>,
    pairs: Vec<(Point3, Pixel)>,
}

/// What was found of one camera.
struct Screened {
    /// Row and residual.
    accused: Vec<(usize, f64)>,
    /// Those that it did not accuse.
    rest: Vec<Spared>,
    pixel_sigma: f64,
}

/// A pixel that its camera does not accuse.
struct Spared {
    row: usize,
    residual: f64,
    /// Whether that is for want of a prediction.
    is_unsure: bool,
}

impl PosedObservations {
    fn of(data: &Dataset, camera: usize) -> Self {
        let seen = data
            .correspondences
            .iter()
            .enumerate()
            .filter_map(|(row, c)| Some((row, (c.world?, (*c.pixels.get(camera)?)?))));
        let (rows, pairs) = seen.unzip();
        Self { rows, pairs }
    }

    fn screened(
        &self,
        level: f64,
        (seed, camera): (u64, usize),
        progress: &dyn Progress,
    ) -> Result<Screened> {
        progress.check()?;
        let nobody = Screened { accused: Vec::new(), rest: Vec::new(), pixel_sigma: f64::NAN };
        if self.pairs.len() < POINTS_NEEDED {
            return Ok(nobody);
        }
        let mut random = Random::stream(seed, camera as u64);
        let Some(start) = start::start(&self.pairs, &mut random) else { return Ok(nobody) };
        if let Some(pixel_sigma) = decision::nothing_stands_out(&start) {
            return Ok(Screened { pixel_sigma, ..nobody });
        }
        let judge = Decision::new(&self.pairs, &start, level);
        let verdict = self.grown(&judge, judge.by_start(), &mut random, progress)?;
        let Some(verdict) = verdict else { return Ok(nobody) };
        let accused: Vec<usize> =
            (0..self.rows.len()).filter(|index| !verdict.good[*index]).collect();
        if accused.len() as f64 > MOST_ACCUSED * self.rows.len() as f64 {
            return Ok(nobody);
        }
        let rest = (0..self.rows.len()).filter(|index| verdict.good[*index]).map(|index| Spared {
            row: self.rows[index],
            residual: verdict.errors[index],
            is_unsure: verdict.is_unsure(index, FIRST_REACH),
        });
        Ok(Screened {
            rest: rest.collect(),
            accused: accused
                .into_iter()
                .map(|index| (self.rows[index], verdict.errors[index]))
                .collect(),
            pixel_sigma: verdict.pixel_sigma,
        })
    }

    /// The accepted points grown or shrunk until they stand; `None` where they determine no camera.
    fn grown(
        &self,
        judge: &Decision<'_>,
        start: Vec<bool>,
        random: &mut Random,
        progress: &dyn Progress,
    ) -> Result<Option<Verdict>> {
        let mut accepted = start;
        let mut best: Option<Verdict> = None;
        let mut last: Option<Fitted> = None;
        let mut most_sigma = judge.most_sigma;
        let (mut wary, mut reach) = (true, FIRST_REACH);
        for _ in 0..ROUNDS {
            let earlier = last.take();
            let fitted = self.fitted(&accepted, earlier.as_ref(), random, progress)?;
            let Some(fitted) = fitted else { break };
            let held = judge.held(&fitted);
            let mut verdict = judge.verdict(&held, (wary, most_sigma));
            if let Some(best) = best.as_ref().filter(|_| verdict.misfit > most_sigma) {
                // What came last was bad, and the fit broke: not so far next time.
                reach *= 0.5;
                if reach < 1.0 {
                    break;
                }
                accepted = best.members(reach);
                continue;
            }
            // Where all are taken in, those that were judged without having been fitted too, a fit to them has
            // nobody left to accuse.
            let stands = |next: &[bool]| next == accepted || next.iter().all(|taken| *taken);
            if wary && stands(&verdict.members(reach)) {
                wary = false;
                verdict = judge.verdict(&held, (wary, most_sigma));
            }
            let next = verdict.members(reach);
            let settled = stands(&next);
            accepted = next;
            most_sigma = most_sigma.min(2.0 * verdict.misfit.max(judge.least_sigma));
            best = Some(verdict);
            if settled {
                break;
            }
            last = Some(fitted);
        }
        Ok(best)
    }

    /// A neural camera of the accepted points, from an `earlier` one where they are nearly the points of that;
    /// `None` where they determine none.
    fn fitted(
        &self,
        accepted: &[bool],
        earlier: Option<&Fitted>,
        random: &mut Random,
        progress: &dyn Progress,
    ) -> Result<Option<Fitted>> {
        let mut members: Vec<usize> = (0..self.rows.len()).filter(|i| accepted[*i]).collect();
        if members.len() > MOST_FITTED {
            random.shuffle(&mut members);
            members.truncate(MOST_FITTED);
            members.sort_unstable();
        }
        let point = |index: &usize| {
            let (world, pixel) = self.pairs[*index];
            Correspondence {
                view: 0,
                id: None,
                pixels: vec![Some(pixel)],
                world: Some(world),
                board: None,
            }
        };
        let alone = Dataset {
            unit: String::new(),
            cameras: 1,
            views: Vec::new(),
            correspondences: members.iter().map(point).collect(),
        };
        let progress = &Muted(progress);
        let camera = match earlier.filter(|earlier| earlier.has_nearly(&members)) {
            Some(Fitted { camera, .. }) => camera.refit(&alone, progress).map(Some),
            None => NeuralCamera::default().fit(&alone, 0, progress).map(|fit| {
                match fit.reconstructor {
                    AnyReconstructor::NeuralCamera(camera) => Some(camera),
                    _ => None,
                }
            }),
        };
        match camera {
            Ok(camera) => Ok(camera.map(|camera| Fitted { camera, members })),
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(_) => Ok(None),
        }
    }
}
