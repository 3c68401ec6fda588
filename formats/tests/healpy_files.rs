//! Written files are read back.

use longan_formats::*;

fn file(grid: Healpix, ordering: Ordering, float32: bool) -> HealpixFile {
    let column = |name: &str, scale: f64| Column {
        name: name.to_owned(),
        unit: "uK".to_owned(),
        values: (0..grid.pixels()).map(|p| if p % 7 == 3 { f64::NAN } else { scale * p as f64 }).collect(),
    };
    let extension = |name: &str| Extension {
        name: name.to_owned(),
        cards: vec![],
        history: vec![],
        columns: vec![column("A", 1.0), column("B", -0.5)],
    };
    HealpixFile {
        grid,
        ordering,
        coordinates: Some(CoordinateSystem::Galactic),
        float32,
        extensions: vec![extension("ONE"), extension("TWO")],
    }
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for (nside, ordering, float32, name) in [
        (1, Ordering::Ring, false, "a.fits"),
        (3, Ordering::Ring, true, "b.fits.gz"),
        (16, Ordering::Nested, false, "c[1].fits"),
        (64, Ordering::Nested, true, "d.fits"),
        (64, Ordering::Ring, false, "e.fits"),
    ] {
        let file = file(Healpix::new(nside).unwrap(), ordering, float32);
        let path = folder.path().join(name);
        write_healpix(&path, &file, false).unwrap();
        let map = read(&path, &Selection { field: Some(Field::Number(1)), hdu: Some(2), nside: None }).unwrap();
        assert_eq!((map.name.as_str(), map.unit.as_deref(), map.ordering), ("B", Some("uK"), ordering));
        for (read, written) in map.values().iter().zip(&file.extensions[1].columns[1].values) {
            assert_eq!(read.to_bits(), written.to_bits());
        }
    }
}
