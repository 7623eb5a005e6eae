//! Charts on paper: what is printed has the sizes that the chart says.

use wheatstone_charts::chart::{
    AnyChart, Shape,
    chessboard::Chessboard,
    sheet::{Paper, Sheet, largest, rounded_down},
};

/// Edges of what a PDF paints black, and the page, in millimetres from its top-left corner.
struct Printed {
    page: [f64; 2],
    rectangles: Vec<[f64; 4]>,
    discs: Vec<[f64; 4]>,
    words: Vec<String>,
}

fn numbers(words: &[&str]) -> Vec<f64> {
    words.iter().map(|word| word.parse().unwrap()).collect()
}

/// Reads the page as a printer does: through the matrix, in points of 1/72 inch.
fn printed(pdf: &[u8]) -> Printed {
    let text = std::str::from_utf8(pdf).unwrap();
    let millimetres = |points: f64| points * 25.4 / 72.0;
    let media = text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap();
    let media = numbers(&media.split(' ').collect::<Vec<_>>());
    let mut page = Printed {
        page: [millimetres(media[2]), millimetres(media[3])],
        rectangles: Vec::new(),
        discs: Vec::new(),
        words: Vec::new(),
    };
    let stream = text.split("stream\n").nth(1).unwrap().strip_suffix("end").unwrap();
    let (mut matrix, mut path) = (Vec::new(), Vec::<[f64; 2]>::new());
    for line in stream.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let place = |x: f64, y: f64| {
            let m: &[f64] = &matrix;
            let [a, b] = [m[0] * x + m[2] * y + m[4], m[1] * x + m[3] * y + m[5]];
            [millimetres(a), page.page[1] - millimetres(b)]
        };
        match words.last().copied().unwrap() {
            "cm" => matrix = numbers(&words[..6]),
            "re" => {
                let [x, y, width, height] = numbers(&words[..4])[..] else { panic!("{line}") };
                let ([l, t], [r, b]) = (place(x, y), place(x + width, y + height));
                page.rectangles.push([l, t, r, b]);
            }
            "m" => path = vec![place(words[0].parse().unwrap(), words[1].parse().unwrap())],
            "c" => {
                let n = numbers(&words[..6]);
                // The middle of the curve, and its end.
                let start = *path.last().unwrap();
                let [p, q, end] = [place(n[0], n[1]), place(n[2], n[3]), place(n[4], n[5])];
                let middle = |k: usize| (start[k] + 3.0 * p[k] + 3.0 * q[k] + end[k]) / 8.0;
                path.push([middle(0), middle(1)]);
                path.push(end);
            }
            "h" => {
                let ends = |k: usize, pick: fn(f64, f64) -> f64| {
                    path.iter().map(|p| p[k]).reduce(pick).unwrap()
                };
                let edges =
                    [ends(0, f64::min), ends(1, f64::min), ends(0, f64::max), ends(1, f64::max)];
                let [x, y] = [(edges[0] + edges[2]) / 2.0, (edges[1] + edges[3]) / 2.0];
                let radius = (edges[2] - edges[0]) / 2.0;
                for [a, b] in &path {
                    assert!(
                        (((a - x).powi(2) + (b - y).powi(2)).sqrt() - radius).abs() < 1e-4 * radius,
                        "not round"
                    );
                }
                page.discs.push(edges);
            }
            "ET" => {
                let words = line.split_once('(').unwrap().1.rsplit_once(')').unwrap().0;
                page.words.push(words.replace("\\(", "(").replace("\\)", ")"));
            }
            "f" => {}
            other => panic!("{other} in {line}"),
        }
    }
    page
}

/// Largest difference of two lists of edges after a shift that is the same for all.
fn differences(printed: &[[f64; 4]], chart: &[[f64; 4]], shift: [f64; 2]) -> f64 {
    let shift = [shift[0], shift[1], shift[0], shift[1]];
    let of = |(a, b): (&[f64; 4], &[f64; 4])| {
        (0..4).map(|k| (a[k] - b[k] - shift[k]).abs()).fold(0.0, f64::max)
    };
    printed.iter().zip(chart).map(of).fold(0.0, f64::max)
}

/// The shapes of a chart in millimetres, rectangles and discs.
fn shapes(chart: &AnyChart, scale: f64) -> [Vec<[f64; 4]>; 2] {
    let scaled = |shape: Shape| shape.edges().map(|edge| edge * scale);
    let all = chart.shapes();
    let (rectangles, discs): (Vec<Shape>, Vec<Shape>) =
        all.into_iter().partition(|shape| matches!(shape, Shape::Rectangle(_)));
    [rectangles, discs].map(|list| list.into_iter().map(scaled).collect())
}

#[test]
fn every_chart_is_printed_to_scale_with_its_name_and_a_ruler() {
    for chart in AnyChart::all() {
        for (unit, scale) in [("mm", 1.0), ("in", 25.4)] {
            let sheet = Sheet::new(&chart, unit, None).unwrap();
            let page = printed(&sheet.pdf());
            let [rectangles, discs] = shapes(&chart, scale);
            let (ruler, own) = {
                let (own, ruler) = page.rectangles.split_at(rectangles.len());
                (ruler, own)
            };
            assert_eq!(page.discs.len(), discs.len());
            let (first, same) = match (own.first(), page.discs.first()) {
                (Some(edges), _) => (edges, rectangles[0]),
                (None, edges) => (edges.unwrap(), discs[0]),
            };
            let shift = [first[0] - same[0], first[1] - same[1]];
            let kind = chart.kind();
            assert!(differences(own, &rectangles, shift) < 3e-6, "{kind}");
            assert!(differences(&page.discs, &discs, shift) < 3e-6, "{kind}");

            // Eleven ticks after the line, the last 100 mm from the first.
            assert_eq!(ruler.len(), 12, "{kind}");
            let middle = |tick: usize| (ruler[tick][0] + ruler[tick][2]) / 2.0;
            for tick in 1..12 {
                let from_first = middle(tick) - middle(1);
                assert!((from_first - 10.0 * (tick as f64 - 1.0)).abs() < 3e-6, "{kind}");
            }
            // The white margin of the chart is free of them.
            let [left, top, right, bottom] = chart.board().map(|edge| edge * scale);
            assert!(ruler.iter().all(|edges| edges[1] > bottom + shift[1] - 3e-6), "{kind}");
            assert!(left + shift[0] > -1e-6 && top + shift[1] > -1e-6, "{kind}");
            assert!(right + shift[0] < page.page[0] + 1e-6, "{kind}");
            assert!(page.words.contains(&sheet.title().to_owned()), "{kind}: {:?}", page.words);
            assert!(sheet.title().starts_with(kind), "{}", sheet.title());

            let drawing = sheet.svg();
            let count = |what: &str| drawing.matches(what).count();
            // The ground, the chart and the ruler.
            assert_eq!(count("<rect"), 1 + rectangles.len() + 12, "{kind}");
            assert_eq!(count("<circle"), discs.len(), "{kind}");
            assert!(drawing.contains("100 mm</text>"), "{kind}");
        }
    }
}

#[test]
fn offsets_in_the_file_lead_to_its_objects() {
    let pdf = Sheet::new(&AnyChart::all()[0], "mm", Some(Paper::A4)).unwrap().pdf();
    let text = std::str::from_utf8(&pdf).unwrap();
    let start: usize = text.lines().rev().nth(1).unwrap().parse().unwrap();
    assert!(text[start..].starts_with("xref\n0 7\n"));
    for (number, line) in text[start..].lines().skip(3).take(6).enumerate() {
        let offset: usize = line[..10].parse().unwrap();
        assert!(text[offset..].starts_with(&format!("{} 0 obj\n", number + 1)));
    }
    let length: usize =
        text.split("/Length ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let stream = text.split("stream\n").nth(1).unwrap();
    assert_eq!(stream.strip_suffix("end").unwrap().len(), length);
}

#[test]
fn a_chart_fits_its_paper_or_is_told_what_would() {
    let board = |pitch: f64| Chessboard { pitch, ..Chessboard::default() }.into();
    for (paper, size) in [(Paper::A4, [297.0, 210.0]), (Paper::Letter, [279.4, 215.9])] {
        let page = printed(&Sheet::new(&board(25.0), "mm", Some(paper)).unwrap().pdf());
        assert!((page.page[0] - size[0]).abs() < 1e-9 && (page.page[1] - size[1]).abs() < 1e-9);
        let inside = |edges: &[f64; 4]| {
            edges[0] > 4.0 && edges[1] > 4.0 && edges[2] < size[0] - 4.0 && edges[3] < size[1] - 4.0
        };
        assert!(page.rectangles.iter().all(inside));
    }
    let refused = Sheet::new(&board(30.0), "mm", Some(Paper::A4)).unwrap_err();
    assert_eq!(refused.to_string(), "[chart] pitch cannot be 30 mm");
    assert!(refused.hint().unwrap().contains("at most 25 mm, or fewer columns and rows"));

    for chart in AnyChart::all() {
        for paper in [Paper::A4, Paper::Letter] {
            let most = largest(&chart, "mm", paper).unwrap();
            assert_eq!(Sheet::new(&chart, "mm", Some(paper)).is_ok(), most >= 1.0);
        }
    }
    assert_eq!([25.9, 9.87, 0.66].map(|size| rounded_down(size, "mm")), [25.0, 9.8, 0.6]);
    assert_eq!([2.59, 0.987].map(|size| rounded_down(size, "cm")), [2.5, 0.98]);
    assert_eq!([1.04, 0.33].map(|size| rounded_down(size, "in")), [1.0, 0.33]);
}
