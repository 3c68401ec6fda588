//! Tests of the engine, one module a theme.

/// Thresholds by themselves, regions, and Gaussian skies.
mod graphs;
/// What holds for any map: Gauss–Bonnet, symmetry, duality, additivity, threads.
mod invariants;
/// Masked windows have what whole ones have.
mod masks;
/// A slow, obvious implementation judges the fast one.
mod oracle;
/// Expected values from an independent implementation, and litchi's, for the data in `LONGAN_SHARED`.
mod reference;
/// Bodies and fields whose measures are known in closed form.
mod shapes;
/// Windows from prefix sums against windows summed directly.
mod summation;
