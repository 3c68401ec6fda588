//! Two measures at one pixel, in the data and all simulations: a table and a picture.
//!
//! How the picture looks is left to [`longan_picture::cloud`].

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail, ensure};
use longan::measures::Quantity;
use longan_formats::is_alike;
use longan_grid::Healpix;
use longan_picture::cloud::{AxisLabel, Cloud};

use super::super::options::{between, shown};
use super::super::picture_format::{Form, save};
use super::provenance_reader::{Column, MadeFrom};

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
        let listed = |places: &mut dyn Iterator<Item = usize>| {
            places.map(|place| columns[place].name.as_str()).collect::<Vec<_>>().join(", ")
        };
        let mut pair = [0; 2];
        for (place, name) in pair.iter_mut().zip(&self.names) {
            let whole = columns.iter().position(|column| is_alike(&column.name, name));
            let called: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].is_called(name)).collect();
            *place = match (whole, &called[..]) {
                (Some(whole), _) => whole,
                (None, [only]) => *only,
                (None, []) => {
                    let columns = listed(&mut (0..columns.len()));
                    bail!("--scatter: the measure '{name}' is not compared; there are {columns}")
                }
                (None, several) => {
                    let columns = listed(&mut several.iter().copied());
                    bail!("--scatter: the measure '{name}' could be any of {columns}; name one of them")
                }
            };
        }
        Ok(pair)
    }

    /// Refuses measures that are not among these, whatever their windows and thresholds.
    pub(super) fn check_among(&self, measures: &[Column]) -> anyhow::Result<()> {
        let plain = |name: &str| Column::to_be(name.to_ascii_uppercase().replace('-', "_"), "", Quantity::Number);
        for name in &self.names {
            if !measures.iter().any(|measure| plain(name).is_called(&measure.name)) {
                let measures: Vec<&str> = measures.iter().map(|measure| measure.name.as_str()).collect();
                bail!("--scatter: the measure '{name}' is not compared; there are {}", measures.join(", "));
            }
        }
        Ok(())
    }

    /// Refuses data that is masked at its place. Smoothing leaves masked pixels as they are.
    pub(super) fn check(&self, data: &MadeFrom) -> anyhow::Result<()> {
        let pair = self.pair(&data.columns)?.map(|i| &data.columns[i]);
        let maps = [data.read(pair[0])?.into_values(), data.read(pair[1])?.into_values()];
        let grid = Healpix::new(data.recipe.nside_out)?;
        self.check_point(&data.path, grid, self.point(grid, [&maps[0], &maps[1]]), pair)
    }

    /// Refuses the data's point where it is masked.
    pub(super) fn check_point(
        &self,
        path: &Path,
        grid: Healpix,
        point: [f64; 2],
        pair: [&Column; 2],
    ) -> anyhow::Result<()> {
        let masked = point.iter().zip(pair).find(|(value, _)| value.is_nan());
        masked.map_or(Ok(()), |(_, column)| {
            bail!(
                "{}: {} is masked or undefined at {}; choose another place for --scatter",
                shown(path),
                column.name,
                self.place(grid)
            )
        })
    }

    /// Refuses a place at which no simulation has both values.
    pub(super) fn check_simulations(&self, grid: Healpix, points: &[[f64; 2]]) -> anyhow::Result<()> {
        ensure!(
            points.iter().any(|point| !point.iter().any(|value| value.is_nan())),
            "every simulation is masked or undefined at {}; choose another place for --scatter",
            self.place(grid)
        );
        Ok(())
    }

    /// Its place, for people.
    fn place(&self, grid: Healpix) -> String {
        format!("{},{} (pixel {} of Nside {})", self.at.lon, self.at.lat, self.pixel(grid), grid.nside())
    }

    /// The pixel (RING) that contains its point.
    fn pixel(&self, grid: Healpix) -> usize {
        grid.pixel_at((90.0 - self.at.lat).to_radians(), self.at.lon.to_radians())
    }

    /// The values of two maps at its pixel.
    pub(super) fn point(&self, grid: Healpix, maps: [&[f64]; 2]) -> [f64; 2] {
        let pixel = self.pixel(grid);
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
        let [x, y] = columns.map(|column| AxisLabel { name: column.name.clone(), unit: column.unit.clone() });
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
