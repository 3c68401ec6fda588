//! HEALPix maps in NetCDF and Zarr, as CF 1.13 has them and as they were written before it.
//!
//! [`grid`] finds out how a variable's cells are numbered, [`read`] fetches values. The meaning of other dimensions, time
//! and packing is left to [`crate::cf`], bytes to the [`Dataset`].
//!
//! On an ellipsoid, HEALPix latitudes are authalic: the pixels of a map are the file's pixels, whatever the ellipsoid,
//! and their areas are equal, but on WGS84 geodetic latitudes differ by up to 0.13 degrees from those of the sphere.

mod grid;
mod read;

use std::rc::Rc;

use crate::adapter::MapSeries;
use crate::cf::{self, shape};
use crate::dataset::{self, Dataset, Kind, Variable};
use crate::describe::TableDescription;
use crate::error::{Ask, Error, ErrorKind, Reason};
use crate::names::is_alike;
use crate::request::{Field, Selection};
use crate::text::spaced;
use grid::Grid;

/// A name or number that no field on a HEALPix grid has.
#[derive(Debug, thiserror::Error)]
#[error("there is no variable {variable}; those on a HEALPix grid are {variables}")]
struct Unknown {
    variable: String,
    variables: String,
}

impl Reason for Unknown {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Unknown
    }

    fn ask(&self) -> Option<Ask> {
        Some(Ask::Variable)
    }
}

/// Finds the field that is selected; nothing where the dataset has no HEALPix field, or another field is named.
///
/// # Errors
/// Where the field cannot be read, or a selected place is not there.
pub(crate) fn open(dataset: &Rc<dyn Dataset>, selection: &Selection) -> Result<Option<Box<dyn MapSeries>>, Error> {
    let fields = fields(&**dataset);
    if fields.is_empty() {
        return Ok(None);
    }
    let Some(place) = choose(&**dataset, &fields, selection.field.as_ref())? else { return Ok(None) };
    selection.without_hdu()?;
    read::open(dataset, place, selection).map(Some)
}

/// Describes the fields of a dataset on HEALPix grids; nothing where there is no such field.
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
    let listed = |fields: &[usize]| spaced(fields.iter().map(describe).collect::<Vec<_>>().join("; "));
    let unknown = |field: &Field| Unknown { variable: field.to_string(), variables: listed(fields) };
    let several = |fields| dataset::Problem::SeveralVariables { variables: listed(fields) };
    match field {
        None if fields.len() == 1 => Ok(Some(fields[0])),
        None => Err(several(fields).into()),
        Some(Field::Number(number)) => Ok(Some(*fields.get(*number).ok_or_else(|| unknown(&Field::Number(*number)))?)),
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
                [] => Err(unknown(&Field::Name(name.clone())).into()),
                ref found => Err(several(found).into()),
            }
        }
    }
}
