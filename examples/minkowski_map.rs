//! A Minkowski map in a few lines: a simulated field, two measures, the most anisotropic place.
//!
//! Run with `cargo run --release --example minkowski_map`.

use longan::measures::find;
use longan::simulate::Waves;
use longan::{Analysis, Healpix};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let field = Waves::new(4.0, 1)?.map(Healpix::new(128)?);
    let maps = Analysis::default().minkowski_maps(&field, &[find("evq")?, find("evq-direction")?], |_| ())?.remove(0);

    let (evq, direction) = (&maps.values[0], &maps.values[1]);
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
