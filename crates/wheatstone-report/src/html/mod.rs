//! Pages of one HTML file, which hold all that they show: text that cannot break out of its place,
//! bytes and pictures inside the page, and a policy that lets no request out.

mod digest;

use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
use wheatstone_charts::imaging::GrayImage;

/// The colours of all pages, and what their parts look like.
pub const STYLE: &str = include_str!("page.css");

/// Nothing may be loaded or sent; pictures travel inside the page, and of scripts and styles only those
/// with these digests run.
#[must_use]
pub fn policy(style: &str, script: &str) -> String {
    format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        digest::source(script),
        digest::source(style)
    )
}

/// Replaces `{{name}}` by values; what a value holds is not looked at again.
#[must_use]
pub fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut text = String::new();
    for (index, piece) in template.split("{{").enumerate() {
        match piece.split_once("}}").filter(|_| index > 0) {
            Some((name, rest)) => {
                let value = values.iter().find(|(known, _)| *known == name);
                text += value.map_or("", |(_, value)| value);
                text += rest;
            }
            None => text += piece,
        }
    }
    text
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

/// Text as HTML and SVG show it, in text and in quoted attributes. Control characters, which neither
/// may hold, and the marks that turn the direction of what follows become visible signs.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            '\t' | '\n' | '\r' => escaped.push(' '),
            c if c.is_control() => escaped.push('\u{fffd}'),
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => {
                escaped.push('\u{fffd}');
            }
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// JSON as it may stand inside a `<script>`: nothing in it ends the element or begins a comment, and
/// nothing turns the direction of what follows.
pub fn json(value: &impl serde::Serialize) -> String {
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
    coded
}

/// Base 64 with padding (RFC 4648, section 4).
#[must_use]
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |index: usize| u32::from(group.get(index).copied().unwrap_or(0));
        let all = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let letter = LETTERS[(all >> (18 - 6 * place) & 63) as usize];
            text.push(if place <= group.len() { letter as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4648, section 10.
    #[test]
    fn base_64_of_the_standard() {
        let pairs =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn nothing_escapes() {
        assert_eq!(
            escape("<a href='x'>\"&\u{0}\u{202e}"),
            "&lt;a href=&#39;x&#39;&gt;&quot;&amp;\u{fffd}\u{fffd}"
        );
        let coded = json(&"</script><!--\u{2028}&");
        assert!(!coded.contains(['<', '>', '&', '\u{2028}']));
        assert_eq!(serde_json::from_str::<String>(&coded).unwrap(), "</script><!--\u{2028}&");
    }
}
