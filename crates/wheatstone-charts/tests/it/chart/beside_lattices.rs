//! Charts beside lattices that are no charts, in pictures whose truth is known.

use wheatstone_charts::{
    chart::{Chart, ChartSearch, charuco::Charuco, dot_grid::DotGrid},
    imaging::{GrayImage, filter},
};
use wheatstone_core::geometry::{Homography, Pixel};
use wheatstone_numeric::random::Random;

/// Equal rectangles in rows, as of a keyboard or a tiled wall.
#[derive(Clone, Copy, Debug)]
struct Tiles {
    columns: usize,
    rows: usize,
    /// In pixels, from one to the next.
    period: usize,
    /// In pixels, between two.
    gap: usize,
    /// Light that a tile returns, and what is between tiles.
    light: [f64; 2],
}

/// Left and top edges of the tiles in pixels.
const BESIDE: [usize; 2] = [12, 400];

impl Tiles {
    /// The light at a pixel; `None` beside the tiles.
    fn light(&self, x: usize, y: usize) -> Option<f64> {
        let (x, y) = (x.checked_sub(BESIDE[0])?, y.checked_sub(BESIDE[1])?);
        let inside = x < self.columns * self.period && y < self.rows * self.period;
        let in_gap = [x, y].iter().any(|at| at % self.period >= self.period - self.gap);
        inside.then_some(self.light[usize::from(in_gap)])
    }
}

/// The corners of the board in the picture, from the top left clockwise.
const SLANTED: [[f64; 2]; 4] = [[203.0, 42.5], [520.5, 71.0], [488.0, 371.0], [180.5, 340.0]];

/// From the chart to the picture.
fn view(chart: &dyn Chart) -> Homography {
    let [left, top, right, bottom] = chart.board();
    let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
    let pairs = [0, 1, 2, 3].map(|corner| (corners[corner].into(), SLANTED[corner].into()));
    Homography::fit(&pairs).unwrap()
}

/// Blurred by 0.7 pixels, with noise of 2 of 255, in whole grey values.
fn render(chart: &dyn Chart, tiles: Tiles) -> GrayImage {
    const SUB: usize = 6;
    let back = Homography(view(chart).0.try_inverse().unwrap());
    let light = |x: usize, y: usize| {
        let mut sum = 0.0;
        for part in 0..SUB * SUB {
            let offset = |part: usize| (part as f64 + 0.5) / SUB as f64 - 0.5;
            let (dx, dy) = (offset(part % SUB), offset(part / SUB));
            let place = back.map(Pixel::new(x as f64 + dx, y as f64 + dy)).unwrap();
            let printed = chart.reflectance([place.x, place.y], [0.0, 0.0]);
            sum += printed.or_else(|| tiles.light(x, y)).unwrap_or(0.45);
        }
        (30.0 + 190.0 * sum / (SUB * SUB) as f64) as f32
    };
    let blurred = filter::gaussian_blur(&GrayImage::from_fn(640, 480, light), 0.7);
    let mut random = Random::new(1);
    let values = blurred.values().iter().map(|v| (v + 2.0 * random.normal() as f32).round());
    GrayImage::from_values(640, 480, values.collect()).unwrap()
}

/// Asserts that the chart is found whole, where it is.
fn assert_found_beside(chart: &dyn Chart, tiles: Tiles) {
    let found = match chart.detect(&render(chart, tiles)) {
        ChartSearch::Found(readings) => readings[0].points.clone(),
        ChartSearch::NotFound(why) => panic!("{tiles:?}: {why}"),
    };
    let (view, points) = (view(chart), chart.points());
    assert_eq!(found.len(), points.len(), "{tiles:?}");
    let off = |(id, at): &(usize, Pixel)| (view.map(points[*id].xy()).unwrap() - at).norm();
    let most = found.iter().map(off).fold(0.0, f64::max);
    assert!(most < 0.2, "{tiles:?}: {most} px off");
}

const KEYS: Tiles = Tiles { columns: 12, rows: 5, period: 11, gap: 2, light: [0.1, 0.45] };

#[test]
fn a_charuco_board_is_found_beside_lattices_of_other_directions() {
    let chart = Charuco::default();
    assert_found_beside(&chart, KEYS);
    assert_found_beside(&chart, Tiles { light: [0.8, 0.2], ..KEYS });
    assert_found_beside(&chart, Tiles { columns: 20, rows: 6, ..KEYS });
    assert_found_beside(&chart, Tiles { period: 16, gap: 5, rows: 4, light: [0.1, 0.8], ..KEYS });
}

#[test]
fn a_grid_of_dots_is_found_beside_lattices_of_more() {
    let asymmetric = DotGrid { columns: 4, rows: 11, asymmetric: true, ..DotGrid::default() };
    let symmetric = DotGrid { columns: 8, rows: 6, ..DotGrid::default() };
    for chart in [asymmetric, symmetric] {
        assert_found_beside(&chart, KEYS);
        assert_found_beside(&chart, Tiles { columns: 20, rows: 6, ..KEYS });
        assert_found_beside(
            &chart,
            Tiles { period: 16, gap: 5, light: [0.1, 0.8], rows: 4, ..KEYS },
        );
    }
}
