//! Compressed LAS 1.4 of the ASPRS, by the crates `las` and `laz`. Lengths are metres there.
//!
//! Coordinates are whole numbers times a scale, which is chosen so fine that 31 bits just hold the cloud. Standard deviations and
//! confidence are *extra bytes*, with the record that describes them (LAS 1.4 R15, table 24).

use super::{SCALARS, scalars};
use crate::cloud::Cloud;
use las::{Builder, Color, Point, Transform, Vector, Version, Vlr, Writer, point::Format};
use std::io::{self, Cursor, Write};
use wheatstone_core::unit::factor;

/// Whole numbers that a coordinate has on either side of the middle; what is left of 31 bits is for rounding.
const STEPS: f64 = 2e9;
/// The finest scale, in metres.
const FINEST: f64 = 1e-9;
/// Describes one of the extra bytes.
const DESCRIPTION_BYTES: usize = 192;
/// A float of four bytes, in that description.
const FLOAT: u8 = 9;

pub(super) fn write(cloud: &Cloud, unit: &str, out: &mut dyn Write) -> io::Result<()> {
    let bytes = encoded(cloud, factor(unit, "m").unwrap_or(1.0)).map_err(io::Error::other)?;
    out.write_all(&bytes)
}

fn encoded(cloud: &Cloud, metres: f64) -> las::Result<Vec<u8>> {
    let mut builder = Builder::from(Version::new(1, 4));
    builder.point_format = Format::new(2)?;
    builder.point_format.is_compressed = true;
    builder.point_format.extra_bytes = 4 * SCALARS.len() as u16;
    builder.generating_software = "Wheatstone".into();
    builder.vlrs.push(Vlr {
        user_id: "LASF_Spec".into(),
        record_id: 4,
        description: "standard deviations in metres".into(),
        data: SCALARS.iter().flat_map(|name| description(name)).collect(),
    });
    let [low, high] = cloud.bounds().unwrap_or_default();
    let [x, y, z] =
        [0, 1, 2].map(|axis| transform([low, high].map(|bound: [f64; 3]| bound[axis] * metres)));
    builder.transforms = Vector { x, y, z };
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
    for (index, (point, colour)) in cloud.points.iter().zip(&cloud.colours).enumerate() {
        let [x, y, z] = point.map(|length| length * metres);
        // Eight bits become sixteen, as the standard has it.
        let [red, green, blue] = colour.map(|value| 257 * u16::from(value));
        writer.write_point(Point {
            x,
            y,
            z,
            return_number: 1,
            number_of_returns: 1,
            color: Some(Color::new(red, green, blue)),
            extra_bytes: scalars(cloud, index, metres)
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect(),
            ..Point::default()
        })?;
    }
    Ok(writer.into_inner()?.into_inner())
}

/// The finest power of ten that reaches from the middle to both ends.
fn transform([low, high]: [f64; 2]) -> Transform {
    let mut scale = FINEST;
    while 0.5 * (high - low) > STEPS * scale {
        scale *= 10.0;
    }
    // A round number, so that the middle adds no digits.
    let offset = (0.5 * (low + high) / (1e6 * scale)).round() * (1e6 * scale);
    Transform { scale, offset }
}

fn description(name: &str) -> [u8; DESCRIPTION_BYTES] {
    let mut bytes = [0; DESCRIPTION_BYTES];
    bytes[2] = FLOAT;
    bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
    bytes
}
