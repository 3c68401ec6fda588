//! The sulcal depth of a real cortical surface, given as points and as triangles.
//!
//! The two say the same at the 10242 vertices. In between, the triangles are linear where points are averaged or taken
//! singly, so that the maps differ by what the field changes over half an edge (2°): that much they may.

use std::path::Path;

use crate::*;

/// Reads both files.
fn both(folder: &Path, nside: Option<usize>, regrid: Regrid) -> (Map, Map) {
    let read = |name: &str, field: Option<&str>| {
        let field = field.map(|name| name.parse().unwrap());
        let selection = Selection { field, nside, regrid: regrid.clone(), ..Selection::default() };
        longan_formats::read(&folder.join("data").join(name), &selection).unwrap()
    };
    (read("cortex_fsaverage5_left.csv", None), read("cortex_fsaverage5_left_sphere.ply", Some("sulc")))
}

/// The values at these shares of the whole.
fn quantiles(map: &Map) -> Vec<f64> {
    let mut values = map.values().to_vec();
    values.sort_by(f64::total_cmp);
    [0.05, 0.25, 0.5, 0.75, 0.95].map(|share| values[(share * values.len() as f64) as usize]).to_vec()
}

#[test]
fn points_and_triangles_agree() {
    let Some(folder) = longan_support::shared() else { return };
    // A Gaussian as wide as the edges of triangles weighs points about as linear interpolation does.
    for (way, least, apart) in
        [(Gather::Mean, 0.99, 0.05), (Gather::Nearest, 0.99, 0.05), (Gather::Gaussian { fwhm: 2.0 }, 0.9995, 0.02)]
    {
        for nside in [None, Some(64), Some(128)] {
            let (points, triangles) = both(&folder, nside, gather(way));
            assert_eq!(points.grid(), triangles.grid());
            assert_eq!(points.grid().nside(), nside.unwrap_or(32));
            assert_eq!((points.name.as_str(), triangles.name.as_str()), ("sulc", "sulc"));
            // The whole sphere is covered.
            assert!(points.values().iter().chain(triangles.values()).all(|v| v.is_finite()));
            let count = points.values().len() as f64;
            let mean = |map: &Map| map.values().iter().sum::<f64>() / count;
            let (m, n) = (mean(&points), mean(&triangles));
            let product = |a: &Map, m: f64, b: &Map, n: f64| {
                a.values().iter().zip(b.values()).map(|(a, b)| (a - m) * (b - n)).sum::<f64>() / count
            };
            let deviation = product(&triangles, n, &triangles, n).sqrt();
            let correlation = product(&points, m, &triangles, n) / (product(&points, m, &points, m).sqrt() * deviation);
            assert!(correlation > least, "{way:?} at {nside:?}: {correlation}");
            assert!((m - n).abs() < 0.002 * deviation, "{way:?} at {nside:?}: {m} {n}");
            for (a, b) in quantiles(&points).into_iter().zip(quantiles(&triangles)) {
                assert!((a - b).abs() < apart * deviation, "{way:?} at {nside:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn both_are_the_same_at_the_vertices() {
    let Some(folder) = longan_support::shared() else { return };
    let (points, triangles) = both(&folder, Some(512), gather(Gather::Nearest));
    let table = std::fs::read_to_string(folder.join("data/cortex_fsaverage5_left.csv")).unwrap();
    let mut differences = Vec::new();
    for row in table.lines().skip(1) {
        let [lon, lat, value] = row.split(',').map(|cell| cell.parse::<f64>().unwrap()).collect::<Vec<_>>()[..] else {
            panic!("{row}")
        };
        let pixel = points.grid().pixel_at((90.0 - lat).to_radians(), lon.to_radians());
        assert_eq!(points.values()[pixel], value);
        differences.push((triangles.values()[pixel] - value).abs());
    }
    assert_eq!(differences.len(), 10242);
    // A pixel's centre is up to 0.08° from the vertex, a twenty-fifth of an edge, over which the depth changes by less than
    // its whole range (4).
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let largest = differences.iter().copied().fold(0.0, f64::max);
    assert!(mean < 0.02 && largest < 0.16, "{mean} {largest}");
}
