//! The log of a reconstruction, where one is wanted.

use crate::failure::Outcome;
use std::{
    io::{self, BufWriter},
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error,
    reconstruction::{EncodedPicture, McapLog, Reconstruction, SceneReconstructor},
    storage::Output,
};

/// Frames as they are reconstructed, one second each; the file appears when all are there.
pub(super) struct Log<'s, 'm>(Option<Open<'s, 'm>>);

struct Open<'s, 'm> {
    path: PathBuf,
    log: McapLog<'s, 'm, BufWriter<Output>>,
    frames: u32,
}

impl<'s, 'm> Log<'s, 'm> {
    pub(super) fn create(
        path: Option<&Path>,
        made: &'s SceneReconstructor<'m>,
        model: &Calibration,
    ) -> Outcome<Self> {
        let Some(path) = path else { return Ok(Self(None)) };
        let out = BufWriter::new(Output::create(path)?);
        let log = McapLog::new(made, &model.unit, out).map_err(|source| failed(path, source))?;
        Ok(Self(Some(Open { path: path.into(), log, frames: 0 })))
    }

    pub(super) fn frame(&mut self, files: &[PathBuf], found: &Reconstruction) -> Outcome {
        let Some(open) = &mut self.0 else { return Ok(()) };
        let pictures: Vec<Option<(&str, Vec<u8>)>> =
            files.iter().map(|file| picture(file)).collect::<Result<_, _>>()?;
        let pictures: Vec<Option<EncodedPicture>> = pictures
            .iter()
            .map(|own| own.as_ref().map(|(format, bytes)| EncodedPicture { format, bytes }))
            .collect();
        let written = open.log.frame(f64::from(open.frames), &pictures, found);
        written.map_err(|source| failed(&open.path, source))?;
        open.frames += 1;
        Ok(())
    }

    pub(super) fn commit(self) -> Outcome {
        let Some(Open { path, log, .. }) = self.0 else { return Ok(()) };
        let finished = log.finish().and_then(|out| out.into_inner().map_err(io::Error::from));
        Ok(finished.map_err(|source| failed(&path, source))?.commit()?)
    }
}

/// A file as it is, where viewers read its format.
fn picture(path: &Path) -> Result<Option<(&'static str, Vec<u8>)>, Error> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let format = match extension.to_str() {
        Some("png") => "png",
        Some("jpg" | "jpeg") => "jpeg",
        _ => return Ok(None),
    };
    let bytes = std::fs::read(path).map_err(|source| Error::reading(path, source))?;
    Ok(Some((format, bytes)))
}

fn failed(path: &Path, source: io::Error) -> Error {
    Error::Io { action: "write", path: path.into(), source }
}
