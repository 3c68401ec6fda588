//! Two measures at one pixel, in the data and all simulations: a table and a picture.
//!
//! How the picture looks is left to [`longan::picture::cloud`].

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail};
use longan::formats::Healpix;
use longan::picture::cloud::{Cloud, Quantity};

use super::super::drawn::{Form, save};
use super::super::options::{between, shown};
use super::said::Column;

/// A point of the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At {
    lon: f64,
    lat: f64,
}

/// Longitude and latitude in degrees, with a comma between them.
impl FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || "not a longitude and a latitude in degrees, such as 264,-17".to_owned();
        let (lon, lat) = text.split_once(',').ok_or_else(form)?;
        let lon = between(lon.trim(), -360.0, 360.0).map_err(|e| format!("the longitude is {e}"))?;
        let lat = between(lat.trim(), -90.0, 90.0).map_err(|e| format!("the latitude is {e}"))?;
        Ok(At { lon, lat })
    }
}

/// A scatter plot.
pub(super) struct Scatter {
    at: At,
    /// The measures.
    names: [String; 2],
    table: PathBuf,
    picture: PathBuf,
    form: Form,
}

impl Scatter {
    /// Of two measures, with a comma between them.
    pub(super) fn new(at: At, pair: &str, picture: PathBuf) -> Result<Self, String> {
        let names = pair.split_once(',').map(|(x, y)| [x, y].map(|name| name.trim().to_owned()));
        let names = names.filter(|names| names.iter().all(|name| !name.is_empty() && !name.contains(',')));
        let names = names.ok_or("not two measures, such as evq,rank4-mid")?;
        let form = Form::of(&picture)
            .ok_or_else(|| format!("the picture's name '{}' ends neither in .png nor in .svg", shown(&picture)))?;
        Ok(Scatter { at, names, table: picture.with_extension("csv"), picture, form })
    }

    /// The files that it makes.
    pub(super) fn outputs(&self) -> [&Path; 2] {
        [&self.table, &self.picture]
    }

    /// The places of its measures among the columns compared.
    pub(super) fn pair(&self, columns: &[Column]) -> anyhow::Result<[usize; 2]> {
        let mut pair = [0; 2];
        for (place, name) in pair.iter_mut().zip(&self.names) {
            let Some(found) = columns.iter().position(|column| column.is_called(name)) else {
                let columns: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
                bail!("--scatter: the measure '{name}' is not compared; there are {}", columns.join(", "));
            };
            *place = found;
        }
        Ok(pair)
    }

    /// The values of two maps at its pixel.
    pub(super) fn point(&self, grid: Healpix, maps: [&[f64]; 2]) -> [f64; 2] {
        let pixel = grid.pixel_at((90.0 - self.at.lat).to_radians(), self.at.lon.to_radians());
        maps.map(|map| map.get(pixel).copied().unwrap_or(f64::NAN))
    }

    /// Writes the table and the picture of the data's point and all others; their names.
    pub(super) fn write(
        &self,
        files: &[&Path],
        points: &[[f64; 2]],
        columns: [&Column; 2],
        overwrite: bool,
    ) -> anyhow::Result<Vec<String>> {
        let table = table(files, points, columns).context("the table of the scatter plot")?;
        let [x, y] = columns.map(|column| Quantity { name: column.name.clone(), unit: column.unit.clone() });
        let mut points: Vec<(f64, f64)> = points.iter().map(|[x, y]| (*x, *y)).collect();
        let star = points.remove(0);
        let legend = [format!("{} simulations", points.len()), files[0].to_string_lossy().into_owned()];
        let drawing = Cloud { x, y, points, star, legend }.draw().with_context(|| shown(&self.picture))?;
        let picture = self.form.bytes(&drawing).with_context(|| shown(&self.picture))?;
        save(&self.table, overwrite, &table)?;
        save(&self.picture, overwrite, &picture)?;
        Ok(self.outputs().map(shown).to_vec())
    }
}

/// A line for each map, the data first; an empty value where it is masked.
fn table(files: &[&Path], points: &[[f64; 2]], columns: [&Column; 2]) -> anyhow::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let [x, y] = columns.map(|column| column.name.as_str());
    table.write_record(["kind", "file", x, y])?;
    for (i, (file, point)) in files.iter().zip(points).enumerate() {
        let kind = if i == 0 { "data" } else { "simulation" };
        let [x, y] = point.map(|value| if value.is_nan() { String::new() } else { value.to_string() });
        table.write_record([kind, &file.to_string_lossy(), &x, &y])?;
    }
    Ok(table.into_inner()?)
}
