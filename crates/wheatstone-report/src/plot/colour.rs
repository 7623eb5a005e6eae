//! Colours that colour-blind readers can tell apart.

/// Cividis in ten steps, from dark blue to yellow (Nuñez, Anderton & Renslow 2018,
/// doi:10.1371/journal.pone.0199239): it rises evenly in lightness for every kind of sight.
const CIVIDIS: [[u8; 3]; 10] = [
    [0, 34, 78],
    [18, 53, 112],
    [59, 73, 108],
    [87, 93, 109],
    [112, 113, 115],
    [138, 134, 120],
    [165, 156, 116],
    [195, 179, 105],
    [225, 204, 85],
    [254, 232, 56],
];

/// The colour at `share` of the map, 0 to 1, as SVG writes it.
pub(crate) fn cividis(share: f64) -> String {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let place = share * (CIVIDIS.len() - 1) as f64;
    let below = (place.floor() as usize).min(CIVIDIS.len() - 2);
    let part = place - below as f64;
    let mix = |channel: usize| {
        let (a, b) = (f64::from(CIVIDIS[below][channel]), f64::from(CIVIDIS[below + 1][channel]));
        (a + (b - a) * part).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::cividis;

    #[test]
    fn the_ends_are_the_ends() {
        assert_eq!(cividis(0.0), "#00224e");
        assert_eq!(cividis(1.0), "#fee838");
        assert_eq!(cividis(f64::NAN), "#00224e");
    }
}
