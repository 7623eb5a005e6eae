//! Charts.

mod beside_lattices;
mod chessboard;
mod kalibr_target;
mod lattice;
mod line_grid;
mod misdeclared;
mod sheet;
