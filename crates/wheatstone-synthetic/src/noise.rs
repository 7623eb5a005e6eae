//! What a detector adds to where a point falls.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};
use wheatstone_core::{Error, geometry::Pixel};
use wheatstone_numeric::random::Random;

/// An error of pixel coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Noise {
    /// None.
    None,
    /// Rounding to whole pixels, as the 2001 paper measured.
    Quantised,
    /// Normal, with this standard deviation in pixels.
    Normal(f64),
}

impl Noise {
    /// A pixel as a detector with this error reports it.
    pub fn apply(self, pixel: Pixel, random: &mut Random) -> Pixel {
        match self {
            Self::None => pixel,
            Self::Quantised => pixel.map(f64::round),
            Self::Normal(sigma) => {
                let mut moved = |value: f64| value + sigma * random.normal();
                Pixel::new(moved(pixel.x), moved(pixel.y))
            }
        }
    }

    /// Standard deviation of one coordinate, in pixels.
    #[must_use]
    pub fn sigma(self) -> f64 {
        match self {
            Self::None => 0.0,
            // Of a uniform error between -1/2 and 1/2.
            Self::Quantised => (1.0_f64 / 12.0).sqrt(),
            Self::Normal(sigma) => sigma,
        }
    }
}

impl FromStr for Noise {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "none" => Ok(Self::None),
            "quantised" | "quantized" => Ok(Self::Quantised),
            _ => match text.parse::<f64>() {
                Ok(sigma) if sigma >= 0.0 && sigma.is_finite() => Ok(Self::Normal(sigma)),
                _ => Err(Error::Setting {
                    setting: "noise".into(),
                    value: text.into(),
                    need: "`none`, `quantised`, or a standard deviation in pixels".into(),
                }),
            },
        }
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => write!(f, "none"),
            Self::Quantised => write!(f, "quantised"),
            Self::Normal(sigma) => write!(f, "{sigma}"),
        }
    }
}
