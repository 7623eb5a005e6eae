//! Edges: where plain faces meet, to a fraction of a pixel.

use super::gradient::Gradient;
use nalgebra::Vector2;
use wheatstone_core::geometry::Pixel;

/// A place on an edge.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Where, in pixels.
    pub at: Pixel,
    /// Unit vector from the dark to the light side.
    pub towards_light: Vector2<f64>,
    /// Logarithm of how much lighter the light side is.
    pub contrast: f32,
    /// Logarithm of the mean grey of both sides.
    pub grey: f32,
    /// Which connected smooth piece it belongs to.
    pub chain: u32,
}

impl Edge {
    /// Unit vector along it, the light side to the left of someone who goes that way over the picture.
    #[must_use]
    pub fn along(&self) -> Vector2<f64> {
        Vector2::new(-self.towards_light.y, self.towards_light.x)
    }
}

/// The edges of a picture.
pub struct Edges {
    /// In the order of rows.
    pub all: Vec<Edge>,
    /// Which one lies at each pixel, row by row.
    map: Vec<u32>,
    /// Whether one lies at each pixel or at one of its four neighbours.
    near: Vec<bool>,
    width: usize,
    height: usize,
}

/// No edge.
const NONE: u32 = u32::MAX;

/// The least steepness of an edge, in grey levels a pixel: six times what the sensor's noise makes after
/// smoothing, a third of what the tiles' edges have.
const LEAST: f32 = 2.2;

/// How far beside an edge its sides are looked at, in pixels: beyond the lens's blur.
const BESIDE: f64 = 3.0;

/// Pixels at the border that have no derivatives or sides.
const MARGIN: usize = 5;

impl Edges {
    /// Of a picture: where its gradient is steepest along itself.
    #[must_use]
    pub fn new(gradient: &Gradient) -> Self {
        let (width, height) = (gradient.width, gradient.height);
        let (map, near) = (vec![NONE; width * height], vec![false; width * height]);
        let mut edges = Self { all: Vec::new(), map, near, width, height };
        for y in MARGIN..height.saturating_sub(MARGIN) {
            for x in MARGIN..width.saturating_sub(MARGIN) {
                if gradient.square(y * width + x) < LEAST * LEAST {
                    continue;
                }
                if let Some(edge) = edge(gradient, x, y) {
                    let place = y * width + x;
                    edges.map[place] = edges.all.len() as u32;
                    for near in [place - width, place - 1, place, place + 1, place + width] {
                        edges.near[near] = true;
                    }
                    edges.all.push(edge);
                }
            }
        }
        edges.link();
        edges
    }

    /// The edge at a pixel.
    #[must_use]
    pub fn at(&self, x: isize, y: isize) -> Option<&Edge> {
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        let number = if inside { self.map[y as usize * self.width + x as usize] } else { NONE };
        self.all.get(number as usize)
    }

    /// Whether there is one at a pixel or at one of its four neighbours.
    #[must_use]
    pub fn is_near(&self, x: isize, y: isize) -> bool {
        // No edge is as close to the border as to be near a pixel beyond it.
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        inside && self.near[y as usize * self.width + x as usize]
    }

    /// Columns and rows of the picture.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Numbers the smooth pieces.
    fn link(&mut self) {
        // Neighbours on a straight edge differ by noise, those at a corner by much more.
        const ALIKE: f64 = 0.9;
        let mut chain = 0;
        for start in 0..self.all.len() {
            if self.all[start].chain != NONE {
                continue;
            }
            let mut open = vec![start];
            self.all[start].chain = chain;
            while let Some(number) = open.pop() {
                let Edge { at, towards_light, .. } = self.all[number];
                for (x, y) in about(at) {
                    let place = y as usize * self.width + x as usize;
                    let other = self.map[place.min(self.map.len() - 1)] as usize;
                    let Some(next) = self.all.get_mut(other) else { continue };
                    if next.chain == NONE && next.towards_light.dot(&towards_light) > ALIKE {
                        next.chain = chain;
                        open.push(other);
                    }
                }
            }
            chain += 1;
        }
    }
}

/// Columns and rows of the pixels about a place, two to each side; beyond the picture too.
pub fn about(at: Pixel) -> impl Iterator<Item = (isize, isize)> {
    let (x, y) = (at.x.round() as isize, at.y.round() as isize);
    (0..25).map(move |number| (x + number % 5 - 2, y + number / 5 - 2))
}

/// The edge at a pixel, if the gradient is steepest there.
fn edge(gradient: &Gradient, x: usize, y: usize) -> Option<Edge> {
    let width = gradient.width;
    let place = y * width + x;
    let (gx, gy) = (gradient.across[place], gradient.down[place]);
    let length = (gx * gx + gy * gy).sqrt();
    let steps_across = gx.abs() >= gy.abs();
    // One pixel along the larger part of the gradient, and as far along the other as it goes.
    let beside = |sign: isize| {
        let (major, minor) = if steps_across { (gx, gy) } else { (gy, gx) };
        let lean = (minor / major.abs()) * sign as f32;
        let along = sign * if major > 0.0 { 1 } else { -1 };
        let (toward, share) = (if lean > 0.0 { 1 } else { -1 }, lean.abs());
        let at = |dx: isize, dy: isize| {
            let place = (y as isize + dy) as usize * width + (x as isize + dx) as usize;
            gradient.square(place).sqrt()
        };
        let (straight, slanted) = if steps_across {
            (at(along, 0), at(along, toward))
        } else {
            (at(0, along), at(toward, along))
        };
        straight * (1.0 - share) + slanted * share
    };
    let (ahead, behind) = (beside(1), beside(-1));
    if ahead > length || behind >= length {
        return None;
    }
    let direction = Vector2::new(f64::from(gx / length), f64::from(gy / length));
    // The parabola's top, in steps as long as one along the larger part is.
    let step = f64::from(length / gx.abs().max(gy.abs()));
    let bend = f64::from(2.0 * length - ahead - behind);
    let off = if bend > 0.0 { 0.5 * f64::from(ahead - behind) / bend } else { 0.0 };
    let at = Pixel::new(x as f64, y as f64) + direction * (off * step);
    let light = gradient.smooth.sample(at + direction * BESIDE).max(1.0);
    let dark = gradient.smooth.sample(at - direction * BESIDE).max(1.0);
    Some(Edge {
        at,
        towards_light: direction,
        contrast: libm::logf(light / dark),
        grey: 0.5 * libm::logf(light * dark),
        chain: NONE,
    })
}
