//! Where exactly a dot is: the centroid of the light that it takes away or adds, and from there the
//! picture of its centre, which under perspective is another place.

use super::blobs::{Blob, area};
use crate::imaging::GrayImage;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::collections::BTreeMap;
use wheatstone_core::geometry::{Homography, Pixel};
use wheatstone_numeric::statistics::median;

/// A dot as the picture shows it.
#[derive(Clone, Copy, Debug)]
pub(in crate::chart) struct Dot {
    /// Centroid of its picture.
    pub(in crate::chart) centroid: Pixel,
    /// Of its picture, in square pixels.
    pub(in crate::chart) area: f64,
    /// Standard deviation of the centroid along each axis, from the picture's noise, in pixels.
    pub(in crate::chart) sigma: f64,
    /// How much darker it is than its ground, in grey levels; negative for bright ones.
    pub(in crate::chart) depth: f64,
}

/// A dot as the chart has it.
#[derive(Clone, Copy, Debug)]
pub(in crate::chart) struct Placed {
    /// Where its centre is seen.
    pub(in crate::chart) centre: Pixel,
    /// Its radius squared, in steps of the labels.
    pub(in crate::chart) radius_squared: f64,
}

/// Rounds of centroid and window about it. Each shrinks a window's error tenfold.
const ROUNDS: usize = 4;
/// In pixels: a hundredth of [`OWN_FAULT`].
const SETTLED: f64 = 1e-4;
/// In pixels, at most: the width of a blurred edge on either side, for blurs up to 1.2 px.
const MARGIN: f64 = 2.5;
/// In pixels: the width of the ring about a dot that shows its ground.
const RING: f64 = 2.5;

/// The dot of a patch, `gap` pixels from the edge of the next one; `None` where it leaves the picture
/// or has no ground about it.
pub(in crate::chart) fn measure(image: &GrayImage, blob: &Blob, gap: f64) -> Option<Dot> {
    let margin = (0.4 * gap).clamp(0.8, MARGIN);
    let ring = (0.5 * gap).clamp(1.0, RING);
    let (mut centroid, mut covariance) = (blob.centre, blob.covariance);
    let (mut ink, mut sigma, mut depth) = (0.0, 0.0, 0.0);
    for _ in 0..ROUNDS {
        let window = Window::new(image, centroid, covariance, margin + ring)?;
        let sums = window.sums(margin)?;
        centroid += sums.step;
        // Noise about a small dot weighs much in the second moments.
        let growth = area(&sums.covariance) / blob.area();
        let credible = (0.5..2.0).contains(&growth);
        covariance = if credible { sums.covariance } else { blob.covariance };
        (sigma, depth) = (sums.sigma, sums.depth);
        ink = sums.area.unwrap_or_else(|| area(&covariance));
        if (centroid - blob.centre).norm_squared() > blob.area() / 4.0 {
            return None;
        }
        if sums.step.norm() < SETTLED {
            break;
        }
    }
    let sigma = (sigma * sigma + OWN_FAULT * OWN_FAULT).sqrt();
    Some(Dot { centroid, area: ink, sigma, depth })
}

/// In pixels: what is left without noise, measured on rendered dots (see the decision on charts).
const OWN_FAULT: f64 = 0.01;
/// In grey levels: what rounding to whole ones leaves uncertain, the root of a twelfth.
const ROUNDING: f64 = 0.29;

/// The pixels about a dot: steps from its centre, distance outside its edge, value.
struct Window {
    pixels: Vec<(Vector2<f64>, f64, f64)>,
}

/// What a window holds.
struct Sums {
    /// From the window's centre to the centroid.
    step: Vector2<f64>,
    covariance: Matrix2<f64>,
    /// Where the dot is large enough to show its own grey level.
    area: Option<f64>,
    /// Standard deviation of the centroid along each axis, from noise.
    sigma: f64,
    /// Ground less dot, in grey levels.
    depth: f64,
}

/// A grey level that changes evenly: at the window's centre, and a pixel to the right and down.
type Plane = Vector3<f64>;

fn on(plane: &Plane, step: Vector2<f64>) -> f64 {
    plane[0] + plane[1] * step.x + plane[2] * step.y
}

impl Window {
    fn new(
        image: &GrayImage,
        centre: Pixel,
        covariance: Matrix2<f64>,
        beyond: f64,
    ) -> Option<Self> {
        let inverse = covariance.try_inverse()?;
        let half = |variance: f64| 2.0 * variance.sqrt() + beyond + 1.0;
        let (wide, high) = (half(covariance[(0, 0)]), half(covariance[(1, 1)]));
        let low = centre - Vector2::new(wide, high);
        let high = centre + Vector2::new(wide, high);
        if !image.contains(low, 0.0) || !image.contains(high, 0.0) {
            return None;
        }
        let mut pixels = Vec::new();
        for y in low.y as isize..=high.y as isize {
            for x in low.x as isize..=high.x as isize {
                let step = Pixel::new(x as f64, y as f64) - centre;
                // Half the Mahalanobis distance is 1 on the edge.
                let share = (step.transpose() * inverse * step)[0].sqrt() / 2.0;
                let outside = step.norm() * (1.0 - 1.0 / share.max(1e-9));
                let outside = if share < 1e-6 { -half(covariance[(0, 0)]) } else { outside };
                if outside < beyond {
                    pixels.push((step, outside, f64::from(image.at(x, y))));
                }
            }
        }
        Some(Self { pixels })
    }

    /// Plane through the values of the pixels at these distances outside the edge.
    fn plane(&self, from: f64, to: f64, keep: impl Fn(Vector2<f64>, f64) -> bool) -> Option<Plane> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let mut count = 0;
        for (step, outside, value) in &self.pixels {
            if *outside < from || *outside >= to || !keep(*step, *value) {
                continue;
            }
            let terms = Vector3::new(1.0, step.x, step.y);
            normal.ger(1.0, &terms, &terms, 1.0);
            right += terms * *value;
            count += 1;
        }
        // Four times the unknowns, so that noise does not tilt it.
        (count >= 12).then(|| normal.cholesky().map(|it| it.solve(&right))).flatten()
    }

    fn sums(&self, margin: f64) -> Option<Sums> {
        let ground = self.plane(margin, f64::INFINITY, |_, _| true)?;
        let inner = self.plane(f64::NEG_INFINITY, -MARGIN, |_, _| true);
        let level = inner.map_or_else(|| self.deepest(&ground), |plane| plane[0]);
        // Other things on the ground, and what lies beyond the board's edge, are not ground.
        let far = 0.25 * (ground[0] - level).abs();
        let ground = self
            .plane(margin, f64::INFINITY, |step, value| (value - on(&ground, step)).abs() < far)
            .unwrap_or(ground);
        // A dot too small to show its own level is as deep everywhere, as far as can be told.
        let depth = |step: Vector2<f64>| {
            let gap = |plane: &Plane| on(&ground, step) - on(plane, step);
            inner.as_ref().map_or(ground[0] - level, gap)
        };
        let (mut sum, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        let (mut lever, mut tilt) = (0.0, 0.0);
        for (step, _, value) in self.pixels.iter().filter(|pixel| pixel.1 < margin) {
            let deep = depth(*step);
            let ink = (on(&ground, *step) - value) / deep;
            lever += step.norm_squared() / (2.0 * deep * deep);
            tilt += step.norm_squared() / (2.0 * deep);
            sum += ink;
            first += ink * step;
            second += ink * step * step.transpose();
        }
        let step = first / sum;
        let covariance = second / sum - step * step.transpose();
        (sum > 0.0 && step.norm().is_finite()).then_some(Sums {
            step,
            covariance,
            area: inner.map(|_| sum),
            sigma: self.noise(&ground, (margin, far)) * self.leverage(margin, lever, tilt) / sum,
            depth: ground[0] - level,
        })
    }

    /// Standard deviation of the ground's pixels about their plane, in grey levels.
    fn noise(&self, ground: &Plane, (margin, far): (f64, f64)) -> f64 {
        let off: Vec<f64> = self
            .pixels
            .iter()
            .filter(|pixel| pixel.1 >= margin)
            .map(|(step, _, value)| (value - on(ground, *step)).abs())
            .filter(|off| *off < far)
            .collect();
        // The median deviation of normal noise is 0.6745 standard deviations.
        (median(&off) / 0.6745).max(ROUNDING)
    }

    /// How much a grey level's noise moves the light's first moment: that of the dot's own pixels, and that
    /// of the ring, which tilts the ground.
    fn leverage(&self, margin: f64, lever: f64, tilt: f64) -> f64 {
        let ring = self.pixels.iter().filter(|pixel| pixel.1 >= margin);
        let spread: f64 = ring.map(|pixel| pixel.0.norm_squared() / 2.0).sum();
        (lever + tilt * tilt / spread.max(1.0)).sqrt()
    }

    /// The level of a dot that is all edge: its value nearest to the centre.
    fn deepest(&self, ground: &Plane) -> f64 {
        let nearest = self.pixels.iter().min_by(|a, b| a.0.norm().total_cmp(&b.0.norm()));
        nearest.map_or(ground[0], |pixel| pixel.2)
    }
}

/// Where the dots' centres are seen, by their labels, which count steps of the chart.
///
/// The picture of a disc is an ellipse whose centre is not the picture of the disc's (Heikkilä 2000,
/// doi:10.1109/34.879788). How far apart they are follows from the homography of the dots around, and
/// the dot's own size; done twice, since the first homography has gone through displaced centres.
pub(in crate::chart) fn placed(dots: &BTreeMap<(i32, i32), Dot>) -> BTreeMap<(i32, i32), Placed> {
    let mut centres: BTreeMap<(i32, i32), Placed> = dots
        .iter()
        .map(|(label, dot)| (*label, Placed { centre: dot.centroid, radius_squared: 0.0 }))
        .collect();
    for _ in 0..2 {
        let moved = dots.iter().filter_map(|(label, dot)| {
            let homography = around(&centres, *label)?;
            Some((*label, undisplaced(dot, &homography)?))
        });
        let moved: Vec<_> = moved.collect();
        centres.extend(moved);
    }
    centres
}

/// From steps about a label to the picture, by the dots up to two steps away.
fn around(centres: &BTreeMap<(i32, i32), Placed>, (column, row): (i32, i32)) -> Option<Homography> {
    let near = (-2..=2).flat_map(|c| (-2..=2).map(move |r| (c, r)));
    let pairs: Vec<(Pixel, Pixel)> = near
        .filter_map(|(c, r)| {
            let placed = centres.get(&(column + c, row + r))?;
            Some((Pixel::new(f64::from(c), f64::from(r)), placed.centre))
        })
        .collect();
    Homography::fit(&pairs)
}

fn undisplaced(dot: &Dot, Homography(map): &Homography) -> Option<Placed> {
    let scale = map[(2, 2)];
    let centre = Pixel::new(map[(0, 2)] / scale, map[(1, 2)] / scale);
    // How much the map enlarges areas at the dot.
    let enlarged = (map.determinant() / (scale * scale * scale)).abs();
    let radius_squared = dot.area / (std::f64::consts::PI * enlarged);
    // The dual of the circle about the origin, and that of its picture, whose last column is the
    // ellipse's centre.
    let circle = Matrix3::from_diagonal(&Vector3::new(radius_squared, radius_squared, -1.0));
    let ellipse = map * circle * map.transpose();
    let seen = Pixel::new(ellipse[(0, 2)] / ellipse[(2, 2)], ellipse[(1, 2)] / ellipse[(2, 2)]);
    let displacement = seen - centre;
    // More than half a radius is no displacement but a homography gone wrong.
    (displacement.norm_squared() * 12.0 < dot.area)
        .then_some(Placed { centre: dot.centroid - displacement, radius_squared })
}
