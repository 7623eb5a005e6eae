//! Links lead somewhere, pages are in the table of contents, and blocks say what they are.

use super::{docs, pages, prose, root, text};
use std::path::{Component, Path, PathBuf};

/// The links of a page: what stands between `](` and `)`.
fn links(page: &str) -> Vec<String> {
    let page = prose(page);
    page.split("](").skip(1).map(|rest| rest.split(')').next().unwrap().into()).collect()
}

/// The anchors of a page, as mdBook and others make them of its headings.
fn anchors(page: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let prose = prose(page);
    for heading in prose.lines().filter(|line| line.starts_with('#')) {
        let words = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = |letter: char| letter.is_alphanumeric() || "-_ ".contains(letter);
        let anchor: String = words.chars().filter(|letter| kept(*letter)).collect();
        let anchor = anchor.replace(' ', "-");
        let again = found.iter().filter(|other| **other == anchor).count();
        assert_eq!(again, 0, "two headings are called {words}");
        found.push(anchor);
    }
    found
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            other => plain.push(other),
        }
    }
    plain
}

/// Why a link of a page leads nowhere, if it does.
fn broken(page: &str, link: &str) -> Option<String> {
    if link.starts_with("https://") {
        return None;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let folder = Path::new(page).parent().unwrap();
    let target = if file.is_empty() { PathBuf::from(page) } else { plain(&folder.join(file)) };
    if !root().join(&target).exists() {
        return Some(format!("{page}: nothing is at {link}"));
    }
    if page.starts_with("docs/") && !target.starts_with("docs") {
        return Some(format!("{page}: {link} leads out of the site"));
    }
    let is_known = || anchors(&text(target.to_str().unwrap())).iter().any(|it| it == anchor);
    if !anchor.is_empty() && !is_known() {
        return Some(format!("{page}: {} has no heading #{anchor}", target.display()));
    }
    None
}

#[test]
fn every_link_leads_somewhere() {
    let mut all: Vec<String> = pages().iter().map(|page| format!("docs/{page}")).collect();
    for page in ["docs/SUMMARY.md", "README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"] {
        all.push(page.into());
    }
    let (mut wrong, mut count) = (Vec::new(), 0);
    for page in &all {
        for link in links(&text(page)) {
            count += 1;
            wrong.extend(broken(page, &link));
        }
    }
    assert!(count > 200, "{count} links");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn links_that_lead_nowhere_are_noticed() {
    assert!(broken("docs/charts.md", "formats.md#cameras").is_none());
    assert!(broken("docs/charts.md", "formats.md#no-such-heading").is_some());
    assert!(broken("docs/tutorial/stage.md", "formats.md").is_some());
    assert!(broken("docs/charts.md", "../README.md").is_some());
}

#[test]
fn every_page_is_in_the_table_of_contents_once() {
    let listed = links(&text("docs/SUMMARY.md"));
    for page in pages() {
        let count = listed.iter().filter(|link| **link == page).count();
        assert_eq!(count, 1, "{page} stands {count} times in SUMMARY.md");
    }
}

/// The languages of blocks: what is run (`console`, `rust`), and what is not.
const LANGUAGES: [&str; 7] =
    ["```console", "```rust", "```bash", "```text", "```toml", "```python", "```csv"];

#[test]
fn every_block_says_what_it_is() {
    for page in pages() {
        let page_text = text(&format!("docs/{page}"));
        let mut inside: Option<&str> = None;
        for (number, line) in page_text.lines().map(str::trim_start).enumerate() {
            let place = format!("docs/{page}:{}: {line}", number + 1);
            if !line.starts_with("```") {
                let unsaid = inside == Some("```bash") && line.starts_with("wheatstone ");
                assert!(!unsaid, "{place}: a command that is not run stands in `text`");
            } else if inside.take().is_none() {
                assert!(LANGUAGES.contains(&line), "{place}: a language of {LANGUAGES:?}");
                inside = Some(line);
            }
        }
    }
}

#[test]
fn every_program_in_rust_is_compiled() {
    let facade = text("crates/wheatstone/src/lib.rs");
    let mut count = 0;
    for page in pages() {
        if text(&format!("docs/{page}")).contains("```rust") {
            count += 1;
            let included = facade.contains(&format!("include_str!(\"../../../docs/{page}\")"));
            assert!(included, "{page} has Rust that `crates/wheatstone/src/lib.rs` does not test");
        }
    }
    assert!(count >= 2 && docs().is_dir());
}
