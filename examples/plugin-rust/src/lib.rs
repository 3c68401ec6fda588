//! A plugin in Rust: the shape index, and EVQ as the built-in measure has it.
//!
//! `cargo build --release -p longan-example-plugin`, then
//! `longan map sky.fits -o out.fits --plugin target/release/liblongan_example_plugin.so --measure shape-index`.
//! `longan plugin new NAME` writes a crate of your own to start from.

#![forbid(unsafe_code)]

use longan_plugin::{Measure, Needs, Quantity, Window};

/// The rank 2 tensor's eigenvalues by magnitude, times two: the larger and the smaller, negative where they differ in sign.
fn eigenvalues(window: &Window<'_>) -> (f64, f64) {
    let (psi0, anisotropy) = (window.psi0.abs(), window.psi(2).norm());
    (psi0 + anisotropy, psi0 - anisotropy)
}

/// Their ratio, smaller over larger: 1 for round bodies.
struct ShapeIndex;

impl Measure for ShapeIndex {
    fn name(&self) -> String {
        "shape-index".to_owned()
    }

    fn definition(&self) -> String {
        "ratio of the rank 2 tensor's eigenvalues, smaller over larger: (ψ_0 − |ψ_2|)/(ψ_0 + |ψ_2|)".to_owned()
    }

    fn quantity(&self) -> Quantity {
        Quantity::Ratio
    }

    fn unit(&self) -> &str {
        ""
    }

    fn rank(&self) -> u32 {
        2
    }

    fn needs(&self) -> Needs {
        Needs { ranks: vec![0, 2], ..Needs::default() }
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        let (larger, smaller) = eigenvalues(window);
        (larger > 0.0 && smaller >= -window.resolution * window.psi0.abs()).then(|| smaller.max(0.0) / larger)
    }
}

/// Their ratio, larger over smaller, as the built-in EVQ.
struct Quotient;

impl Measure for Quotient {
    fn name(&self) -> String {
        "quotient".to_owned()
    }

    fn definition(&self) -> String {
        "eigenvalue quotient of the rank 2 tensor, larger over smaller, as evq".to_owned()
    }

    fn quantity(&self) -> Quantity {
        Quantity::Ratio
    }

    fn unit(&self) -> &str {
        ""
    }

    fn rank(&self) -> u32 {
        2
    }

    fn needs(&self) -> Needs {
        Needs { ranks: vec![0, 2], ..Needs::default() }
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        let (larger, smaller) = eigenvalues(window);
        (smaller > window.resolution * window.psi0.abs()).then(|| larger / smaller)
    }
}

longan_plugin::export!("example": ShapeIndex, Quotient);

#[cfg(test)]
mod tests {
    use super::*;
    use longan_plugin::{Complex64, testing};

    #[test]
    fn the_measures_keep_the_contract() {
        testing::check(&ShapeIndex);
        testing::check(&Quotient);
    }

    #[test]
    fn a_rectangle_has_the_quotient_of_its_sides() {
        // Normals of a rectangle a × b: ψ_0 = 2(a + b), |ψ_2| = 2 |a − b|.
        let window = Window { psi0: 8.0, ranks: &[2], psi: &[Complex64::new(-4.0, 0.0)], ..Window::default() };
        assert_eq!(Quotient.evaluate(&window), Some(3.0));
        assert_eq!(ShapeIndex.evaluate(&window), Some(1.0 / 3.0));
    }
}
