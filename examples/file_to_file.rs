//! A map in a file of any format that longan reads, and its Minkowski map in HEALPix FITS.
//!
//! Run with `cargo run --release --example file_to_file INPUT OUTPUT.fits`.

use std::path::Path;

use longan::measures::{Measure, find};
use longan::{Analysis, go_on};
use longan_formats::{Column, Extension, HealpixFile, Selection, read, write_healpix};
use longan_grid::Ordering;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [input, output] = &arguments[..] else { return Err("name an input and an output".into()) };

    // The selection chooses a column or variable, a time, and the way to HEALPix.
    let field = read(Path::new(input), &Selection::default())?;
    let names = ["evq", "evq-direction"];
    let measures = [find(names[0])?, find(names[1])?];
    let maps = Analysis::default().minkowski_maps(&field, &measures, go_on)?;

    let columns = names.iter().zip(&measures).map(|(name, measure)| Column {
        name: name.to_uppercase(),
        unit: measure.unit().to_owned(),
        values: maps[*name].to_vec(),
    });
    let file = HealpixFile {
        grid: maps.grid,
        ordering: Ordering::Ring,
        coordinates: field.coordinates,
        float32: false,
        extensions: vec![Extension {
            name: "MINKOWSKI".to_owned(),
            cards: vec![],
            history: vec![format!("Minkowski map of {}", field.name)],
            columns: columns.collect(),
        }],
    };
    Ok(write_healpix(Path::new(output), &file, false)?)
}
