//! Depths as pictures: TIFF with 32-bit floats, and PNG with 16 bits.

use std::io::{Seek, Write};
use tiff::{
    encoder::{Compression, DeflateLevel, TiffEncoder, colortype::Gray32Float},
    tags::Tag,
};

/// How depths are put into 16 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DepthPng {
    /// A grey level of 1 is so long, in the model's unit; 0 stands for no depth.
    pub step: f64,
}

/// Writes depths as a TIFF with one 32-bit float a pixel, NaN where there is none; the unit stands in its
/// `ImageDescription`.
///
/// # Errors
///
/// Where the writer fails; what it says.
pub fn depth_tiff(
    (width, height): (usize, usize),
    depth: &[f32],
    unit: &str,
    out: impl Write + Seek,
) -> Result<(), String> {
    let told = |e: tiff::TiffError| e.to_string();
    let side = |side: usize| u32::try_from(side).map_err(|e| e.to_string());
    // Compressed: of others, libtiff finds the predictor's tag strange, which the encoder always writes.
    let compression = Compression::Deflate(DeflateLevel::default());
    let mut encoder = TiffEncoder::new(out).map_err(told)?.with_compression(compression);
    let mut image = encoder.new_image::<Gray32Float>(side(width)?, side(height)?).map_err(told)?;
    let described = described(&format!("unit: {unit}"));
    image.encoder().write_tag(Tag::ImageDescription, &described[..]).map_err(told)?;
    image.write_data(depth).map_err(told)
}

/// What a file says of itself, in ASCII.
fn described(unit: &str) -> String {
    let unit: String = unit.chars().filter(|letter| matches!(letter, ' '..='~')).collect();
    format!("depth along the optical axis of the left rectified camera; {unit}")
}

/// The step of a 16-bit picture: a power of ten of the unit, the smallest that holds the largest depth.
impl DepthPng {
    /// For these depths.
    #[must_use]
    pub fn of(depth: &[f32]) -> Self {
        let largest =
            depth.iter().filter(|depth| depth.is_finite()).fold(0.0_f32, |a, b| a.max(*b));
        let mut step = 1e-6;
        while f64::from(largest) / step > f64::from(u16::MAX) {
            step *= 10.0;
        }
        Self { step }
    }

    fn level(self, depth: f32) -> u16 {
        let level = (f64::from(depth) / self.step).round();
        // NaN is no depth; what is nearer than half a step is not told from it.
        if level > 0.0 { level.min(f64::from(u16::MAX)) as u16 } else { 0 }
    }
}

/// Writes depths as a 16-bit grey PNG: the depth over [`DepthPng::step`], 0 where there is none; the step stands in its
/// `Description`.
///
/// # Errors
///
/// Where the writer fails; what it says.
pub fn depth_png(
    (width, height): (usize, usize),
    depth: &[f32],
    (scale, unit): (DepthPng, &str),
    out: impl Write,
) -> Result<(), String> {
    let told = |e: png::EncodingError| e.to_string();
    let side = |side: usize| u32::try_from(side).map_err(|e| e.to_string());
    let mut encoder = png::Encoder::new(out, side(width)?, side(height)?);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let described = described(&format!("a grey level is {} {unit}", scale.step));
    encoder.add_text_chunk("Description".into(), described).map_err(told)?;
    let mut writer = encoder.write_header().map_err(told)?;
    let bytes: Vec<u8> = depth.iter().flat_map(|depth| scale.level(*depth).to_be_bytes()).collect();
    writer.write_image_data(&bytes).map_err(told)?;
    writer.finish().map_err(told)
}
