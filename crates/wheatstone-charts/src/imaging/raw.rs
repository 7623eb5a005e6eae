//! Pictures from memory: rows of bytes or of 16-bit numbers.

use super::GrayImage;
use wheatstone_core::{Error, Result};

impl GrayImage {
    /// A picture from 8-bit grey values, row by row from the top, without gaps between rows.
    ///
    /// ```
    /// use wheatstone_charts::imaging::GrayImage;
    ///
    /// let image = GrayImage::from_raw(3, 2, &[0, 10, 20, 30, 40, 255])?;
    /// assert_eq!(image.row(1), [30.0, 40.0, 255.0]);
    /// assert!(GrayImage::from_raw(3, 2, &[0; 5]).is_err());
    /// # Ok::<(), wheatstone_core::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] where the number of values is not `width * height`, or is 0.
    pub fn from_raw(width: usize, height: usize, values: &[u8]) -> Result<Self> {
        exactly(width, height, values.len())?;
        Self::from_raw_stride(width, height, width, values)
    }

    /// [`GrayImage::from_raw`] with `stride` values from the start of one row to that of the next, as
    /// cameras and video decoders deliver them. The last row need not be filled up.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] where `stride` is less than `width` or there are too few values.
    pub fn from_raw_stride(
        width: usize,
        height: usize,
        stride: usize,
        values: &[u8],
    ) -> Result<Self> {
        strided((width, height), stride, values, f32::from)
    }

    /// A picture from 16-bit grey values, row by row. `white` is the value of white: 65535 for the full
    /// range, 4095 for a 12-bit camera. Values are scaled to 0 to 255 and keep their fractions.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] where the number of values is not `width * height`, or is 0, or `white` is 0.
    pub fn from_raw16(width: usize, height: usize, white: u16, values: &[u16]) -> Result<Self> {
        exactly(width, height, values.len())?;
        Self::from_raw16_stride(width, height, width, white, values)
    }

    /// [`GrayImage::from_raw16`] with `stride` values from the start of one row to
    /// that of the next.
    ///
    /// # Errors
    ///
    /// As [`GrayImage::from_raw_stride`], and where `white` is 0.
    pub fn from_raw16_stride(
        width: usize,
        height: usize,
        stride: usize,
        white: u16,
        values: &[u16],
    ) -> Result<Self> {
        if white == 0 {
            return Err(refuse("the value of white", 0, "the largest value of a pixel".into()));
        }
        let white = f32::from(white);
        strided((width, height), stride, values, |value| f32::from(value) * 255.0 / white)
    }
}

fn refuse(setting: &str, value: usize, need: String) -> Error {
    Error::Setting { setting: setting.into(), value: value.to_string(), need }
}

fn exactly(width: usize, height: usize, count: usize) -> Result<()> {
    if width.checked_mul(height) == Some(count) && count > 0 {
        return Ok(());
    }
    Err(refuse("the number of grey values", count, format!("{width} x {height}, and at least one")))
}

/// Rows of values that begin `stride` apart.
fn strided<T: Copy>(
    (width, height): (usize, usize),
    stride: usize,
    values: &[T],
    grey: impl Fn(T) -> f32,
) -> Result<GrayImage> {
    if width == 0 || height == 0 {
        return Err(refuse("a side of a picture", 0, "at least one pixel".into()));
    }
    if stride < width {
        return Err(refuse("the stride of a row", stride, format!("at least {width}, the width")));
    }
    let need = (height - 1).checked_mul(stride).and_then(|most| most.checked_add(width));
    if need.is_none_or(|need| values.len() < need) {
        let what = format!("{height} rows of {width} that begin {stride} apart");
        return Err(refuse("the number of grey values", values.len(), what));
    }
    let rows = values.chunks(stride).take(height);
    let values = rows.flat_map(|row| row[..width].iter().map(|value| grey(*value))).collect();
    Ok(GrayImage { width, height, values })
}
