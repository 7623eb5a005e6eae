//! `wheatstone chart`.

use crate::failure::{Failure, Outcome};
use crate::verbosity::say;
use clap::{Args, builder::PossibleValuesParser};
use serde_json::{Value, json};
use std::path::PathBuf;
use wheatstone::{
    chart::{
        AnyChart,
        sheet::{self, Paper, Sheet},
    },
    storage,
};

/// Write a chart to print, to true scale, with its name and a ruler
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone chart --paper a4 -o board.pdf\n  \
    wheatstone chart chessboard --columns 9 --rows 6 --pitch 25 --unit mm -o chart.pdf\n  \
    wheatstone chart line-grid --columns 9 --rows 7 --pitch 5 --unit cm -o chart.pdf\n  \
    wheatstone chart dot-grid --columns 4 --rows 11 --pitch 20 --asymmetric -o chart.pdf\n  \
    wheatstone chart charuco --columns 8 --rows 6 --pitch 30 --marker 22 --dictionary DICT_5X5_100 -o chart.pdf\n  \
    wheatstone chart april-grid --columns 6 --rows 6 --tag 30 --spacing 0.3 -o chart.pdf\n\n\
    Print it at 100 %, and check the ruler along its lower edge.")]
pub(crate) struct Chart {
    /// The kind of chart
    #[arg(default_value = "chessboard", value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    kind: String,
    /// Unit of the pitch
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(sheet::UNITS))]
    unit: String,
    /// The paper that it must fit; without a size, the chart is as large as fits
    #[arg(long, value_parser = PossibleValuesParser::new(Paper::NAMES))]
    paper: Option<String>,
    /// The file to write, a PDF or an SVG drawing by its extension
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    options: ChartOptions,
}

/// What a chart looks like.
#[derive(Args, Clone)]
pub(crate) struct ChartOptions {
    /// Inner corners, crossings or dots across; squares of a charuco board, tags of an april-grid
    #[arg(long)]
    columns: Option<usize>,
    /// Inner corners, crossings or dots down; squares of a charuco board, tags of an april-grid
    #[arg(long)]
    rows: Option<usize>,
    /// Distance between neighbouring points
    #[arg(long)]
    pitch: Option<f64>,
    /// Width of a line as a fraction of the pitch (line-grid)
    #[arg(long)]
    line_width: Option<f64>,
    /// Diameter of a dot (dot-grid)
    #[arg(long)]
    diameter: Option<f64>,
    /// Every second row is shifted by the pitch (dot-grid)
    #[arg(long)]
    asymmetric: bool,
    /// The first dot is larger (dot-grid)
    #[arg(long)]
    first_larger: bool,
    /// Side of a tag (april-grid)
    #[arg(long)]
    tag: Option<f64>,
    /// Gap between tags as a fraction of their side (april-grid)
    #[arg(long)]
    spacing: Option<f64>,
    /// Side of a marker (charuco)
    #[arg(long)]
    marker: Option<f64>,
    /// The markers' dictionary, by OpenCV's name (charuco)
    #[arg(long)]
    dictionary: Option<String>,
    /// Boards with an even count of rows begin with a light square (charuco)
    #[arg(long)]
    legacy: bool,
    /// The kind of chart, if the command does not name it
    #[arg(long = "chart", value_name = "KIND", value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    chart_kind: Option<String>,
}

impl ChartOptions {
    /// Whether no length of the chart is given.
    fn sizes_are_free(&self) -> bool {
        [self.pitch, self.tag, self.marker, self.diameter].iter().all(Option::is_none)
    }

    /// The options that are given, by the names of the chart's settings.
    fn given(&self) -> impl Iterator<Item = (&'static str, Value)> {
        let given = [
            ("columns", self.columns.map(|n| json!(n))),
            ("rows", self.rows.map(|n| json!(n))),
            ("line_width", self.line_width.map(|n| json!(n))),
            ("diameter", self.diameter.map(|n| json!(n))),
            ("asymmetric", self.asymmetric.then_some(json!(true))),
            ("first_larger", self.first_larger.then_some(json!(true))),
            ("marker", self.marker.map(|n| json!(n))),
            ("dictionary", self.dictionary.as_ref().map(|name| json!(name))),
            ("tag", self.tag.map(|n| json!(n))),
            ("spacing", self.spacing.map(|n| json!(n))),
            ("legacy", self.legacy.then_some(json!(true))),
        ];
        given.into_iter().filter_map(|(name, value)| Some((name, value?)))
    }

    /// The chart that these options describe: `kind` unless they name another, its defaults for
    /// what they leave out, as large as `size` says where they do not.
    pub(crate) fn chart(&self, kind: &str, size: Option<f64>) -> Outcome<AnyChart> {
        let kind = self.chart_kind.as_deref().unwrap_or(kind);
        let as_json = |chart| (serde_json::to_value(&chart).unwrap_or_default(), chart);
        let mut all = AnyChart::all().into_iter().map(as_json);
        let Some((Value::Object(mut fields), default)) = all.find(|it| it.0["type"] == kind) else {
            return Err(not_of_kind(kind, "there is no such chart"));
        };
        if fields.contains_key("tag") && self.tag.is_some() && self.pitch.is_some() {
            let hint = "leave one of them out: both are the side of a tag";
            return Err(Failure::usage(format!("`--tag` and `--pitch` of one {kind}"), hint));
        }
        // Without a setting of its size a chart is as large as the distance of its first two points.
        let name = default.size().map(|size| size.0);
        let points = default.points();
        let known = default.size().map_or((points[1] - points[0]).norm(), |size| size.1);
        if let Some(size) = self.pitch.or(self.tag).or(size) {
            // All lengths are as large a part of it as on the default chart.
            for other in ["marker", "second", "points"] {
                if let Some(value) = fields.get_mut(other) {
                    *value = scaled(value, size / known);
                }
            }
            if let Some(name) = name {
                fields.insert(name.into(), json!(size));
            }
        }
        // A column of an asymmetric grid is two pitches wide.
        if let (true, Some(columns)) = (self.asymmetric, fields.get_mut("columns")) {
            *columns = json!(columns.as_u64().unwrap_or(0) / 2);
        }
        for (name, value) in self.given() {
            // The second level has as many less as on the default chart.
            let second = format!("second_{name}");
            let less = [name, &second].map(|name| fields.get(name).and_then(Value::as_u64));
            if let ([Some(first), Some(other)], Some(count)) = (less, value.as_u64()) {
                fields.insert(second, json!((count + other).saturating_sub(first)));
            }
            fields.insert(name.into(), value);
        }
        let chart: AnyChart = serde_json::from_value(Value::Object(fields))
            .map_err(|e| not_of_kind(kind, &e.to_string()))?;
        chart.validate()?;
        Ok(chart)
    }
}

/// An option that this kind of chart does not have, and those that it has.
fn not_of_kind(kind: &str, message: &str) -> Failure {
    let option = |name: &str| format!("`--{}`", name.replace('_', "-"));
    let mut names = message.split('`').skip(1).step_by(2);
    let Some(name) = names.next().filter(|_| message.starts_with("unknown field")) else {
        let hint = "`wheatstone chart --help` lists the options";
        return Failure::usage(format!("no {kind}: {message}"), hint);
    };
    let options = ChartOptions::augment_args(clap::Command::new(""));
    let is_option =
        |name: &str| options.get_arguments().any(|known| known.get_id().as_str() == name);
    let list: Vec<String> = names.filter(|name| is_option(name)).map(option).collect();
    Failure::usage(
        format!("{} is no option of `{kind}`", option(name)),
        format!("leave it out; `{kind}` has {}", list.join(", ")),
    )
}

/// A number, or each of a list, so many times as large.
fn scaled(value: &Value, times: f64) -> Value {
    match value {
        Value::Array(values) => values.iter().map(|value| scaled(value, times)).collect(),
        value => value.as_f64().map_or_else(|| value.clone(), |number| json!(times * number)),
    }
}

impl Chart {
    pub(crate) fn run(mut self) -> Outcome {
        let extension = self.output.extension().and_then(|end| end.to_str()).map(str::to_lowercase);
        let paper = self.paper.as_deref().map(Paper::named).transpose()?;
        if let Some(paper) = paper {
            self.fill(paper)?;
        }
        let chart = self.options.chart(&self.kind, None)?;
        let sheet = Sheet::new(&chart, &self.unit, paper)?;
        let bytes = match extension.as_deref() {
            Some("pdf") => sheet.pdf(),
            Some("svg") => sheet.svg().into_bytes(),
            _ => {
                return Err(Failure::usage(
                    format!("`{}` is neither a PDF nor an SVG file", self.output.display()),
                    "let its name end in `.pdf` or `.svg`",
                ));
            }
        };
        storage::write(&self.output, &bytes)?;
        say!("Wrote {}: {}", self.output.display(), sheet.title());
        say!("Print it at 100 %, and measure its ruler");
        Ok(())
    }

    /// Makes a chart whose size is not given as large as fits.
    fn fill(&mut self, paper: Paper) -> Outcome {
        let chart = self.options.chart(&self.kind, None)?;
        let options = &mut self.options;
        let size = match chart.size() {
            Some(("pitch", size)) if options.sizes_are_free() => (&mut options.pitch, size),
            Some(("tag", size)) if options.sizes_are_free() => (&mut options.tag, size),
            _ => return Ok(()),
        };
        let most = size.1 * sheet::largest(&chart, &self.unit, paper)?;
        *size.0 = Some(sheet::rounded_down(most, &self.unit));
        Ok(())
    }
}
