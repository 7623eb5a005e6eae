//! The parts of the page, in the order in which they are read.

use crate::{
    FindingFigures, Judgement, OutlierFigures, PictureFigures, Report,
    figures::{self, Figure},
    plot,
    text::{escape, figure, round},
    verdict::{FAIR, SOUND},
};

/// One part.
pub(super) struct Part {
    /// Its name in addresses.
    pub(super) name: &'static str,
    /// What the list at the top calls it.
    pub(super) short: &'static str,
    pub(super) html: String,
}

/// All parts that there is something to show in.
pub(super) fn all(report: &Report) -> Vec<Part> {
    let drawn = |name, short, title| {
        let figures = figures::of_part(report, name);
        let cards: String = figures.iter().map(card).collect();
        let html = section(name, title, &format!("<div class=\"figures\">{cards}</div>"));
        (!figures.is_empty()).then_some(Part { name, short, html })
    };
    let parts = [
        view(report),
        drawn("accuracy", "Accuracy", "How good the points are"),
        drawn("pictures", "Errors", "Errors over the pictures"),
        drawn("coverage", "Coverage", "What was covered"),
        drawn("methods", "Methods", "Methods and learning"),
        gallery(report),
        faults(report),
        claims(report),
        (!report.points.is_empty() || !report.methods.is_empty()).then(limits),
        Some(made(report)),
    ];
    parts.into_iter().flatten().collect()
}

fn section(name: &str, title: &str, inside: &str) -> String {
    format!(
        "<section id=\"{name}\" aria-labelledby=\"{name}-title\"><h2 id=\"{name}-title\">{title}</h2>{inside}</section>"
    )
}

/// Escaped, with what stands between grave accents set as code.
fn with_code(text: &str) -> String {
    let pieces: Vec<&str> = text.split('`').collect();
    if pieces.len().is_multiple_of(2) {
        return escape(text);
    }
    let set = |(index, piece): (usize, &&str)| match index % 2 {
        1 => format!("<code>{}</code>", escape(piece)),
        _ => escape(piece),
    };
    pieces.iter().enumerate().map(set).collect()
}

fn list(items: &[String]) -> String {
    items.iter().map(|item| format!("<li>{}</li>", with_code(item))).collect()
}

/// The verdict: one word, one sentence, figures, and why.
pub(super) fn verdict(report: &Report) -> String {
    let verdict = &report.verdict;
    let mut html = format!(
        "<span class=\"grade\">{}</span><p class=\"sentence\">{}</p>",
        escape(&verdict.grade),
        escape(&verdict.sentence)
    );
    html += &tiles(report);
    html += "<div class=\"why\">";
    for (title, items) in
        [("Why", &verdict.reasons), ("What would make it better", &verdict.advice)]
    {
        if !items.is_empty() {
            html += &format!("<div><h2>{title}</h2><ul>{}</ul></div>", list(items));
        }
    }
    html += "</div>";
    if report.accuracy.is_some() || !report.methods.is_empty() {
        html += &format!(
            "<p class=\"note\">Sound: errors on held-out points are at most {SOUND} times what the pixels allow; fair: at most {FAIR} times; doubtful: more; unproven: no points were held out.</p>"
        );
    }
    html
}

fn tiles(report: &Report) -> String {
    let Some(accuracy) = &report.accuracy else { return String::new() };
    let unit = escape(&report.unit);
    let mut tiles = vec![
        ("rms error", figure(accuracy.rms), unit.clone()),
        ("half err less than", figure(accuracy.median), unit.clone()),
        ("95 % err less than", figure(accuracy.p95), unit.clone()),
        ("mean, of the distance", figure(accuracy.mean_percent), "%".into()),
    ];
    if let Some(ratio) = accuracy.ratio() {
        let name =
            if accuracy.floor_rms.is_some() { "what pixels allow" } else { "what was promised" };
        tiles.push((name, format!("{} ×", figure(ratio)), String::new()));
    }
    let points =
        if report.judgement == Judgement::HeldOut { "held-out points" } else { "fitted points" };
    tiles.push((points, accuracy.located.to_string(), format!("of {}", accuracy.n)));
    tiles.push(("working distance", round(accuracy.working_distance), unit));
    let tile = |(name, value, unit): &(&str, String, String)| {
        format!("<div><dt>{name}</dt><dd>{value} <small>{unit}</small></dd></div>")
    };
    format!("<dl class=\"tiles\">{}</dl>", tiles.iter().map(tile).collect::<String>())
}

/// A figure with its words.
fn card(figure: &Figure) -> String {
    let broad = if figure.panels.len() > 1 { " broad" } else { "" };
    // Drawings of several widths keep them, so that their scales stay the same.
    let several = figure.panels.len() > 1;
    let natural = several && figure.panels.iter().any(|panel| panel.size[0] < plot::WIDTH - 1.0);
    let natural = if natural { " natural" } else { "" };
    let panel = |panel: &figures::Panel| {
        let heading = if panel.heading.is_empty() {
            String::new()
        } else {
            format!("<h4>{}</h4>", escape(&panel.heading))
        };
        format!("<div>{heading}{}</div>", panel.inline())
    };
    format!(
        "<figure class=\"card{broad}\" id=\"figure-{}\"><h3>{}</h3><div class=\"panels{natural}\">{}</div><figcaption><p><strong>How to read:</strong> {}</p><p><strong>Good looks like:</strong> {}</p></figcaption></figure>",
        figure.name,
        escape(figure.title),
        figure.panels.iter().map(panel).collect::<String>(),
        escape(&figure.how),
        escape(figure.good)
    )
}

fn view(report: &Report) -> Option<Part> {
    let still = figures::of_part(report, "scene").first().map(|figure| {
        let panels: String = figure.panels.iter().map(figures::Panel::inline).collect();
        format!(
            "{panels}<p><strong>How to read:</strong> {}</p><p><strong>Good looks like:</strong> {}</p>",
            escape(&figure.how),
            escape(figure.good)
        )
    })?;
    let exaggerated = "with the errors as many times longer as the slider says";
    let html = super::filled(
        include_str!("view.html"),
        &[("still", &still), ("exaggerated", exaggerated)],
    );
    let html = html.replacen("</section>", &format!("{}</section>", worst(report)), 1);
    Some(Part { name: "scene", short: "3-D view", html })
}

/// Rows of the list of largest errors.
const WORST: usize = 15;

fn worst(report: &Report) -> String {
    let mut points: Vec<(f64, usize)> = report
        .points
        .iter()
        .enumerate()
        .filter_map(|(index, point)| Some((point.error()?, index)))
        .collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    if points.is_empty() {
        return String::new();
    }
    let row = |(error, index): &(f64, usize)| {
        let point = &report.points[*index];
        let name = point.id.clone().unwrap_or_else(|| (index + 1).to_string());
        let view = report.point_views.get(point.view).map_or("-", String::as_str);
        let promised = point.predicted().map_or_else(|| "-".into(), figure);
        format!(
            "<tr><td><bdi>{}</bdi></td><td><bdi>{}</bdi></td><td class=\"n\">{}</td><td class=\"n\">{promised}</td><td><button type=\"button\" class=\"screen\" data-p=\"{index}\" aria-label=\"Show point {}\">show</button></td></tr>",
            escape(view),
            escape(&name),
            figure(*error),
            escape(&name)
        )
    };
    let unit = escape(&report.unit);
    format!(
        "<details class=\"card\"><summary>The largest errors, point by point</summary><div class=\"scroll\" role=\"region\" aria-label=\"The largest errors\" tabindex=\"0\"><table><thead><tr><th>view</th><th>point</th><th class=\"n\">error, {unit}</th><th class=\"n\">promised, {unit}</th><th>in the view</th></tr></thead><tbody>{}</tbody></table></div></details>",
        points.iter().take(WORST).map(row).collect::<String>()
    )
}

fn gallery(report: &Report) -> Option<Part> {
    if report.pictures.is_empty() {
        return None;
    }
    let pictures: String =
        report.pictures.iter().enumerate().map(|it| picture(report, it)).collect();
    let inside = format!(
        "<div class=\"card\"><p><strong>How to read:</strong> rings lie where chart points were found. <strong>Good looks like:</strong> a ring on every point of the chart, none elsewhere.</p><div class=\"gallery\">{pictures}</div></div>"
    );
    let html = section("gallery", "What was found in the pictures", &inside);
    Some(Part { name: "gallery", short: "Pictures", html })
}

fn picture(report: &Report, (index, picture): (usize, &PictureFigures)) -> String {
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
    let words = format!("{camera}, view {}: {found}", picture.view);
    format!(
        "<figure id=\"picture-{index}\"><svg viewBox=\"-0.5 -0.5 {width} {height}\" role=\"img\" aria-label=\"{label}\"><image x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" href=\"{}\"/><path class=\"ring back\" stroke-width=\"{:.1}\" d=\"{path}\"/><path class=\"ring\" stroke-width=\"{:.1}\" d=\"{path}\"/></svg><figcaption>{label} <bdi>({})</bdi></figcaption></figure>",
        picture.data,
        width as f64 / 120.0,
        width as f64 / 240.0,
        escape(&picture.name),
        label = escape(&words)
    )
}

pub(super) fn table(name: &str, heads: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = heads.iter().map(|head| format!("<th>{}</th>", escape(head))).collect();
    let row = |cells: &Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr>{cells}</tr>")
    };
    format!(
        "<div class=\"card\"><h3>{name}</h3><div class=\"scroll\" role=\"region\" aria-label=\"{name}\" tabindex=\"0\"><table><thead><tr>{head}</tr></thead><tbody>{}</tbody></table></div></div>",
        rows.iter().map(row).collect::<String>()
    )
}

fn faults(report: &Report) -> Option<Part> {
    let mut inside = String::new();
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
        let rows: Vec<Vec<String>> = report.findings.iter().map(row).collect();
        inside += &table("Faults", &["severity", "code", "where", "what", "what to do"], &rows);
    }
    if !report.outliers.is_empty() {
        let rows: Vec<Vec<String>> =
            report.outliers.iter().enumerate().map(|it| outlier(report, it)).collect();
        inside +=
            &table("Observations set aside", &["view", "point", "camera", "why", "picture"], &rows);
    }
    if !report.stage.is_empty() {
        let row = |it: &crate::StageFigures| {
            let [x, y, z] = it.offset.map(figure);
            let degrees = it.rotation.iter().map(|a| a * a).sum::<f64>().sqrt().to_degrees();
            let sigma = it.sigma.map_or_else(|| "-".into(), figure);
            vec![escape(&it.view), x, y, z, figure(degrees), sigma]
        };
        let rows: Vec<Vec<String>> = report.stage.iter().map(row).collect();
        let unit = escape(&report.unit);
        inside += &table(
            &format!("Charts that stood elsewhere, in {unit}"),
            &["view", "X", "Y", "Z", "turned, degrees", "standard deviation"],
            &rows,
        );
    }
    inside += &super::placed::html(report);
    let html = section("faults", "Outliers and faults", &inside);
    (!inside.is_empty()).then_some(Part { name: "faults", short: "Faults", html })
}

/// Where a fault is: views that have pictures in the page lead there.
fn place(report: &Report, found: &FindingFigures) -> String {
    let view = |view: &String| {
        let shown = report.pictures.iter().position(|picture| picture.view == *view);
        let name = escape(view);
        shown.map_or(name.clone(), |index| format!("<a href=\"#picture-{index}\">{name}</a>"))
    };
    let views: Vec<String> = found.views.iter().map(view).collect();
    [views.join(", "), escape(&found.cameras.join(", "))].join(" ")
}

fn outlier(report: &Report, (index, outlier): (usize, &OutlierFigures)) -> Vec<String> {
    let pieces = report.outlier_crops.iter().flat_map(|crops| crops.of.iter().enumerate());
    let crops: String = pieces
        .filter(|(_, [of, _])| *of == index)
        .map(|(number, [_, camera])| {
            let name = report.cameras.get(*camera).map_or("", |camera| camera.name.as_str());
            format!(
                "<canvas data-outlier=\"{number}\" role=\"img\" aria-label=\"The point in {}\"></canvas>",
                escape(name)
            )
        })
        .collect();
    let camera = outlier.camera.and_then(|camera| report.cameras.get(camera));
    let camera = camera.map_or_else(|| "all".into(), |camera| escape(&camera.name));
    vec![escape(&outlier.view), escape(&outlier.id), camera, escape(&outlier.reason), crops]
}

fn claims(report: &Report) -> Option<Part> {
    if report.claims.is_empty() {
        return None;
    }
    let row = |claim: &crate::ClaimFigures| {
        let verdict = if claim.holds { "holds" } else { "does not hold" };
        vec![escape(&claim.claim), escape(&claim.measured), verdict.into()]
    };
    let rows: Vec<Vec<String>> = report.claims.iter().map(row).collect();
    let inside = table("Claims", &["what is said", "what is measured", "verdict"], &rows);
    let html = section("claims", "Claims tested", &inside);
    Some(Part { name: "claims", short: "Claims", html })
}

/// What no data of this kind can show, however good the figures above.
fn limits() -> Part {
    let inside = "<div class=\"card\"><p>The points prove themselves right only against the places that were given for them. Faults that fit both alike leave no trace in any figure above:</p><ul>\
        <li><strong>A uniform scale.</strong> If every length is 1 % too long (a chart printed at 99 %, a wrong pitch everywhere, centimetres taken for inches), all located points are off by the same factor. Measure one known length with the cameras.</li>\
        <li><strong>Cameras exchanged in every pair.</strong> If the pictures of two cameras are swapped everywhere, the fit is as good; the cameras then stand in each other's place. Cover one lens and see which picture goes dark.</li>\
        <li><strong>A bend or a stretch that all views share.</strong> A warped board, or a stage whose every step is wrong alike, shapes the world that is learned.</li>\
        <li><strong>What lies outside.</strong> Nothing is known of the space, and of the parts of the pictures, where no point was.</li>\
        <li><strong>What changes later.</strong> A camera that is moved, refocused or warmed up after the pictures were taken observes another world.</li></ul></div>";
    let html = section("limits", "What cannot be checked from these data", inside);
    Part { name: "limits", short: "Limits", html }
}

fn made(report: &Report) -> Part {
    let mut facts = vec![("program", escape(&report.program))];
    if let Some(command) = &report.command {
        facts.push(("command", format!("<code><bdi>{}</bdi></code>", escape(command))));
    }
    if let Some(method) = &report.method {
        facts.push(("method", escape(method)));
    }
    if let Some(seed) = report.seed {
        facts.push(("seed", seed.to_string()));
    }
    facts.push(("unit of lengths", escape(&report.unit)));
    if !report.points.is_empty() {
        let cameras = report.cameras.len();
        facts.push(("points", format!("{} seen by {cameras} cameras", report.points.len())));
    }
    facts.push(("form", format!("{} {}", report.format, report.version)));
    let facts: String =
        facts.iter().map(|(name, value)| format!("<dt>{name}</dt><dd>{value}</dd>")).collect();
    let settings = if report.settings.is_null() {
        String::new()
    } else {
        let text = serde_json::to_string_pretty(&report.settings).unwrap_or_default();
        format!("<details><summary>Settings</summary><pre>{}</pre></details>", escape_lines(&text))
    };
    let inside = format!("<div class=\"card\"><dl class=\"made\">{facts}</dl>{settings}</div>");
    Part {
        name: "made",
        short: "How it was made",
        html: section("made", "How this was made", &inside),
    }
}

/// Escaped, with the line breaks kept.
fn escape_lines(text: &str) -> String {
    text.lines().map(escape).collect::<Vec<_>>().join("\n")
}
