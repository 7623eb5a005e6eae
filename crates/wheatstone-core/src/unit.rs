//! Units of length.

/// Names of the units that convert, with their lengths in micrometres, which are whole numbers.
const UNITS: [(&str, f64); 8] = [
    ("um", 1.0),
    ("mm", 1e3),
    ("cm", 1e4),
    ("dm", 1e5),
    ("m", 1e6),
    ("km", 1e9),
    ("in", 25_400.0),
    ("ft", 304_800.0),
];

/// The names of the units that convert into each other.
pub fn names() -> impl Iterator<Item = &'static str> {
    UNITS.iter().map(|(name, _)| *name)
}

/// A unit as we write it: `um` for `µm` or `microns`; what is no unit of length that we know as it is.
#[must_use]
pub fn canonical(name: &str) -> &str {
    let name = name.trim();
    let plain = name.to_lowercase().replace("meter", "metre");
    let singular = plain.strip_suffix('s').unwrap_or(&plain);
    match singular {
        "µm" | "\u{3bc}m" | "micron" | "micrometre" => "um",
        "millimetre" => "mm",
        "centimetre" => "cm",
        "decimetre" => "dm",
        "metre" => "m",
        "kilometre" => "km",
        "inch" | "inche" | "\"" => "in",
        "foot" | "feet" => "ft",
        _ => name,
    }
}

/// Whether a name is that of a unit of something else than lengths: pixels, or angles.
#[must_use]
pub fn is_of_other_kind(name: &str) -> bool {
    let plain = name.trim().to_lowercase();
    let singular = plain.strip_suffix('s').unwrap_or(&plain);
    ["px", "pix", "pixel", "deg", "degree", "°", "rad", "radian"].contains(&singular)
}

/// What a length in one unit is multiplied by to give it in another, by any of their names; `None` where one is not known.
#[must_use]
pub fn factor(from: &str, to: &str) -> Option<f64> {
    let length =
        |unit: &str| UNITS.iter().find(|(name, _)| *name == canonical(unit)).map(|own| own.1);
    Some(length(from)? / length(to)?)
}

/// The unit by which lengths that are `ratio` times as large would be in `unit`, to a twentieth: which unit
/// they are in where they were taken for `unit`.
#[must_use]
pub fn mistaken(unit: &str, ratio: f64) -> Option<&'static str> {
    let close = |name: &&str| {
        *name != canonical(unit)
            && factor(name, unit).is_some_and(|own| (own / ratio - 1.0).abs() < 0.05)
    };
    names().find(close)
}
