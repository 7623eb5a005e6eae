//! Which way the floor's edges run: a compass wherever they cross at right angles, as tiles', boards' and
//! rooms' do (the Manhattan world of Coughlan & Yuille 1999, doi:10.1109/ICCV.1999.790349).

use super::LocatedEdge;
use crate::Ground;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::FRAC_PI_2;

/// Which way the floor's edges run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorDirection {
    /// From straight ahead to the right, modulo a quarter turn, in radians.
    pub bearing: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// A straight edge on the floor.
struct Line {
    bearing: f64,
    /// Sum of squared distances of its points from their middle: what its direction weighs.
    weight: f64,
}

/// Nearer than this to the common direction an edge counts for it, in radians: three degrees.
const AGREE: f64 = 0.05;

/// What agrees is at least this share of all by weight, and so many edges.
const LEAST_SHARE: f64 = 0.6;
const LEAST_LINES: usize = 5;

/// Lenses and mounts bend the floor by so much though all edges agree, in radians: a third of a degree.
const LEAST_SIGMA: f64 = 0.005;

/// An angle as one between minus and plus an eighth of a turn, whole quarter turns away from it.
#[must_use]
pub(crate) fn quarter(angle: f64) -> f64 {
    libm::remainder(angle, FRAC_PI_2)
}

/// Of these edges; `None` where they have no common direction, or too few are of the floor.
#[must_use]
pub(super) fn floor_direction(edges: &[LocatedEdge]) -> Option<FloorDirection> {
    let lines = lines(edges);
    let total: f64 = lines.iter().map(|line| line.weight).sum();
    let agreeing = |bearing: f64| {
        lines.iter().filter(move |line| quarter(line.bearing - bearing).abs() < AGREE)
    };
    let weight = |bearing: f64| agreeing(bearing).map(|line| line.weight).sum::<f64>();
    let best = lines.iter().max_by(|a, b| weight(a.bearing).total_cmp(&weight(b.bearing)))?;
    let off = |line: &Line, bearing: f64| line.weight * quarter(line.bearing - bearing);
    let sum = weight(best.bearing);
    let shift = agreeing(best.bearing).map(|line| off(line, best.bearing)).sum::<f64>() / sum;
    let bearing = quarter(best.bearing + shift);
    if sum < LEAST_SHARE * total || agreeing(bearing).count() < LEAST_LINES {
        return None;
    }
    let squares: f64 = agreeing(bearing).map(|line| off(line, bearing).powi(2)).sum();
    Some(FloorDirection { bearing, sigma: libm::hypot(squares.sqrt() / sum, LEAST_SIGMA) })
}

/// The straight pieces of the floor's edges.
fn lines(edges: &[LocatedEdge]) -> Vec<Line> {
    let chains = edges.iter().map(|edge| edge.matched.edge.chain as usize + 1).max().unwrap_or(0);
    let mut places: Vec<Vec<Ground>> = vec![Vec::new(); chains];
    for edge in edges {
        places[edge.matched.edge.chain as usize].extend(edge.matched.floor);
    }
    places.iter().filter_map(|places| line(places)).collect()
}

fn line(places: &[Ground]) -> Option<Line> {
    // Fewer places, nearer together, tell no direction; so far off the floor is a few pixels high.
    const LEAST: usize = 6;
    const SHORTEST: f64 = 5.0;
    const FARTHEST: f64 = 220.0;
    // What is bent more than this is no tile's edge, as a share of its length.
    const BENT: f64 = 0.03;
    let near: Vec<&Ground> = places.iter().filter(|at| at.coords.norm() < FARTHEST).collect();
    if near.len() < LEAST {
        return None;
    }
    let count = near.len() as f64;
    let middle = near.iter().map(|at| at.coords).sum::<Vector2<f64>>() / count;
    let off = near.iter().map(|at| at.coords - middle);
    let scatter: Matrix2<f64> = off.map(|off| off * off.transpose()).sum();
    let axes = scatter.symmetric_eigen();
    let long = axes.eigenvalues.imax();
    let [along, across] = [long, 1 - long].map(|axis| axes.eigenvalues[axis].max(0.0));
    // Places evenly along a line have a twelfth of its squared length as their variance.
    let length = (12.0 * along / count).sqrt();
    let direction = axes.eigenvectors.column(long);
    let straight = (across / count).sqrt() < BENT * length;
    (length > SHORTEST && straight)
        .then(|| Line { bearing: libm::atan2(direction[0], direction[1]), weight: along })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeing::EdgeMatch;
    use wheatstone_core::geometry::Pixel;
    use wheatstone_reconstruction::features::Edge;

    /// Points along lines from `from` on, every centimetre, turned by `bearing`.
    fn edges(lines: &[([f64; 2], f64, usize)]) -> Vec<LocatedEdge> {
        let mut all = Vec::new();
        for (chain, (from, bearing, count)) in lines.iter().enumerate() {
            let by = Vector2::new(libm::sin(*bearing), libm::cos(*bearing));
            for step in 0..*count {
                let edge = Edge {
                    at: Pixel::origin(),
                    towards_light: Vector2::x(),
                    contrast: 1.0,
                    grey: 1.0,
                    chain: chain as u32,
                };
                let floor = Some(Ground::from(Vector2::from(*from) + by * step as f64));
                let matched = EdgeMatch { edge, other: None, crossing: 0.0, floor };
                all.push(LocatedEdge { matched, at: None });
            }
        }
        all
    }

    #[test]
    fn lines_that_cross_at_right_angles_tell_the_way_and_others_do_not_disturb() {
        for turn in [-0.7, -0.3, 0.0, 0.2, 0.78] {
            let crossing = [0.0, 1.0, 2.0, 3.0].map(|quarters| turn + quarters * FRAC_PI_2);
            let mut lines: Vec<([f64; 2], f64, usize)> =
                crossing.iter().map(|at| ([20.0, 80.0], *at, 20)).collect();
            lines.extend(crossing.iter().map(|at| ([-10.0, 60.0], *at, 15)));
            lines.push(([0.0, 100.0], turn + 0.5, 22));
            let found = floor_direction(&edges(&lines)).unwrap();
            assert!(quarter(found.bearing - turn).abs() < 1e-6, "{turn}: {found:?}");
            assert!(found.sigma < 2.0 * LEAST_SIGMA);
        }
    }

    #[test]
    fn lines_of_all_directions_and_few_tell_nothing() {
        let all: Vec<_> = (0..12).map(|line| ([0.0, 80.0], 0.131 * f64::from(line), 20)).collect();
        assert_eq!(floor_direction(&edges(&all)), None);
        assert_eq!(floor_direction(&edges(&[([0.0, 80.0], 0.1, 30); 4])), None);
        assert_eq!(floor_direction(&[]), None);
    }
}
