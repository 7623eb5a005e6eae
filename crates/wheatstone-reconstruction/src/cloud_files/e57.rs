//! ASTM E57 (E2807), by the crate `e57`. Lengths are metres there.
//!
//! Standard deviations and confidence are attributes of an extension, which readers that do not know it leave out.

use super::{SCALARS, scalars};
use crate::cloud::Cloud;
use ::e57::{E57Writer, Extension, Record, RecordDataType, RecordName, RecordValue};
use hmac_sha256::Hash;
use std::io::{self, Cursor, Write};
use uuid::Uuid;
use wheatstone_core::unit::factor;

/// The name of the extension, and what stands for it in the file.
const EXTENSION: &str = "wheatstone";
const EXTENSION_URL: &str = "urn:wheatstone:error-bars";

pub(super) fn write(cloud: &Cloud, unit: &str, out: &mut dyn Write) -> io::Result<()> {
    let bytes = encoded(cloud, factor(unit, "m").unwrap_or(1.0)).map_err(io::Error::other)?;
    out.write_all(&bytes)
}

fn encoded(cloud: &Cloud, metres: f64) -> ::e57::Result<Vec<u8>> {
    let [file_id, cloud_id] = identifiers(cloud);
    let mut bytes = Cursor::new(Vec::new());
    let mut file = E57Writer::new(&mut bytes, &file_id)?;
    file.register_extension(Extension::new(EXTENSION, EXTENSION_URL))?;
    let own = SCALARS.map(|name| Record {
        name: RecordName::Unknown { namespace: EXTENSION.into(), name: name.into() },
        data_type: RecordDataType::F32,
    });
    let mut prototype = vec![
        Record::CARTESIAN_X_F64,
        Record::CARTESIAN_Y_F64,
        Record::CARTESIAN_Z_F64,
        Record::COLOR_RED_U8,
        Record::COLOR_GREEN_U8,
        Record::COLOR_BLUE_U8,
    ];
    prototype.extend(own);
    let mut points = file.add_pointcloud(&cloud_id, prototype)?;
    points.set_name(Some("cloud".into()));
    for (index, (point, colour)) in cloud.points.iter().zip(&cloud.colours).enumerate() {
        let place = point.iter().map(|length| RecordValue::Double(length * metres));
        let colour = colour.iter().map(|value| RecordValue::Integer(i64::from(*value)));
        let own = scalars(cloud, index, metres).map(RecordValue::Single);
        points.add_point(place.chain(colour).chain(own).collect())?;
    }
    points.finalize()?;
    file.finalize()?;
    drop(file);
    Ok(bytes.into_inner())
}

/// Identifiers of the file and of the cloud in it that follow from what the cloud holds, so that equal clouds give equal
/// files: UUIDs of version 8 (RFC 9562).
fn identifiers(cloud: &Cloud) -> [String; 2] {
    let mut hash = Hash::new();
    for value in cloud.points.as_flattened() {
        hash.update(value.to_le_bytes());
    }
    for value in cloud.sigmas.as_flattened() {
        hash.update(value.to_le_bytes());
    }
    let digest = hash.finalize();
    [0, 16].map(|first| {
        let half = std::array::from_fn(|place| digest[first + place]);
        Uuid::new_v8(half).braced().to_string()
    })
}
