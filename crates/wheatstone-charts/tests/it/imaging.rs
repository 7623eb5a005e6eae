//! Pictures.

mod decode;
mod filter;
mod raw;
