//! Minkowski maps of maps in memory, written as `longan map` writes those of files.

use std::path::Path;

use anyhow::Context;
use longan::measures::Measure;
use longan::{Analysis, MinkowskiMaps};
use longan_grid::Map;

use super::identity::Identity;
use super::map_writer::{self, Kind, LayoutOptions};
use super::provenance::Provenance;

/// Writes Minkowski maps, one step for each map that they are made of, to a file: FITS or NetCDF, by its name.
///
/// `steps` are maps with their [Minkowski maps](Analysis::minkowski_maps), all on one grid, which are asked for one after the
/// other. The file states `analysis` and `measures` as one from the program does, so that `longan compare` and `longan
/// plot` take it. It names no input files, so that `--resume` and `--work` do not.
///
/// ```no_run
/// use longan::{Analysis, go_on, measures::find};
/// use longan_formats::{Selection, open, read};
///
/// // The steps of a NetCDF file, masked, become a cube of EVQ.
/// let (analysis, measures) = (Analysis::default(), [find("evq")?]);
/// let mut series = open("era5.nc".as_ref(), &Selection::default())?;
/// let mask = read("land.nc".as_ref(), &Selection::default())?;
/// let steps = (0..series.times().len()).map(|step| {
///     let mut map = series.read(step)?;
///     map.apply_mask(&mask, 0.9)?;
///     let maps = analysis.minkowski_maps(&map, &measures, go_on)?;
///     anyhow::Ok((map, maps))
/// });
/// longan_cli::write_minkowski_maps("evq.nc".as_ref(), false, &analysis, &measures, steps)?;
/// # anyhow::Ok(())
/// ```
///
/// # Errors
/// Those of `steps`; where the name says no format, the file exists and is not to be overwritten, or it cannot be written.
pub fn write_minkowski_maps<I>(
    path: &Path,
    overwrite: bool,
    analysis: &Analysis,
    measures: &[impl AsRef<dyn Measure>],
    steps: I,
) -> anyhow::Result<()>
where
    I: IntoIterator<Item = anyhow::Result<(Map, MinkowskiMaps)>, IntoIter: ExactSizeIterator>,
{
    let kind = Kind::of(path)?;
    let mut steps = steps.into_iter();
    let count = steps.len();
    let first = steps.next().context("there is no step to write")??;
    let layout = LayoutOptions::default().layout(&first.0, first.1.grid, kind, count)?;
    let recipe = analysis.recipe(first.0.grid(), measures)?;
    let identity = &Identity { recipe, inputs: Vec::new() };
    let written = |step: anyhow::Result<(Map, MinkowskiMaps)>| {
        let (map, maps) = step?;
        let command = "longan, the library".to_owned();
        let provenance = Provenance { path: Path::new(""), map: &map, input: None, analysis, identity, command };
        Ok(provenance.step(&maps, measures))
    };
    map_writer::write(path, kind, layout, overwrite, std::iter::once(Ok(first)).chain(steps).map(written))
}
