//! The form in which the files of built-in measures describe them; the [registry](crate::registry) lists them.

use crate::{Needs, Quantity, Window};

/// A built-in measure, or a family of them with a rank N in its name.
#[derive(Debug)]
pub struct Kind {
    /// The name; `N` stands for any rank from 1.
    pub pattern: &'static str,
    /// The rank of the tensor; in a family, `None`.
    pub rank: Option<u32>,
    /// The quantity, for a rank, as [`Measure::quantity`](crate::Measure::quantity).
    pub quantity: fn(u32) -> Quantity,
    /// The unit, as [`Measure::unit`](crate::Measure::unit).
    pub unit: &'static str,
    /// The definition, as [`Measure::definition`](crate::Measure::definition), with `N` for the rank of a family.
    pub definition: &'static str,
    /// The moments needed, for a rank.
    pub needs: fn(u32) -> Needs,
    /// The measure of a window, for a rank.
    pub evaluate: fn(u32, &Window<'_>) -> Option<f64>,
}
