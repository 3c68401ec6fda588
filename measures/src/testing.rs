//! What every measure must keep to: the built-ins are tested with it, and so can any other measure be.

use num_complex::Complex64;

use crate::{Measure, Window};

/// Checks names, units and needs of a measure, and that it evaluates windows of every sort.
///
/// # Panics
/// With a sentence that says what is wrong.
pub fn check(measure: &dyn Measure) {
    let name = measure.name();
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    assert!(!name.is_empty() && name.chars().all(allowed), "'{name}' is not lower case, digits and hyphens");
    assert!(measure.definition().lines().count() == 1, "{name}: the definition is not one line");
    assert!(measure.unit().is_ascii(), "{name}: the unit is not ASCII, as FITS wants it");
    let ranks = &measure.needs().ranks;
    let needed: Vec<u32> = ranks.iter().copied().filter(|&s| s > 0).collect();
    assert!(ranks.windows(2).all(|w| w[0] < w[1]), "{name}: the ranks needed do not ascend");

    let windows = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.3), (1e-300, 0.0), (-1.0, 0.2)];
    for (psi0, share) in windows {
        let psi: Vec<Complex64> = needed.iter().map(|&s| Complex64::from_polar(psi0 * share, f64::from(s))).collect();
        let window = Window {
            centre: (60.0, 30.0),
            masked_fraction: 0.03,
            area: 0.01,
            length: psi0.abs(),
            curvature: -0.5,
            psi0,
            ranks: &needed,
            psi: &psi,
        };
        if let Some(value) = measure.evaluate(&window) {
            assert!(value.is_finite(), "{name} is {value} for {window:?}; undefined should be None");
        }
    }
}
