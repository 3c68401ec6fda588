//! Fields on regular and rectilinear grids of latitude and longitude, in any dataset, as maps.
//!
//! The dimensions and coordinates of a variable, and the meaning of its numbers, are left to [`crate::cf`], the way from
//! a grid to HEALPix to [`longan_grid::Weights`].

use std::rc::Rc;

use crate::adapter::{About, MapSeries, MemoryEstimate, Target};
use crate::cf::{self, Horizontal};
use crate::dataset::{self, Dataset, Kind, Variable};
use crate::describe::{AxisDescription, GridDescription, TableDescription};
use crate::error::{Ask, Error, ErrorKind, Reason};
use crate::names::is_alike;
use crate::quantity::StatedQuantity;
use crate::request::{Field, Selection};
use longan_grid::regridded;
use longan_grid::{Healpix, LatLon, Map, Method, Regridded, Sphere, Time, Weights};

/// Lists name at most this many variables.
const LISTED: usize = 24;

/// Coordinates are regular where no distance differs from their mean by more than this part of it. Single precision
/// is good to 3e-4 for longitudes at a spacing of 0.1°.
const REGULAR_TOLERANCE: f64 = 1e-3;

/// A dataset without the field that is asked for on a grid of latitude and longitude.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error(
        "no variable is on a HEALPix grid, or has dimensions of latitude and longitude in degrees; the variables are {variables}"
    )]
    NoLatLon { variables: String },
    #[error("there is no variable {variable} with latitude and longitude; those that have them are {variables}")]
    UnknownVariable { variable: String, variables: String },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::NoLatLon { .. } => ErrorKind::NoMap,
            Problem::UnknownVariable { .. } => ErrorKind::Unknown,
        }
    }

    fn ask(&self) -> Option<Ask> {
        matches!(self, Problem::UnknownVariable { .. }).then_some(Ask::Variable)
    }
}

/// A variable on a grid of latitude and longitude.
struct OnGrid {
    /// The variable's place among the dataset's.
    variable: usize,
    horizontal: Horizontal,
}

/// Finds the selected field of a dataset.
///
/// # Errors
/// Where there is no such field on a grid of latitude and longitude, several could be meant, or a place along another
/// dimension is missing.
pub(crate) fn open(dataset: Rc<dyn Dataset>, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
    selection.without_hdu()?;
    let OnGrid { variable, horizontal } = choose(&*dataset, selection.field.as_ref())?;
    let sphere = [horizontal.latitude, horizontal.longitude];
    let chosen = cf::select(&*dataset, &dataset.variables()[variable], &sphere, &selection.at)?;
    let (from, _, _) = grid(&*dataset, &horizontal)?;
    let to = Healpix::new(selection.nside.unwrap_or_else(|| from.nside_closest()))?;
    let (method, regridded) = regridded::method(&from, to, selection.regrid.method);
    let min_valid = selection.regrid.min_valid;
    let weights = None;
    Ok(Box::new(Series { dataset, variable, horizontal, chosen, from, to, method, regridded, min_valid, weights }))
}

/// Describes the fields of a dataset on grids of latitude and longitude.
///
/// # Errors
/// Where it cannot be read or holds no such field.
pub(crate) fn describe(dataset: &dyn Dataset) -> Result<Vec<TableDescription>, Error> {
    candidates(dataset)?.iter().map(|on_grid| describe_one(dataset, on_grid)).collect()
}

/// The maps of one variable.
struct Series {
    dataset: Rc<dyn Dataset>,
    /// The variable's place among the dataset's.
    variable: usize,
    horizontal: Horizontal,
    chosen: cf::Chosen,
    from: LatLon,
    to: Healpix,
    method: Method,
    regridded: Regridded,
    min_valid: f64,
    /// Computed when the first map is read.
    weights: Option<Weights>,
}

impl MapSeries for Series {
    fn times(&self) -> &[Time] {
        self.chosen.times()
    }

    fn place(&self) -> Vec<String> {
        self.chosen.place(&self.dataset.variables()[self.variable])
    }

    fn target(&mut self) -> Result<Target, Error> {
        let settings = vec![self.regridded.way.to_string(), format!("min-valid={}", self.min_valid)];
        Ok(Target::regridded(self.to, settings))
    }

    fn about(&self) -> About {
        let variable = &self.dataset.variables()[self.variable];
        let (name, unit) = (variable.name.clone(), variable.text("units").map(str::to_owned));
        About { name, unit, coordinates: None, sphere: Sphere::Earth, quantity: StatedQuantity::of(variable) }
    }

    fn memory(&self) -> Option<MemoryEstimate> {
        let (values, pixels) = (self.from.values() as f64, self.to.pixels() as f64);
        let weights = match self.method {
            // Cells of a grid that lies askew on another.
            Method::Conservative => (values.sqrt() + pixels.sqrt()).powi(2),
            Method::Bilinear => 4.0 * pixels,
            Method::Nearest => pixels,
        };
        // The field, twice; where each pixel's weights end; weights and places, in arrays that may have grown to twice
        // their length.
        Some(MemoryEstimate::of(self.to, (16.0 * values + 8.0 * pixels + 24.0 * weights) as usize))
    }

    fn read(&mut self, step: usize) -> Result<Map, Error> {
        let values = self.values(step)?;
        let weights = match &mut self.weights {
            Some(weights) => weights,
            none => none.insert(Weights::new(&self.from, self.to, self.method)?),
        };
        let mut map = Map::from_masked(self.to, weights.apply(&values, self.min_valid));
        let variable = &self.dataset.variables()[self.variable];
        map.long_name = variable.text("long_name").map(str::to_owned);
        map.time = self.times().get(step).cloned();
        map.regridded = Some(self.regridded);
        self.about().label(&mut map);
        Ok(map)
    }

    /// In the order of the coordinates, longitudes the faster.
    fn values(&mut self, step: usize) -> Result<Vec<f64>, Error> {
        let variable = &self.dataset.variables()[self.variable];
        let values = cf::values(&*self.dataset, variable, &self.chosen.ranges(variable, step))?;
        let Horizontal { latitude, longitude, .. } = self.horizontal;
        if latitude < longitude {
            return Ok(values);
        }
        let (rows, columns) = (variable.dimensions[latitude].len, variable.dimensions[longitude].len);
        let mut turned = Vec::new();
        turned
            .try_reserve_exact(values.len())
            .map_err(|_| dataset::Problem::memory(variable.path(), values.len() as f64 * 8.0))?;
        for row in 0..rows {
            turned.extend((0..columns).map(|column| values[column * rows + row]));
        }
        Ok(turned)
    }
}

/// The grid that the coordinates make, and their values.
fn grid(dataset: &dyn Dataset, horizontal: &Horizontal) -> Result<(LatLon, Vec<f64>, Vec<f64>), Error> {
    let coordinate = |place: usize| {
        let coordinate = &dataset.variables()[place];
        let whole = |v: &Variable| v.dimensions.iter().map(|d| 0..d.len).collect::<Vec<_>>();
        let bounds = coordinate.text("bounds").and_then(|name| cf::find(dataset, &coordinate.group, name.trim()));
        let bounds = bounds.map(|bounds| cf::values(dataset, bounds, &whole(bounds))).transpose()?;
        Ok::<_, Error>((cf::values(dataset, coordinate, &whole(coordinate))?, bounds))
    };
    let (latitudes, latitude_bounds) = coordinate(horizontal.latitudes)?;
    let (longitudes, longitude_bounds) = coordinate(horizontal.longitudes)?;
    let grid = LatLon::new(&latitudes, latitude_bounds.as_deref(), &longitudes, longitude_bounds.as_deref())?;
    Ok((grid, latitudes, longitudes))
}

/// The variables that may be meant where none is named: those on grids of latitude and longitude, without those that
/// others name as their coordinates, bounds or weights.
fn candidates(dataset: &dyn Dataset) -> Result<Vec<OnGrid>, Error> {
    const SERVING: [&str; 6] =
        ["bounds", "climatology", "coordinates", "cell_measures", "ancillary_variables", "grid_mapping"];
    let variables = dataset.variables();
    let mut serving = Vec::new();
    for variable in variables {
        let names = SERVING.iter().flat_map(|attribute| cf::names_in(variable, attribute));
        serving.extend(names.filter_map(|name| cf::find(dataset, &variable.group, name)).map(Variable::path));
    }
    let mut found = Vec::new();
    let mut problem = None;
    for (place, variable) in variables.iter().enumerate() {
        let numbers = !matches!(variable.kind, Kind::Text | Kind::Other);
        let serves = serving.contains(&variable.path()) || cf::is_position(variable);
        if !numbers || serves || variable.dimensions.len() < 2 {
            continue;
        }
        match Horizontal::of(dataset, variable) {
            Ok(Some(horizontal)) => found.push(OnGrid { variable: place, horizontal }),
            Ok(None) => {}
            Err(error) => problem = problem.or(Some(Error::from(error))),
        }
    }
    if found.is_empty() {
        return Err(problem.unwrap_or_else(|| Problem::NoLatLon { variables: listed(variables.iter()) }.into()));
    }
    Ok(found)
}

/// The variable that a field is.
fn choose(dataset: &dyn Dataset, field: Option<&Field>) -> Result<OnGrid, Error> {
    let variables = dataset.variables();
    if let Some(Field::Name(name)) = field {
        // A name is enough, a path is surer.
        let path = name.trim_start_matches('/');
        let tests: [&dyn Fn(&Variable) -> bool; 3] =
            [&|v| v.path() == path, &|v| v.name == *name, &|v| is_alike(&v.name, name)];
        for test in tests {
            let mut places = (0..variables.len()).filter(|&place| test(&variables[place]));
            let Some(place) = places.next() else { continue };
            if places.next().is_some() {
                let several = variables.iter().filter(|v| test(v));
                return Err(dataset::Problem::SeveralVariables { variables: listed(several) }.into());
            }
            if let Some(horizontal) = Horizontal::of(dataset, &variables[place])? {
                return Ok(OnGrid { variable: place, horizontal });
            }
        }
    }
    let mut candidates = candidates(dataset)?;
    match field {
        None if candidates.len() == 1 => Ok(candidates.remove(0)),
        Some(Field::Number(number)) if *number < candidates.len() => Ok(candidates.remove(*number)),
        _ => {
            let names = listed(candidates.iter().map(|on_grid| &variables[on_grid.variable]));
            Err(match field {
                None => dataset::Problem::SeveralVariables { variables: names }.into(),
                Some(field) => Problem::UnknownVariable { variable: field.to_string(), variables: names }.into(),
            })
        }
    }
}

/// Variables with their units and dimensions.
fn listed<'v>(variables: impl Iterator<Item = &'v Variable> + Clone) -> String {
    let one = |variable: &Variable| {
        let unit = variable.text("units").map(|unit| format!(" in {}", unit.escape_debug())).unwrap_or_default();
        format!("'{}'{unit} with dimensions {}", variable.path(), cf::shape(variable))
    };
    let mut names: Vec<_> = variables.clone().take(LISTED).map(one).collect();
    let others = variables.count() - names.len();
    if others > 0 {
        names.push(format!("and {others} others"));
    }
    if names.is_empty() { "none".to_owned() } else { names.join("; ") }
}

fn describe_one(dataset: &dyn Dataset, on_grid: &OnGrid) -> Result<TableDescription, Error> {
    let variable = &dataset.variables()[on_grid.variable];
    let (grid, latitudes, longitudes) = grid(dataset, &on_grid.horizontal)?;
    let sphere = [on_grid.horizontal.latitude, on_grid.horizontal.longitude];
    let grid = GridDescription::LatLon {
        latitudes: axis(&latitudes),
        longitudes: axis(&longitudes),
        global: grid.is_global(),
    };
    cf::describe(dataset, variable, &sphere, grid)
}

/// The values of a coordinate, of which there is at least one. Longitudes may cross 360 or ±180.
fn axis(values: &[f64]) -> AxisDescription {
    let steps = || values.windows(2).map(|pair| pair[1] - pair[0]).map(|step| step - 360.0 * (step / 360.0).round());
    let mean = steps().sum::<f64>().abs() / (values.len() - 1) as f64;
    let regular = steps().all(|step| (step.abs() - mean).abs() <= REGULAR_TOLERANCE * mean);
    AxisDescription {
        count: values.len(),
        first: values[0],
        last: values[values.len() - 1],
        spacing: (regular && values.len() > 1).then_some(mean),
    }
}
