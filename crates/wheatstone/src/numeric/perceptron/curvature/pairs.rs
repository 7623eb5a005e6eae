//! Pairs of layers of weights, and which entries of the curvature they make.

use super::ROWS;
use crate::numeric::{cholesky::Lower, lines::Lines};

/// Columns of the right factor are filled up to a multiple of the widest register.
pub(super) const COLUMNS: usize = 8;

/// Two layers of weights, and what their entries have added up to.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    pub(super) layers: (usize, usize),
    /// A unit of each layer, pair by pair.
    pub(super) units: Vec<(usize, usize)>,
    /// An input of each layer, or its bias, pair by pair.
    pub(super) inputs: Vec<(usize, usize)>,
    /// Pairs of units, a row each, times pairs of inputs.
    pub(super) sums: Lines<f64>,
    /// Where each sum belongs in the lower triangle; within a layer each belongs to two places.
    places: Vec<Vec<usize>>,
    /// Length of a row.
    pub(super) width: usize,
}

/// One layer of weights within the network.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub(super) below: usize,
    pub(super) here: usize,
    /// Its first weight.
    pub(super) start: usize,
    /// Its first unit below, and above the inputs.
    pub(super) first_below: usize,
    pub(super) first_here: usize,
}

impl Layer {
    /// The layers of weights of a network with so many units in each layer.
    pub(super) fn of(sizes: &[usize]) -> Vec<Self> {
        let (mut start, mut first_below, mut first_here) = (0, 0, 0);
        let layer = |sizes: &[usize]| {
            let (below, here) = (sizes[0], sizes[1]);
            let layer = Self { below, here, start, first_below, first_here };
            start += (below + 1) * here;
            first_below += below;
            first_here += here;
            layer
        };
        sizes.windows(2).map(layer).collect()
    }

    /// Place among the weights of what leads from `input` (or is the bias, after the last) to `unit`.
    fn weight(&self, unit: usize, input: usize) -> usize {
        if input < self.below {
            self.start + unit * self.below + input
        } else {
            self.start + self.below * self.here + unit
        }
    }
}

impl Pair {
    /// Of these two layers.
    pub(super) fn new(layers: &[Layer], (first, second): (usize, usize)) -> Self {
        let (a, b, same) = (layers[first], layers[second], first == second);
        let units = pairs_of_units((&a, &b), (same, first + 1 == layers.len()));
        let inputs = pairs_of_inputs((a.below, b.below), same);
        let width = inputs.len().next_multiple_of(COLUMNS);
        let sums = Lines::zeros(units.len().next_multiple_of(ROWS) * width);
        let place = |one: usize, other: usize| Lower::place(one.max(other), one.min(other));
        let mut places = vec![Vec::new(); if same { 2 } else { 1 }];
        for (one, other) in &units {
            for (p, q) in &inputs {
                places[0].push(place(a.weight(*one, *p), b.weight(*other, *q)));
                if same {
                    places[1].push(place(a.weight(*one, *q), b.weight(*other, *p)));
                }
            }
        }
        Self { layers: (first, second), units, inputs, sums, places, width }
    }

    /// Puts the entries where they belong in the lower triangle.
    pub(super) fn write_out(&self, hessian: &mut Lower) {
        let matrix = hessian.values_mut();
        for places in &self.places {
            let rows = places.chunks_exact(self.inputs.len());
            for (places, sums) in rows.zip(self.sums.chunks_exact(self.width)) {
                for (place, sum) in places.iter().zip(sums) {
                    matrix[*place] = *sum;
                }
            }
        }
    }
}

/// How far inputs are apart, counted round the layer, whose pairs are made together, and how many pairs that are:
/// each pair once.
pub(super) fn distances(inputs: usize) -> impl Iterator<Item = (usize, usize)> {
    let count = move |apart| if 2 * apart == inputs { apart } else { inputs };
    (0..=inputs / 2).map(move |apart| (apart, count(apart)))
}

/// The pairs of inputs of two layers, or of one with itself, in the order in which they are made: those with
/// the second layer's bias come last, so that eight inputs are as many products side by side and not nine.
fn pairs_of_inputs((a, b): (usize, usize), same: bool) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize)> = if same {
        let turned = |(apart, count)| (0..count).map(move |one| (one, (one + apart) % a));
        distances(a).flat_map(turned).collect()
    } else {
        (0..=a).flat_map(|one| (0..b).map(move |other| (one, other))).collect()
    };
    pairs.extend((0..=a).map(|one| (one, b)));
    pairs
}

/// The pairs of units of two layers, or of one with itself, whose weights some output depends on together: of
/// the last layer each unit has but its own output to answer for.
fn pairs_of_units((a, b): (&Layer, &Layer), (same, last): (bool, bool)) -> Vec<(usize, usize)> {
    let with = |one: usize| match (same, last) {
        (true, true) => one..one + 1,
        (true, false) => one..b.here,
        (false, _) => 0..b.here,
    };
    (0..a.here).flat_map(|one| with(one).map(move |other| (one, other))).collect()
}
