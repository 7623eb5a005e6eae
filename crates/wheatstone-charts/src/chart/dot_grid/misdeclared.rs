//! What of a grid of dots was declared otherwise than the picture shows it.

use super::{Chart, ChartSearch, DotGrid, blobs, growth, layout};
use crate::imaging::{GrayImage, filter::halvings};

/// In pixels, the shorter side of the smallest half that is looked at.
const LEAST_SIDE: usize = 120;

/// The counts, and where it is wrong the kind, under which the dots of this picture are this chart; `None`
/// where no whole grid is seen, or the declared one.
pub(super) fn told(declared: &DotGrid, image: &GrayImage) -> Option<String> {
    let sizes = halvings(image, LEAST_SIDE);
    let sides = sizes.iter().flat_map(|image| {
        let blobs = blobs::find(image, blobs::Outline::Ellipse);
        [blobs.dark, blobs.bright]
    });
    let mut grids: Vec<_> = sides
        .filter_map(|mut blobs| growth::take_largest(&mut blobs, super::LEAST_FOUND))
        .collect();
    // In smaller pictures a part of the dots may look like another grid, and so may what is between them,
    // which stands out less.
    let clear = |labels: &growth::Labels| labels.values().map(|blob| blob.contrast).sum::<f64>();
    grids.sort_by(|a, b| clear(b).total_cmp(&clear(a)));
    let charts: Vec<DotGrid> =
        grids.iter().flat_map(|labels| candidates(declared, labels)).collect();
    // What fits as it was declared is not there for another reason.
    if charts.contains(declared) {
        return None;
    }
    let fitting =
        charts.iter().find(|chart| matches!(chart.detect(image), ChartSearch::Found(_)))?;
    Some(described(fitting, declared))
}

/// Charts that these labels are all dots of, those of the declared kind first.
fn candidates(declared: &DotGrid, labels: &growth::Labels) -> Vec<DotGrid> {
    let kinds = [declared.asymmetric, !declared.asymmetric];
    let sizes = kinds.into_iter().flat_map(|asymmetric| {
        let labels = layout::straightened(labels, asymmetric);
        let (width, height) = layout::size(&labels);
        let (width, height) = (width as usize, height as usize);
        let across = if asymmetric { 2 } else { 1 };
        // The declared order of sides first: a symmetric grid is the same either way.
        let (long, short) = (width.max(height), width.min(height));
        let sides = if declared.columns < declared.rows { [short, long] } else { [long, short] };
        [sides, [sides[1], sides[0]]]
            .into_iter()
            .filter(move |[columns, _]| columns.is_multiple_of(across))
            .map(move |[columns, rows]| (asymmetric, columns / across, rows))
            .filter(move |(_, columns, rows)| columns * rows == labels.len())
            .collect::<Vec<_>>()
    });
    sizes
        .map(|(asymmetric, columns, rows)| DotGrid {
            asymmetric,
            columns,
            rows,
            ..declared.clone()
        })
        .filter(|chart| chart.validate().is_ok())
        .collect()
}

fn described(chart: &DotGrid, declared: &DotGrid) -> String {
    let mut text = format!("`columns = {}`, `rows = {}`", chart.columns, chart.rows);
    if chart.asymmetric != declared.asymmetric {
        text += &format!(", `asymmetric = {}`", chart.asymmetric);
    }
    text
}
