//! The values of a HEALPix field, step by step, brought to RING order.
//!
//! How cells are numbered is left to [`super::grid`], cells of several sizes to [`crate::multi_order`].

use std::rc::Rc;

use rayon::prelude::*;

use super::grid::{Grid, Scheme};
use crate::dataset::{Array, Attribute, Dataset, Variable};
use crate::multi_order::{Cell, Problem, gather, place_of_uniq, place_of_zuniq};
use crate::{About, Error, GridDescription, Indexing, Maps, Room, Selection, cf};
use longan_grid::accumulate::{Accumulator, CHUNK};
use longan_grid::{CoordinateSystem, Healpix, Map, Ordering, Sphere, Time, UNSEEN, is_bad};

/// Finds what is selected of a field.
pub(super) fn open(dataset: &Rc<dyn Dataset>, variable: usize, selection: &Selection) -> Result<Box<dyn Maps>, Error> {
    let field = &dataset.variables()[variable];
    let grid = Grid::of(&**dataset, field)?;
    let chosen = cf::select(&**dataset, field, &[grid.dimension], &selection.at)?;
    let scheme = grid.scheme(field)?;
    if let (Scheme::Pixels(healpix, _), Some(asked)) = (scheme, selection.nside)
        && asked != healpix.nside()
    {
        return Err(Error::OneResolution { variable: field.path(), nside: healpix.nside(), asked });
    }
    let cells = cells(&**dataset, field, &grid, scheme)?;
    Ok(Box::new(Field { dataset: dataset.clone(), variable, chosen, cells, nside: selection.nside }))
}

/// The grid of a field, in words for users.
pub(super) fn describe(dataset: &dyn Dataset, field: &Variable, grid: &Grid) -> Result<GridDescription, Error> {
    let (nside, ordering, indexing) = match cells(dataset, field, grid, grid.scheme(field)?)? {
        Cells::All(healpix, ordering) => (healpix.nside(), ordering, Indexing::Implicit),
        Cells::Some(healpix, ordering, _) => (healpix.nside(), ordering, Indexing::Explicit),
        Cells::Sizes(places, _) => {
            let finest = places.iter().map(|&place| Cell { place, value: 0.0 }.order()).max();
            (1 << finest.unwrap_or(0), Ordering::Nested, Indexing::MultiOrder)
        }
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

/// What each cell of a field is.
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

impl Maps for Field {
    fn times(&self) -> &[Time] {
        self.chosen.times()
    }

    fn about(&self) -> About {
        let variable = &self.dataset.variables()[self.variable];
        let (name, unit) = (variable.name.clone(), variable.text("units").map(str::to_owned));
        let coordinates = coordinates(&*self.dataset);
        let sphere = if coordinates.is_some() { Sphere::Sky } else { Sphere::Earth };
        About { name, unit, coordinates, sphere }
    }

    fn room(&self) -> Option<Room> {
        let (grid, cells) = match &self.cells {
            Cells::All(grid, _) => (*grid, grid.pixels()),
            Cells::Some(grid, _, places) => (*grid, 2 * places.len()),
            Cells::Sizes(places, _) => (Healpix::new(self.nside?).ok()?, 4 * places.len()),
        };
        Some(Room::of(grid, cells.saturating_mul(size_of::<f64>())))
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
                    Problem::Overlap { first, second } => Error::CellOverlap { index: index(), first, second },
                    Problem::TooFine { finest, limit } => Error::CellsFine { index: index(), finest, limit },
                    Problem::Other(error) => error,
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

/// What each cell of a field is.
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
    let numbers = numbers.ok_or_else(|| Error::GridUnknown { variable: field.path(), unknown })?;
    debug_assert_eq!(numbers.len(), dimension.len);
    let number = |(i, &number): (usize, &i64)| {
        let expected = match scheme {
            Scheme::Nuniq => "4^(level + 1) + pixel for any level up to 29",
            _ => "(2 pixel + 1) 4^(29 - level) for any level up to 29",
        };
        let wrong = || Error::CellNumber { index: path(), number, place: i, expected: expected.to_owned() };
        place(number.into()).ok_or_else(wrong)
    };
    let places = numbers.iter().enumerate().map(number).collect::<Result<_, Error>>()?;
    Ok(Cells::Sizes(places, path()))
}

/// What each cell of a field on one grid is.
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
        let count = Error::CellCount { variable, dimension, found, nside, expected };
        return if all { Ok(Cells::All(healpix, ordering)) } else { Err(count) };
    };
    let layer = match ordering {
        Ordering::Ring => None,
        Ordering::Nested => Some(cdshealpix::nested::get(healpix.depth()?)),
    };
    let place = |(i, &number): (usize, &i64)| match u64::try_from(number) {
        Ok(pixel) if pixel < healpix.pixels() as u64 => Ok(layer.map_or(pixel, |layer| layer.to_ring(pixel))),
        _ => {
            let expected = format!("a pixel of Nside {}, 0 to {}", healpix.nside(), healpix.pixels() - 1);
            Err(Error::CellNumber { index: index(), number, place: i, expected })
        }
    };
    let places = numbers.iter().enumerate().map(place).collect::<Result<Vec<_>, _>>()?;
    let mut sorted = numbers;
    sorted.par_sort_unstable();
    if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::CellTwice { index: index(), number: twice[0] });
    }
    Ok(Cells::Some(healpix, ordering, places))
}

/// The numbers of cells.
fn numbers(dataset: &dyn Dataset, index: &Variable) -> Result<Vec<i64>, Error> {
    let wrong = |found| Error::CellKind { index: index.path(), found };
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
