//! Tests of the library from outside.

mod data;
mod real_charts;
