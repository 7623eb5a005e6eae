//! Why a computation on numbers ended without a result.

/// Shorthand for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data cannot determine what is asked, however many there are.
    #[error("{problem}")]
    Degenerate {
        /// What is degenerate.
        problem: String,
        /// What to add or change.
        hint: String,
    },
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
}
