//! Charts with names on them that were declared otherwise than they are.

use wheatstone_charts::{
    chart::{Chart, ChartSearch, april_grid::AprilGrid, charuco::Charuco, dot_grid::DotGrid},
    imaging::{GrayImage, filter},
};

/// The part of a chart right of and below `from` (as shares of its board), a little turned and bent, with so
/// many pixels a unit of its lengths.
fn picture(chart: &dyn Chart, from: [f64; 2], scale: f64) -> GrayImage {
    let [left, top, right, bottom] = chart.board();
    let (width, height) = (scale * (right - left), scale * (bottom - top));
    let light = |x: usize, y: usize| {
        let (x, y) = (x as f64 / width - 0.05, y as f64 / height - 0.05);
        // Squares of shares bend, products are perspective's.
        let across = x + 0.05 * y - 0.04 * x * x;
        let down = y - 0.06 * x + 0.05 * x * y;
        if across < from[0] || down < from[1] {
            return 110.0;
        }
        let place = [left + across * (right - left), top + down * (bottom - top)];
        let reach = 1.0 / scale;
        chart.reflectance(place, [reach, reach]).map_or(110.0, |it| (25.0 + 190.0 * it) as f32)
    };
    let sharp = GrayImage::from_fn((1.2 * width) as usize, (1.2 * height) as usize, light);
    filter::gaussian_blur(&sharp, 0.6)
}

fn points(chart: &dyn Chart, image: &GrayImage) -> usize {
    match chart.detect(image) {
        ChartSearch::Found(readings) => readings[0].points.len(),
        ChartSearch::NotFound(_) => 0,
    }
}

fn grid(columns: usize, rows: usize) -> AprilGrid {
    AprilGrid { columns, rows, ..AprilGrid::default() }
}

#[test]
fn an_april_grid_with_columns_and_rows_exchanged_is_refused_and_told() {
    let image = picture(&grid(5, 4), [0.0; 2], 3.0);
    assert_eq!(points(&grid(5, 4), &image), 80);
    assert_eq!(grid(5, 4).misdeclared(&image), None);
    let exchanged = grid(4, 5);
    assert_eq!(points(&exchanged, &image), 0);
    assert_eq!(exchanged.misdeclared(&image).unwrap(), "`columns = 5`, `rows = 4`");
    let wide = grid(7, 3);
    assert_eq!(wide.misdeclared(&image).unwrap(), "`columns = 5`, `rows = 4`");
    let later = AprilGrid { first: 40, ..grid(5, 4) };
    assert_eq!(later.misdeclared(&image).unwrap(), "`columns = 5`, `rows = 4`, `first = 0`");
}

#[test]
fn parts_of_a_rightly_declared_april_grid_are_not_refused() {
    for from in [[0.0, 0.5], [0.55, 0.0], [0.0, 0.72], [0.78, 0.0], [0.6, 0.5]] {
        let image = picture(&grid(5, 4), from, 3.0);
        assert!(points(&grid(5, 4), &image) >= 8, "{from:?}");
        assert_eq!(grid(5, 4).misdeclared(&image), None, "{from:?}");
        // More rows than there are do no harm.
        assert_eq!(grid(5, 6).misdeclared(&image), None, "{from:?}");
    }
}

#[test]
fn what_of_a_charuco_board_is_declared_wrongly_is_told() {
    let shown = Charuco::default();
    let image = picture(&shown, [0.0; 2], 3.0);
    assert_eq!(points(&shown, &image), 35);
    assert_eq!(shown.misdeclared(&image), None);
    let told = |declared: Charuco| {
        assert_eq!(points(&declared, &image), 0, "{declared:?}");
        declared.misdeclared(&image).unwrap()
    };
    let (columns, rows) = (shown.rows, shown.columns);
    assert_eq!(
        told(Charuco { columns, rows, ..shown.clone() }),
        "`columns = 8`, `rows = 6` (squares)"
    );
    assert_eq!(
        told(Charuco { columns: 9, ..shown.clone() }),
        "`columns = 8`, `rows = 6` (squares)"
    );
    let dictionary = "DICT_6X6_250".into();
    assert_eq!(told(Charuco { dictionary, ..shown.clone() }), "`dictionary = \"DICT_4X4_50\"`");
    let marker = told(Charuco { marker: 14.0, ..shown.clone() });
    let percent = marker.strip_prefix("a `marker` of about ").unwrap().split(' ').next().unwrap();
    assert!((percent.parse::<f64>().unwrap() - 73.3).abs() < 5.0, "{marker}");
    let dictionary = "DICT_5X5_100".into();
    assert_eq!(
        told(Charuco { columns, rows, dictionary, ..shown.clone() }),
        "`columns = 8`, `rows = 6` (squares), `dictionary = \"DICT_4X4_50\"`"
    );
}

#[test]
fn nothing_is_told_of_a_board_that_is_not_there() {
    let plain = GrayImage::from_fn(320, 240, |x, y| ((x / 20 + y / 20) % 2 * 180 + 30) as f32);
    assert_eq!(Charuco::default().misdeclared(&plain), None);
    assert_eq!(grid(5, 4).misdeclared(&plain), None);
}

#[test]
fn the_other_kind_of_a_grid_of_dots_and_other_counts_are_refused_and_told() {
    let symmetric = DotGrid { columns: 9, rows: 7, ..DotGrid::default() };
    let asymmetric = DotGrid { columns: 4, rows: 11, asymmetric: true, ..DotGrid::default() };
    let told = |shown: &DotGrid, declared: DotGrid| {
        let image = picture(shown, [0.0; 2], 2.0);
        assert_eq!(points(shown, &image), shown.columns * shown.rows);
        assert_eq!(shown.misdeclared(&image), None);
        assert_eq!(points(&declared, &image), 0, "{declared:?}");
        declared.misdeclared(&image).unwrap()
    };
    let of = |columns, rows, asymmetric| DotGrid { columns, rows, asymmetric, ..symmetric.clone() };
    assert_eq!(told(&symmetric, of(9, 7, true)), "`columns = 9`, `rows = 7`, `asymmetric = false`");
    assert_eq!(
        told(&asymmetric, of(4, 11, false)),
        "`columns = 4`, `rows = 11`, `asymmetric = true`"
    );
    assert_eq!(told(&asymmetric, of(11, 4, true)), "`columns = 4`, `rows = 11`");
    assert_eq!(told(&symmetric, of(9, 6, false)), "`columns = 9`, `rows = 7`");
}
