//! What can be wrong with what is given.

use crate::limits::{MOST_DISPARITIES, MOST_PENALTY};
use std::fmt;

/// Why a pair cannot be matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MatchError {
    /// A picture without pixels.
    Empty,
    /// Another number of bytes than width times height.
    Pixels {
        /// Width times height.
        expected: usize,
        /// Bytes that were given.
        given: usize,
    },
    /// Pictures of two sizes, (width, height) each.
    Sizes {
        /// Of the left picture.
        left: (usize, usize),
        /// Of the right picture.
        right: (usize, usize),
    },
    /// A range without disparities, or with more than [`MOST_DISPARITIES`].
    Range {
        /// The first disparity.
        first: i32,
        /// The one after the last.
        end: i32,
    },
    /// A range of disparities that lead out of the picture from every pixel.
    OutsidePicture {
        /// The first disparity.
        first: i32,
        /// The one after the last.
        end: i32,
        /// Of both pictures.
        width: usize,
    },
    /// Curves for pictures of another size, (width, height) each.
    CurveSize {
        /// Of the pictures that curves are for.
        curves: (usize, usize),
        /// Of the pictures.
        pictures: (usize, usize),
    },
    /// Curves that are not for all disparities of the search. Of each, the first disparity and the one after the last.
    CurveRange {
        /// What curves are for.
        curves: (i32, i32),
        /// What is searched.
        search: (i32, i32),
    },
    /// A curve whose vertical difference at a pixel of the left picture is not finite.
    CurveValue {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// Penalties that do not grow, or that leave the eight bits of a path's cost.
    Penalties,
}

impl fmt::Display for MatchError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => write!(out, "a picture has no pixels"),
            Self::Pixels { expected, given } => {
                write!(out, "a picture of {expected} pixels has {given} bytes")
            }
            Self::Sizes { left, right } => write!(
                out,
                "the left picture has {} x {} pixels and the right one {} x {}",
                left.0, left.1, right.0, right.1
            ),
            Self::Range { first, end } => write!(
                out,
                "disparities from {first} to {end} are none, or more than {}",
                MOST_DISPARITIES
            ),
            Self::OutsidePicture { first, end, width } => write!(
                out,
                "disparities from {first} to {end} lead out of a picture {width} pixels wide"
            ),
            Self::CurveSize { curves, pictures } => write!(
                out,
                "the pictures have {} x {} pixels and their epipolar curves are for {} x {}",
                pictures.0, pictures.1, curves.0, curves.1
            ),
            Self::CurveRange { curves, search } => write!(
                out,
                "disparities from {} to {} are searched and epipolar curves are from {} to {}",
                search.0, search.1, curves.0, curves.1
            ),
            Self::CurveValue { x, y } => {
                write!(out, "the epipolar curve of pixel ({x}, {y}) is not finite")
            }
            Self::Penalties => {
                write!(out, "penalties must grow: small < least <= large <= {MOST_PENALTY}")
            }
        }
    }
}

impl std::error::Error for MatchError {}
