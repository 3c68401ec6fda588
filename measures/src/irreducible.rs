//! Irreducible Minkowski tensors: strength and direction of each ψ_s.

use num_complex::Complex64;

use crate::kind::Kind;
use crate::{Needs, Quantity};

/// Anisotropy of rank N.
pub(crate) const PSI: Kind = Kind {
    pattern: "psiN",
    rank: None,
    quantity: |_| Quantity::Moment,
    unit: "rad",
    definition: "irreducible anisotropy of rank N, |ψ_N|",
    needs: |n| Needs { ranks: vec![n], ..Needs::default() },
    evaluate: |n, w| Some(w.psi(n).norm()),
};

/// Direction of rank N.
pub(crate) const PSI_DIRECTION: Kind = Kind {
    pattern: "psiN-direction",
    rank: None,
    quantity: |n| Quantity::Angle { symmetry: n },
    unit: "deg",
    definition: "irreducible direction of rank N, arg(ψ_N)/N, in (−180°/N, 180°/N], from south towards east",
    needs: |n| Needs { ranks: vec![n], ..Needs::default() },
    evaluate: |n, w| direction(w.psi(n), n),
};

/// Normalised anisotropy of rank N.
pub(crate) const Q: Kind = Kind {
    pattern: "qN",
    rank: None,
    quantity: |_| Quantity::Ratio,
    unit: "",
    definition: "normalised anisotropy of rank N, |ψ_N|/ψ_0",
    needs: |n| Needs { ranks: vec![0, n], ..Needs::default() },
    evaluate: |n, w| (w.psi0 != 0.0).then(|| w.psi(n).norm() / w.psi0),
};

/// arg(ψ)/n in degrees, in (−180/n, 180/n]; none for ψ = 0.
pub(crate) fn direction(psi: Complex64, n: u32) -> Option<f64> {
    // The lower end is the upper one: a zero imaginary part may carry a minus sign.
    let degrees = if psi.im == 0.0 && psi.re < 0.0 { 180.0 } else { psi.arg().to_degrees() };
    (psi != Complex64::ZERO).then(|| degrees / f64::from(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_stay_in_the_half_open_range() {
        assert_eq!(direction(Complex64::new(-1.0, -0.0), 2), Some(90.0));
        assert_eq!(direction(Complex64::new(-1.0, 0.0), 3), Some(60.0));
        assert_eq!(direction(Complex64::new(0.0, -2.0), 1), Some(-90.0));
        assert_eq!(direction(Complex64::new(0.0, 0.0), 1), None);
    }
}
