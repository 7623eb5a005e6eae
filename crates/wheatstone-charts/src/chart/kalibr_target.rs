//! Charts as Kalibr declares them: a YAML file with a `target_type` and its sizes, in metres.
//!
//! Source: the Kalibr wiki, "Calibration targets": `aprilgrid`, `checkerboard` and `circlegrid`. The keys stand
//! one a line, so that no reader of all of YAML is needed.

use super::{
    AnyChart, april_grid::AprilGrid, chessboard::Chessboard, dot_grid::DotGrid,
    sheet::millimetres_per,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use wheatstone_core::{Error, Result, limits, storage};

/// A target's keys with their lines and values.
struct Target<'a> {
    path: &'a Path,
    entries: BTreeMap<String, (u64, String)>,
}

/// Reads a chart whose lengths will be in `unit`.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] naming the line of what is no target, or a target of another kind;
/// [`Error::UnknownName`] for a unit whose length is not known.
pub fn read(path: &Path, unit: &str) -> Result<AnyChart> {
    let per_metre = millimetres_per(unit).map(|length| 1000.0 / length);
    let per_metre = per_metre.ok_or_else(|| Error::UnknownName {
        kind: "unit",
        name: unit.into(),
        known: super::sheet::UNITS.map(String::from).to_vec(),
    })?;
    let text = storage::read_text(path, limits::SETTINGS_BYTES)?;
    let target = Target::parse(path, &text)?;
    let chart = match target.text("target_type")? {
        "aprilgrid" => target.april_grid(per_metre)?.into(),
        "checkerboard" => target.chessboard(per_metre)?.into(),
        "circlegrid" => target.dot_grid(per_metre)?.into(),
        other => {
            let problem = format!("target_type `{other}` is not known");
            return Err(target.error("target_type", problem));
        }
    };
    Ok(chart)
}

/// Puts the chart that a target of Kalibr declares into a capture's table where its `[chart]` names the target's file; whether it does.
/// What else `[chart]` says stays.
///
/// # Errors
///
/// Those of [`read`].
pub fn declare(table: &mut toml::Table, folder: &Path) -> Result<bool> {
    let unit = table.get("unit").and_then(toml::Value::as_str).unwrap_or_default().to_owned();
    let Some(chart) = table.get_mut("chart").and_then(toml::Value::as_table_mut) else {
        return Ok(false);
    };
    // Lists of points have files of their own.
    let is_list = chart.get("type").and_then(toml::Value::as_str) == Some("point-list");
    let file = chart.get("file").and_then(toml::Value::as_str).map(PathBuf::from);
    let is_yaml = |file: &PathBuf| file.extension().is_some_and(|it| it == "yaml" || it == "yml");
    let Some(file) = file.filter(|file| !is_list && is_yaml(file)) else { return Ok(false) };
    let file = folder.join(file);
    let declared = toml::Table::try_from(read(&file, &unit)?).map_err(|e| Error::Malformed {
        path: file,
        line: None,
        problem: e.to_string(),
        hint: "declare the chart in the capture's file".into(),
    })?;
    chart.remove("file");
    for (key, value) in declared {
        chart.entry(key).or_insert(value);
    }
    Ok(true)
}

impl<'a> Target<'a> {
    fn parse(path: &'a Path, text: &str) -> Result<Self> {
        let mut own = Self { path, entries: BTreeMap::new() };
        for (line, content) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
            let content = content.split('#').next().unwrap_or_default().trim();
            if content.is_empty() || content.starts_with('%') || content == "---" {
                continue;
            }
            let Some((key, value)) = content.split_once(':') else {
                return Err(own.malformed(line, format!("`{content}` is not `key: value`")));
            };
            let bare = |text: &str| text.trim().trim_matches(['\'', '"']).to_owned();
            let key = bare(key);
            if own.entries.insert(key.clone(), (line, bare(value))).is_some() {
                return Err(own.malformed(line, format!("`{key}` is given twice")));
            }
        }
        Ok(own)
    }

    fn malformed(&self, line: u64, problem: String) -> Error {
        Error::Malformed {
            path: self.path.into(),
            line: Some(line),
            problem,
            hint: "a target of Kalibr has `target_type: 'aprilgrid'`, `'checkerboard'` or `'circlegrid'` and its sizes, one per line"
                .into(),
        }
    }

    fn error(&self, key: &str, problem: String) -> Error {
        self.malformed(self.entries.get(key).map_or(1, |entry| entry.0), problem)
    }

    fn text(&self, key: &str) -> Result<&str> {
        let missing = || self.malformed(1, format!("the key `{key}` is missing"));
        self.entries.get(key).map(|entry| entry.1.as_str()).ok_or_else(missing)
    }

    fn count(&self, key: &str) -> Result<usize> {
        let text = self.text(key)?;
        text.parse()
            .map_err(|_| self.error(key, format!("`{key}` is `{text}`, which is not a count")))
    }

    fn number(&self, key: &str) -> Result<f64> {
        let text = self.text(key)?;
        let number = text.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
        number.ok_or_else(|| self.error(key, format!("`{key}` is `{text}`, which is not a length")))
    }

    fn april_grid(&self, per_metre: f64) -> Result<AprilGrid> {
        let first = match self.entries.contains_key("codeOffset") {
            true => self.count("codeOffset")?,
            false => 0,
        };
        Ok(AprilGrid {
            columns: self.count("tagCols")?,
            rows: self.count("tagRows")?,
            tag: self.number("tagSize")? * per_metre,
            spacing: self.number("tagSpacing")?,
            first,
            ..AprilGrid::default()
        })
    }

    fn chessboard(&self, per_metre: f64) -> Result<Chessboard> {
        let pitch = self.number("colSpacingMeters")?;
        if (self.number("rowSpacingMeters")? / pitch - 1.0).abs() > 1e-6 {
            let problem = "squares must be as high as wide".into();
            return Err(self.error("rowSpacingMeters", problem));
        }
        Ok(Chessboard {
            columns: self.count("targetCols")?,
            rows: self.count("targetRows")?,
            pitch: pitch * per_metre,
            ..Chessboard::default()
        })
    }

    fn dot_grid(&self, per_metre: f64) -> Result<DotGrid> {
        let asymmetric = match self.entries.get("asymmetricGrid").map(|entry| entry.1.as_str()) {
            None | Some("False" | "false") => false,
            Some("True" | "true") => true,
            Some(other) => {
                let problem = format!("`asymmetricGrid` is `{other}`, not True or False");
                return Err(self.error("asymmetricGrid", problem));
            }
        };
        Ok(DotGrid {
            columns: self.count("targetCols")?,
            rows: self.count("targetRows")?,
            pitch: self.number("spacingMeters")? * per_metre,
            asymmetric,
            ..DotGrid::default()
        })
    }
}
