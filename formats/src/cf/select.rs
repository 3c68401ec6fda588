//! Places along dimensions: `level=500`, `time=1997-12`, `month=#0`.
//!
//! Which dimensions run over the sphere is left to the caller; of all others one place is to be chosen, but for time,
//! where several make a series of maps.

use std::ops::Range;

use super::coordinates::{Axis, coordinate_of, scalar_time};
use super::time::TimeUnits;
use super::unpack::values;
use crate::adapter::field_place;
use crate::dataset::{Array, Dataset, Dimension, Kind, Variable};
use crate::error::{Ask, Error, ErrorKind, Reason};
use crate::names::is_alike;
use crate::request::{At, Place};
use longan_grid::Time;

/// Problems with a choice of places along dimensions.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error(
        "dimension '{dimension}' of variable '{variable}' has length 0, so there is nothing to read; check how the file was made"
    )]
    EmptyDimension { variable: String, dimension: String },
    #[error("variable '{variable}' has no dimension '{dimension}' to choose along; its dimensions are {dimensions}")]
    NoSuchDimension { variable: String, dimension: String, dimensions: String },
    #[error("dimension '{dimension}' runs over the sphere, all of which is read; leave it out of the selection")]
    SphereDimension { dimension: String },
    #[error("dimension '{dimension}' is chosen along twice; leave one choice out")]
    SelectedTwice { dimension: String },
    #[error("there is no {dimension} = {place}; the values are {values}")]
    NoSuchPlace { dimension: String, place: String, values: String },
    #[error("{dimension} = {place} is met {count} times; choose one by its number, such as #{first}")]
    SeveralPlaces { dimension: String, place: String, count: usize, first: usize },
    #[error("there is no {dimension} = #{index}; they are numbered from #0 to #{last}")]
    IndexRange { dimension: String, index: usize, last: usize },
    #[error("variable '{variable}' has several values along '{dimension}': {values}; choose one")]
    DimensionLeft { variable: String, dimension: String, values: String },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::EmptyDimension { .. } => ErrorKind::NoValues,
            Problem::NoSuchDimension { .. } | Problem::NoSuchPlace { .. } => ErrorKind::Unknown,
            Problem::SphereDimension { .. } => ErrorKind::NotApplicable,
            Problem::SelectedTwice { .. } => ErrorKind::InvalidInput,
            Problem::SeveralPlaces { .. } | Problem::DimensionLeft { .. } => ErrorKind::Ambiguous,
            Problem::IndexRange { .. } => ErrorKind::OutOfRange,
        }
    }

    fn ask(&self) -> Option<Ask> {
        let (dimension, place) = match self {
            Problem::EmptyDimension { .. } => return None,
            Problem::NoSuchDimension { .. } => (None, None),
            Problem::SeveralPlaces { dimension, first, .. } => (Some(dimension), Some(format!("#{first}"))),
            Problem::SphereDimension { dimension }
            | Problem::SelectedTwice { dimension }
            | Problem::NoSuchPlace { dimension, .. }
            | Problem::IndexRange { dimension, .. }
            | Problem::DimensionLeft { dimension, .. } => (Some(dimension), None),
        };
        Some(Ask::Place { dimension: dimension.cloned(), place })
    }

    fn found(&self) -> Option<String> {
        match self {
            Problem::EmptyDimension { dimension, .. } => Some(format!("empty along '{dimension}'")),
            _ => None,
        }
    }
}

/// A number names a coordinate value within this part of it, so that 0.1 finds 0.1 in single precision.
const VALUE_TOLERANCE: f64 = 1e-6;

/// Lists of more values than this are abbreviated, to the first ones and the last ones.
const LISTED: usize = 12;
const LISTED_FIRST: usize = 6;
const LISTED_LAST: usize = 3;

/// The names of the places along a dimension.
pub(crate) enum Labels {
    /// No names, since there is no coordinate; the number of places.
    None(usize),
    /// Numbers, and their unit.
    Numbers(Vec<f64>, Option<String>),
    /// Times, and their dates in full, where the unit is understood.
    Times(Vec<Time>, Vec<Option<String>>),
    Texts(Vec<String>),
}

impl Labels {
    /// The labels along a dimension of a variable.
    pub(crate) fn of(dataset: &dyn Dataset, variable: &Variable, dimension: &Dimension) -> Result<Self, Error> {
        let coordinate = coordinate_of(dataset, variable, dimension);
        let is_time = Axis::Time.is_of(dimension, coordinate);
        let whole = 0..dimension.len;
        match coordinate {
            Some(coordinate) if coordinate.kind == Kind::Text => match dataset.read(coordinate, &[whole])? {
                Array::Text(texts) => Ok(Labels::Texts(texts)),
                _ => Ok(Labels::None(dimension.len)),
            },
            Some(coordinate) => {
                let numbers = values(dataset, coordinate, &[whole])?;
                if is_time {
                    Ok(times(coordinate, &numbers))
                } else {
                    Ok(Labels::Numbers(numbers, coordinate.text("units").map(str::to_owned)))
                }
            }
            None if is_time => {
                let time = |n: usize| Time {
                    value: n as f64,
                    units: "1".to_owned(),
                    calendar: String::new(),
                    label: format!("#{n}"),
                };
                Ok(Labels::Times(whole.clone().map(time).collect(), vec![None; whole.len()]))
            }
            None => Ok(Labels::None(dimension.len)),
        }
    }

    fn len(&self) -> usize {
        match self {
            Labels::None(len) => *len,
            Labels::Numbers(numbers, _) => numbers.len(),
            Labels::Times(times, _) => times.len(),
            Labels::Texts(texts) => texts.len(),
        }
    }

    fn show(&self, n: usize) -> String {
        match self {
            Labels::None(_) => format!("#{n}"),
            Labels::Numbers(numbers, _) => number(numbers[n]),
            Labels::Times(times, _) => times[n].label.clone(),
            Labels::Texts(texts) => texts[n].escape_debug().to_string(),
        }
    }

    /// A name of places in their order, which no other places of the dimension have.
    fn name(&self, places: &[usize]) -> String {
        match places {
            &[place] => {
                let name = self.show(place);
                if self.matching(&name) == [place] { name } else { format!("#{place}") }
            }
            _ if places.len() == self.len() => "all".to_owned(),
            _ => places.iter().map(|place| format!("#{place}")).collect::<Vec<_>>().join(","),
        }
    }

    /// All values, or the first and the last of many.
    pub(crate) fn listed(&self) -> String {
        let len = self.len();
        let show = |range: Range<usize>| range.map(|n| self.show(n)).collect::<Vec<_>>().join(", ");
        let list = match self {
            Labels::None(1..) => format!("#0 to #{}", len - 1),
            Labels::Times(..) if len > 2 => format!("{} to {}", self.show(0), self.show(len - 1)),
            _ if len <= LISTED => show(0..len),
            _ => format!("{}, ..., {}", show(0..LISTED_FIRST), show(len - LISTED_LAST..len)),
        };
        match self {
            Labels::Numbers(_, Some(unit)) => format!("{list} ({})", unit.escape_debug()),
            _ => list,
        }
    }

    /// The places that a text names.
    fn matching(&self, text: &str) -> Vec<usize> {
        let text = text.trim();
        let wanted: Option<f64> = text.parse().ok();
        let equal =
            |value: f64| wanted.is_some_and(|w| (w - value).abs() <= VALUE_TOLERANCE * w.abs().max(value.abs()));
        let all = |is: &dyn Fn(usize) -> bool| (0..self.len()).filter(|&n| is(n)).collect::<Vec<_>>();
        match self {
            Labels::None(_) => Vec::new(),
            Labels::Numbers(numbers, _) => all(&|n| equal(numbers[n])),
            Labels::Times(times, dates) => {
                let date = text.replacen(' ', "T", 1).to_ascii_uppercase();
                let date = date.strip_suffix('Z').unwrap_or(&date);
                let dated = all(&|n| dates[n].as_deref().is_some_and(|full| is_within(full, date)));
                if dated.is_empty() { all(&|n| equal(times[n].value)) } else { dated }
            }
            Labels::Texts(texts) => all(&|n| texts[n] == text),
        }
    }
}

/// Whether a date in full is within the year, the month, or so on, that its beginning names.
fn is_within(full: &str, beginning: &str) -> bool {
    let rest = full.strip_prefix(beginning).filter(|_| !beginning.is_empty());
    rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// The times of a coordinate.
fn times(coordinate: &Variable, numbers: &[f64]) -> Labels {
    let units = coordinate.text("units").unwrap_or_default();
    let calendar = coordinate.text("calendar").map_or("standard".to_owned(), str::to_ascii_lowercase);
    let parsed = TimeUnits::parse(units, &calendar);
    let moment = |value: f64| parsed.and_then(|units| units.moment(value));
    let time = |&value: &f64| Time {
        value,
        units: units.to_owned(),
        calendar: calendar.clone(),
        label: moment(value).map_or_else(|| number(value), |moment| moment.to_string()),
    };
    let in_full = |&value: &f64| moment(value).map(|moment| format!("{moment:#}"));
    Labels::Times(numbers.iter().map(time).collect(), numbers.iter().map(in_full).collect())
}

/// A number without the noise that single precision shows in double.
fn number(value: f64) -> String {
    let single = value as f32;
    if f64::from(single) == value { single.to_string() } else { value.to_string() }
}

/// The places that are chosen of a variable.
#[derive(Debug)]
pub(crate) struct Chosen {
    /// A place along each dimension; nothing along those of the sphere.
    places: Vec<Option<usize>>,
    /// The dimension of time and its places, where there are several steps.
    series: Option<(usize, Vec<usize>)>,
    times: Vec<Time>,
    /// The names of the places, such as `level=500`.
    names: Vec<String>,
}

impl Chosen {
    /// The times of the steps: none where there is no time, which is one step.
    pub(crate) fn times(&self) -> &[Time] {
        &self.times
    }

    /// The variable and the places, for [`MapSeries::place`](crate::adapter::MapSeries::place).
    pub(crate) fn place(&self, variable: &Variable) -> Vec<String> {
        std::iter::once(field_place(&variable.path())).chain(self.names.iter().cloned()).collect()
    }

    /// The ranges of indices of one step, the whole of the sphere.
    pub(crate) fn ranges(&self, variable: &Variable, step: usize) -> Vec<Range<usize>> {
        let mut ranges: Vec<_> = variable.dimensions.iter().map(|dimension| 0..dimension.len).collect();
        for (range, place) in ranges.iter_mut().zip(&self.places) {
            if let Some(place) = *place {
                *range = place..place + 1;
            }
        }
        if let Some((dimension, places)) = &self.series {
            ranges[*dimension] = places[step]..places[step] + 1;
        }
        ranges
    }
}

/// Finds the places that are chosen of a variable, of whose dimensions those at `sphere` run over the sphere.
///
/// # Errors
/// Where there is no such place, or a dimension is left over.
pub(crate) fn select(dataset: &dyn Dataset, variable: &Variable, sphere: &[usize], at: &[At]) -> Result<Chosen, Error> {
    let dimensions = &variable.dimensions;
    if let Some(empty) = dimensions.iter().find(|dimension| dimension.len == 0) {
        return Err(Problem::EmptyDimension { variable: variable.path(), dimension: empty.name.clone() }.into());
    }
    let mut asked: Vec<Option<&Place>> = vec![None; dimensions.len()];
    for At { dimension: name, place } in at {
        let number = dimension_named(dataset, variable, name)?;
        if sphere.contains(&number) {
            return Err(Problem::SphereDimension { dimension: name.escape_debug().to_string() }.into());
        }
        if asked[number].replace(place).is_some() {
            return Err(Problem::SelectedTwice { dimension: name.escape_debug().to_string() }.into());
        }
    }
    let places = vec![None; dimensions.len()];
    let mut chosen = Chosen { places, series: None, times: Vec::new(), names: Vec::new() };
    for (number, dimension) in dimensions.iter().enumerate().filter(|(number, _)| !sphere.contains(number)) {
        let name = || dimension.name.clone();
        let labels = Labels::of(dataset, variable, dimension)?;
        let is_time = matches!(labels, Labels::Times(..)) && chosen.times.is_empty();
        let places = match asked[number] {
            Some(&Place::Index(index)) if index < dimension.len => vec![index],
            Some(&Place::Index(index)) => {
                return Err(Problem::IndexRange { dimension: name(), index, last: dimension.len - 1 }.into());
            }
            Some(Place::Value(text)) => {
                let places = labels.matching(text);
                if places.is_empty() {
                    let (dimension, place, values) = (name(), text.escape_debug().to_string(), labels.listed());
                    return Err(Problem::NoSuchPlace { dimension, place, values }.into());
                }
                if places.len() > 1 && !is_time {
                    let (dimension, place) = (name(), text.escape_debug().to_string());
                    let (count, first) = (places.len(), places[0]);
                    return Err(Problem::SeveralPlaces { dimension, place, count, first }.into());
                }
                places
            }
            None if is_time || dimension.len == 1 => (0..dimension.len).collect(),
            None => {
                let (variable, dimension) = (variable.path(), name());
                return Err(Problem::DimensionLeft { variable, dimension, values: labels.listed() }.into());
            }
        };
        chosen.places[number] = Some(places[0]);
        chosen.names.push(format!("{}={}", dimension.name, labels.name(&places)));
        if is_time {
            if let Labels::Times(times, _) = &labels {
                chosen.times = places.iter().map(|&place| times[place].clone()).collect();
            }
            chosen.series = Some((number, places));
        }
    }
    if let Some(coordinate) = scalar_time(dataset, variable).filter(|_| chosen.times.is_empty())
        && let Labels::Times(times, _) = times(coordinate, &values(dataset, coordinate, &[])?)
    {
        chosen.times = times;
    }
    Ok(chosen)
}

/// The dimension of a variable that has this name, or whose coordinate has it.
fn dimension_named(dataset: &dyn Dataset, variable: &Variable, name: &str) -> Result<usize, Problem> {
    let dimensions = &variable.dimensions;
    let position = |is: &dyn Fn(&Dimension) -> bool| dimensions.iter().position(is);
    let coordinate = |d: &Dimension| coordinate_of(dataset, variable, d).map(|v| v.name.as_str());
    let named = position(&|d| d.name == name)
        .or_else(|| position(&|d| coordinate(d) == Some(name)))
        .or_else(|| position(&|d| is_alike(&d.name, name)))
        .or_else(|| position(&|d| coordinate(d).is_some_and(|c| is_alike(c, name))));
    named.ok_or_else(|| Problem::NoSuchDimension {
        variable: variable.path(),
        dimension: name.escape_debug().to_string(),
        dimensions: shape(variable),
    })
}

/// The dimensions of a variable and their lengths.
pub(crate) fn shape(variable: &Variable) -> String {
    let dimensions: Vec<_> = variable.dimensions.iter().map(|d| format!("{} ({})", d.name, d.len)).collect();
    if dimensions.is_empty() { "none".to_owned() } else { dimensions.join(", ") }
}
