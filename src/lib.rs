//! Placeholder.

pub mod simulate;
