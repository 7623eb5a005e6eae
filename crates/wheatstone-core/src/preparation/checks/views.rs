//! Which points belong together: the file's views, or the layers in which its points lie.

use super::{board::Board, frame::Frame};
use crate::{
    dataset::{Dataset, split},
    geometry::Point3,
};

/// Fewer points tell nothing of a cell.
pub(super) const LEAST: usize = 6;

/// A name, and indices into the dataset's correspondences.
type Group = (String, Vec<usize>);

/// The points of one view.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) name: String,
    /// Indices into the dataset's correspondences.
    pub(super) rows: Vec<usize>,
    pub(super) board: Option<Board>,
}

/// The views of the file, or layers of space where it has none.
pub(super) fn views(data: &Dataset, frame: &Frame) -> Vec<View> {
    let groups = pictures(data).unwrap_or_else(|| {
        split::folds(data).into_iter().map(|fold| (fold.view, fold.held_out)).collect()
    });
    let view = |(name, rows): Group| {
        let places: Vec<Point3> = rows
            .iter()
            .filter_map(|row| Some(frame.scaled(data.correspondences[*row].world?)))
            .collect();
        View { name, board: Board::find(&places), rows }
    };
    groups.into_iter().map(view).collect()
}

/// Points that were seen at once: those of a view of the file, or of a level of a stage. `None` for points spread over a
/// volume.
fn pictures(data: &Dataset) -> Option<Vec<Group>> {
    if data.views.len() < 2 {
        return layers(data);
    }
    let mut members = vec![Vec::new(); data.views.len()];
    for (index, row) in data.correspondences.iter().enumerate() {
        if let (Some(view), true) = (members.get_mut(row.view), row.world.is_some()) {
            view.push(index);
        }
    }
    Some(data.views.iter().cloned().zip(members).collect())
}

/// Whether the points of a view were seen at once, so that a picture of it may be another instant's.
pub(super) fn are_pictures(data: &Dataset) -> bool {
    pictures(data).is_some()
}

/// Layers on which a world coordinate has one value, in the order in which the file begins them. Of
/// the axes that have layers it is the one along which the file changes least often: a chart's own
/// rows and columns are layers too.
fn layers(data: &Dataset) -> Option<Vec<Group>> {
    // More levels than stages stop at are points spread over a volume.
    const MOST: usize = 40;
    let mut best: Option<(usize, Vec<Group>)> = None;
    for (axis, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
        let mut found: Vec<(f64, Vec<usize>)> = Vec::new();
        for (index, row) in data.correspondences.iter().enumerate() {
            let Some(world) = row.world else { continue };
            if let Some((_, rows)) = found.iter_mut().find(|(level, _)| *level == world[axis]) {
                rows.push(index);
            } else if found.len() < MOST {
                found.push((world[axis], vec![index]));
            } else {
                found.clear();
                break;
            }
        }
        let enough = found.len() >= 2 && found.iter().all(|(_, rows)| rows.len() >= LEAST);
        let values: Vec<f64> = data.known().map(|(world, _)| world[axis]).collect();
        let changes = values.windows(2).filter(|pair| pair[0] != pair[1]).count();
        if enough && best.as_ref().is_none_or(|(least, _)| changes < *least) {
            let name = |level: f64| format!("{letter} = {level}");
            let layers = found.into_iter().map(|(level, rows)| (name(level), rows)).collect();
            best = Some((changes, layers));
        }
    }
    best.map(|(_, layers)| layers)
}
