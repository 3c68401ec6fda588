//! The numbering of a variable's cells, from any of the ways in which files say it.
//!
//! In the order in which they are looked for: the grid mapping that the variable names; the attributes that xdggs puts
//! on an index coordinate; the group attribute of the Zarr convention `dggs`; and, for variables that name no grid
//! mapping or one that is not there, a HEALPix grid mapping in scope, if the variable has a dimension for cells. The
//! numbers themselves are left to [`super::read`].

use crate::cf;
use crate::dataset::{self, Attribute, Dataset, Kind, Variable};
use crate::error::{Error, ErrorKind, Reason};
use longan_grid::{Healpix, Ordering};

/// Names that dimensions of cells have in files without an index coordinate.
const CELL_DIMENSIONS: [&str; 8] = ["cell", "cells", "value", "values", "healpix_index", "cell_ids", "pixel", "pix"];

/// The number of pixels is 12 · 4^level, so that level 29 is the last that 64 bits hold.
const LEVEL_MAX: i64 = 29;

/// A HEALPix field about which the file leaves something unsaid.
#[derive(Debug, thiserror::Error)]
#[error("variable '{variable}' is on a HEALPix grid, but nothing says {unknown}; add it to its grid mapping")]
pub(super) struct Unsaid {
    pub(super) variable: String,
    /// The thing unsaid, and the attribute that would say it.
    pub(super) unknown: &'static str,
}

impl Reason for Unsaid {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Incomplete
    }
}

/// The numbering of a variable's cells, as far as the file says it.
pub(super) struct Grid {
    /// The dimension of cells, as a place among the variable's.
    pub(super) dimension: usize,
    /// The variable of numbers, as a place among the dataset's.
    pub(super) index: Option<usize>,
    says: Says,
}

/// The kinds of numbers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scheme {
    /// Of pixels of one grid.
    Pixels(Healpix, Ordering),
    /// UNIQ numbers.
    Nuniq,
    /// Places along the NESTED tree.
    Zuniq,
}

/// The words of attributes about a grid.
#[derive(Clone, Default)]
struct Says {
    /// The variable or group that has the attributes.
    of: String,
    /// Nside or the level, by the name of the attribute that has it.
    nside: Option<(&'static str, Attribute)>,
    level: Option<(&'static str, Attribute)>,
    scheme: Option<(&'static str, Attribute)>,
    /// The scheme where none is named, for conventions that have one.
    scheme_default: Option<&'static str>,
}

impl Says {
    /// The words of attributes, if they are about HEALPix.
    fn of(of: &str, get: &dyn Fn(&str) -> Option<Attribute>) -> Option<Self> {
        let is = |name: &str| matches!(get(name), Some(Attribute::Text(text)) if text.eq_ignore_ascii_case("healpix"));
        let xdggs = is("grid_name") || is("name");
        if !xdggs && !is("grid_mapping_name") && get("healpix_nside").is_none() {
            return None;
        }
        let first = |names: &[&'static str]| names.iter().find_map(|&name| Some((name, get(name)?)));
        let is_text = |named: &(_, Attribute)| matches!(named.1, Attribute::Text(_));
        // To some "order" is the level, to others the scheme.
        let order = first(&["order"]);
        Some(Says {
            of: of.to_owned(),
            nside: first(&["healpix_nside", "nside"]),
            level: first(&["refinement_level", "level", "resolution", "depth"])
                .or_else(|| order.clone().filter(|order| !is_text(order))),
            scheme: first(&["indexing_scheme", "healpix_order", "nest"]).or_else(|| order.filter(is_text)),
            scheme_default: xdggs.then_some("nested"),
        })
    }

    fn of_variable(variable: &Variable) -> Option<Self> {
        Says::of(&variable.path(), &|name| variable.attribute(name).cloned())
    }

    fn wrong(&self, (attribute, found): &(&'static str, Attribute), expected: &'static str) -> dataset::Problem {
        let found = match found {
            Attribute::Text(text) => format!("'{}'", text.escape_debug()),
            Attribute::Real(numbers) => format!("{numbers:?}"),
            Attribute::Whole(numbers) => format!("{numbers:?}"),
            Attribute::Json(value) => value.to_string(),
        };
        dataset::Problem::AttributeValue { variable: self.of.clone(), attribute, found, expected }
    }

    /// The grid, if a level or Nside is named.
    fn healpix(&self) -> Result<Option<Healpix>, Error> {
        if let Some(level) = self.level.as_ref().filter(|level| !is_none(&level.1)) {
            let number = whole(&level.1).filter(|number| (0..=LEVEL_MAX).contains(number));
            let number = number.ok_or_else(|| self.wrong(level, "a whole number from 0 to 29"))?;
            return Ok(Some(Healpix::new(1 << number)?));
        }
        let Some(nside) = &self.nside else { return Ok(None) };
        let number = whole(&nside.1).and_then(|number| Healpix::new(usize::try_from(number).ok()?).ok());
        Ok(Some(number.ok_or_else(|| self.wrong(nside, "a whole number from 1 to 2^29"))?))
    }

    /// The name of the scheme in CF's words.
    fn scheme(&self) -> Result<Option<&'static str>, dataset::Problem> {
        let Some(scheme) = &self.scheme else { return Ok(self.scheme_default) };
        let name = match &scheme.1 {
            Attribute::Text(text) => text.trim().to_ascii_lowercase(),
            Attribute::Json(value) => value.to_string(),
            number => whole(number).map_or_else(String::new, |number| number.to_string()),
        };
        Ok(Some(match name.as_str() {
            "ring" | "false" | "0" => "ring",
            "nested" | "nest" | "true" | "1" => "nested",
            "nuniq" | "uniq" => "nuniq",
            "zuniq" => "zuniq",
            _ => return Err(self.wrong(scheme, "one of nested, ring, nuniq and zuniq")),
        }))
    }
}

/// The whole number of an attribute, which some write as a real one or in digits.
fn whole(attribute: &Attribute) -> Option<i64> {
    match attribute {
        Attribute::Whole(numbers) if numbers.len() == 1 => Some(numbers[0]),
        Attribute::Real(numbers) if numbers.len() == 1 => {
            Some(numbers[0] as i64).filter(|&number| number as f64 == numbers[0])
        }
        Attribute::Text(digits) => digits.trim().parse().ok(),
        _ => None,
    }
}

/// Whether an attribute says that there is no such thing, as the level of cells of several sizes.
fn is_none(attribute: &Attribute) -> bool {
    matches!(attribute, Attribute::Json(serde_json::Value::Null))
}

impl Grid {
    /// Finds the grid of a variable, if it is HEALPix.
    pub(super) fn find(dataset: &dyn Dataset, variable: &Variable) -> Option<Self> {
        // The extended form of CF 5.6 has colons after names of grid mappings, and names of coordinates after those.
        let named = cf::names_in(variable, "grid_mapping");
        let mappings: Vec<_> = named
            .iter()
            .filter_map(|name| cf::find(dataset, &variable.group, name.trim_end_matches(':')))
            .filter(|mapping| mapping.attribute("grid_mapping_name").is_some() || Says::of_variable(mapping).is_some())
            .collect();
        if let Some(says) = mappings.iter().find_map(|mapping| Says::of_variable(mapping)) {
            return Grid::along(dataset, variable, says, None, true);
        }
        if !mappings.is_empty() {
            return None;
        }
        let in_scope = || dataset.variables().iter().filter(|v| is_in_scope(variable, v));
        let indices = in_scope().filter(|v| v.dimensions.len() == 1 && variable.dimensions.contains(&v.dimensions[0]));
        if let Some((index, says)) = indices.into_iter().find_map(|v| Some((v, Says::of_variable(v)?))) {
            return Grid::along(dataset, variable, says, Some(&index.dimensions[0].name), true);
        }
        if let Some((says, dimension)) = convention(dataset, &variable.group) {
            return Grid::along(dataset, variable, says, dimension.as_deref(), true);
        }
        let says = in_scope().find_map(Says::of_variable)?;
        Grid::along(dataset, variable, says, None, !named.is_empty())
    }

    /// The grid of a variable that is known to be HEALPix.
    pub(super) fn of(dataset: &dyn Dataset, variable: &Variable) -> Result<Self, Unsaid> {
        let unknown = "how pixels are numbered (indexing_scheme)";
        Grid::find(dataset, variable).ok_or_else(|| Unsaid { variable: variable.path(), unknown })
    }

    /// The grid of a variable, along the dimension of this name if one is given. Where it is not `sure` that the
    /// variable is on the grid, a dimension is needed that looks like one of cells.
    fn along(
        dataset: &dyn Dataset,
        variable: &Variable,
        says: Says,
        dimension: Option<&str>,
        sure: bool,
    ) -> Option<Self> {
        let dimensions = &variable.dimensions;
        let index_of = |place: usize| index_along(dataset, variable, place, &says);
        let pixels = says.healpix().ok().flatten().map(Healpix::pixels);
        let named = |place: &usize| CELL_DIMENSIONS.contains(&dimensions[*place].name.to_ascii_lowercase().as_str());
        let full = |place: &usize| Some(dimensions[*place].len) == pixels;
        let any = |len: usize| Healpix::with_pixels(len).is_some();
        let places = || 0..dimensions.len();
        let given = places().find(|&place| Some(dimensions[place].name.as_str()) == dimension);
        let is_index = |place: &usize| index_of(*place).is_some_and(|(_, sure)| sure);
        let found = given
            .or_else(|| places().find(is_index))
            .or_else(|| {
                places().find(|place| named(place) && (full(place) || pixels.is_none() && any(dimensions[*place].len)))
            })
            .or_else(|| places().rfind(full).filter(|_| sure))
            .or_else(|| places().find(named))
            .or_else(|| places().next_back().filter(|_| sure && dimensions.len() == 1));
        let dimension = found.filter(|_| dimension.is_none() || given.is_some())?;
        Some(Grid { dimension, index: index_of(dimension).map(|(index, _)| index), says })
    }

    /// The kind of the numbers of cells.
    ///
    /// # Errors
    /// Where the file does not say it, or says what cannot be.
    pub(super) fn scheme(&self, variable: &Variable) -> Result<Scheme, Error> {
        let unknown = |unknown| Unsaid { variable: variable.path(), unknown };
        let scheme = self.says.scheme()?.ok_or_else(|| unknown("how pixels are numbered (indexing_scheme)"))?;
        let ordering = match scheme {
            "nuniq" => return Ok(Scheme::Nuniq),
            "zuniq" => return Ok(Scheme::Zuniq),
            "ring" => Ordering::Ring,
            _ => Ordering::Nested,
        };
        let all = Healpix::with_pixels(variable.dimensions[self.dimension].len);
        let healpix = self.says.healpix()?.or(all).ok_or_else(|| unknown("its resolution (refinement_level)"))?;
        if ordering == Ordering::Nested {
            healpix.depth()?;
        }
        Ok(Scheme::Pixels(healpix, ordering))
    }
}

/// Whether a variable can name another without a path: it is in the same group, or one around it.
fn is_in_scope(variable: &Variable, other: &Variable) -> bool {
    let around =
        other.group == "/" || variable.group.strip_prefix(&other.group).is_some_and(|rest| rest.starts_with('/'));
    around || variable.group == other.group
}

/// The variable of numbers along a dimension, as a place among the dataset's, and whether it is sure that it is one.
fn index_along(dataset: &dyn Dataset, variable: &Variable, dimension: usize, says: &Says) -> Option<(usize, bool)> {
    let dimension = &variable.dimensions[dimension];
    let along = |v: &Variable| v.dimensions.len() == 1 && v.dimensions[0] == *dimension && is_in_scope(variable, v);
    let candidates = || dataset.variables().iter().enumerate().filter(|(_, v)| along(v));
    let by_standard = candidates().find(|(_, v)| v.text("standard_name") == Some("healpix_index"));
    let by_attributes = || candidates().find(|(_, v)| v.path() == says.of || v.text("grid_name") == Some("healpix"));
    let by_convention = || candidates().find(|(_, v)| says.of.ends_with(&format!("[{}]", v.name)));
    let sure = by_standard.or_else(by_attributes).or_else(by_convention);
    let names = [dimension.name.as_str(), "cell", "cell_ids", "healpix_index"];
    let numbers = |v: &Variable| !matches!(v.kind, Kind::Text | Kind::Other);
    let by_name = || candidates().find(|(_, v)| names.contains(&v.name.as_str()) && numbers(v));
    sure.map(|(place, _)| (place, true)).or_else(|| by_name().map(|(place, _)| (place, false)))
}

/// The words of the attribute `dggs` of a group, or of one around it, and the dimension of cells. The variable of numbers
/// is named in brackets.
fn convention(dataset: &dyn Dataset, group: &str) -> Option<(Says, Option<String>)> {
    let mut group = group;
    loop {
        let dggs = dataset.group_attributes(group).iter().find(|(name, _)| name == "dggs");
        if let Some((_, Attribute::Json(dggs))) = dggs {
            let text = |name: &str| dggs.get(name).and_then(|value| value.as_str()).map(str::to_owned);
            let of = format!("{group} dggs[{}]", text("coordinate").unwrap_or_default());
            let says = Says::of(&of, &|name| dggs.get(name).map(|value| json(value.clone())))?;
            return Some((says, text("spatial_dimension")));
        }
        if group == "/" {
            return None;
        }
        group = group.rsplit_once('/').map(|(around, _)| around).filter(|around| !around.is_empty()).unwrap_or("/");
    }
}

fn json(value: serde_json::Value) -> Attribute {
    match (value.as_i64(), value.as_f64(), value) {
        (Some(number), _, _) => Attribute::Whole(vec![number]),
        (_, Some(number), _) => Attribute::Real(vec![number]),
        (_, _, serde_json::Value::String(text)) => Attribute::Text(text),
        (_, _, value) => Attribute::Json(value),
    }
}
