//! How datasets are altered, whatever the fault.

use crate::random_capture::RandomCapture;
use wheatstone_core::{
    dataset::{Correspondence, Dataset},
    geometry::Pixel,
};
use wheatstone_numeric::random::Random;

/// A dataset with one fault, and what should be said of it.
#[derive(Clone, Debug)]
pub struct Faulty {
    /// The data.
    pub data: Dataset,
    /// The names that would be right.
    pub codes: &'static [&'static str],
    /// The views that have it; none where the fault is in all or in none in particular.
    pub views: Vec<usize>,
    /// The cameras that have it; none where it is in all or in none in particular.
    pub cameras: Vec<usize>,
}

/// A capture about to get a fault: what was drawn for it.
pub(super) struct Draw<'a> {
    pub(super) capture: &'a RandomCapture,
    pub(super) data: Dataset,
    pub(super) strength: usize,
    pub(super) random: &'a mut Random,
    pub(super) camera: usize,
    /// Up to a third of the views, one at least.
    pub(super) some: Vec<usize>,
}

pub(super) fn all(count: usize) -> Vec<usize> {
    (0..count).collect()
}

pub(super) fn faulty(
    data: Dataset,
    codes: &'static [&'static str],
    views: Vec<usize>,
    cameras: Vec<usize>,
) -> Faulty {
    Faulty { data, codes, views, cameras }
}

pub(super) fn altered(
    mut data: Dataset,
    views: &[usize],
    change: impl Fn(&mut Correspondence),
) -> Dataset {
    for row in data.correspondences.iter_mut().filter(|row| views.contains(&row.view)) {
        change(row);
    }
    data
}

pub(super) fn pixels(
    data: Dataset,
    views: &[usize],
    camera: usize,
    change: impl Fn(Pixel) -> Pixel,
) -> Dataset {
    altered(data, views, |row| row.pixels[camera] = row.pixels[camera].map(&change))
}

fn index(row: &Correspondence) -> usize {
    row.id.as_ref().and_then(|id| id.parse().ok()).unwrap_or(0)
}

/// Each label gets the pixels of another point of its view.
pub(super) fn relabelled(
    data: &Dataset,
    views: &[usize],
    cameras: &[usize],
    point: impl Fn(usize) -> usize,
) -> Dataset {
    altered(data.clone(), views, |row| {
        let real = point(index(row));
        let twin = data.correspondences.iter().find(|c| c.view == row.view && index(c) == real);
        for camera in cameras {
            row.pixels[*camera] = twin.and_then(|twin| twin.pixels[*camera]);
        }
    })
    .subset(|_, row| row.seen_by() > 0)
}
