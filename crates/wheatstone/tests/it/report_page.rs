//! The report's page in a browser, where there is one.

use std::{path::PathBuf, process::Command};
use wheatstone::{
    Calibration,
    chart::line_grid::LineGrid,
    method::AnyMethod,
    numeric::progress::Silent,
    report::{Material, Report},
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

/// The browser: `CHROMIUM` in the environment, or where Debian puts it.
fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("CHROMIUM").map_or("/usr/bin/chromium".into(), PathBuf::from);
    if path.is_file() {
        return Some(path);
    }
    eprintln!("skipped: no {}; set CHROMIUM to test the page in a browser", path.display());
    None
}

fn html() -> String {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid::default().into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), Some(150));
    let method = AnyMethod::named("dlt").unwrap();
    let model = Calibration::fit(
        &method,
        &wheatstone::preparation::Prepared::as_given(data.clone()),
        0,
        false,
        &Silent,
    )
    .unwrap();
    let material = Material {
        wording: wheatstone::report::Wording::default(),
        title: "a <model> & \"more\"".into(),
        command: None,
        model: &model,
        comparison: None,
        truth: Some(&rig.cameras),
        seen: None,
        held_out: true,
    };
    Report::of(&material, &Silent).unwrap().html()
}

/// A page that shows the report in a frame as wide as a phone and in one as wide as a desk, and
/// tells what became of it.
fn frames(html: &str) -> String {
    let inside = html.replace('&', "&amp;").replace('"', "&quot;");
    let frame = |width: u32| {
        format!("<iframe width={width} height=800 frameborder=0 srcdoc=\"{inside}\"></iframe>")
    };
    format!(
        "<!doctype html><meta charset=utf-8><body>{}{}<script>
        const tell = () => {{
          const told = [...document.querySelectorAll('iframe')].map((frame) => {{
            const page = frame.contentDocument, root = page.documentElement;
            const unnamed = [...page.querySelectorAll('button, input, select, canvas[tabindex], svg, nav, [role]')].filter((it) =>
              !(it.getAttribute('aria-label') || it.getAttribute('aria-labelledby') || it.textContent.trim() || it.closest('label')));
            return {{ ...page.body.dataset, over: root.scrollWidth - root.clientWidth, unnamed: unnamed.length,
              headings: page.querySelectorAll('h1').length, landmarks: page.querySelectorAll('main, header, footer').length }};
          }});
          document.body.dataset.told = JSON.stringify(told);
          document.querySelectorAll('iframe').forEach((frame) => frame.removeAttribute('srcdoc'));
        }};
        const wait = () => [...document.querySelectorAll('iframe')].every((frame) =>
          frame.contentDocument && frame.contentDocument.body && frame.contentDocument.body.dataset.ready
          && frame.contentDocument.body.dataset.ready !== 'no') ? tell() : setTimeout(wait, 50);
        wait();
        </script>",
        frame(390),
        frame(1600)
    )
}

#[test]
fn the_page_works_on_a_phone_and_on_a_desk_and_asks_nobody() {
    let Some(chromium) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.html");
    std::fs::write(&path, frames(&html())).unwrap();
    let output = Command::new(chromium)
        .args(["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
        .args(["--enable-unsafe-swiftshader", "--window-size=2200,1000", "--dump-dom"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=60000", "--disable-gpu-sandbox"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", path.display()))
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(!log.contains("CONSOLE"), "the page complains: {log}");
    let dom = String::from_utf8_lossy(&output.stdout);
    let told = dom.split("data-told=\"").nth(1).and_then(|rest| rest.split('"').next());
    let told = told.unwrap_or_else(|| panic!("the page never was ready: {log}"));
    let told: serde_json::Value = serde_json::from_str(&told.replace("&quot;", "\"")).unwrap();
    for frame in told.as_array().unwrap() {
        assert_eq!(frame["errors"], "0", "{frame}");
        assert_eq!(frame["over"], 0, "it must not scroll sideways: {frame}");
        assert_eq!(frame["unnamed"], 0, "every control has a name: {frame}");
        assert_eq!((frame["headings"].as_u64(), frame["landmarks"].as_u64()), (Some(1), Some(3)));
        // Some browsers have no WebGL even in software: then the still drawing must be there.
        if frame["ready"] == "3d" {
            let painted: u64 = frame["painted"].as_str().unwrap().parse().unwrap();
            assert!(painted > 500, "the view is empty: {frame}");
        } else {
            assert_eq!(frame["ready"], "static");
        }
    }
}
