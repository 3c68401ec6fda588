//! The contract of measures, as a check: the built-ins pass it, and so must any other measure.

use num_complex::Complex64;

use crate::{Measure, Quantity, Window};

/// The value in windows of all that a measure does not need.
const NOT_NEEDED: f64 = 7.5;

/// Checks names, units, the quantity and needs of a measure, and that it evaluates windows of every sort, by themselves, in
/// company and many at a time, to the same.
///
/// # Panics
/// With a sentence that names the fault.
pub fn check(measure: &dyn Measure) {
    let name = measure.name();
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    assert!(!name.is_empty() && name.chars().all(allowed), "'{name}' is not lower case, digits and hyphens");
    assert!(measure.definition().lines().count() == 1, "{name}: the definition is not one line");
    assert!(measure.unit().is_ascii(), "{name}: the unit is not ASCII, as FITS wants it");
    let quantity = measure.quantity();
    assert_eq!(quantity, measure.quantity(), "{name} is not always the same quantity");
    if let Quantity::Angle { symmetry } = quantity {
        assert!(symmetry > 0, "{name}: an angle of the symmetry 0; a whole turn is the symmetry 1");
        assert_eq!(measure.unit(), "deg", "{name}: angles are in 'deg'");
    }
    let needs = measure.needs();
    assert!(needs.ranks.windows(2).all(|w| w[0] < w[1]), "{name}: the ranks needed do not ascend");
    assert_eq!(needs, measure.needs(), "{name} does not always need the same moments");
    let needed: Vec<u32> = needs.ranks.iter().copied().filter(|&s| s > 0).collect();
    // Ranks that other measures of the same run may need.
    let mut more: Vec<u32> = needed.iter().copied().chain(1..=5).collect();
    more.sort_unstable();
    more.dedup();

    let windows = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.3), (1e-300, 0.0), (-1.0, 0.2)];
    let psi_of = |ranks: &[u32]| {
        let psi = |&(psi0, share): &(f64, f64)| -> Vec<Complex64> {
            ranks.iter().map(|&s| Complex64::from_polar(psi0 * share, f64::from(s))).collect()
        };
        windows.iter().map(psi).collect::<Vec<_>>()
    };
    let window = |psi0: f64, not_needed: f64| {
        let given = |needed: bool, value: f64| if needed { value } else { not_needed };
        Window {
            centre: (60.0, 30.0),
            masked_fraction: 0.03,
            area: given(needs.area, 0.01),
            length: given(needs.length, psi0.abs()),
            curvature: given(needs.curvature, -0.5),
            psi0: given(needs.ranks.first() == Some(&0), psi0),
            ranks: &[],
            psi: &[],
            resolution: 0.0,
        }
    };
    let (psi, more_psi) = (psi_of(&needed), psi_of(&more));
    let with = |ranks, psi, psi0, not_needed| Window { ranks, psi, ..window(psi0, not_needed) };
    let alone: Vec<Window<'_>> =
        windows.iter().zip(&psi).map(|((psi0, _), psi)| with(&needed[..], &psi[..], *psi0, 0.0)).collect();
    let in_company: Vec<Window<'_>> =
        windows.iter().zip(&more_psi).map(|((psi0, _), psi)| with(&more[..], &psi[..], *psi0, NOT_NEEDED)).collect();

    let mut values = Vec::new();
    for window in &alone {
        let value = measure.evaluate(window);
        if let Some(value) = value {
            assert!(value.is_finite(), "{name} is {value} for {window:?}; undefined should be None");
            if let Quantity::Angle { symmetry } = quantity {
                let turn = 360.0 / f64::from(symmetry);
                assert!(value.abs() <= turn, "{name} is {value}, more than the {turn} degrees of a turn");
            }
        }
        values.push(value.unwrap_or(f64::NAN).to_bits());
    }
    let together = |windows: &[Window<'_>]| {
        let mut values = vec![NOT_NEEDED; windows.len()];
        let done = measure.evaluate_all(windows, &mut values);
        assert!(done.is_ok(), "{name} fails for {windows:?}: {done:?}");
        values.iter().map(|value| if value.is_nan() { f64::NAN } else { *value }.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(together(&alone), values, "{name} of many windows is not that of each");
    for (window, value) in alone.iter().zip(&values) {
        assert_eq!(together(&[*window]), [*value], "{name} of a window among many is not that of one");
    }
    assert_eq!(together(&in_company), values, "{name} depends on moments that it does not name in its needs");
    assert_eq!(together(&[]), [], "{name} gives values of no windows");
}
