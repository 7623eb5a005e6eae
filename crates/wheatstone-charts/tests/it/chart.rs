//! Charts.

mod beside_lattices;
mod bodies;
mod chessboard;
mod kalibr_target;
mod lattice;
mod line_grid;
mod misdeclared;
mod sheet;
