//! An array of values, its Minkowski map, and the place where the field is stretched most.
//!
//! Run with `cargo run --release --example array_to_evq`.

use longan::measures::find;
use longan::{Analysis, Healpix, go_on};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A value for each pixel in RING order, NaN where there is none: ripples that are stretched towards the equator.
    let grid = Healpix::new(128)?;
    let ripples = |pixel| {
        let (theta, phi): (f64, f64) = grid.centre(pixel);
        if theta < 0.2 { f64::NAN } else { (24.0 * theta).cos() + (12.0 * phi * theta.sin()).cos() }
    };
    let field: Vec<f64> = (0..grid.pixels()).map(ripples).collect();

    // The paper's analysis but for the windows: 13 thresholds from -3 to 3 standard deviations, to Nside 16.
    let analysis = Analysis { windows: vec![12.0], ..Analysis::default() };
    let maps = analysis.minkowski_maps(&field, &[find("evq")?, find("evq-direction")?], go_on)?;

    // A value for each window, NaN where it is masked or has no contour.
    let (evq, direction) = (&maps["evq"], &maps["evq-direction"]);
    let most = (0..evq.len()).filter(|&p| !evq[p].is_nan()).max_by(|&a, &b| evq[a].total_cmp(&evq[b]));
    let pixel = most.ok_or("every window is masked")?;
    let (theta, phi) = maps.grid.centre(pixel);
    println!(
        "EVQ is largest, {:.3}, at longitude {:.1}, latitude {:.1}; normals point {:.0} degrees east of south there",
        evq[pixel],
        phi.to_degrees(),
        90.0 - theta.to_degrees(),
        direction[pixel]
    );
    Ok(())
}
