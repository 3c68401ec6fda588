//! Eigenvalues of the rank 4 tensor W_1^{0,4}, written as a symmetric 3×3 matrix (Mehrabadi & Cowin 1990).
//!
//! In an orthonormal frame its components follow from ψ_0, ψ_2 and ψ_4; the middle eigenvalue is the paper's four-fold
//! measure.

use nalgebra::Matrix3;

use crate::kind::Kind;
use crate::{Needs, Quantity, Window};

macro_rules! kind {
    ($pattern:literal, $definition:literal, $evaluate:expr) => {
        Kind {
            pattern: $pattern,
            rank: Some(4),
            quantity: |_| Quantity::Moment,
            unit: "rad",
            definition: $definition,
            needs: |_| Needs { ranks: vec![0, 2, 4], ..Needs::default() },
            evaluate: |_, w| Some($evaluate(eigenvalues(w))),
        }
    };
}

/// Smallest eigenvalue.
pub(crate) const MIN: Kind = kind!("rank4-min", "smallest eigenvalue of the rank 4 tensor", |e: [f64; 3]| e[0]);
/// Middle eigenvalue.
pub(crate) const MID: Kind =
    kind!("rank4-mid", "middle eigenvalue of the rank 4 tensor, the four-fold measure", |e: [f64; 3]| e[1]);
/// Largest eigenvalue.
pub(crate) const MAX: Kind = kind!("rank4-max", "largest eigenvalue of the rank 4 tensor", |e: [f64; 3]| e[2]);
/// Norm of the three.
pub(crate) const NORM: Kind =
    kind!("rank4-norm", "root of the sum of squares of the rank 4 tensor's eigenvalues", |e: [f64; 3]| e
        .iter()
        .map(|x| x * x)
        .sum::<f64>()
        .sqrt());

/// Eigenvalues of W_1^{0,4}, ascending.
fn eigenvalues(window: &Window<'_>) -> [f64; 3] {
    let (p0, psi2, psi4) = (window.psi0, window.psi(2), window.psi(4));
    let c4 = (3.0 * p0 + 4.0 * psi2.re + psi4.re) / 8.0;
    let s4 = (3.0 * p0 - 4.0 * psi2.re + psi4.re) / 8.0;
    let c2s2 = (p0 - psi4.re) / 8.0;
    let c3s = 2f64.sqrt() * (2.0 * psi2.im + psi4.im) / 8.0;
    let cs3 = 2f64.sqrt() * (2.0 * psi2.im - psi4.im) / 8.0;
    let matrix = Matrix3::new(c4, c3s, c2s2, c3s, 2.0 * c2s2, cs3, c2s2, cs3, s4);
    let mut values: [f64; 3] = matrix.symmetric_eigenvalues().into();
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// Moments of contour pieces (length, angle of the normal).
    fn of(pieces: &[(f64, f64)]) -> [f64; 3] {
        let psi = |s: f64| pieces.iter().map(|(l, a)| Complex64::from_polar(*l, s * a)).sum::<Complex64>();
        eigenvalues(&Window { psi0: psi(0.0).re, ranks: &[2, 4], psi: &[psi(2.0), psi(4.0)], ..Window::default() })
    }

    #[test]
    fn a_square_and_a_circle() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // c⁴ = s⁴ = 2, all else 0, whichever way the square is turned.
        for turn in [0.0, 0.3, 1.1] {
            let square: Vec<_> = (0..4).map(|i| (1.0, turn + quarter * f64::from(i))).collect();
            for (got, want) in of(&square).iter().zip([0.0, 2.0, 2.0]) {
                assert!((got - want).abs() < 1e-14, "{got} {want}");
            }
        }
        // Mean of c⁴ is 3/8, of c²s² 1/8.
        let circle: Vec<_> = (0..64).map(|i| (1.0 / 64.0, quarter / 16.0 * f64::from(i))).collect();
        for (got, want) in of(&circle).iter().zip([0.25, 0.25, 0.5]) {
            assert!((got - want).abs() < 1e-14, "{got} {want}");
        }
    }
}
