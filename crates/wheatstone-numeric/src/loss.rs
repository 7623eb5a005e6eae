//! What an error costs.
//!
//! Source of the robust one: Holland & Welsch 1977 (doi:10.1080/03610927708827533).

/// How an error counts.
#[derive(Clone, Copy, Debug)]
pub enum Loss {
    /// By its square.
    Squares,
    /// By Cauchy's function, with this scale in pixels.
    Cauchy(f64),
}

impl Loss {
    /// Cost and weight of a squared error.
    #[must_use]
    pub fn of(self, square: f64) -> (f64, f64) {
        match self {
            Self::Squares => (0.5 * square, 1.0),
            Self::Cauchy(scale) => {
                let ratio = square / (scale * scale);
                (0.5 * scale * scale * libm::log1p(ratio), 1.0 / (1.0 + ratio))
            }
        }
    }
}
