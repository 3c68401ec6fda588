//! Eigenvalues and eigenvectors of the rank 2 tensors W_1^{0,2} and W_2^{0,2}: (ψ_0 ± |ψ_2|)/2.
//!
//! Those of W_2 may be negative; their quotients are of their magnitudes, and exist only where both have one sign.

use crate::irreducible::direction;
use crate::kind::Kind;
use crate::{Needs, Quantity, Window};

/// Twice the eigenvalues by magnitude, the larger first; the smaller is negative where they differ in sign.
fn eigenvalues(window: &Window<'_>) -> [f64; 2] {
    let (psi0, anisotropy) = (window.psi0.abs(), window.psi(2).norm());
    [psi0 + anisotropy, psi0 - anisotropy]
}

/// Eigenvalue quotient.
pub(crate) const EVQ: Kind = Kind {
    pattern: "evq",
    rank: Some(2),
    quantity: |_| Quantity::Ratio,
    unit: "",
    definition: "eigenvalue quotient of the rank 2 tensor, larger over smaller by magnitude, where both have one sign: \
                 (|ψ_0| + |ψ_2|)/(|ψ_0| − |ψ_2|)",
    needs: |_| Needs { ranks: vec![0, 2], ..Needs::default() },
    evaluate: |_, w| {
        let [larger, smaller] = eigenvalues(w);
        (smaller > w.resolution * w.psi0.abs()).then(|| larger / smaller)
    },
};

/// Eigenvalue quotient the other way round, which has bounds.
pub(crate) const BETA: Kind = Kind {
    pattern: "beta",
    rank: Some(2),
    quantity: |_| Quantity::Ratio,
    unit: "",
    definition: "eigenvalue quotient of the rank 2 tensor, smaller over larger by magnitude, where both have one sign: \
                 (|ψ_0| − |ψ_2|)/(|ψ_0| + |ψ_2|), from 0, all one direction, to 1, none preferred",
    needs: |_| Needs { ranks: vec![0, 2], ..Needs::default() },
    evaluate: |_, w| {
        let [larger, smaller] = eigenvalues(w);
        // A value that is not told apart from 0 is 0, or its rounding would be compared.
        let least = w.resolution * w.psi0.abs();
        (larger > 0.0 && smaller >= -least).then(|| if smaller > least { smaller / larger } else { 0.0 })
    },
};

/// Direction of the eigenvector of the larger eigenvalue.
pub(crate) const EVQ_DIRECTION: Kind = Kind {
    pattern: "evq-direction",
    rank: Some(2),
    quantity: |_| Quantity::Angle { symmetry: 2 },
    unit: "deg",
    definition: "direction of the algebraically larger eigenvalue's vector, arg(ψ_2)/2, in (−90°, 90°], from south \
                 towards east",
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
    fn both_quotients_are_one_inverse_of_the_other_and_know_no_sign() {
        for psi0 in [8.0, -8.0] {
            let window = Window { psi0, ranks: &[2], psi: &[Complex64::new(0.0, 4.0)], ..Window::default() };
            assert_eq!(find("evq").unwrap().evaluate(&window), Some(3.0));
            assert_eq!(find("beta").unwrap().evaluate(&window), Some(1.0 / 3.0));
        }
        // Eigenvalues of different signs, as W_2 may have.
        let window = Window { psi0: 1.0, ranks: &[2], psi: &[Complex64::new(0.0, 4.0)], ..Window::default() };
        assert_eq!(["evq", "beta"].map(|name| find(name).unwrap().evaluate(&window)), [None; 2]);
    }

    #[test]
    fn values_that_the_sum_does_not_resolve_are_no_quotients() {
        let psi = [Complex64::new(1.0 - 1e-9, 0.0)];
        let window = |resolution| Window { psi0: 1.0, ranks: &[2], psi: &psi, resolution, ..Window::default() };
        assert_eq!(find("evq").unwrap().evaluate(&window(1e-7)), None);
        assert!(find("evq").unwrap().evaluate(&window(1e-12)).unwrap() > 1e9);
        assert_eq!(find("beta").unwrap().evaluate(&window(1e-7)), Some(0.0));
        assert!(find("beta").unwrap().evaluate(&window(1e-12)).unwrap() > 1e-10);
    }

    #[test]
    fn nothing_is_said_without_contour_or_with_one_direction_only() {
        for psi0 in [0.0, 1.0] {
            let window = Window { psi0, ranks: &[2], psi: &[Complex64::new(0.0, psi0)], ..Window::default() };
            assert_eq!(find("evq").unwrap().evaluate(&window), None);
            assert_eq!(find("beta").unwrap().evaluate(&window), (psi0 > 0.0).then_some(0.0));
        }
    }
}
