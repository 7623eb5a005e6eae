//! The paper's recipe.

use super::{
    Fit, Network, NetworkReconstructor, Noise, Samples, Scale, SetNetwork, Targets, Training,
    scaled, scales,
};
use crate::Result;
use wheatstone_numeric::{
    backpropagation::{Backpropagation, CurvePoint},
    perceptron::{Batch, OutputActivation, Perceptron},
    progress::Progress,
    random::Random,
};

impl Network {
    /// The 2001 paper's: two hidden layers of eight units, targets scaled to 0..1, 100 000 epochs.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            hidden: vec![8, 8],
            gain: 1.0,
            output: OutputActivation::Linear,
            training: Training::Backpropagation(Backpropagation::default()),
        }
    }
}

/// Least to greatest value to 0..1.
fn range(values: &[f64]) -> Scale {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Scale { low, high }
}

/// Fits; `observe` gets every point of the learning curve, and the map as it then is.
pub(super) fn fit(
    settings: &Network,
    training: &Backpropagation,
    Samples { inputs, points, .. }: &Samples,
    (seed, progress): (u64, &dyn Progress),
    observe: &mut dyn FnMut(CurvePoint, &NetworkReconstructor),
) -> Result<Fit> {
    let targets: Vec<Vec<f64>> = points.iter().map(|p| p.iter().copied().collect()).collect();
    let input_scales = scales(inputs, &["a camera's x", "a camera's y"], range)?;
    let output_scales = scales(&targets, &["X", "Y", "Z"], range)?;
    let (unit_inputs, unit_targets) =
        (scaled(inputs, &input_scales), scaled(&targets, &output_scales));
    let mut perceptron = Perceptron::nguyen_widrow(
        &settings.sizes(inputs[0].len() / 2),
        settings.gain,
        settings.output,
        &mut Random::new(seed),
    );
    let cameras = inputs[0].len() / 2;
    let network = SetNetwork {
        cameras: (0..cameras).collect(),
        perceptron: perceptron.clone(),
        inputs: input_scales,
        outputs: [output_scales[0], output_scales[1], output_scales[2]],
        targets: Targets::World {},
        base: None,
        noise: Noise::Targets { variance: [0.0; 3] },
        weight_covariance: Vec::new(),
        modes: Vec::new(),
        effective_parameters: None,
    };
    let mut fitted = NetworkReconstructor { cameras, sets: vec![network], epipolar_check: None };
    let mut curve = Vec::new();
    let batch = Batch::new(&unit_inputs, &unit_targets);
    training.train(&mut perceptron, &batch, progress, &mut |point, network| {
        curve.push(point);
        fitted.sets[0].perceptron.clone_from(network);
        observe(point, &fitted);
    })?;
    // The spread about the training points is all that is known of the error.
    let mut variance = [0.0; 3];
    for (input, target) in unit_inputs.iter().zip(&unit_targets) {
        let out = perceptron.evaluate(input);
        for ((sum, out), wanted) in variance.iter_mut().zip(out).zip(target) {
            *sum += (out - wanted) * (out - wanted) / inputs.len() as f64;
        }
    }
    let network = &mut fitted.sets[0];
    (network.perceptron, network.noise) = (perceptron, Noise::Targets { variance });
    Ok(Fit { curve, ..Fit::of(fitted) })
}
