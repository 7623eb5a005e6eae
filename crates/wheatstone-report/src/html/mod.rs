//! Pages of one HTML file, which hold all that they show: text that cannot break out of its place,
//! bytes and pictures inside the page, and a policy that lets no request out.

use base64::{Engine, engine::general_purpose::STANDARD};
use hmac_sha256::Hash;
use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
use maud::{Markup, PreEscaped, Render};
use wheatstone_charts::imaging::GrayImage;

/// The colours of all pages, and what their parts look like.
pub const STYLE: &str = include_str!("page.css");

/// Nothing may be loaded or sent; pictures travel inside the page, and of scripts and styles only those
/// with these digests run.
#[must_use]
pub fn policy(style: &str, script: &str) -> String {
    format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        source(script),
        source(style)
    )
}

/// How a policy names a script or a style: `sha256-` and the digest.
fn source(text: &str) -> String {
    format!("sha256-{}", base64(&Hash::hash(text.as_bytes())))
}

/// Replaces `{{name}}` by values, each escaped as its type says; what a value holds is not looked at
/// again.
#[must_use]
pub fn filled(template: &str, values: &[(&str, &dyn Render)]) -> Markup {
    let mut text = String::new();
    for (index, piece) in template.split("{{").enumerate() {
        match piece.split_once("}}").filter(|_| index > 0) {
            Some((name, rest)) => {
                if let Some((_, value)) = values.iter().find(|(known, _)| *known == name) {
                    value.render_to(&mut text);
                }
                text += rest;
            }
            None => text += piece,
        }
    }
    PreEscaped(text)
}

/// A picture as an address that holds it: JPEG of a quality from 1 to 100. `None` for a picture of no
/// pixels.
#[must_use]
pub fn jpeg(image: &GrayImage, quality: u8) -> Option<String> {
    let bytes = image.to_8_bit();
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality)
        .encode(bytes.as_raw(), bytes.width(), bytes.height(), ExtendedColorType::L8)
        .ok()?;
    Some(format!("data:image/jpeg;base64,{}", base64(&file)))
}

/// Text as HTML and SVG show it, in text and in attributes in double quotation marks. Control characters, which neither
/// may hold, and the marks that turn the direction of what follows become visible signs.
#[must_use]
pub fn escape(text: &str) -> Markup {
    let visible = |letter| match letter {
        '\t' | '\n' | '\r' => ' ',
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => '\u{fffd}',
        '\u{fffe}' | '\u{ffff}' => '\u{fffd}',
        c if c.is_control() => '\u{fffd}',
        c => c,
    };
    text.chars().map(visible).collect::<String>().render()
}

/// JSON as it may stand inside a `<script>`: nothing in it ends the element or begins a comment, and
/// nothing turns the direction of what follows.
pub fn json(value: &impl serde::Serialize) -> Markup {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".into());
    let mut coded = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '<'
            | '>'
            | '&'
            | '\u{200e}'
            | '\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2066}'..='\u{2069}' => coded += &format!("\\u{:04x}", u32::from(letter)),
            c => coded.push(c),
        }
    }
    PreEscaped(coded)
}

/// Base 64 with padding (RFC 4648, section 4).
#[must_use]
pub fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}
