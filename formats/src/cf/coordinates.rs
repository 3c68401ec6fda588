//! The coordinates that belong to a variable's dimensions: latitude, longitude, time and other coordinates.
//!
//! A coordinate is known by its units, else by its `standard_name`, else by its `axis`, else by its name, and may be
//! in the variable's group or any that this one is in. The values of coordinates are left to others.

use crate::dataset::{Dataset, Dimension, Kind, Variable};
use crate::error::{ErrorKind, Reason};

/// Coordinates of the sphere that are not read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error(
        "variable '{variable}' is on a curvilinear grid, whose coordinate '{coordinate}' has two dimensions, but only rectilinear ones are read; regrid it first, such as with cdo remapbil,global_1"
    )]
    Curvilinear { variable: String, coordinate: String },
    #[error(
        "variable '{variable}' is on an unstructured grid, whose latitudes and longitudes both run along '{dimension}', but only rectilinear ones are read; regrid it first, such as with cdo remapnn,global_1"
    )]
    Unstructured { variable: String, dimension: String },
    #[error(
        "coordinate '{coordinate}' is a {found}, not a latitude or longitude; regrid the field first, such as with cdo remapbil,global_1"
    )]
    OtherAxis { coordinate: String, found: String },
    #[error(
        "coordinate '{coordinate}' is in '{units}', but degrees are needed; multiply it by 180/pi and set its units to degrees, such as with ncap2"
    )]
    CoordinateRadians { coordinate: String, units: String },
    #[error(
        "coordinate '{coordinate}' is in '{units}', not degrees; bring the field to a grid of latitude and longitude first, such as with gdalwarp -t_srs EPSG:4326"
    )]
    CoordinateUnits { coordinate: String, units: String },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Unsupported
    }
}

/// The axis of places on the sphere, or of time, along which a coordinate runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    Latitude,
    Longitude,
    Time,
}

/// How a coordinate is known, the surest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Evidence {
    Units,
    StandardName,
    Axis,
    Name,
}

impl Axis {
    fn standard_name(self) -> &'static str {
        match self {
            Axis::Latitude => "latitude",
            Axis::Longitude => "longitude",
            Axis::Time => "time",
        }
    }

    fn letter(self) -> &'static str {
        match self {
            Axis::Latitude => "Y",
            Axis::Longitude => "X",
            Axis::Time => "T",
        }
    }

    fn names(self) -> &'static [&'static str] {
        match self {
            Axis::Latitude => &["lat", "latitude", "lats", "latitudes", "nav_lat", "y"],
            Axis::Longitude => &["lon", "longitude", "lons", "longitudes", "nav_lon", "long", "x"],
            Axis::Time => &["time", "t"],
        }
    }

    /// Whether these units are of nothing else.
    fn has_units(self, units: &str) -> bool {
        let units = units.trim().to_ascii_lowercase();
        let points = match self {
            Axis::Latitude => ["north", "n"],
            Axis::Longitude => ["east", "e"],
            Axis::Time => return units.contains(" since "),
        };
        let direction = units.strip_prefix("degree").map(|rest| rest.strip_prefix('s').unwrap_or(rest));
        direction.is_some_and(|rest| points.contains(&rest.strip_prefix('_').unwrap_or(rest)))
    }

    /// How a variable is known to be such a coordinate, if it is.
    fn evidence(self, variable: &Variable) -> Option<Evidence> {
        let standard_name = variable.text("standard_name");
        if variable.text("units").is_some_and(|units| self.has_units(units)) {
            Some(Evidence::Units)
        } else if standard_name == Some(self.standard_name()) {
            Some(Evidence::StandardName)
        } else if variable.text("axis").is_some_and(|axis| axis.eq_ignore_ascii_case(self.letter())) {
            Some(Evidence::Axis)
        } else if standard_name.is_none() && self.is_name(&variable.name) {
            Some(Evidence::Name)
        } else {
            None
        }
    }

    fn is_name(self, name: &str) -> bool {
        self.names().iter().any(|n| n.eq_ignore_ascii_case(name))
    }

    /// Whether a dimension, by its name or by what is known of its coordinate, runs along this axis.
    pub(crate) fn is_of(self, dimension: &Dimension, coordinate: Option<&Variable>) -> bool {
        match coordinate {
            Some(coordinate) => self.evidence(coordinate).is_some(),
            None => self.is_name(&dimension.name),
        }
    }
}

/// Whether a variable surely holds latitudes or longitudes.
pub(crate) fn is_position(variable: &Variable) -> bool {
    let evidence = |axis: Axis| axis.evidence(variable).is_some_and(|evidence| evidence <= Evidence::StandardName);
    evidence(Axis::Latitude) || evidence(Axis::Longitude)
}

/// The dimensions of a variable that run over the sphere, and their coordinates.
#[derive(Debug)]
pub(crate) struct Horizontal {
    /// The place of the latitude among the variable's dimensions.
    pub(crate) latitude: usize,
    /// That of the longitude.
    pub(crate) longitude: usize,
    /// The coordinates, as places among the dataset's variables.
    pub(crate) latitudes: usize,
    pub(crate) longitudes: usize,
}

impl Horizontal {
    /// Finds the dimensions of latitude and longitude; nothing where a variable has none.
    ///
    /// # Errors
    /// Where it has, but not in a way that can be read: two-dimensional coordinates, one dimension for both, or other
    /// units than degrees.
    pub(crate) fn of(dataset: &dyn Dataset, variable: &Variable) -> Result<Option<Self>, Problem> {
        let latitude = axis_of(dataset, variable, Axis::Latitude);
        let longitude = axis_of(dataset, variable, Axis::Longitude);
        let sure = |axis: &Option<Found>| axis.as_ref().is_some_and(|found| found.evidence <= Evidence::StandardName);
        if !(sure(&latitude) && sure(&longitude))
            && let Some(coordinate) = two_dimensional(dataset, variable)
        {
            return Err(Problem::Curvilinear { variable: variable.path(), coordinate: coordinate.path() });
        }
        let (Some(latitude), Some(longitude)) = (latitude, longitude) else { return Ok(None) };
        let both = [latitude.variable, longitude.variable].map(|place| &dataset.variables()[place]);
        if latitude.dimension == longitude.dimension {
            let dimension = variable.dimensions[latitude.dimension].name.clone();
            return Err(Problem::Unstructured { variable: variable.path(), dimension });
        }
        for coordinate in both {
            check_degrees(coordinate)?;
        }
        Ok(Some(Horizontal {
            latitude: latitude.dimension,
            longitude: longitude.dimension,
            latitudes: latitude.variable,
            longitudes: longitude.variable,
        }))
    }
}

/// A dimension with a coordinate of some axis.
struct Found {
    evidence: Evidence,
    /// The place among the variable's dimensions.
    dimension: usize,
    /// The coordinate's place among the dataset's variables.
    variable: usize,
}

/// The dimension of a variable that is surest to run along an axis.
fn axis_of(dataset: &dyn Dataset, variable: &Variable, axis: Axis) -> Option<Found> {
    let listed = names_in(variable, "coordinates");
    let mut best: Option<(Evidence, bool, Found)> = None;
    for (dimension, d) in variable.dimensions.iter().enumerate() {
        for place in in_scope(dataset, &variable.group) {
            let candidate = &dataset.variables()[place];
            if candidate.dimensions.len() != 1 || candidate.dimensions[0] != *d {
                continue;
            }
            let named = candidate.name == d.name;
            let Some(evidence) = axis.evidence(candidate) else { continue };
            // Any other variable along the dimension needs to be sure.
            if !named && !is_listed(&listed, candidate) && evidence > Evidence::StandardName {
                continue;
            }
            if best.as_ref().is_none_or(|(e, n, _)| (evidence, !named) < (*e, *n)) {
                best = Some((evidence, !named, Found { evidence, dimension, variable: place }));
            }
        }
    }
    best.map(|(_, _, found)| found)
}

/// A latitude or longitude over two dimensions of a variable.
fn two_dimensional<'d>(dataset: &'d dyn Dataset, variable: &Variable) -> Option<&'d Variable> {
    let listed = names_in(variable, "coordinates");
    let axes = [Axis::Latitude, Axis::Longitude];
    in_scope(dataset, &variable.group).map(|place| &dataset.variables()[place]).find(|candidate| {
        let evidence = axes.iter().filter_map(|axis| axis.evidence(candidate)).min();
        let sure = evidence.is_some_and(|e| e <= Evidence::StandardName || is_listed(&listed, candidate));
        let within = candidate.dimensions.iter().all(|d| variable.dimensions.contains(d));
        candidate.dimensions.len() == 2 && within && sure && candidate.path() != variable.path()
    })
}

/// Fails where a coordinate of the sphere is in other units than degrees.
fn check_degrees(coordinate: &Variable) -> Result<(), Problem> {
    let standard_name = coordinate.text("standard_name");
    if let Some(found) = standard_name.filter(|name| !["latitude", "longitude"].contains(name)) {
        return Err(Problem::OtherAxis { coordinate: coordinate.path(), found: found.escape_debug().to_string() });
    }
    let Some(units) = coordinate.text("units").map(str::trim) else { return Ok(()) };
    let plain = ["degrees", "degree", "deg", "\u{b0}", ""].iter().any(|u| u.eq_ignore_ascii_case(units));
    if plain || Axis::Latitude.has_units(units) || Axis::Longitude.has_units(units) {
        return Ok(());
    }
    let (coordinate, units) = (coordinate.path(), units.escape_debug().to_string());
    if units.to_ascii_lowercase().starts_with("rad") {
        Err(Problem::CoordinateRadians { coordinate, units })
    } else {
        Err(Problem::CoordinateUnits { coordinate, units })
    }
}

/// The places among a dataset's variables of those in a group and in all that it is in, the nearest first.
fn in_scope<'d>(dataset: &'d dyn Dataset, group: &str) -> impl Iterator<Item = usize> + use<'d> {
    let mut groups = vec![group.to_owned()];
    while let Some((parent, _)) = groups.last().and_then(|group| group.rsplit_once('/')) {
        let parent = if parent.is_empty() { "/" } else { parent };
        if groups.last().is_some_and(|group| group == parent) {
            break;
        }
        groups.push(parent.to_owned());
    }
    let variables = dataset.variables();
    groups.into_iter().flat_map(move |group| {
        variables.iter().enumerate().filter(move |(_, v)| v.group == group).map(|(place, _)| place)
    })
}

/// The variable that an attribute of one in `group` calls by this name, which may be a path.
pub(crate) fn find<'d>(dataset: &'d dyn Dataset, group: &str, name: &str) -> Option<&'d Variable> {
    let variables = dataset.variables();
    match name.rsplit_once('/') {
        None => in_scope(dataset, group).map(|place| &variables[place]).find(|v| v.name == name),
        Some(_) => {
            let absolute = name.strip_prefix('/');
            let below = format!("{}/{name}", group.trim_matches('/'));
            let path = absolute.unwrap_or_else(|| below.trim_start_matches('/'));
            variables.iter().find(|v| v.path() == path)
        }
    }
}

/// The names in an attribute that lists some, such as `coordinates`.
pub(crate) fn names_in<'v>(variable: &'v Variable, attribute: &str) -> Vec<&'v str> {
    variable.text(attribute).map(|text| text.split_whitespace().collect()).unwrap_or_default()
}

/// Whether a list of names has a variable's.
fn is_listed(names: &[&str], variable: &Variable) -> bool {
    names.iter().any(|name| name.rsplit('/').next() == Some(&variable.name))
}

/// The coordinate of one of a variable's dimensions: the variable of the dimension's name, else one that the variable
/// lists among its coordinates, numbers before texts.
pub(crate) fn coordinate_of<'d>(
    dataset: &'d dyn Dataset,
    variable: &Variable,
    dimension: &Dimension,
) -> Option<&'d Variable> {
    let along = |candidate: &&Variable| {
        candidate.kind != Kind::Other && candidate.dimensions.len() == 1 && candidate.dimensions[0] == *dimension
    };
    let listed = names_in(variable, "coordinates");
    let candidates = || in_scope(dataset, &variable.group).map(|place| &dataset.variables()[place]).filter(along);
    let listed = || candidates().filter(|candidate| is_listed(&listed, candidate));
    let numbers = |candidate: &&Variable| candidate.kind != Kind::Text;
    let named = candidates().find(|candidate| candidate.name == dimension.name);
    named.or_else(|| listed().find(numbers)).or_else(|| listed().next())
}

/// The time that a variable has without a dimension for it: a coordinate of a single value.
pub(crate) fn scalar_time<'d>(dataset: &'d dyn Dataset, variable: &Variable) -> Option<&'d Variable> {
    let listed = names_in(variable, "coordinates").into_iter().filter_map(|n| find(dataset, &variable.group, n));
    listed.filter(|v| v.dimensions.is_empty()).find(|v| Axis::Time.evidence(v).is_some())
}
