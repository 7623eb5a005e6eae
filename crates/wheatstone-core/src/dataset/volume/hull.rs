//! The convex hull of points in space, as half-spaces.

use crate::geometry::Vector3;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::number::Number;

/// Half-spaces whose intersection is the convex hull of some points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Hull {
    /// Unit normal outwards, how far along it the points reach, and from how far.
    pub(super) facets: Vec<[f64; 5]>,
}

/// Directions in which corners of the hull are looked for: about 14 degrees apart, so that a sphere's
/// hull falls short of it by 0.7 %.
const DIRECTIONS: usize = 200;

/// In units of the points' spread: above rounding, below what any chart is made to.
const SAME: f64 = 1e-9;

/// Directions spread evenly over the sphere, on a Fibonacci spiral (Gonzalez 2010,
/// doi:10.1007/s11004-009-9257-x).
fn directions() -> impl Iterator<Item = Vector3> {
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..DIRECTIONS).map(move |index| {
        let height = 1.0 - (2 * index + 1) as f64 / DIRECTIONS as f64;
        let radius = (1.0 - height * height).sqrt();
        let angle = turn * index as f64;
        Vector3::new(radius * libm::cos(angle), radius * libm::sin(angle), height)
    })
}

impl Hull {
    /// The hull of points relative to somewhere among them; `None` where they lie on a plane.
    pub(super) fn of(points: &[Vector3]) -> Option<Self> {
        let count = points.len() as f64;
        let centre = points.iter().sum::<Vector3>() / count;
        let scatter = points
            .iter()
            .map(|p| (p - centre) * (p - centre).transpose() / count)
            .sum::<Matrix3<f64>>();
        // In these coordinates the points spread equally in all directions.
        let whitening = scatter.cholesky()?.l().try_inverse()?;
        let white: Vec<Vector3> = points.iter().map(|p| whitening * (p - centre)).collect();
        let corners = corners(&white);
        let facets: Vec<[f64; 5]> = normals(&corners)
            .into_iter()
            .map(|normal| {
                let normal = (whitening.transpose() * normal).normalize();
                let reach = points.iter().map(|p| normal.dot(p));
                let (low, high) = reach
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(r), h.max(r)));
                [normal.x, normal.y, normal.z, high, low]
            })
            .collect();
        // A body has at least four faces.
        let hull = Self { facets };
        (hull.facets.len() >= 4 && hull.is_consistent()).then_some(hull)
    }

    /// By how much a point lies beyond the hull, as a share of the hull's width in the direction in
    /// which that is most; negative inside.
    pub(super) fn beyond(&self, point: &Vector3) -> f64 {
        self.planes().beyond((*point).into())
    }

    /// The hull made ready for many points.
    pub(super) fn planes(&self) -> Planes {
        let plane =
            |[a, b, c, high, low]: &[f64; 5]| [*a, *b, *c, -high].map(|value| value / (high - low));
        Planes(self.facets.iter().map(plane).collect())
    }

    pub(super) fn is_consistent(&self) -> bool {
        self.facets.iter().all(|f| f.iter().all(|v| v.is_finite()) && f[3] > f[4])
    }
}

/// A hull's planes: so much by X, Y, Z and always is how far a point lies beyond one, as a share of the hull's width.
pub(super) struct Planes(Vec<[f64; 4]>);

impl Planes {
    /// [`Hull::beyond`].
    #[inline(always)]
    pub(super) fn beyond<N: Number>(&self, [x, y, z]: [N; 3]) -> N {
        let mut most = x.all(f64::NEG_INFINITY);
        for [by_x, by_y, by_z, always] in &self.0 {
            let off = x.all(*always).add_product(x.all(*by_x), x).add_product(x.all(*by_y), y);
            most = off.add_product(x.all(*by_z), z).max_with(most);
        }
        most
    }
}

/// The points that lie furthest in some direction, each once.
fn corners(points: &[Vector3]) -> Vec<Vector3> {
    let furthest = |direction: Vector3| {
        let reach = |index: &usize| direction.dot(&points[*index]);
        (0..points.len()).max_by(|a, b| reach(a).total_cmp(&reach(b)).then(b.cmp(a)))
    };
    let mut found: Vec<usize> = directions().filter_map(furthest).collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|index| points[index]).collect()
}

/// Outward normals of the corners' hull, by trying every plane through three of them: there are at
/// most 200, and nearly all planes are refused at the first corners on both sides.
fn normals(corners: &[Vector3]) -> Vec<Vector3> {
    let mut normals: Vec<Vector3> = Vec::new();
    for (i, a) in corners.iter().enumerate() {
        for (j, b) in corners.iter().enumerate().skip(i + 1) {
            for c in &corners[j + 1..] {
                let across = (b - a).cross(&(c - a));
                let length = across.norm();
                // Three corners in a line, as many are along a chart's edge.
                if length < SAME.sqrt() * (b - a).norm() * (c - a).norm() {
                    continue;
                }
                let Some(normal) = outward(across / length, a, corners) else { continue };
                if normals.iter().all(|other| (other - normal).norm_squared() > SAME) {
                    normals.push(normal);
                }
            }
        }
    }
    normals
}

/// The normal of a plane through `on` with its sign such that no corner lies beyond; `None` where
/// corners lie on both sides.
fn outward(normal: Vector3, on: &Vector3, corners: &[Vector3]) -> Option<Vector3> {
    let (mut before, mut behind) = (false, false);
    for corner in corners {
        let height = normal.dot(&(corner - on));
        before |= height > SAME;
        behind |= height < -SAME;
        if before && behind {
            return None;
        }
    }
    Some(if before { -normal } else { normal })
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    #[test]
    fn hulls_of_known_bodies() {
        // A grid: its faces hold many points, its edges too.
        let at = |i: usize| [i % 5, i / 5 % 4, i / 20].map(|k| k as f64);
        let grid: Vec<Vector3> = (0..60).map(|i| Vector3::from(at(i))).collect();
        let hull = Hull::of(&grid).unwrap();
        assert_eq!(hull.facets.len(), 6, "{hull:?}");
        assert!((hull.beyond(&Vector3::new(2.0, 1.0, 2.2)) - 0.1).abs() < 1e-12);
        assert!((hull.beyond(&Vector3::new(-0.4, 1.0, 1.0)) - 0.1).abs() < 1e-12);
        assert!(hull.beyond(&Vector3::new(2.0, 1.5, 1.0)) < -0.4);
        let mut random = Random::new(3);
        let ball: Vec<Vector3> = (0..2000)
            .map(|_| Vector3::new(random.normal(), random.normal(), random.normal()).normalize())
            .collect();
        let hull = Hull::of(&ball).unwrap();
        for p in &ball {
            assert!(hull.beyond(p) < 1e-12 && hull.beyond(&(p * 0.95)) < 0.0);
            assert!(hull.beyond(&(p * 1.05)) > 0.01);
        }
        assert!(Hull::of(&grid[..20]).is_none(), "a plane has no inside");
    }
}
