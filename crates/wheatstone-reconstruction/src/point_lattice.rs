//! Where a model places what one pair matches, on a lattice in its rectified picture and in disparity.
//!
//! To ask the map about every pixel costs more than to match it, and maps are smooth. So the map is asked at nodes, and
//! its answers are interpolated, cubic in all three directions: as deviations from what ideal cameras would say, in
//! pixels, which change slowly where places in the world do not.

use crate::{
    matches::Matches,
    pair::RectifiedPair,
    points::{Point, PointEstimator},
    seen::PairPoint,
};
use nalgebra::{Matrix3, Matrix4, Vector3};
use std::ops::Range;
use wheatstone_core::geometry::Point3;
use wheatstone_numeric::random::Random;

/// Of each node: deviations of x, y and disparity from its own, in pixels, and the lower triangle of their covariance.
const VALUES: usize = 9;

/// Pieces of the lattice along the longer side of the picture, and along disparity: as measured on VGA scenes through
/// four optics, where these leave error bars within three percent (99 of 100), and 20 pieces up to seven.
const PIECES: f64 = 30.0;
const DISPARITY_PIECES: f64 = 7.0;

/// How many times as many pieces are tried, one after the other: large pictures and wavy optics need more.
const FINER: [f64; 2] = [1.0, 2.0];

/// Places at which a lattice is held beside the map, and how many of them may be off by more than [`TOLERANCE`].
const PROBES: usize = 400;
const MOST_OFF: usize = PROBES / 20;

/// By how much deviations and their standard deviations may be off, in pixels: a fifth of what the best matches are.
const TOLERANCE: f64 = 0.01;

/// Nodes that one axis takes part with in a value.
const TAPS: usize = 4;

/// Rows and columns of a covariance's lower triangle.
const LOWER: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

/// The map's places of matches with one pair's pixels and disparities.
pub(crate) struct PointLattice {
    /// Along x, y and disparity.
    axes: [Axis; 3],
    /// [y][x][disparity]; NaN for nodes that the map places nowhere.
    nodes: Vec<[f64; VALUES]>,
    /// From x, y and disparity of an ideal pair to the world.
    world_from_pair: ProjectiveMap,
}

impl PointLattice {
    /// Of a pair of cameras, as fine as it has to be to agree with the map between its nodes; `None` where no lattice does.
    pub(crate) fn new(pair: &RectifiedPair<'_>, estimator: &PointEstimator<'_>) -> Option<Self> {
        let [width, height] = pair.rectification.pair.size.map(|side| f64::from(side - 1));
        let [far, near] = pair.finite_disparities();
        let ends = [[0.0, width], [0.0, height], [far, near]];
        let mut random = Random::new(0);
        let probe = |_| Vector3::from(ends.map(|[first, last]| random.uniform(first, last)));
        let probes: Vec<_> = (0..PROBES).map(probe).collect();
        let world_from_pair = pair.world_from_pair();
        let pair_from_world = ProjectiveMap(world_from_pair.try_inverse()?);
        let map = NodeMap { pair, estimator, pair_from_world };
        let truth = map.nodes(&probes);
        FINER.into_iter().find_map(|finer| {
            let step = width.max(height) / (PIECES * finer);
            let depth_step = (near - far) / (DISPARITY_PIECES * finer);
            let [across, down, deep] = ends;
            let axes =
                [Axis::new(across, step), Axis::new(down, step), Axis::new(deep, depth_step)];
            let nodes = map.nodes(&places(&axes));
            let lattice = Self { axes, nodes, world_from_pair: ProjectiveMap(world_from_pair) };
            lattice.agrees(&probes, &truth).then_some(lattice)
        })
    }

    /// Whether it says what the map says of most places; those that either places nowhere do not count.
    fn agrees(&self, probes: &[Vector3<f64>], truth: &[[f64; VALUES]]) -> bool {
        let is_off = |(at, truth): &(&Vector3<f64>, &[f64; VALUES])| {
            let (found, _) = self.about((at.x, at.y)).values(at.x, at.z);
            let [found, truth] = [found, **truth].map(|of| in_pixels(&of));
            found.iter().zip(truth).any(|(found, truth)| (found - truth).abs() > TOLERANCE)
        };
        probes.iter().zip(truth).filter(is_off).count() <= MOST_OFF
    }

    /// What a match with the pixel at x and y of the pair's reference picture means; `None` where the map places nodes
    /// about it nowhere.
    pub(crate) fn at(&self, (x, y): (f64, f64), disparity: f64) -> Option<PairPoint> {
        self.about((x, y)).at(x, disparity)
    }

    /// The nodes that take part with the values at a pixel.
    fn about(&self, (x, y): (f64, f64)) -> LatticeRow<'_> {
        let first = self.axes[0].taps(x).first;
        self.columns_of_row(y, first..first + TAPS)
    }

    /// The lattice of one row of pixels: quicker for many of them.
    pub(crate) fn row(&self, y: f64) -> LatticeRow<'_> {
        self.columns_of_row(y, 0..self.axes[0].nodes)
    }

    fn columns_of_row(&self, y: f64, columns: Range<usize>) -> LatticeRow<'_> {
        let [all_columns, _, depths] = self.axes.map(|axis| axis.nodes);
        let down = self.axes[1].taps(y);
        let mut nodes = vec![[0.0; VALUES]; columns.len() * depths];
        for (row, weight) in down.weights.iter().enumerate() {
            let start = (down.first + row) * all_columns + columns.start;
            for (sums, node) in nodes.iter_mut().zip(&self.nodes[start * depths..]) {
                for (sum, value) in sums.iter_mut().zip(node) {
                    *sum += weight * value;
                }
            }
        }
        LatticeRow { lattice: self, y, first_column: columns.start, nodes }
    }
}

/// A lattice between its rows of nodes.
pub(crate) struct LatticeRow<'a> {
    lattice: &'a PointLattice,
    y: f64,
    first_column: usize,
    /// [column][disparity]
    nodes: Vec<[f64; VALUES]>,
}

impl LatticeRow<'_> {
    /// As [`PointLattice::at`].
    pub(crate) fn at(&self, x: f64, disparity: f64) -> Option<PairPoint> {
        let (values, slope) = self.values(x, disparity);
        let world_from_pair = &self.lattice.world_from_pair;
        let [dx, dy, dd, lower @ ..] = values;
        let found = Point3::new(x + dx, self.y + dy, disparity + dd);
        let mut covariance = Matrix3::zeros();
        for (value, (row, column)) in lower.into_iter().zip(LOWER) {
            (covariance[(row, column)], covariance[(column, row)]) = (value, value);
        }
        let place = world_from_pair.apply(found)?;
        let slopes = world_from_pair.slopes(found);
        let mut calibration = slopes * covariance * slopes.transpose();
        // Cubics may swing below zero.
        for axis in 0..3 {
            calibration[(axis, axis)] = calibration[(axis, axis)].max(0.0);
        }
        Some(PairPoint { place, slope: slopes * slope, calibration })
    }

    /// What a node there would have, and by how much the point moves in the pair's space with disparity.
    fn values(&self, x: f64, disparity: f64) -> ([f64; VALUES], Vector3<f64>) {
        let [across, _, depths] = self.lattice.axes;
        let (along, deep) = (across.taps(x), depths.taps(disparity));
        let (mut values, mut slope) = ([0.0; VALUES], Vector3::z());
        for (column, part) in along.weights.iter().enumerate() {
            let column = along.first - self.first_column + column;
            let nodes = &self.nodes[column * depths.nodes + deep.first..][..TAPS];
            for ((node, weight), by) in nodes.iter().zip(deep.weights).zip(deep.slopes) {
                for (value, of_node) in values.iter_mut().zip(node) {
                    *value += part * weight * of_node;
                }
                for (slope, of_node) in slope.iter_mut().zip(node) {
                    *slope += part * by * of_node;
                }
            }
        }
        (values, slope)
    }
}

/// The deviations of a node, and their standard deviations.
fn in_pixels([x, y, disparity, xx, _, yy, _, _, dd]: &[f64; VALUES]) -> [f64; 6] {
    let [sigma_x, sigma_y, sigma] = [xx, yy, dd].map(|variance| variance.max(0.0).sqrt());
    [*x, *y, *disparity, sigma_x, sigma_y, sigma]
}

/// x, y and disparity of all nodes, in their order.
fn places(axes: &[Axis; 3]) -> Vec<Vector3<f64>> {
    let [columns, rows, depths] = axes.map(|axis| axis.nodes);
    let place = |index: usize| {
        let of = [index / depths % columns, index / depths / columns, index % depths];
        Vector3::from_fn(|axis, _| axes[axis].node(of[axis]))
    };
    (0..columns * rows * depths).map(place).collect()
}

/// What nodes have.
struct NodeMap<'m, 'a> {
    pair: &'m RectifiedPair<'a>,
    estimator: &'m PointEstimator<'a>,
    pair_from_world: ProjectiveMap,
}

impl NodeMap<'_, '_> {
    /// At places in the pair's space; NaN where the map has no point.
    fn nodes(&self, places: &[Vector3<f64>]) -> Vec<[f64; VALUES]> {
        let mut matches = Matches::new(self.pair.cameras.to_vec());
        let mut asked = Vec::new();
        for (index, at) in places.iter().enumerate() {
            if let Some((reference, other)) = self.pair.match_at(*at) {
                matches.push(reference, std::iter::once(Some(other)));
                asked.push(index);
            }
        }
        let mut nodes = vec![[f64::NAN; VALUES]; places.len()];
        for (index, point) in asked.into_iter().zip(self.estimator.locate(&matches)) {
            let found = point.and_then(|point| self.node(places[index], &point));
            nodes[index] = found.unwrap_or([f64::NAN; VALUES]);
        }
        nodes
    }

    /// Of a point, at a place.
    fn node(&self, at: Vector3<f64>, point: &Point) -> Option<[f64; VALUES]> {
        let off = self.pair_from_world.apply(point.place)?.coords - at;
        let slopes = self.pair_from_world.slopes(point.place);
        let covariance = slopes * point.covariance * slopes.transpose();
        let mut values = [0.0; VALUES];
        let (deviations, lower) = values.split_at_mut(3);
        deviations.copy_from_slice(off.as_slice());
        for (value, place) in lower.iter_mut().zip(LOWER) {
            *value = covariance[place];
        }
        Some(values)
    }
}

/// Nodes along one axis.
#[derive(Clone, Copy)]
struct Axis {
    first: f64,
    step: f64,
    nodes: usize,
}

/// Which nodes take part in a value, and with what weights.
struct Taps {
    first: usize,
    weights: [f64; TAPS],
    /// Derivatives of the weights.
    slopes: [f64; TAPS],
}

impl Axis {
    /// From end to end, with at most `step` between nodes.
    fn new([first, last]: [f64; 2], step: f64) -> Self {
        let pieces = ((last - first) / step).ceil().max((TAPS - 1) as f64);
        Self { first, step: (last - first) / pieces, nodes: pieces as usize + 1 }
    }

    fn node(&self, index: usize) -> f64 {
        self.first + index as f64 * self.step
    }

    /// Lagrange's polynomial through four nodes, two on either side but at the ends.
    fn taps(&self, at: f64) -> Taps {
        let at = (at - self.first) / self.step;
        let first = (at.floor() - 1.0).clamp(0.0, (self.nodes - TAPS) as f64);
        let at = at - first;
        let [a, b, c, d] = [at, at - 1.0, at - 2.0, at - 3.0];
        let weights = [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0];
        let pairs = |a: f64, b: f64, c: f64| a * b + b * c + a * c;
        let slopes = [
            -pairs(b, c, d) / 6.0,
            pairs(a, c, d) / 2.0,
            -pairs(a, b, d) / 2.0,
            pairs(a, b, c) / 6.0,
        ];
        let slopes = slopes.map(|slope| slope / self.step);
        Taps { first: first as usize, weights, slopes }
    }
}

/// A map of space that keeps lines straight, on homogeneous coordinates.
struct ProjectiveMap(Matrix4<f64>);

impl ProjectiveMap {
    /// `None` of a point that comes to lie at infinity or behind it.
    fn apply(&self, point: Point3) -> Option<Point3> {
        let h = self.0 * point.to_homogeneous();
        (h.w > 0.0).then(|| Point3::from(h.xyz() / h.w))
    }

    /// The derivatives of what a point becomes by the point.
    fn slopes(&self, point: Point3) -> Matrix3<f64> {
        let h = self.0 * point.to_homogeneous();
        let (linear, last) = (self.0.fixed_view::<3, 3>(0, 0), self.0.fixed_view::<1, 3>(3, 0));
        (linear - h.xyz() / h.w * last) / h.w
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReconstructionSettings;
    use wheatstone_charts::chart::line_grid::LineGrid;
    use wheatstone_core::{Calibration, method::AnyMethod, preparation::Prepared};
    use wheatstone_numeric::{progress::Silent, statistics::percentile};
    use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences};

    const SIZES: [[u32; 2]; 2] = [[640, 480]; 2];
    /// Of disparities, in pixels.
    const SIGMA: f64 = 0.1;

    fn fitted(rig: &str, method: &str) -> Calibration {
        let rig = Rig::named(rig, 2).unwrap();
        let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
        let views = Stage::default().views().unwrap();
        let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 0), None);
        let method = AnyMethod::named(method).unwrap();
        Calibration::fit(&method, &Prepared::as_given(data), 0, false, &Silent).unwrap()
    }

    /// Places in a pair's reference picture with disparities, and what the pair matches there.
    fn random_matches(pair: &RectifiedPair<'_>, count: usize) -> (Vec<Vector3<f64>>, Matches) {
        let mut random = Random::new(1);
        let [width, height] = pair.rectification.pair.size.map(|side| f64::from(side - 1));
        let [far, near] = pair.finite_disparities();
        let mut matches = Matches::new(pair.cameras.to_vec());
        let mut places = Vec::new();
        while places.len() < count {
            let of = [(0.0, width), (0.0, height), (far, near)];
            let [x, y, disparity] = of.map(|(first, last)| random.uniform(first, last));
            let Some(reference) = pair.reference((x, y)) else { continue };
            let Some(other) = pair.matched((x, y), (disparity, SIGMA)) else { continue };
            matches.push(reference, std::iter::once(Some(other)));
            places.push(Vector3::new(x, y, disparity));
        }
        (places, matches)
    }

    #[test]
    fn a_lattice_is_the_map_between_its_nodes_and_mirrored_too() {
        // Far beyond the charts, too: to 4 pixels of parallax.
        let far = Some([45.0, 1000.0]);
        for (rig, method, reference, depths) in [
            ("paper", "brown", None, None),
            ("paper", "brown", Some(1), far),
            ("fisheye", "kannala-brandt", None, None),
            ("water", "neural-camera", None, far),
            ("water", "neural-camera", Some(1), None),
            ("bump", "neural-camera", None, None),
            ("paper", "network", None, None),
            ("paper", "network", None, far),
        ] {
            let model = fitted(rig, method);
            let settings = ReconstructionSettings { depths, ..ReconstructionSettings::new(SIZES) };
            let pair = RectifiedPair::new(&model, [0, 1], reference, &settings, &Silent).unwrap();
            let estimator = PointEstimator::new(&model, &Matches::new(pair.cameras.to_vec()));
            let lattice = PointLattice::new(&pair, &estimator).unwrap();
            let (places, matches) = random_matches(&pair, 1000);
            let (mut off, mut ratios) = (Vec::new(), Vec::new());
            for (at, point) in places.iter().zip(estimator.locate(&matches)) {
                let Some(point) = point else { continue };
                let found = lattice.at((at.x, at.y), at.z).unwrap();
                let match_covariance = found.slope * found.slope.transpose() * SIGMA * SIGMA;
                let covariance = found.calibration + match_covariance;
                for axis in 0..3 {
                    let sigma = point.covariance[(axis, axis)].sqrt();
                    off.push((found.place[axis] - point.place[axis]).abs() / sigma);
                    ratios.push((covariance[(axis, axis)].sqrt() / sigma - 1.0).abs());
                }
            }
            assert!(off.len() > 2900, "{rig} {method}: {}", off.len());
            let of = |values: &[f64]| [0.5, 0.99].map(|share| percentile(values, share));
            let ([usual, most], [_, widest]) = (of(&off), of(&ratios));
            assert!(usual < 0.002 && most < 0.08, "{rig} {method}: {usual} {most}");
            assert!(widest < 0.03, "{rig} {method}: {widest}");
        }
    }
}
