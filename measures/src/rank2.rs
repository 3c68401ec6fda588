//! Eigenvalues and eigenvectors of the rank 2 tensor W_1^{0,2}: (ψ_0 ± |ψ_2|)/2.

use crate::Needs;
use crate::irreducible::direction;
use crate::registry::Kind;

/// An eigenvalue that is less than this share of the other is taken as 0.
const ZERO_EIGENVALUE: f64 = 1e-12;

/// Eigenvalue quotient.
pub(crate) const EVQ: Kind = Kind {
    pattern: "evq",
    rank: Some(2),
    unit: "",
    definition: "eigenvalue quotient of the rank 2 tensor, larger over smaller: (ψ_0 + |ψ_2|)/(ψ_0 − |ψ_2|)",
    needs: |_| Needs { ranks: vec![0, 2], ..Needs::default() },
    evaluate: |_, w| {
        let anisotropy = w.psi(2).norm();
        let (larger, smaller) = (w.psi0 + anisotropy, w.psi0 - anisotropy);
        (smaller.abs() > ZERO_EIGENVALUE * larger.abs()).then(|| larger / smaller)
    },
};

/// Direction of the eigenvector of the larger eigenvalue.
pub(crate) const EVQ_DIRECTION: Kind = Kind {
    pattern: "evq-direction",
    rank: Some(2),
    unit: "deg",
    definition: "direction of the larger eigenvalue's vector, arg(ψ_2)/2, in (−90°, 90°], from south towards east",
    needs: |_| Needs { ranks: vec![2], ..Needs::default() },
    evaluate: |_, w| direction(w.psi(2), 2),
};

#[cfg(test)]
mod tests {
    use crate::{Measure, Window, find};
    use num_complex::Complex64;

    #[test]
    fn rectangles_have_the_quotient_of_their_sides() {
        // Normals of a rectangle a × b: ψ_0 = 2(a + b), |ψ_2| = 2 |a − b|.
        let window = Window { psi0: 8.0, ranks: &[2], psi: &[Complex64::new(-4.0, 0.0)], ..Window::default() };
        assert_eq!(find("evq").unwrap().evaluate(&window), Some(3.0));
        assert_eq!(find("evq-direction").unwrap().evaluate(&window), Some(90.0));
    }

    #[test]
    fn nothing_is_said_without_contour_or_with_one_direction_only() {
        for psi0 in [0.0, 1.0] {
            let window = Window { psi0, ranks: &[2], psi: &[Complex64::new(0.0, psi0)], ..Window::default() };
            assert_eq!(find("evq").unwrap().evaluate(&window), None);
        }
    }
}
