//! The parts of the page, in the order in which they are read.

use super::{
    card::{card, explained},
    reconstruction, shell,
    table::table,
};
use crate::{
    FindingFigures, OutlierFigures, PictureFigures, Report, Validation, figures,
    text::{escape, figure, percent, round},
    verdict::{FAIR, HONEST, SOUND},
};
use maud::{Markup, PreEscaped, html};

/// One part.
pub(super) struct Part {
    /// Its name in addresses.
    pub(super) name: &'static str,
    /// What the list at the top calls it.
    pub(super) short: &'static str,
    pub(super) html: Markup,
}

/// All parts that there is something to show in.
pub(super) fn all(report: &Report) -> Vec<Part> {
    let drawn = |name, short, title| {
        let figures = figures::of_part(report, name);
        let cards = html! { div.figures { @for figure in &figures { (card(figure)) } } };
        let html = section(name, title, &cards);
        (!figures.is_empty()).then_some(Part { name, short, html })
    };
    let parts = [
        claims(report),
        view(report),
        drawn("accuracy", "Accuracy", "Accuracy of the points"),
        drawn("pictures", "Errors", "Errors across the pictures"),
        drawn("coverage", "Coverage", "Coverage"),
        drawn("setup", "Setup", "The setup of the paper"),
        drawn("methods", "Methods", "Methods and training"),
        reconstruction::html(report).map(|inside| {
            let html = section("reconstruction", "A scene reconstructed", &inside);
            Part { name: "reconstruction", short: "Scene", html }
        }),
        gallery(report),
        faults(report),
        (!report.points.is_empty() || !report.methods.is_empty()).then(limits),
        Some(made(report)),
    ];
    parts.into_iter().flatten().collect()
}

fn section(name: &str, title: &str, inside: &Markup) -> Markup {
    html! {
        section id=(name) aria-labelledby={ (name) "-title" } {
            h2 id={ (name) "-title" } { (title) }
            (inside)
        }
    }
}

/// Escaped, with what stands between grave accents set as code.
fn with_code(text: &str) -> Markup {
    let pieces: Vec<&str> = text.split('`').collect();
    if pieces.len().is_multiple_of(2) {
        return escape(text);
    }
    html! {
        @for (index, piece) in pieces.iter().enumerate() {
            @if index % 2 == 1 { code { (escape(piece)) } } @else { (escape(piece)) }
        }
    }
}

/// The verdict: one word, one sentence, figures, and why.
pub(super) fn verdict(report: &Report) -> Markup {
    let verdict = &report.verdict;
    let lists = [("Why", &verdict.reasons), ("What would improve it", &verdict.advice)];
    html! {
        span.grade { (escape(&verdict.grade)) }
        p.sentence { (escape(&verdict.sentence)) }
        @if report.accuracy.is_some() { dl.tiles { (tiles(report)) } }
        div.why {
            @for (title, items) in lists.iter().filter(|(_, items)| !items.is_empty()) {
                div { h2 { (title) } ul { @for item in *items { li { (with_code(item)) } } } }
            }
        }
        @if report.accuracy.is_some() || !report.methods.is_empty() {
            p.note {
                "Sound: the held-out error is at most " (SOUND.to_string())
                " times the floor, the error that pixel noise alone causes, and 70 % error ellipsoids hold at least "
                (percent(HONEST)) " of the points; fair: at most " (FAIR.to_string())
                " times; doubtful: more; unproven: no points were held out."
            }
        }
    }
}

fn tiles(report: &Report) -> Markup {
    let Some(accuracy) = &report.accuracy else { return Markup::default() };
    let unit = &report.unit;
    let mut tiles = vec![
        ("rms error", figure(accuracy.rms), unit.clone()),
        ("median error", figure(accuracy.median), unit.clone()),
        ("95 % below", figure(accuracy.p95), unit.clone()),
        ("mean, of the distance", figure(accuracy.mean_percent), "%".into()),
    ];
    if let Some(ratio) = accuracy.ratio() {
        let name =
            if accuracy.floor_rms.is_some() { "times the floor" } else { "times the error bars" };
        tiles.push((name, format!("{} ×", figure(ratio)), String::new()));
    }
    let points =
        if report.judgement == Validation::HeldOut { "held-out points" } else { "fitted points" };
    tiles.push((points, accuracy.located.to_string(), format!("of {}", accuracy.n)));
    tiles.push(("working distance", round(accuracy.working_distance), unit.clone()));
    html! {
        @for (name, value, unit) in &tiles {
            div { dt { (name) } dd { (value) " " small { (escape(unit)) } } }
        }
    }
}

/// The view in words.
const LABEL: &str = "Cameras and points in space. Arrow keys turn, with shift they move, plus and minus zoom, N and P go through the points from the largest error on, Home shows the points, R the whole rig.";

fn view(report: &Report) -> Option<Part> {
    let figures = figures::of_part(report, "scene");
    let figure = figures.first()?;
    let still = html! {
        @for panel in &figure.panels { (panel.inline()) }
        (explained(figure))
    };
    let stage = shell::stage(LABEL);
    let html = crate::html::filled(
        include_str!("view.html"),
        &[("stage", &stage), ("still", &still), ("worst", &worst(report))],
    );
    Some(Part { name: "scene", short: "3-D view", html })
}

/// Rows of the list of largest errors.
const WORST: usize = 15;

fn worst(report: &Report) -> Markup {
    let mut points: Vec<(f64, usize)> = report
        .points
        .iter()
        .enumerate()
        .filter_map(|(index, point)| Some((point.error()?, index)))
        .collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    if points.is_empty() {
        return Markup::default();
    }
    let unit = escape(&report.unit);
    html! {
        details.card {
            summary { "The largest errors, point by point" }
            div.scroll role="region" aria-label="The largest errors" tabindex="0" {
                table {
                    thead {
                        tr {
                            th { "view" }
                            th { "point" }
                            th.n { "error, " (unit) }
                            th.n { "predicted error, " (unit) }
                            th { "in the view" }
                        }
                    }
                    tbody { @for point in points.iter().take(WORST) { (worst_row(report, *point)) } }
                }
            }
        }
    }
}

fn worst_row(report: &Report, (error, index): (f64, usize)) -> Markup {
    let point = &report.points[index];
    let name = point.id.clone().unwrap_or_else(|| (index + 1).to_string());
    let view = report.point_views.get(point.view).map_or("-", String::as_str);
    html! {
        tr {
            td { bdi { (escape(view)) } }
            td { bdi { (escape(&name)) } }
            td.n { (figure(error)) }
            td.n { (point.predicted().map_or_else(|| "-".into(), figure)) }
            td {
                button.screen type="button" data-p=(index) aria-label={ "Show point " (escape(&name)) } {
                    "show"
                }
            }
        }
    }
}

fn gallery(report: &Report) -> Option<Part> {
    let inside = html! {
        div.card {
            p {
                strong { "How to read:" } " rings lie where chart points were found. "
                strong { "Ideally:" } " a ring on every point of the chart, none elsewhere."
            }
            div.gallery { @for it in report.pictures.iter().enumerate() { (picture(report, it)) } }
        }
    };
    let html = section("gallery", "Detections in the pictures", &inside);
    (!report.pictures.is_empty()).then_some(Part { name: "gallery", short: "Pictures", html })
}

fn picture(report: &Report, (index, picture): (usize, &PictureFigures)) -> Markup {
    let [width, height] = picture.size;
    // Rings of an even size on the page, whatever the size of the picture.
    let radius = width as f64 / 75.0;
    let mut path = String::new();
    for [x, y] in &picture.found {
        path += &format!(
            "M{:.1} {y:.1}a{radius:.1} {radius:.1} 0 1 0 {:.1} 0a{radius:.1} {radius:.1} 0 1 0 {:.1} 0",
            x - radius,
            2.0 * radius,
            -2.0 * radius
        );
    }
    let camera = report.cameras.get(picture.camera).map_or("", |camera| camera.name.as_str());
    let found = match &picture.problem {
        Some(problem) => format!("not found: {problem}"),
        None => format!("{} points", picture.found.len()),
    };
    let label = escape(&format!("{camera}, view {}: {found}", picture.view));
    let stroke = |parts: f64| format!("{:.1}", width as f64 / parts);
    html! {
        figure id={ "picture-" (index) } {
            svg viewBox={ "-0.5 -0.5 " (width) " " (height) } role="img" aria-label=(label) {
                image x="-0.5" y="-0.5" width=(width) height=(height) href=(picture.data) {}
                path class="ring back" stroke-width=(stroke(120.0)) d=(path) {}
                path class="ring" stroke-width=(stroke(240.0)) d=(path) {}
            }
            figcaption { (label) " " bdi { "(" (escape(&picture.name)) ")" } }
        }
    }
}

fn faults(report: &Report) -> Option<Part> {
    let mut tables = Vec::new();
    if !report.findings.is_empty() {
        let row = |found: &FindingFigures| {
            vec![
                escape(&found.severity),
                escape(&found.code),
                place(report, found),
                with_code(&found.explanation),
                with_code(&found.hint),
            ]
        };
        let rows: Vec<Vec<Markup>> = report.findings.iter().map(row).collect();
        tables.push(table("Faults", &["severity", "code", "where", "what", "what to do"], &rows));
    }
    if !report.outliers.is_empty() {
        let rows: Vec<Vec<Markup>> =
            report.outliers.iter().enumerate().map(|it| outlier(report, it)).collect();
        let heads = ["view", "point", "camera", "why", "picture"];
        tables.push(table("Excluded observations", &heads, &rows));
    }
    if !report.stage.is_empty() {
        let row = |it: &crate::StageFigures| {
            let [x, y, z] = it.offset.map(figure);
            let degrees = it.rotation.iter().map(|a| a * a).sum::<f64>().sqrt().to_degrees();
            let sigma = it.sigma.map_or_else(|| "-".into(), figure);
            [&it.view, &x, &y, &z, &figure(degrees), &sigma].map(|cell| escape(cell)).into()
        };
        let rows: Vec<Vec<Markup>> = report.stage.iter().map(row).collect();
        let heads = ["view", "X", "Y", "Z", "turned, degrees", "standard deviation"];
        let name = format!("Corrected chart positions, in {}", report.unit);
        tables.push(table(&name, &heads, &rows));
    }
    tables.extend(super::placed::html(report));
    let inside = html! { @for table in &tables { (table) } };
    let html = section("faults", "Outliers and faults", &inside);
    (!tables.is_empty()).then_some(Part { name: "faults", short: "Faults", html })
}

/// Where a fault is: views that have pictures in the page lead there.
fn place(report: &Report, found: &FindingFigures) -> Markup {
    let shown = |view: &String| report.pictures.iter().position(|it| it.view == *view);
    html! {
        @for (number, view) in found.views.iter().enumerate() {
            @if number > 0 { ", " }
            @if let Some(index) = shown(view) {
                a href={ "#picture-" (index) } { (escape(view)) }
            } @else { (escape(view)) }
        }
        " " (escape(&found.cameras.join(", ")))
    }
}

fn outlier(report: &Report, (index, outlier): (usize, &OutlierFigures)) -> Vec<Markup> {
    let name = |camera: usize| report.cameras.get(camera).map_or("", |it| it.name.as_str());
    let pieces = report.outlier_crops.iter().flat_map(|crops| crops.of.iter().enumerate());
    let crops = html! {
        @for (number, [_, camera]) in pieces.filter(|(_, [of, _])| *of == index) {
            canvas data-outlier=(number) role="img" aria-label={ "The point in " (escape(name(*camera))) } {}
        }
    };
    let camera = outlier.camera.and_then(|camera| report.cameras.get(camera));
    let camera = escape(camera.map_or("all", |camera| &camera.name));
    vec![escape(&outlier.view), escape(&outlier.id), camera, escape(&outlier.reason), crops]
}

fn claims(report: &Report) -> Option<Part> {
    if report.claims.is_empty() {
        return None;
    }
    let row = |claim: &crate::ClaimFigures| {
        [&claim.claim, &claim.measured, &claim.verdict, &claim.why].map(|text| escape(text)).into()
    };
    let rows: Vec<Vec<Markup>> = report.claims.iter().map(row).collect();
    let inside = table("Claims", &["claim", "measured", "verdict", "why"], &rows);
    let html = section("claims", "Claims tested", &inside);
    Some(Part { name: "claims", short: "Claims", html })
}

/// What no data of this kind can show, however good the figures above.
fn limits() -> Part {
    let inside = "<div class=\"card\"><p>The points were checked only against the coordinates that were given for them. Faults that affect both alike leave no trace in any figure above:</p><ul>\
        <li><strong>A uniform scale.</strong> If every length is 1 % too long (a chart printed at 99 %, a wrong pitch everywhere, centimetres taken for inches), all located points are off by the same factor. Measure one known length with the cameras.</li>\
        <li><strong>Cameras exchanged in every pair.</strong> If the pictures of two cameras are swapped everywhere, the fit is just as good, with the cameras in each other's place. Cover one lens and see which picture goes dark.</li>\
        <li><strong>A bend or a stretch that all views share.</strong> A warped board, or a stage with the same error in every step, deforms the calibrated space.</li>\
        <li><strong>What lies outside.</strong> Where no point was seen, in space or in the pictures, the calibration is extrapolated.</li>\
        <li><strong>What changes later.</strong> A camera that is moved, refocused or warmed up after the pictures were taken needs a new calibration.</li></ul></div>";
    let inside = PreEscaped(inside.into());
    let html = section("limits", "What cannot be checked from these data", &inside);
    Part { name: "limits", short: "Limits", html }
}

fn made(report: &Report) -> Part {
    let mut facts = vec![("program", escape(&report.program))];
    if let Some(command) = &report.command {
        facts.push(("command", html! { code { bdi { (escape(command)) } } }));
    }
    if let Some(method) = &report.method {
        facts.push(("method", escape(method)));
    }
    if let Some(seed) = report.seed {
        facts.push(("seed", html! { (seed) }));
    }
    facts.push(("unit of lengths", escape(&report.unit)));
    if !report.points.is_empty() {
        let (points, cameras) = (report.points.len(), report.cameras.len());
        facts.push(("points", html! { (points) " seen by " (cameras) " cameras" }));
    }
    facts.push(("form", html! { (report.format) " " (report.version) }));
    let settings = Some(&report.settings).filter(|settings| !settings.is_null());
    let settings =
        settings.map(|settings| serde_json::to_string_pretty(settings).unwrap_or_default());
    let inside = html! {
        div.card {
            dl.made { @for (name, value) in &facts { dt { (name) } dd { (value) } } }
            @if let Some(settings) = &settings {
                details { summary { "Settings" } pre { (escape_lines(settings)) } }
            }
        }
    };
    Part {
        name: "made",
        short: "How it was made",
        html: section("made", "How this was made", &inside),
    }
}

/// Escaped, with the line breaks kept.
fn escape_lines(text: &str) -> Markup {
    let lines: Vec<String> = text.lines().map(|line| escape(line).into_string()).collect();
    PreEscaped(lines.join("\n"))
}
