//! What the paper says, and whether it is so.

use super::{BeyondPoint, Claim, Reproduction, Verdict};
use wheatstone_numeric::least_squares::solve;

fn claim(claim: &str, measured: String, holds: bool) -> Claim {
    let verdict = if holds { Verdict::Confirmed } else { Verdict::NotConfirmed };
    Claim { claim: claim.into(), measured, verdict }
}

/// Root mean square of what a growth `a + b (Z - 140)^power` from the end of the trained range leaves,
/// in percent.
pub(super) fn growth_residual(points: &[BeyondPoint], power: i32) -> f64 {
    let growth = |point: &BeyondPoint| (point.distance - 140.0).powi(power);
    let rows: Vec<f64> = points.iter().flat_map(|point| [1.0, growth(point)]).collect();
    let values: Vec<f64> = points.iter().map(|point| point.percent).collect();
    let Some(fit) = solve(&rows, 2, &values, 1) else { return f64::NAN };
    let squares = points.iter().map(|p| (p.percent - fit[0] - fit[1] * growth(p)).powi(2));
    (squares.sum::<f64>() / points.len() as f64).sqrt()
}

/// Each claim beside its figure.
pub(super) fn judge(all: &Reproduction, epochs: u64) -> Vec<Claim> {
    let mut claims = Vec::new();
    if let Some(last) = all.figure_5.last() {
        let p = last.exam_percent;
        claims.push(claim(
            "figure 5: the mean error comes down to 4.33 % after 100 000 epochs",
            format!(
                "{:.2} % after {epochs} epochs, {:.2} to {:.2} over the seeds",
                p.median, p.least, p.greatest
            ),
            p.median <= 4.33,
        ));
    }
    if let Some(point) = all.figure_5.iter().find(|point| point.epoch >= 40_000.min(epochs)) {
        claims.push(claim(
            "figure 5: the mean error is below 5 % after 40 000 epochs",
            format!("{:.2} % at {}", point.exam_percent.median, point.epoch),
            point.exam_percent.median < 5.0,
        ));
    }
    let falls = all
        .figure_5
        .windows(2)
        .all(|pair| pair[1].training_percent.median <= 1.05 * pair[0].training_percent.median);
    claims.push(claim(
        "figure 5: the error falls steadily",
        format!(
            "its median over the seeds {} rises by more than a twentieth",
            if falls { "never" } else { "sometimes" }
        ),
        falls,
    ));
    for curve in &all.figure_6 {
        let linear = curve.linear_residual <= curve.quadratic_residual;
        let which = if linear { "a straight line" } else { "a parabola" };
        let measured = format!(
            "{which} fits better: {:.3} % is left by the line, {:.3} % by the parabola",
            curve.linear_residual, curve.quadratic_residual
        );
        match curve.method.as_str() {
            "network of 2001" => claims.push(claim(
                "figure 6: beyond the trained range the network's error in Z, in percent, grows linearly",
                measured,
                linear,
            )),
            "dlt" | "interpolation" => claims.push(claim(
                &format!("figure 6: that of {} grows as the square", curve.method),
                measured,
                !linear,
            )),
            _ => {}
        }
    }
    claims.extend(architectures(all));
    claims.extend(rivals(all));
    claims
}

fn architectures(all: &Reproduction) -> Option<Claim> {
    let medians: Vec<f64> = all.architectures.iter().map(|net| net.exam_percent.median).collect();
    let least = medians.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = medians.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (!medians.is_empty()).then(|| {
        claim(
            "other architectures change little but the time to converge",
            format!(
                "medians of {} networks lie between {least:.2} and {greatest:.2} %",
                medians.len()
            ),
            greatest < 2.0 * least,
        )
    })
}

fn rivals(all: &Reproduction) -> Option<Claim> {
    let network = all.figure_5.last()?.exam_percent.median;
    let named = |name: &str| all.comparison.iter().find(|row| row.method == name);
    let (tsai, brown) = (named("tsai")?.inside_percent, named("brown")?.inside_percent);
    let best = tsai.min(brown);
    Some(claim(
        "the accuracy is comparable with that of standard calibration",
        format!(
            "{network:.2} % against {tsai:.2} (Tsai) and {brown:.2} (Brown); the same layers trained as they are by default: {:.2}",
            named("network")?.inside_percent
        ),
        network < 1.5 * best,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growths_are_told_apart() {
        let points = |power: i32| -> Vec<BeyondPoint> {
            (0..=10)
                .map(|step| {
                    let distance = 150.0 + 5.0 * f64::from(step);
                    BeyondPoint { distance, percent: 2.0 + 0.1 * (distance - 140.0).powi(power) }
                })
                .collect()
        };
        assert!(growth_residual(&points(1), 1) < 1e-9 && growth_residual(&points(1), 2) > 0.1);
        assert!(growth_residual(&points(2), 2) < 1e-9 && growth_residual(&points(2), 1) > 1.0);
    }
}
