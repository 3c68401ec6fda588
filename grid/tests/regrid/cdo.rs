//! The Climate Data Operators, where they are installed, as judges.

use std::fmt::Write as _;
use std::fs::File;
use std::process::Command;

use longan_grid::Method;

use crate::*;

/// One number on each line: cdo does not take long lines.
fn list(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().fold(String::new(), |mut list, value| {
        writeln!(list, " {value:.17}").unwrap();
        list
    })
}

/// What cdo makes of a field at the centres of HEALPix pixels.
fn remapped(operator: &str, grid: &Grid, field: &[f64], nside: usize) -> Option<Vec<f64>> {
    let cdo = longan_support::cdo()?;
    let folder = tempfile::tempdir().unwrap();
    let to = healpix(nside);
    let centres = |part: fn((f64, f64)) -> f64| list((0..to.pixels()).map(|p| part(centre(to, p))));
    let from = format!(
        "gridtype = lonlat\nxsize = {}\nysize = {}\nxvals ={}\nyvals ={}\n",
        grid.longitudes.len(),
        grid.latitudes.len(),
        list(grid.longitudes.iter().copied()),
        list(grid.latitudes.iter().copied()),
    );
    let points = format!(
        "gridtype = unstructured\ngridsize = {}\nxvals ={}\nyvals ={}\n",
        to.pixels(),
        centres(|(_, lon)| lon),
        centres(|(lat, _)| lat),
    );
    for (name, text) in [("from", from), ("points", points), ("values", list(field.iter().copied()))] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let values = File::open(folder.path().join("values")).unwrap();
    let arguments = ["-s", "-b", "F64", "outputf,%.17g,1", &format!("-{operator},points"), "-input,from"];
    let printed = Command::new(cdo).current_dir(folder.path()).args(arguments).stdin(values).output().unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    let printed = String::from_utf8(printed.stdout).unwrap();
    Some(printed.lines().map(|line| line.trim().parse().unwrap()).collect())
}

#[test]
fn bilinear_agrees_with_cdo() {
    for (what, grid) in [("with poles", with_poles(19, 36)), ("without poles", without_poles(18, 36))] {
        let field: Vec<f64> = (0..grid.latitudes.len() * 36).map(noise).collect();
        let Some(expected) = remapped("remapbil", &grid, &field, 8) else { return };
        let map = grid.weights(8, Method::Bilinear).apply(&field, 1.0);
        assert_eq!(map.len(), expected.len());
        let mut compared = 0;
        for (pixel, (found, expected)) in map.iter().zip(&expected).enumerate() {
            // Next to the poles, cdo has no mean of the row.
            if centre(healpix(8), pixel).0.abs() < 80.0 {
                assert!((found - expected).abs() < 1e-12, "{what}, pixel {pixel}: {found}, not {expected}");
                compared += 1;
            }
        }
        assert!(compared > 700);
    }
}
