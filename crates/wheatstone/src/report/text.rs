//! Figures, words and bytes as the page can hold them.

/// Three significant digits, so that figures of all sizes read alike.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "none".into();
    }
    let digits = libm::floor(libm::log10(value.abs())) as i32;
    if !(-4..6).contains(&digits) {
        return format!("{value:.2e}");
    }
    let places = (2 - digits).max(0) as usize;
    let text = format!("{value:.places$}");
    // Rounding up may have gained a digit: 9.999 is 10.0.
    match text.trim_start_matches('-').trim_start_matches("0.").find('.') {
        Some(point) if point + places > 3 => format!("{value:.*}", places - 1),
        _ => text,
    }
}

/// A distance as one says it: whole numbers, two digits below ten.
pub(super) fn round(value: f64) -> String {
    if value.abs() >= 10.0 && value.abs() < 1e6 {
        return format!("{value:.0}");
    }
    let text = figure(value);
    match text.strip_suffix(|c: char| c.is_ascii_digit()) {
        Some(shorter) if text.contains('.') && !text.contains('e') => {
            shorter.trim_end_matches('.').into()
        }
        _ => text,
    }
}

/// A share as whole percent.
pub(super) fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Text as HTML and SVG show it, in text and in quoted attributes. Control characters, which neither
/// may hold, and the marks that turn the direction of what follows become visible signs.
pub(super) fn escape(text: &str) -> String {
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
pub(super) fn json(value: &impl serde::Serialize) -> String {
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
pub(super) fn base64(bytes: &[u8]) -> String {
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

    #[test]
    fn figures_have_three_digits() {
        for (value, text) in [
            (0.0123456, "0.0123"),
            (0.5, "0.500"),
            (9.999, "10.0"),
            (0.9999, "1.00"),
            (99.96, "100"),
            (12.345, "12.3"),
            (-1.5, "-1.50"),
            (1234.5, "1234"),
            (3e-7, "3.00e-7"),
            (0.0, "0"),
            (f64::NAN, "none"),
        ] {
            assert_eq!(figure(value), text);
        }
        for (value, text) in [(98.4, "98"), (100.0, "100"), (1.234, "1.2"), (0.97, "0.97")] {
            assert_eq!(round(value), text);
        }
    }

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
