//! What the library does as a whole: its shape, the contracts of its extension points, synthetic
//! worlds with known answers, and real data.

mod architecture;
mod contract;
mod data;
mod paper;
mod pipeline;
mod real_charts;
mod real_points;
