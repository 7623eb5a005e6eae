//! Pages in a browser, and what is true of all of them.

use serde_json::Value;
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// The browser: `CHROMIUM` in the environment, or where Debian puts it.
pub(crate) fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("CHROMIUM").map_or("/usr/bin/chromium".into(), PathBuf::from);
    if path.is_file() {
        return Some(path);
    }
    eprintln!("skipped: no {}; set CHROMIUM to test the page in a browser", path.display());
    None
}

/// A page that shows another one in a frame as wide as a phone and in one as wide as a desk, does
/// in each what the JavaScript `act` says with its `page` and writes to `told`, and tells what became of it.
fn frames(html: &str, act: &str) -> String {
    let inside = html.replace('&', "&amp;").replace('"', "&quot;");
    let frame = |width: u32| {
        format!("<iframe width={width} height=800 frameborder=0 srcdoc=\"{inside}\"></iframe>")
    };
    format!(
        "<!doctype html><meta charset=utf-8><body>{}{}<script>
        const tell = () => {{
          const told = [...document.querySelectorAll('iframe')].map((frame) => {{
            const page = frame.contentDocument, root = page.documentElement;
            const told = {{}};
            {act}
            const unnamed = [...page.querySelectorAll('button, input, select, canvas[tabindex], svg, nav, [role]')].filter((it) =>
              !(it.getAttribute('aria-label') || it.getAttribute('aria-labelledby') || it.textContent.trim() || it.closest('label')));
            return {{ ...told, ...page.body.dataset, over: root.scrollWidth - root.clientWidth, unnamed: unnamed.length,
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

/// Shows a page in both frames; it must have what it needs, show it, and complain of nothing. Returns
/// what each frame tells, with what `act` adds.
pub(crate) fn works_on_a_phone_and_on_a_desk(chromium: &Path, html: &str, act: &str) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.html");
    std::fs::write(&path, frames(html, act)).unwrap();
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
    let signs = [("&quot;", "\""), ("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")];
    let told = signs.iter().fold(told.to_owned(), |told, (coded, sign)| told.replace(coded, sign));
    let told: Value = serde_json::from_str(&told).unwrap();
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
    told.as_array().unwrap().clone()
}

/// One file may name no address: of XML spaces the names look like some.
pub(crate) fn names_no_address(html: &str) {
    let html = html.replace("http://www.w3.org/1999/xhtml", "");
    let html = html.replace("http://www.w3.org/2000/svg", "");
    for address in ["http://", "https://", "src=\"", "@import", "url("] {
        assert!(!html.contains(address), "the page holds {address}");
    }
    assert!(html.contains("default-src 'none'"));
}

/// What an attacker would call things, to break out of a page.
pub(crate) const EVIL: &str = "</script><script>document.title='broken'</script>\"'><img src=x onerror=alert(1)>{{data}}\u{202e}\u{0}";

/// Names of `EVIL` stay words: a page has its own two scripts, and its unit ends with that name.
pub(crate) fn stays_whole(html: &str) {
    assert_eq!(html.matches("<script").count(), 2);
    assert_eq!(html.matches("</script").count(), 2);
    assert!(!html.contains("<img") && !html.contains('\u{0}') && !html.contains('\u{202e}'));
    assert!(!html.contains("onerror=alert(1)>{{data}}<"));
    let data = html.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: Value = serde_json::from_str(data).unwrap();
    assert!(data["unit"].as_str().unwrap().ends_with(EVIL));
}
