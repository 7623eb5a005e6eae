//! By how much units differ that get mixed.

/// Units that get mixed, as ratios: decimal ones, and inches with millimetres and centimetres.
const RATIOS: [f64; 7] = [10.0, 100.0, 1000.0, 25.4, 2.54, 0.0254, 0.3048];

/// The ratios of units, each both ways.
pub(super) fn unit_ratios() -> impl Iterator<Item = f64> {
    RATIOS.iter().flat_map(|ratio| [*ratio, 1.0 / ratio])
}

/// The ratio that a scale is, but for its error.
pub(super) fn as_ratio(scale: f64) -> Option<f64> {
    unit_ratios().find(|known| (scale / known - 1.0).abs() < 5e-3)
}

/// A ratio in as few figures as it has.
pub(super) fn tidy(ratio: f64) -> String {
    let text = format!("{ratio:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
