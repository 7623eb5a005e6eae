//! Pairs of layers of weights, and which entries of the curvature they make.

use crate::{aligned::AlignedVec, cholesky::Lower};

/// Columns of the right factor are filled up to a multiple of the widest register.
pub(super) const COLUMNS: usize = 8;

/// Rows of the left factor that are multiplied at a time.
pub(super) const ROWS: usize = 4;

/// Two layers of weights, and what their entries have added up to.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    pub(super) layers: (usize, usize),
    /// A unit of each layer, pair by pair.
    pub(super) units: Vec<(usize, usize)>,
    /// An input of each layer, or its bias, pair by pair.
    pub(super) inputs: Vec<(usize, usize)>,
    /// Pairs of units, a row each, times pairs of inputs.
    pub(super) sums: AlignedVec<f64>,
    /// Where each sum belongs in the lower triangle; within a layer each belongs to two places.
    places: Vec<Vec<u32>>,
    /// Length of a row of sums.
    pub(super) width: usize,
    /// What the columns of the right factor are made of.
    pub(super) blocks: Vec<Block>,
}

/// Columns of a right factor side by side, as many inputs of a layer times what they are multiplied by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// The layer whose inputs they are, and the first of them: the inputs may go round, and the bias comes last.
    pub(super) layer: usize,
    pub(super) from: usize,
    pub(super) factor: Factor,
    /// The first column.
    pub(super) first: usize,
    pub(super) count: usize,
}

/// What inputs are multiplied by.
#[derive(Clone, Copy, Debug)]
pub(super) enum Factor {
    /// Those of the same layer so far behind.
    Behind(usize),
    /// One input of the first layer.
    Input(usize),
    /// A bias's 1.
    One,
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

    /// Length of a row of its inputs, twice, and the 1 of the biases: the last register is read whole.
    pub(super) fn row(&self) -> usize {
        (2 * self.below + COLUMNS).next_multiple_of(COLUMNS)
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
        let blocks = blocks((first, a.below), (second, b.below));
        let inputs: Vec<(usize, usize)> =
            blocks.iter().flat_map(|block| block.pairs((a.below, b.below))).collect();
        let width = inputs.len().next_multiple_of(COLUMNS);
        let sums = AlignedVec::zeros(units.len().next_multiple_of(ROWS) * width);
        // Half as long as a word, so that they stay in the second cache.
        let place = |one: usize, other: usize| Lower::place(one.max(other), one.min(other)) as u32;
        let mut places = vec![Vec::new(); if same { 2 } else { 1 }];
        for (one, other) in &units {
            for (p, q) in &inputs {
                places[0].push(place(a.weight(*one, *p), b.weight(*other, *q)));
                if same {
                    places[1].push(place(a.weight(*one, *q), b.weight(*other, *p)));
                }
            }
        }
        Self { layers: (first, second), units, inputs, sums, places, width, blocks }
    }

    /// Puts the entries where they belong in the lower triangle.
    pub(super) fn write_out(&self, hessian: &mut Lower) {
        let matrix = hessian.values_mut();
        for places in &self.places {
            let rows = places.chunks_exact(self.inputs.len());
            for (places, sums) in rows.zip(self.sums.chunks_exact(self.width)) {
                for (place, sum) in places.iter().zip(sums) {
                    matrix[*place as usize] = *sum;
                }
            }
        }
    }
}

impl Block {
    /// An input of each of two layers, pair by pair.
    fn pairs(self, (a, b): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        (self.from..self.from + self.count).map(move |own| match self.factor {
            Factor::Behind(apart) => (own, (own + apart) % a),
            Factor::Input(input) => (input, own),
            // The second layer's bias, or the first's.
            Factor::One if self.from > 0 => (own - a, b),
            Factor::One => (a, own),
        })
    }
}

/// What the pairs of inputs of two layers are made of, or of one with itself, each pair once: those with the second
/// layer's bias come last, so that eight inputs are as many products side by side and not nine.
fn blocks((one, a): (usize, usize), (other, b): (usize, usize)) -> Vec<Block> {
    let of = |layer, factor, count| Block { layer, from: 0, factor, first: 0, count };
    let mut blocks: Vec<Block> = if one == other {
        // How far inputs are apart, counted round the layer.
        let count = |apart| if 2 * apart == a { apart } else { a };
        (0..=a / 2).map(|apart| of(one, Factor::Behind(apart), count(apart))).collect()
    } else {
        let inputs = (0..a).map(Factor::Input).chain([Factor::One]);
        inputs.map(|factor| of(other, factor, b)).collect()
    };
    blocks.push(Block { from: a, ..of(one, Factor::One, a + 1) });
    let mut first = 0;
    for block in &mut blocks {
        block.first = first;
        first += block.count;
    }
    blocks
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
