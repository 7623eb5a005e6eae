//! Values between samples: the cubic polynomial through four of them whose slopes are central differences (Keys 1981,
//! doi:10.1109/TASSP.1981.1163711).

use crate::picture::Picture;

/// The value between the second and the third of four samples, at `t` from 0 to 1.
#[inline(always)]
pub(crate) fn cubic([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    let first = 0.5 * (c - a);
    let second = a - 2.5 * b + 2.0 * c - 0.5 * d;
    let third = 0.5 * (d - a) + 1.5 * (b - c);
    b + t * (first + t * (second + t * third))
}

/// The value of a row between pixels.
#[inline(always)]
pub(crate) fn along(row: &[u8], x: f32) -> f32 {
    let whole = x.floor();
    cubic(four(row, whole as isize - 1), x - whole)
}

/// The value of a picture between pixels and between rows. Above and below, a picture repeats its outermost rows.
#[inline(always)]
pub(crate) fn around(picture: &Picture<'_>, x: f32, y: f32) -> f32 {
    let (column, row) = (x.floor(), y.floor());
    let last = picture.height() as isize - 1;
    let rows: [[f32; 4]; 4] = std::array::from_fn(|k| {
        let row = (row as isize).saturating_add(k as isize - 1).clamp(0, last);
        four(picture.row(row as usize), column as isize - 1)
    });
    let down = std::array::from_fn(|column| cubic(rows.map(|row| row[column]), y - row));
    cubic(down, x - column)
}

/// Four pixels of a row. Beyond its ends a row repeats them.
#[inline(always)]
fn four(row: &[u8], from: isize) -> [f32; 4] {
    let inside = usize::try_from(from).ok().and_then(|from| row.get(from..from + 4));
    let last = row.len() as isize - 1;
    let pixels = match inside {
        Some(&[a, b, c, d]) => [a, b, c, d],
        _ => std::array::from_fn(|k| row[(from + k as isize).clamp(0, last) as usize]),
    };
    pixels.map(f32::from)
}

#[cfg(test)]
mod tests {
    use super::{along, around};
    use crate::picture::Picture;

    #[test]
    fn straight_lines_and_parabolas_come_back() {
        let row: Vec<u8> = (0..12).map(|x| 3 * x * x / 2 + 5).map(|v| v as u8).collect();
        let line: Vec<u8> = (0..12).map(|x| 7 * x + 2).collect();
        assert!((along(&line, 4.3) - 32.1).abs() < 1e-4);
        assert!((along(&row, 6.0) - 59.0).abs() < 1e-4);
        assert!((along(&line, -3.5) - 2.0).abs() < 1e-4);
    }

    #[test]
    fn planes_come_back() {
        let pixels: Vec<u8> = (0..60).map(|at| (3 * (at % 10) + 20 * (at / 10)) as u8).collect();
        let picture = Picture::new(10, 6, &pixels).unwrap();
        assert!((around(&picture, 4.3, 2.6) - 64.9).abs() < 1e-4);
        assert!((around(&picture, 4.3, -1e9) - 12.9).abs() < 1e-4);
        assert_eq!(around(&picture, 4.3, 3.0), along(picture.row(3), 4.3));
    }
}
