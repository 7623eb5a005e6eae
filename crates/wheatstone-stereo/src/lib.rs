//! Dense stereo matching of a rectified pair.
//!
//! Two cameras that look in one direction see a point in one row of both pictures, farther to the left in the right one: by the
//! *disparity*, x on the left less x on the right, in pixels, which falls with the distance. A [`Matcher`] finds it for
//! every pixel of the left picture, says how probable it is that it is right, and how exact it is. It knows nothing of
//! cameras: disparities become distances elsewhere.
//!
//! ```
//! use wheatstone_stereo::{Matcher, Picture};
//!
//! // A texture that the right camera sees five pixels farther to the left.
//! let (width, height) = (96, 48);
//! let texture = |x: usize, y: usize| ((x * x * 7 + y * y * 13 + x * y * 5) % 251) as u8;
//! let picture = |shift: usize| -> Vec<u8> {
//!     (0..width * height).map(|at| texture(at % width + shift, at / width)).collect()
//! };
//! let (left, right) = (picture(0), picture(5));
//! let left = Picture::new(width, height, &left)?;
//! let right = Picture::new(width, height, &right)?;
//!
//! let map = Matcher::new(0..16).compute(&left, &right)?;
//! let found = map.at(60, 20).ok_or("no disparity")?;
//! assert!((found.disparity - 5.0).abs() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The way of the data
//!
//! 1. `census` makes codes of both pictures, and `cost` compares those of a pixel and of its `candidates`.
//! 2. `aggregation` adds costs along four paths, in `bands` of rows, and `winner` takes the best candidate: this is
//!    semi-global matching (Hirschmüller 2008, doi:10.1109/TPAMI.2007.1166).
//! 3. `left_right`, `median` and `speckles` take away what the right picture, the neighbours or the size of the surface contradict.
//! 4. `warp` moves the right picture onto the left one, `agreement` compares them, `neighbourhood` looks farther around, and
//!    `confidence` makes one probability of all `evidence`.
//! 5. `least_squares` refines, `error_bars` says how exact the result is, and `filling` fills gaps. `saturation` and `repetition`
//!    take confidence away where a picture shows nothing, or a copy that the search cannot see.
//!
//! Several frames of one scene are put together by [`DisparityFusion`]. [`vertical_offset`] tells beforehand whether a pair is rectified. Where no rectification is possible, as behind flat ports,
//! [`EpipolarCurves`] say where candidates lie, and [`Matcher::compute_along`] follows them.

mod limits;
mod error;
mod picture;
mod registers;
mod buffers;
mod field;
mod search_range;
mod cubic;
mod curves;
mod pair;
mod census;
mod quarter_rows;
mod candidates;
mod cost;
mod aggregation;
mod winner;
mod bands;
mod left_right;
mod median;
mod speckles;
mod warp;
mod window;
mod agreement;
mod neighbourhood;
mod coefficients;
mod evidence;
mod confidence;
mod slopes;
mod least_squares;
mod noise_correlation;
mod error_bars;
mod filling;
mod map;
mod saturation;
mod repetition;
mod matcher;
mod fusion;
mod offset_pattern;
mod vertical;
mod pair_fault;

pub use aggregation::Penalties;
pub use curves::EpipolarCurves;
pub use error::MatchError;
pub use error_bars::doubt_factor;
pub use evidence::Evidence;
pub use fusion::DisparityFusion;
pub use limits::{MOST_DISPARITIES, MOST_PENALTY};
pub use map::{CONFIDENT, DisparityMap, Match};
pub use matcher::Matcher;
pub use pair_fault::{PairFault, PairJudgement, judge_pair};
pub use picture::Picture;
pub use vertical::{CornerOffset, VerticalOffset, vertical_offset};
