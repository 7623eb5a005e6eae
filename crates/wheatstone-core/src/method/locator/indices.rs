//! Few rows among many.

/// Where the few values are that a test holds of: many are passed over at once where it holds of none.
pub(super) fn indices_where(values: &[f64], test: impl Fn(f64) -> bool) -> Vec<usize> {
    const PART: usize = 32;
    let mut found = Vec::new();
    for (number, part) in values.chunks(PART).enumerate() {
        if part.iter().fold(false, |any, value| any | test(*value)) {
            let own = part.iter().enumerate().filter(|(_, value)| test(**value));
            found.extend(own.map(|(index, _)| number * PART + index));
        }
    }
    found
}
