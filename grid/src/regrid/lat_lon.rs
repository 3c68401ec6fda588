//! Grids of latitude and longitude: where their points and cells lie.
//!
//! A coordinate is sorted here once, eastward or northward, and each of its points and cells keeps the number that it
//! was given with. How a grid becomes a map is left to [`super::Weights`].

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::{Error, Healpix, NSIDE_MAX};

/// Latitudes may lie this far beyond a pole, in degrees: single precision has 4e-6 there.
const LATITUDE_TOLERANCE: f64 = 1e-4;

/// Longitudes of any convention lie within this, in degrees.
const LONGITUDE_MAX: f64 = 720.0;

/// Values beyond this are no angles in degrees of any convention, but metres.
const METRES: f64 = 1000.0;

/// How well, as a part of it, the circle is met by coordinates in radians: single precision has 1e-7, and no usual grid
/// in degrees has an extent of 2π to this.
const RADIANS_TOLERANCE: f64 = 1e-4;

/// Bounds closer to each other, or to a point, than this part of a cell are the same: in single precision, those of a
/// 0.01° grid are off by 0.003 of a cell.
const BOUNDS_TOLERANCE: f64 = 0.01;

/// A last column within this part of a spacing from the first one's repetition is that repetition.
const REPEATED: f64 = 0.1;

/// Longitudes go around the sphere where the gap between the last and the first is at most this many spacings.
const CLOSING_GAP: f64 = 1.5;

/// An outermost row extends to the pole where its cell would end within this many spacings of it. Just below a half, so
/// that a grid that leaves out the row at the pole never extends there, whatever the rounding.
const POLE_GAP: f64 = 0.49;

/// How errors name the coordinates.
const LATITUDE: &str = "latitude";
const LONGITUDE: &str = "longitude";

/// A grid of latitude and longitude: each latitude with each longitude.
#[derive(Clone, Debug)]
pub struct LatLon {
    pub(super) latitudes: Axis,
    pub(super) longitudes: Axis,
    /// Whether the cells go around the sphere.
    pub(super) periodic: bool,
}

/// One coordinate of a grid.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// The number of values given.
    pub(super) given: usize,
    /// The points, ascending and at least one, without a column that repeats another.
    pub(super) points: Vec<Point>,
    /// The cells, ascending and at least one. They do not overlap, and two that touch have the same bound. Longitudes
    /// end at most 360° after they begin.
    pub(super) cells: Vec<Cell>,
}

/// A value of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Its number as given.
    pub(super) index: usize,
    /// Longitudes ascend without a jump and may leave 0–360.
    pub(super) degrees: f64,
}

/// The extent of a cell along a coordinate, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// The number of its point as given.
    pub(super) index: usize,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Cell {
    /// From bound to bound.
    pub(super) fn width(self) -> f64 {
        self.high - self.low
    }
}

impl Axis {
    /// The mean distance of neighbouring points; of a single one, the width of its cell.
    fn spacing(&self) -> f64 {
        match self.points.as_slice() {
            [first, .., last] => (last.degrees - first.degrees) / (self.points.len() - 1) as f64,
            _ => self.cells[0].width(),
        }
    }
}

impl LatLon {
    /// The grid of these coordinates, in degrees.
    ///
    /// Latitudes ascend or descend. Longitudes ascend or descend too, from any start and across 360 or ±180 where they
    /// will; a last column that repeats the first is left out. Bounds are edges, one more than there are values, or
    /// pairs. Without bounds, cells meet half-way between points, and the outermost rows of a grid that goes around
    /// the sphere end at the poles where they come near them.
    ///
    /// # Errors
    /// [`Error::NoCoordinates`], [`Error::CoordinateRange`], [`Error::Radians`], [`Error::NotMonotonic`],
    /// [`Error::LongitudeSpan`], [`Error::NoSpacing`], [`Error::BoundsCount`], [`Error::BoundsApart`],
    /// [`Error::BoundsOverlap`], or [`Error::GridSize`].
    pub fn new(
        latitudes: &[f64],
        latitude_bounds: Option<&[f64]>,
        longitudes: &[f64],
        longitude_bounds: Option<&[f64]>,
    ) -> Result<Self, Error> {
        check_latitudes(LATITUDE, latitudes)?;
        check_longitudes(LONGITUDE, longitudes)?;
        if look_like_radians(latitudes, longitudes) {
            return Err(Error::Radians);
        }
        let longitudes = longitude_axis(longitudes, longitude_bounds)?;
        let periodic = goes_around(&longitudes.cells);
        let latitudes = latitude_axis(latitudes, latitude_bounds, periodic)?;
        if latitudes.given.checked_mul(longitudes.given).is_none_or(|cells| cells > 1 << 32) {
            return Err(Error::GridSize { latitudes: latitudes.given, longitudes: longitudes.given });
        }
        Ok(LatLon { latitudes, longitudes, periodic })
    }

    /// The number of values that a field on the grid has.
    pub fn values(&self) -> usize {
        self.latitudes.given * self.longitudes.given
    }

    /// The place among a field's values of the one at a latitude and a longitude, by their numbers as given: longitudes
    /// are the faster.
    pub(super) fn place(&self, latitude: usize, longitude: usize) -> u32 {
        // `new` has checked that it fits.
        (latitude * self.longitudes.given + longitude) as u32
    }

    /// The distance between points on the equator, in degrees: the geometric mean of those of latitudes and longitudes.
    pub fn spacing_degrees(&self) -> f64 {
        (self.latitudes.spacing() * self.longitudes.spacing()).sqrt()
    }

    /// Whether there are points on all sides to interpolate between, and not one row or column alone.
    pub(crate) fn has_squares(&self) -> bool {
        self.latitudes.points.len() > 1 && self.longitudes.points.len() > 1
    }

    /// Whether the cells cover the sphere, from pole to pole and once around.
    pub fn is_global(&self) -> bool {
        let ends = (self.latitudes.cells.first(), self.latitudes.cells.last());
        self.periodic && matches!(ends, (Some(south), Some(north)) if south.low <= -90.0 && north.high >= 90.0)
    }

    /// The Nside, a power of two, with pixels closest in size to the grid's spacing.
    pub fn nside_closest(&self) -> usize {
        let nside = Healpix::BASE.pixel_side() / self.spacing_degrees().to_radians();
        1 << (nside.log2().round() as u32).min(NSIDE_MAX.ilog2())
    }
}

/// Whether all latitudes, or bounds of them, are on the sphere.
fn check_latitudes(coordinate: &'static str, values: &[f64]) -> Result<(), Error> {
    check(coordinate, values, 90.0, LATITUDE_TOLERANCE)
}

/// Whether all longitudes, or bounds of them, are within any convention.
fn check_longitudes(coordinate: &'static str, values: &[f64]) -> Result<(), Error> {
    check(coordinate, values, LONGITUDE_MAX, 0.0)
}

/// Whether all values are within `most` from 0, but for the tolerance.
fn check(coordinate: &'static str, values: &[f64], most: f64, tolerance: f64) -> Result<(), Error> {
    if values.is_empty() {
        return Err(Error::NoCoordinates { coordinate });
    }
    let Some(index) = values.iter().position(|v| v.is_nan() || v.abs() > most + tolerance) else {
        return Ok(());
    };
    let extreme = values.iter().fold(0.0, |extreme: f64, v| extreme.max(v.abs()));
    let remedy = if !values.iter().all(|v| v.is_finite()) {
        "correct the coordinate"
    } else if extreme > METRES {
        "it looks like metres, so bring the field to longitude and latitude first"
    } else if extreme <= LONGITUDE_MAX {
        "it looks like a longitude, so check which coordinate is which"
    } else {
        "correct the coordinate"
    };
    Err(Error::CoordinateRange { coordinate, index, value: values[index], least: -most, most, remedy })
}

/// Whether the longitudes go around the sphere in 2π, and the latitudes could be in radians too.
fn look_like_radians(latitudes: &[f64], longitudes: &[f64]) -> bool {
    let n = longitudes.len() as f64;
    let (low, high) = extremes(longitudes);
    // With a column that repeats the first, or without.
    let around = |extent: f64| (extent / TAU - 1.0).abs() < RADIANS_TOLERANCE;
    let (south, north) = extremes(latitudes);
    let most = FRAC_PI_2 * (1.0 + RADIANS_TOLERANCE);
    longitudes.len() > 1
        && (around(high - low) || around((high - low) * n / (n - 1.0)))
        && south >= -most
        && north <= most
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

/// The points in ascending order. The values come as given, for errors, and without jumps.
fn ascending(coordinate: &'static str, given: &[f64], values: &[f64]) -> Result<Vec<Point>, Error> {
    let upwards = values.len() < 2 || values[1] > values[0];
    let turn = values.windows(2).position(|pair| if upwards { pair[1] <= pair[0] } else { pair[1] >= pair[0] });
    if let Some(before) = turn {
        let index = before + 1;
        return Err(Error::NotMonotonic { coordinate, index, before: given[before], value: given[index] });
    }
    let mut points: Vec<Point> = (0..).zip(values).map(|(index, &degrees)| Point { index, degrees }).collect();
    if !upwards {
        points.reverse();
    }
    Ok(points)
}

/// Longitudes plus whole turns, so that each is within half a turn of the one before; half a turn stays as written.
fn without_jumps(longitudes: &[f64]) -> Vec<f64> {
    let mut before = longitudes[0];
    let place = |&value: &f64| {
        let turns = (before - value) / 360.0;
        let half = turns.fract().abs() == 0.5;
        before = value + 360.0 * if half { turns.trunc() } else { turns.round() };
        before
    };
    longitudes.iter().map(place).collect()
}

fn latitude_axis(values: &[f64], bounds: Option<&[f64]>, periodic: bool) -> Result<Axis, Error> {
    let clamped: Vec<f64> = values.iter().map(|v| v.clamp(-90.0, 90.0)).collect();
    let points = ascending(LATITUDE, values, &clamped)?;
    let mut cells = match bounds {
        Some(bounds) => {
            let pairs = pairs(LATITUDE, values.len(), bounds)?;
            check_latitudes("latitude bound", bounds)?;
            let cell = |&p: &Point| cell(LATITUDE, p, pairs[p.index], &[sorted(pairs[p.index])]);
            let mut cells: Vec<Cell> = points.iter().map(cell).collect::<Result<_, _>>()?;
            join(LATITUDE, &mut cells)?;
            cells
        }
        None => derived(LATITUDE, &points)?,
    };
    // How far from the poles, in degrees, the outermost rows may end and still extend to them.
    let reach = |spacing: f64, cell: Cell| match bounds {
        Some(_) => BOUNDS_TOLERANCE * cell.width(),
        None if periodic => POLE_GAP * spacing,
        None => 0.0,
    };
    let (n, last) = (points.len(), cells.len() - 1);
    let (southern, northern) = match n {
        1 => (0.0, 0.0),
        _ => (points[1].degrees - points[0].degrees, points[n - 1].degrees - points[n - 2].degrees),
    };
    if cells[0].low + 90.0 <= reach(southern, cells[0]) {
        cells[0].low = -90.0;
    }
    if 90.0 - cells[last].high <= reach(northern, cells[last]) {
        cells[last].high = 90.0;
    }
    Ok(Axis { given: values.len(), points, cells })
}

fn longitude_axis(values: &[f64], bounds: Option<&[f64]>) -> Result<Axis, Error> {
    let all = ascending(LONGITUDE, values, &without_jumps(values))?;
    let repeated = repeated(&all)?;
    let points: Vec<Point> = all.iter().copied().filter(|p| Some(p.index) != repeated).collect();
    let cells = match bounds {
        Some(bounds) => {
            let pairs = pairs(LONGITUDE, values.len(), bounds)?;
            check_longitudes("longitude bound", bounds)?;
            let cell = |&p: &Point| cell(LONGITUDE, p, pairs[p.index], &about(p.degrees, pairs[p.index]));
            let mut cells: Vec<Cell> = all.iter().map(cell).collect::<Result<_, _>>()?;
            // Two columns at one longitude may also be the halves of one cell.
            if gap(cells[cells.len() - 1], turned(cells[0])).is_none() {
                cells.retain(|cell| Some(cell.index) != repeated);
            }
            join(LONGITUDE, &mut cells)?;
            close(&mut cells)?;
            cells
        }
        None => {
            let mut cells = derived(LONGITUDE, &points)?;
            // There are two points or more, else `derived` refuses them.
            let n = points.len();
            let (west, east) = (points[1].degrees - points[0].degrees, points[n - 1].degrees - points[n - 2].degrees);
            let closing = points[0].degrees + 360.0 - points[n - 1].degrees;
            if repeated.is_some() || closing <= CLOSING_GAP * west.max(east) {
                cells[0].low = points[0].degrees - 0.5 * closing;
                cells[n - 1].high = cells[0].low + 360.0;
            }
            cells
        }
    };
    Ok(Axis { given: values.len(), points, cells })
}

/// The number of the last column as given where it repeats the first.
fn repeated(points: &[Point]) -> Result<Option<usize>, Error> {
    let [first, _, .., last] = points else { return Ok(None) };
    let span = last.degrees - first.degrees;
    let tolerance = REPEATED * span / (points.len() - 1) as f64;
    if span > 360.0 + tolerance {
        return Err(Error::LongitudeSpan { span });
    }
    Ok((span >= 360.0 - tolerance).then_some(first.index.max(last.index)))
}

/// The bounds of each cell as given.
fn pairs(coordinate: &'static str, points: usize, bounds: &[f64]) -> Result<Vec<[f64; 2]>, Error> {
    if bounds.len() == points + 1 {
        Ok(bounds.windows(2).map(|pair| [pair[0], pair[1]]).collect())
    } else if bounds.len() == 2 * points {
        Ok(bounds.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
    } else {
        Err(Error::BoundsCount { coordinate, points, bounds: bounds.len() })
    }
}

fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// What a cell about a longitude may be whose bounds are given modulo whole turns: as written, or each bound within
/// half a turn of the longitude.
fn about(longitude: f64, bounds: [f64; 2]) -> [[f64; 2]; 2] {
    let turns_to = |from: f64| 360.0 * ((longitude - from) / 360.0).round();
    let as_written = sorted(bounds);
    let turns = turns_to(0.5 * (as_written[0] + as_written[1]));
    [as_written.map(|bound| bound + turns), sorted(bounds.map(|bound| bound + turns_to(bound)))]
}

/// The narrowest of possible cells that contains its point.
fn cell(coordinate: &'static str, point: Point, given: [f64; 2], possible: &[[f64; 2]]) -> Result<Cell, Error> {
    let contains = |cell: &Cell| {
        let slack = BOUNDS_TOLERANCE * cell.width();
        cell.low < cell.high && (cell.low - slack..=cell.high + slack).contains(&point.degrees)
    };
    let cells = possible.iter().map(|&[low, high]| Cell { index: point.index, low, high });
    let narrowest = cells.filter(contains).min_by(|a, b| a.width().total_cmp(&b.width()));
    let [low, high] = given;
    narrowest.ok_or(Error::BoundsApart { coordinate, index: point.index, value: point.degrees, low, high })
}

/// Cells that meet half-way between points, of which the outermost are as wide on both sides.
fn derived(coordinate: &'static str, points: &[Point]) -> Result<Vec<Cell>, Error> {
    let n = points.len();
    if n < 2 {
        return Err(Error::NoSpacing { coordinate, value: points[0].degrees });
    }
    let between = |i: usize| 0.5 * (points[i].degrees + points[i + 1].degrees);
    let cells = points.iter().enumerate().map(|(i, &Point { index, degrees })| Cell {
        index,
        low: if i > 0 { between(i - 1) } else { 2.0 * degrees - between(0) },
        high: if i + 1 < n { between(i) } else { 2.0 * degrees - between(n - 2) },
    });
    Ok(cells.collect())
}

/// A cell one turn farther.
fn turned(cell: Cell) -> Cell {
    Cell { low: cell.low + 360.0, high: cell.high + 360.0, ..cell }
}

/// The gap between a cell and the next, 0 where they touch; none where they overlap.
fn gap(cell: Cell, next: Cell) -> Option<f64> {
    let gap = next.low - cell.high;
    let tolerance = BOUNDS_TOLERANCE * cell.width().min(next.width());
    if gap.abs() <= tolerance { Some(0.0) } else { (gap > 0.0).then_some(gap) }
}

/// Gives cells that touch the same bound.
fn join(coordinate: &'static str, cells: &mut [Cell]) -> Result<(), Error> {
    for i in 1..cells.len() {
        let (before, after) = (cells[i - 1], cells[i]);
        match gap(before, after) {
            Some(0.0) => cells[i].low = before.high,
            Some(_) => (),
            None => return Err(Error::BoundsOverlap { coordinate, first: before.index, second: after.index }),
        }
    }
    Ok(())
}

/// Gives the last and the first cell the same bound where they touch around the sphere.
fn close(cells: &mut [Cell]) -> Result<(), Error> {
    let (first, last) = (cells[0], cells[cells.len() - 1]);
    match gap(last, turned(first)) {
        Some(0.0) => cells[cells.len() - 1].high = first.low + 360.0,
        Some(_) => (),
        None => return Err(Error::BoundsOverlap { coordinate: LONGITUDE, first: last.index, second: first.index }),
    }
    Ok(())
}

/// Whether cells go around the sphere without a gap.
fn goes_around(cells: &[Cell]) -> bool {
    cells[cells.len() - 1].high == cells[0].low + 360.0 && cells.windows(2).all(|pair| pair[0].high == pair[1].low)
}
