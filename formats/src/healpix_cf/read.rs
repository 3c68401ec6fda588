//! The values of a HEALPix field, step by step, brought to RING order.
//!
//! The numbering of cells is left to [`super::grid`], cells of several sizes to [`crate::multi_order`].

use std::rc::Rc;

use rayon::prelude::*;

use super::grid::{Grid, Scheme, Unsaid};
use crate::adapter::{About, MapSeries, MemoryEstimate, Target};
use crate::cf;
use crate::dataset::{Array, Attribute, Dataset, Variable};
use crate::describe::{GridDescription, Indexing};
use crate::error::{Ask, Error, ErrorKind, Reason};
use crate::multi_order::{self, Cell, finest, gather, place_of_uniq, place_of_zuniq};
use crate::quantity::StatedQuantity;
use crate::request::Selection;
use longan_grid::accumulate::{Accumulator, CHUNK};
use longan_grid::{CoordinateSystem, Healpix, Map, Ordering, Sphere, Time, UNSEEN, is_bad};

/// Cells that do not make a map, or not at the Nside asked for.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error(
        "variable '{variable}' has {found} values along '{dimension}', but Nside {nside} has {expected} pixels; add the coordinate healpix_index, which says which ones they are, or correct the grid mapping"
    )]
    Count { variable: String, dimension: String, found: usize, nside: usize, expected: usize },
    #[error("'{index}' has {number} at place {place} (from 0), which is not {expected}; correct it")]
    Number { index: String, number: i64, place: usize, expected: String },
    #[error("'{index}' should number pixels but holds {found}; store whole numbers")]
    Kind { index: String, found: &'static str },
    #[error("'{index}' has the cells {first} and {second} (UNIQ numbers), which overlap; remove one of them")]
    Overlap { index: String, first: u64, second: u64 },
    #[error("'{index}' names pixel {number} more than once; remove the duplicates")]
    Twice { index: String, number: i64 },
    #[error("the cells of '{index}' reach Nside {finest}, beyond {limit}; choose the resolution to bring them to")]
    TooFine { index: String, finest: usize, limit: usize },
    #[error(
        "variable '{variable}' has Nside {nside}, so it cannot be read at Nside {asked}; leave the Nside out, or degrade the field first (for example with healpy.ud_grade)"
    )]
    OneResolution { variable: String, nside: usize, asked: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::TooFine { .. } => ErrorKind::OutOfRange,
            Problem::OneResolution { .. } => ErrorKind::NotApplicable,
            _ => ErrorKind::Invalid,
        }
    }

    fn ask(&self) -> Option<Ask> {
        matches!(self, Problem::TooFine { .. } | Problem::OneResolution { .. }).then_some(Ask::Nside)
    }
}

/// Finds the selected places of a field.
pub(super) fn open(
    dataset: &Rc<dyn Dataset>,
    variable: usize,
    selection: &Selection,
) -> Result<Box<dyn MapSeries>, Error> {
    let field = &dataset.variables()[variable];
    let grid = Grid::of(&**dataset, field)?;
    let chosen = cf::select(&**dataset, field, &[grid.dimension], &selection.at)?;
    let scheme = grid.scheme(field)?;
    if let (Scheme::Pixels(healpix, _), Some(asked)) = (scheme, selection.nside)
        && asked != healpix.nside()
    {
        return Err(Problem::OneResolution { variable: field.path(), nside: healpix.nside(), asked }.into());
    }
    let cells = cells(&**dataset, field, &grid, scheme)?;
    Ok(Box::new(Field { dataset: dataset.clone(), variable, chosen, cells, nside: selection.nside }))
}

/// The grid of a field, in words for users.
pub(super) fn describe(dataset: &dyn Dataset, field: &Variable, grid: &Grid) -> Result<GridDescription, Error> {
    let (nside, ordering, indexing) = match cells(dataset, field, grid, grid.scheme(field)?)? {
        Cells::All(healpix, ordering) => (healpix.nside(), ordering, Indexing::Implicit),
        Cells::Some(healpix, ordering, _) => (healpix.nside(), ordering, Indexing::Explicit),
        Cells::Sizes(places, _) => (finest(places.iter().copied()), Ordering::Nested, Indexing::MultiOrder),
    };
    let pixels = field.dimensions[grid.dimension].len;
    let coordinates = coordinates(dataset);
    Ok(GridDescription::Healpix { nside, ordering, ordering_assumed: false, coordinates, indexing, pixels })
}

/// The celestial coordinate system that the file names, as longan does. Without one it is of the Earth, as CF is.
fn coordinates(dataset: &dyn Dataset) -> Option<CoordinateSystem> {
    let named = dataset.group_attributes("/").iter().find(|(name, _)| name.eq_ignore_ascii_case("coordsys"));
    match named {
        Some((_, Attribute::Text(system))) => CoordinateSystem::parse(system),
        _ => None,
    }
}

/// The pixels of a field's cells.
enum Cells {
    /// All pixels, one after the other.
    All(Healpix, Ordering),
    /// Some pixels, or all in disorder, by their RING numbers.
    Some(Healpix, Ordering, Vec<u64>),
    /// Cells of several sizes, by their places along the NESTED tree; and the name of the variable of numbers.
    Sizes(Vec<u64>, String),
}

/// A field, one map for each step.
struct Field {
    dataset: Rc<dyn Dataset>,
    variable: usize,
    chosen: cf::Chosen,
    cells: Cells,
    nside: Option<usize>,
}

impl MapSeries for Field {
    fn times(&self) -> &[Time] {
        self.chosen.times()
    }

    fn about(&self) -> About {
        let variable = &self.dataset.variables()[self.variable];
        let (name, unit) = (variable.name.clone(), variable.text("units").map(str::to_owned));
        let coordinates = coordinates(&*self.dataset);
        let sphere = if coordinates.is_some() { Sphere::Sky } else { Sphere::Earth };
        About { name, unit, coordinates, sphere, quantity: StatedQuantity::of(variable) }
    }

    fn place(&self) -> Vec<String> {
        self.chosen.place(&self.dataset.variables()[self.variable])
    }

    fn target(&mut self) -> Result<Target, Error> {
        let (grid, ordering) = match &self.cells {
            Cells::All(grid, ordering) | Cells::Some(grid, ordering, _) => (*grid, *ordering),
            Cells::Sizes(places, _) => {
                let nside = self.nside.unwrap_or_else(|| finest(places.iter().copied()));
                (Healpix::new(nside)?, Ordering::Nested)
            }
        };
        Ok(Target { grid, ordering, settings: Vec::new() })
    }

    fn memory(&self) -> Option<MemoryEstimate> {
        let (grid, cells) = match &self.cells {
            Cells::All(grid, _) => (*grid, grid.pixels()),
            Cells::Some(grid, _, places) => (*grid, 2 * places.len()),
            Cells::Sizes(places, _) => (Healpix::new(self.nside?).ok()?, 4 * places.len()),
        };
        Some(MemoryEstimate::of(grid, cells.saturating_mul(size_of::<f64>())))
    }

    fn read(&mut self, step: usize) -> Result<Map, Error> {
        let variable = &self.dataset.variables()[self.variable];
        let ranges = self.chosen.ranges(variable, step);
        let mut values = cf::values(&*self.dataset, variable, &ranges)?;
        values.par_iter_mut().for_each(|value| {
            if is_bad(*value, UNSEEN) {
                *value = f64::NAN;
            }
        });
        let (canvas, ordering) = match &self.cells {
            Cells::All(healpix, Ordering::Ring) => {
                (Accumulator { grid: *healpix, ordering: Ordering::Ring, values }, Ordering::Ring)
            }
            Cells::All(healpix, ordering) => {
                let mut canvas = Accumulator::new(*healpix, *ordering)?;
                let mut places = Vec::new();
                for (start, values) in (0..).step_by(CHUNK).zip(values.chunks(CHUNK)) {
                    places.clear();
                    places.extend(start..start + values.len() as u64);
                    canvas.put(&mut places, values)?;
                }
                (canvas, *ordering)
            }
            Cells::Some(healpix, ordering, places) => {
                let mut canvas = Accumulator::new(*healpix, Ordering::Ring)?;
                for (&place, &value) in places.iter().zip(&values) {
                    canvas.values[place as usize] = value;
                }
                (canvas, *ordering)
            }
            Cells::Sizes(places, index) => {
                let cells = places.iter().zip(&values).map(|(&place, &value)| Cell { place, value }).collect();
                let index = || index.clone();
                let canvas = gather(cells, self.nside).map_err(|problem| match problem {
                    multi_order::Problem::Overlap { first, second } => {
                        Problem::Overlap { index: index(), first, second }.into()
                    }
                    multi_order::Problem::TooFine { finest, limit } => {
                        Problem::TooFine { index: index(), finest, limit }.into()
                    }
                    multi_order::Problem::Other(error) => error,
                })?;
                (canvas, Ordering::Nested)
            }
        };
        let mut map = Map::from_masked(canvas.grid, canvas.values);
        self.about().label(&mut map);
        map.long_name = variable.text("long_name").or(variable.text("standard_name")).map(str::to_owned);
        map.ordering = ordering;
        map.time = self.chosen.times().get(step).cloned();
        Ok(map)
    }
}

/// The pixels of a field's cells.
fn cells(dataset: &dyn Dataset, field: &Variable, grid: &Grid, scheme: Scheme) -> Result<Cells, Error> {
    let dimension = &field.dimensions[grid.dimension];
    let index = grid.index.map(|place| &dataset.variables()[place]);
    let numbers = index.map(|index| numbers(dataset, index)).transpose()?;
    let path = || index.map(Variable::path).unwrap_or_default();
    let place = match scheme {
        Scheme::Pixels(healpix, ordering) => return pixels(field, grid, (healpix, ordering), numbers, path),
        Scheme::Nuniq => place_of_uniq,
        Scheme::Zuniq => place_of_zuniq,
    };
    let unknown = "which cells they are (a coordinate with standard_name healpix_index)";
    let numbers = numbers.ok_or_else(|| Unsaid { variable: field.path(), unknown })?;
    debug_assert_eq!(numbers.len(), dimension.len);
    let number = |(i, &number): (usize, &i64)| {
        let expected = match scheme {
            Scheme::Nuniq => "4^(level + 1) + pixel for any level up to 29",
            _ => "(2 pixel + 1) 4^(29 - level) for any level up to 29",
        };
        let wrong = || Problem::Number { index: path(), number, place: i, expected: expected.to_owned() };
        place(number.into()).ok_or_else(wrong)
    };
    let places = numbers.iter().enumerate().map(number).collect::<Result<_, Problem>>()?;
    Ok(Cells::Sizes(places, path()))
}

/// The pixels of the cells of a field on one grid.
fn pixels(
    field: &Variable,
    grid: &Grid,
    (healpix, ordering): (Healpix, Ordering),
    numbers: Option<Vec<i64>>,
    index: impl Fn() -> String,
) -> Result<Cells, Error> {
    let dimension = &field.dimensions[grid.dimension];
    let all = dimension.len == healpix.pixels();
    let Some(numbers) = numbers.filter(|numbers| !all || (0..).zip(numbers).any(|(i, &number)| number != i)) else {
        let (variable, dimension, found) = (field.path(), dimension.name.clone(), dimension.len);
        let (nside, expected) = (healpix.nside(), healpix.pixels());
        let count = Problem::Count { variable, dimension, found, nside, expected };
        return if all { Ok(Cells::All(healpix, ordering)) } else { Err(count.into()) };
    };
    let layer = match ordering {
        Ordering::Ring => None,
        Ordering::Nested => Some(cdshealpix::nested::get(healpix.depth()?)),
    };
    let place = |(i, &number): (usize, &i64)| match u64::try_from(number) {
        Ok(pixel) if pixel < healpix.pixels() as u64 => Ok(layer.map_or(pixel, |layer| layer.to_ring(pixel))),
        _ => {
            let expected = format!("a pixel of Nside {}, 0 to {}", healpix.nside(), healpix.pixels() - 1);
            Err(Problem::Number { index: index(), number, place: i, expected })
        }
    };
    let places = numbers.iter().enumerate().map(place).collect::<Result<Vec<_>, _>>()?;
    let mut sorted = numbers;
    sorted.par_sort_unstable();
    if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Problem::Twice { index: index(), number: twice[0] }.into());
    }
    Ok(Cells::Some(healpix, ordering, places))
}

/// The numbers of cells.
fn numbers(dataset: &dyn Dataset, index: &Variable) -> Result<Vec<i64>, Error> {
    let wrong = |found| Problem::Kind { index: index.path(), found }.into();
    let whole: Vec<_> = index.dimensions.iter().map(|dimension| 0..dimension.len).collect();
    match dataset.read(index, &whole)? {
        Array::Whole(numbers) => Ok(numbers),
        Array::Real(numbers) => {
            // Some software stores them so.
            let whole = |&number: &f64| Some(number as i64).filter(|&whole| whole as f64 == number);
            numbers.iter().map(whole).collect::<Option<_>>().ok_or_else(|| wrong("numbers with fractions"))
        }
        Array::Text(_) => Err(wrong("text")),
    }
}
