//! HEALPix maps in NetCDF and Zarr, as CF 1.13 has them and as they were written before it.
//!
//! [`grid`] finds out how a variable's cells are numbered, [`read`] fetches values. What other dimensions, time and
//! packing mean is left to [`crate::cf`], bytes to the [`Dataset`].
//!
//! On an ellipsoid, HEALPix latitudes are authalic: the pixels of a map are the file's pixels, whatever the ellipsoid,
//! and their areas are equal, but on WGS84 geodetic latitudes differ by up to 0.13 degrees from those of the sphere.

mod grid;
mod read;

use std::rc::Rc;

use crate::cf::{self, shape};
use crate::dataset::{Dataset, Kind, Variable};
use crate::names::is_alike;
use crate::{Error, Field, Maps, Selection, TableDescription};
use grid::Grid;

/// Finds the field that is selected; nothing where the dataset has no HEALPix field, or another field is named.
///
/// # Errors
/// Where it cannot be read, or has not what is selected.
pub(crate) fn open(dataset: &Rc<dyn Dataset>, selection: &Selection) -> Result<Option<Box<dyn Maps>>, Error> {
    let fields = fields(&**dataset);
    if fields.is_empty() {
        return Ok(None);
    }
    let Some(place) = choose(&**dataset, &fields, selection.field.as_ref())? else { return Ok(None) };
    if let Some(hdu) = selection.hdu {
        return Err(Error::NoHdus { hdu });
    }
    read::open(dataset, place, selection).map(Some)
}

/// What a dataset holds on HEALPix grids; nothing where there is no such field.
///
/// # Errors
/// Where it cannot be read.
pub(crate) fn describe(dataset: &dyn Dataset) -> Result<Vec<TableDescription>, Error> {
    fields(dataset).into_iter().map(|place| describe_one(dataset, &dataset.variables()[place])).collect()
}

fn describe_one(dataset: &dyn Dataset, variable: &Variable) -> Result<TableDescription, Error> {
    let grid = Grid::of(dataset, variable)?;
    cf::describe(dataset, variable, &[grid.dimension], read::describe(dataset, variable, &grid)?)
}

/// The fields on a HEALPix grid, as places among the dataset's variables.
fn fields(dataset: &dyn Dataset) -> Vec<usize> {
    let variables = dataset.variables().iter().enumerate();
    variables.filter(|(_, v)| is_field(v) && Grid::find(dataset, v).is_some()).map(|(place, _)| place).collect()
}

/// Whether a variable could be a field: not one of coordinates, and not one that describes a grid.
fn is_field(variable: &Variable) -> bool {
    const STANDARD_NAMES: [&str; 4] = ["latitude", "longitude", "healpix_index", "time"];
    const NAMES: [&str; 7] = ["lat", "lon", "latitude", "longitude", "clat", "clon", "cell_ids"];
    let name = variable.name.as_str();
    let numbers = !matches!(variable.kind, Kind::Text | Kind::Other);
    let dimension = variable.dimensions.iter().any(|dimension| dimension.name == name);
    let bounds = name.ends_with("_bnds") || name.ends_with("_bounds");
    let standard = variable.text("standard_name").is_some_and(|name| STANDARD_NAMES.contains(&name));
    let degrees = variable.text("units").is_some_and(|units| units.starts_with("degrees_"));
    let grid = variable.text("grid_name").or(variable.text("grid_mapping_name")).is_some();
    numbers && !(dimension || bounds || standard || degrees || grid || NAMES.contains(&name))
}

/// The field that is meant, as a place among the dataset's variables; nothing where it is one of another grid.
fn choose(dataset: &dyn Dataset, fields: &[usize], field: Option<&Field>) -> Result<Option<usize>, Error> {
    let variables = dataset.variables();
    let describe = |&place: &usize| {
        let variable = &variables[place];
        let unit = variable.text("units").map(|unit| format!(" in {unit}")).unwrap_or_default();
        format!("{} with {}{unit}", variable.path(), shape(variable))
    };
    let list = || fields.iter().map(describe).collect::<Vec<_>>().join("; ").replace(char::is_control, " ");
    let unknown = |field: &Field| Error::UnknownHealpix { variable: field.to_string(), variables: list() };
    match field {
        None if fields.len() == 1 => Ok(Some(fields[0])),
        None => Err(Error::SeveralVariables { variables: list() }),
        Some(Field::Number(number)) => {
            fields.get(*number).copied().map(Some).ok_or_else(|| unknown(&Field::Number(*number)))
        }
        Some(Field::Name(name)) => {
            let exact = |variable: &Variable| variable.name == *name || variable.path() == *name;
            let alike = |variable: &Variable| is_alike(&variable.name, name) || is_alike(&variable.path(), name);
            let those = |is: &dyn Fn(&Variable) -> bool| -> Vec<usize> {
                fields.iter().copied().filter(|&place| is(&variables[place])).collect()
            };
            let same = those(&exact);
            let found = if same.is_empty() { those(&alike) } else { same };
            match found[..] {
                [place] => Ok(Some(place)),
                [] if variables.iter().any(alike) => Ok(None),
                [] => Err(unknown(&Field::Name(name.clone()))),
                [..] => {
                    let variables = found.iter().map(describe).collect::<Vec<_>>().join("; ");
                    Err(Error::SeveralVariables { variables: variables.replace(char::is_control, " ") })
                }
            }
        }
    }
}
