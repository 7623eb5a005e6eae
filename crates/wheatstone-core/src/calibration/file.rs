//! The model file: JSON with a checksum of its content, so that damage is noticed before a point is located with it.

use super::Calibration;
use crate::{
    Error, Result,
    error::{Hint, Remedy},
    limits,
    method::{AnyMethod, AnyReconstructor},
    storage,
};
use hmac_sha256::Hash;
use serde::Serialize;
use serde_json::{Map, Value};
use std::{
    io::{BufWriter, Write},
    path::Path,
};

/// What the first field of every model file says.
pub const FORMAT: &str = "wheatstone-calibration";

/// The version of the form that is written.
pub const VERSION: u32 = 3;

/// The oldest version that is read. Every version since the first stays readable.
pub const OLDEST_VERSION: u32 = 1;

/// The first version with a checksum.
const CHECKED_VERSION: u32 = 3;

/// The field that holds the checksum of all others.
const CHECKSUM: &str = "checksum";

/// A model with the checksum of its fields.
#[derive(Serialize)]
struct Checked<'a> {
    #[serde(flatten)]
    model: &'a Calibration,
    checksum: String,
}

/// SHA-256 of a value as canonical JSON (RFC 8785, doi:10.17487/RFC8785), in hexadecimal digits.
///
/// White space, the order of keys and the way in which a number is written do not count.
fn checksum(value: &impl Serialize) -> serde_json::Result<String> {
    struct Hasher(Hash);
    impl Write for Hasher {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.update(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut hasher = Hasher(Hash::new());
    serde_jcs::to_writer(BufWriter::new(&mut hasher), value)?;
    Ok(hasher.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Whether a file has to be what was written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Damage {
    Refused,
    Ignored,
}

impl Calibration {
    /// Writes the file; what was there before stays until the new one is whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Unsupported`] as [`Calibration::to_bytes`].
    pub fn save(&self, path: &Path) -> Result<()> {
        storage::write(path, &self.to_bytes()?)
    }

    /// The bytes of the file that [`Calibration::save`] writes: JSON in UTF-8, with a checksum.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] where no program could read them back: the fitted map or its method is from outside of
    /// this library, or a number is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let foreign = match (&self.reconstructor, &self.method) {
            (AnyReconstructor::Custom(map), _) => Some(("fitted map", map.name())),
            (_, AnyMethod::Custom(method)) => Some(("method", method.name())),
            _ => None,
        };
        let refuse = |what: String, hint: &str| Error::Unsupported {
            format: "model file".into(),
            what,
            hint: hint.into(),
        };
        if let Some((kind, name)) = foreign {
            return Err(refuse(
                format!("the {kind} `{name}`, which is not part of this library"),
                "save the points and fit again, or write the map in a format of your own",
            ));
        }
        let checked = checksum(self).map(|checksum| Checked { model: self, checksum });
        let mut bytes = checked
            .and_then(|checked| serde_json::to_vec(&checked))
            .map_err(|e| refuse(format!("this model: {e}"), "please report this as a bug"))?;
        bytes.push(b'\n');
        match Self::from_bytes(&bytes) {
            Ok(_) => Ok(bytes),
            Err(e) => Err(refuse(
                format!("this model, which could not be read back: {e}"),
                "are all numbers that it was fitted with of a sensible size?",
            )),
        }
    }

    /// Reads a file that [`Calibration::save`] wrote, of this version or an earlier one.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Malformed`] for anything else than a whole model of a known version, and where its
    /// content has not the checksum that it was written with.
    pub fn load(path: &Path) -> Result<Self> {
        parse(path, &storage::read_text(path, limits::MODEL_BYTES)?, Damage::Refused)
    }

    /// Reads a file as [`Calibration::load`] does, but does not ask for its checksum: to look into a file that was
    /// damaged or edited. Nothing should be located with it.
    ///
    /// # Errors
    ///
    /// As [`Calibration::load`], but for the checksum.
    pub fn load_damaged(path: &Path) -> Result<Self> {
        parse(path, &storage::read_text(path, limits::MODEL_BYTES)?, Damage::Ignored)
    }

    /// Reads what [`Calibration::to_bytes`] gave. Messages call it `model`.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] as [`Calibration::load`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let path = Path::new("model");
        let text = std::str::from_utf8(bytes).map_err(|_| Error::Malformed {
            path: path.into(),
            line: None,
            problem: "not text (UTF-8)".into(),
            hint: written(),
        })?;
        parse(path, text, Damage::Refused)
    }
}

/// Where models come from.
fn written() -> Hint {
    Hint::new("model files are written by a fit", Remedy::Fit)
}

/// Reads a model; messages name `path`.
fn parse(path: &Path, text: &str, damage: Damage) -> Result<Calibration> {
    let refuse = |line, problem: String, hint: Hint| Error::Malformed {
        path: path.into(),
        line,
        problem,
        hint,
    };
    if !text.trim_start().starts_with('{') {
        return Err(refuse(None, "not a model file, which is JSON".into(), written()));
    }
    let mut fields: Map<String, Value> = serde_json::from_str(text)
        .map_err(|e| refuse(Some(e.line() as u64), format!("not a model file: {e}"), written()))?;
    if fields.get("format").and_then(Value::as_str) != Some(FORMAT) {
        let problem = "not a model file: the key that marks one is missing";
        return Err(refuse(None, problem.into(), written()));
    }
    let version = fields.get("version").and_then(Value::as_u64);
    let known = u64::from(OLDEST_VERSION)..=u64::from(VERSION);
    let Some(version) = version.filter(|version| known.contains(version)) else {
        let found = version.map_or("none".into(), |version| version.to_string());
        let problem = format!(
            "model version {found}; this program reads versions {OLDEST_VERSION} to {VERSION}"
        );
        return Err(refuse(None, problem, "use the version that wrote it, or fit again".into()));
    };
    let damaged = |problem: String, hint: &str| {
        refuse(None, format!("damaged model file: {problem}"), hint.into())
    };
    let stated = fields.remove(CHECKSUM);
    let is_stated = stated.is_some() || version >= u64::from(CHECKED_VERSION);
    if is_stated && damage == Damage::Refused {
        let found = checksum(&fields).map_err(|e| damaged(e.to_string(), "fit again"))?;
        if stated.as_ref().and_then(Value::as_str) != Some(&found) {
            return Err(damaged(
                "its content has not the checksum that it was written with".into(),
                "take a copy that was not changed, or fit again; `info --force` looks inside",
            ));
        }
    }
    let mut model: Calibration = serde_json::from_value(Value::Object(fields))
        .map_err(|e| damaged(e.to_string(), "fit again"))?;
    if !model.is_whole() {
        return Err(damaged("its numbers are inconsistent".into(), "fit again"));
    }
    model.version = VERSION;
    Ok(model)
}
