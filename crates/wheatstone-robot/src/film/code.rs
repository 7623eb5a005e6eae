//! Marks and maps as few bytes, which the page's script reads again.

use crate::{
    map::{Cell, Map},
    seeing::{LocatedEdge, Observation},
};
use wheatstone_core::geometry::{Pixel, Point3};

/// Edges of a kind that are shown: more would hide the picture.
const MOST_EDGES: usize = 220;

/// What a mark is, as its first byte says.
const CORNER: u8 = 0;
const FLOOR: u8 = 1;
const OBSTACLE: u8 = 2;

/// Below this height an edge is drawn as the floor's, in centimetres: half the least obstacle's is well
/// above what edges of the floor scatter by.
const FLOOR_HEIGHT: f64 = 4.0;

/// What was matched: for each mark its kind in a byte, then as 16 bits each (low byte first) x and y in
/// the first and in the second picture in tenths of a pixel, distance and height in millimetres, the
/// height 1000 mm too high so as not to be negative. Also how many there are of each kind.
pub(super) fn marks(observation: &Observation) -> (Vec<u8>, [usize; 3]) {
    let mut bytes = Vec::new();
    let [floor, obstacle] = by_kind(&observation.edges);
    let counts = [observation.corners.len(), floor.len(), obstacle.len()];
    for (kind, edges) in [(FLOOR, floor), (OBSTACLE, obstacle)] {
        for (first, second, point) in edges.iter().step_by(edges.len().div_ceil(MOST_EDGES).max(1))
        {
            put(&mut bytes, kind, (*first, *second), *point);
        }
    }
    for corner in &observation.corners {
        let pixels = (corner.matched.first, corner.matched.second);
        put(&mut bytes, CORNER, pixels, corner.point);
    }
    (bytes, counts)
}

type Mark = (Pixel, Pixel, Point3);

/// Edges found in both pictures: those of the floor, those of what stands on it.
fn by_kind(edges: &[LocatedEdge]) -> [Vec<Mark>; 2] {
    let (mut floor, mut obstacle) = (Vec::new(), Vec::new());
    for edge in edges {
        let (Some(other), Some((point, _))) = (edge.matched.other, edge.at) else { continue };
        let kind = if -point.y < FLOOR_HEIGHT { &mut floor } else { &mut obstacle };
        kind.push((edge.matched.edge.at, other, point));
    }
    [floor, obstacle]
}

fn put(bytes: &mut Vec<u8>, kind: u8, (first, second): (Pixel, Pixel), point: Point3) {
    bytes.push(kind);
    let distance = (point.x * point.x + point.z * point.z).sqrt();
    let lengths = [distance, 100.0 - point.y];
    for value in [first.x, first.y, second.x, second.y].into_iter().chain(lengths) {
        // Out of range is as far as the numbers reach.
        bytes.extend(((value * 10.0).round() as u16).to_le_bytes());
    }
}

/// What is known of the map's cells, and how that changes.
#[derive(Default)]
pub(super) struct Changes {
    known: Vec<u8>,
}

impl Changes {
    /// The cells that changed since the last call: for each, three times its distance from the one before
    /// in the order of rows (the first's from -1) and what it is now (0 unknown, 1 free, 2 occupied), as
    /// a number of seven bits a byte, low ones first, with the eighth set where more follow. `None`
    /// where nothing changed.
    pub(super) fn since(&mut self, map: &Map) -> Option<Vec<u8>> {
        self.known.resize(map.columns() * map.rows(), 0);
        let (mut bytes, mut last) = (Vec::new(), -1_i64);
        for row in 0..map.rows() {
            for column in 0..map.columns() {
                let index = row * map.columns() + column;
                let now = match map.cell(column, row) {
                    Cell::Unknown => 0,
                    Cell::Free => 1,
                    Cell::Occupied => 2,
                };
                if self.known[index] == now {
                    continue;
                }
                self.known[index] = now;
                let mut number = 3 * (index as i64 - last) as u64 + u64::from(now);
                last = index as i64;
                while number > 127 {
                    bytes.push(number as u8 & 127 | 128);
                    number >>= 7;
                }
                bytes.push(number as u8);
            }
        }
        (!bytes.is_empty()).then_some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ground;

    /// As the page's script does.
    fn read(bytes: &[u8], cells: &mut [u8]) {
        let (mut at, mut number, mut shift) = (-1_i64, 0_u64, 0);
        for byte in bytes {
            number |= u64::from(byte & 127) << shift;
            shift += 7;
            if byte & 128 == 0 {
                at += (number / 3) as i64;
                cells[at as usize] = (number % 3) as u8;
                (number, shift) = (0, 0);
            }
        }
    }

    #[test]
    fn maps_are_read_again() {
        let map = Map::new(Ground::new(40.0, 100.0));
        let mut changes = Changes::default();
        let bytes = changes.since(&map).unwrap();
        let mut cells = vec![0; map.columns() * map.rows()];
        read(&bytes, &mut cells);
        for (index, cell) in cells.iter().enumerate() {
            let truth = map.cell(index % map.columns(), index / map.columns());
            assert_eq!(*cell == 1, truth == Cell::Free);
        }
        assert!(cells.contains(&1) && changes.since(&map).is_none());
        // A second map differs where the first one was free.
        let other = Map::new(Ground::new(-40.0, 100.0));
        read(&changes.since(&other).unwrap(), &mut cells);
        let free = |column: usize, row: usize| other.cell(column, row) == Cell::Free;
        for (index, cell) in cells.iter().enumerate() {
            assert_eq!(*cell == 1, free(index % other.columns(), index / other.columns()));
        }
    }
}
