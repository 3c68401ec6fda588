//! A measure of your own: the shape index β = (ψ_0 − |ψ_2|)/(ψ_0 + |ψ_2|), the inverse of EVQ, 1 for round bodies.
//!
//! Run with `cargo run --release --example own_measure`.

use longan::measures::{Measure, Needs, Quantity, Window, testing};
use longan::simulate::Waves;
use longan::{Analysis, Healpix, go_on};

struct ShapeIndex;

impl Measure for ShapeIndex {
    fn name(&self) -> String {
        "shape-index".to_owned()
    }

    fn definition(&self) -> String {
        "ratio of the rank 2 tensor's eigenvalues, smaller over larger".to_owned()
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
        let anisotropy = window.psi(2).norm();
        (window.psi0 > 0.0).then(|| (window.psi0 - anisotropy) / (window.psi0 + anisotropy))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The checks that the built-in measures pass.
    testing::check(&ShapeIndex);

    let field = Waves::new(6.0, 2)?.map(Healpix::new(64)?);
    let measures: [Box<dyn Measure>; 1] = [Box::new(ShapeIndex)];
    let maps = Analysis::default().minkowski_maps(&field, &measures, go_on)?;
    let values: Vec<f64> = maps["shape-index"].iter().copied().filter(|v| !v.is_nan()).collect();
    println!("mean shape index in {} windows: {:.3}", values.len(), values.iter().sum::<f64>() / values.len() as f64);
    Ok(())
}
