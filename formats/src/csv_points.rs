//! Points in tables of text (CSV, TSV): the adapter that reads them.
//!
//! A header names the columns; those that say where a point is are known by their names. Cells are parted by commas,
//! semicolons or tabs, whichever part the header. Lines that begin with # are comments; the last one before the numbers
//! may be the header. How values at points become a map is left to [`longan_grid::Points`].

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::adapter::{About, Adapter, MapSeries, MemoryEstimate, Target, field_place};
use crate::columns::{self, Column};
use crate::describe::{Description, GridDescription};
use crate::error::{self, Error, ErrorKind, Reason};
use crate::request::Selection;
use crate::text::shortened;
use longan_grid::directions::{self, FARTHEST, at, from_centre};
use longan_grid::{CoordinateSystem, Map, Regrid, Regridded, Sphere, Time, UNSEEN, is_bad};
use longan_grid::{Points, PointsSummary};

/// Columns or rows of text that do not make points.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error(
        "no line of this text names columns of longitude and latitude, or of x, y and z; add a line such as 'lon,lat,value' before the numbers"
    )]
    NoPointColumns,
    #[error("columns '{first}' and '{second}' could both be the {coordinate}; rename one of them")]
    TwoCoordinates { coordinate: &'static str, first: String, second: String },
    #[error("the angles in column '{column}' are in radians; convert them to degrees")]
    RadianColumn { column: String },
    #[error("{place} has {found} values but there are {expected} columns; correct it")]
    RowLength { place: String, found: usize, expected: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::NoPointColumns => ErrorKind::NoMap,
            Problem::TwoCoordinates { .. } | Problem::RowLength { .. } => ErrorKind::Invalid,
            Problem::RadianColumn { .. } => ErrorKind::Unsupported,
        }
    }
}

/// The letters that may part cells.
const DELIMITERS: [u8; 3] = [b',', b';', b'\t'];

/// No line up to the header is longer than this.
const LONGEST: u64 = 1 << 20;

/// Cells that mean "no value here", in lower case.
const MISSING: [&str; 5] = ["", "na", "n/a", "nan", "null"];

/// Names of longitude and latitude, in lower case, with the coordinate system that they imply.
const ANGLES: [(&[&str], &[&str], Option<CoordinateSystem>); 3] = [
    (&["lon", "long", "longitude", "lng"], &["lat", "latitude"], None),
    (&["ra", "raj2000"], &["dec", "dej2000"], Some(CoordinateSystem::Celestial)),
    (&["glon"], &["glat"], Some(CoordinateSystem::Galactic)),
];

/// Units of angles in degrees, in lower case.
const DEGREES: [&str; 11] =
    ["", "deg", "degs", "degree", "degrees", "°", "dd", "degree_east", "degrees_east", "degree_north", "degrees_north"];

/// Units of angles in radians, in lower case.
const RADIANS: [&str; 3] = ["rad", "radian", "radians"];

/// Units of length that follow x, y and z without brackets, in lower case.
const LENGTHS: [&str; 18] = [
    "", "m", "mm", "cm", "km", "um", "µm", "μm", "nm", "px", "pix", "pixel", "pixels", "voxel", "voxels", "au", "pc",
    "kpc",
];

/// The adapter for points in tables of text.
pub(crate) struct PointsCsv;

impl Adapter for PointsCsv {
    fn name(&self) -> &'static str {
        "table of points (CSV)"
    }

    fn recognises(&self, head: &[u8]) -> bool {
        // A table of coordinates of which either could be meant is one too, with an error of its own.
        !head.contains(&0) && !matches!(Header::find(&mut io::Cursor::new(head)), Ok(None))
    }

    fn describe(&self, path: &Path) -> Result<Description, Error> {
        let table = Table::open(path)?;
        // All points are counted, whatever values they have.
        let (samples, _) = table.samples(table.header.position.columns()[0], None)?;
        let PointsSummary { spacing, nside, covered } = samples.summary()?;
        let (points, coordinates) = (samples.values.len(), table.header.system);
        let grid = GridDescription::Points { points, coordinates, spacing, nside, covered };
        Ok(columns::describe(self.name(), grid, &table.header.columns))
    }

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
        columns::check(selection)?;
        let table = Table::open(path)?;
        let values = columns::choose(&table.header.columns, selection.field.as_ref())?;
        let (samples, centre) = table.samples(values, selection.regrid.centre)?;
        Ok(Box::new(SingleMap {
            table,
            values,
            samples,
            centre,
            nside: selection.nside,
            regrid: selection.regrid.clone(),
        }))
    }
}

/// The one map of a table of points.
struct SingleMap {
    table: Table,
    /// The column of values.
    values: usize,
    samples: Points,
    /// The point from which points in space are seen.
    centre: Option<[f64; 3]>,
    nside: Option<usize>,
    regrid: Regrid,
}

impl MapSeries for SingleMap {
    fn times(&self) -> &[Time] {
        &[]
    }

    fn place(&self) -> Vec<String> {
        vec![field_place(&self.table.header.columns[self.values].name)]
    }

    fn target(&mut self) -> Result<Target, Error> {
        let Regridded { way, grid, reach, .. } = self.samples.regridded(self.nside, &self.regrid)?;
        let mut settings = vec![way.to_string()];
        settings.extend(reach.map(|reach| format!("reach={reach}")));
        settings.extend(self.centre.map(|[x, y, z]| format!("centre={x},{y},{z}")));
        Ok(Target::regridded(grid, settings))
    }

    fn about(&self) -> About {
        let Header { columns, system, position, .. } = &self.table.header;
        let Column { name, unit, .. } = columns[self.values].clone();
        let sphere = match position {
            Position::Cartesian(_) => Sphere::Body,
            Position::Angles { .. } if system.is_some() => Sphere::Sky,
            Position::Angles { .. } => Sphere::Earth,
        };
        About { name, unit, coordinates: *system, sphere, quantity: None }
    }

    fn memory(&self) -> Option<MemoryEstimate> {
        // Direction and value, and the directions once more in a tree.
        MemoryEstimate::of_points(self.nside, self.samples.values.len(), 128)
    }

    fn read(&mut self, _: usize) -> Result<Map, Error> {
        let mut map = self.samples.regrid(self.nside, &self.regrid)?;
        self.about().label(&mut map);
        Ok(map)
    }

    fn values(&mut self, _: usize) -> Result<Vec<f64>, Error> {
        Ok(self.table.points(self.values)?.into_iter().map(|(_, value, _)| value).collect())
    }
}

/// The header: the text up to the numbers.
struct Header {
    delimiter: u8,
    columns: Vec<Column>,
    position: Position,
    system: Option<CoordinateSystem>,
    /// Bytes before the rows.
    offset: u64,
}

/// The columns that say where a point is.
enum Position {
    Angles { longitude: usize, latitude: usize },
    Cartesian([usize; 3]),
}

impl Position {
    /// The columns.
    fn columns(&self) -> Vec<usize> {
        match *self {
            Position::Angles { longitude, latitude } => vec![longitude, latitude],
            Position::Cartesian(axes) => axes.to_vec(),
        }
    }
}

/// The part of a point's place that a column may hold.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coordinate {
    /// By the number of its names in [`ANGLES`].
    Longitude(usize),
    Latitude(usize),
    Axis(usize),
}

impl Header {
    /// Finds the header; nothing where no line names columns of points.
    fn find(input: &mut impl BufRead) -> Result<Option<Self>, Error> {
        let mut offset = 0;
        let mut comment = Vec::new();
        loop {
            let mut line = Vec::new();
            let read = input.take(LONGEST).read_until(b'\n', &mut line).map_err(Error::io("read it"))? as u64;
            let text = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&line).trim_ascii();
            if let Some(text) = text.strip_prefix(b"#") {
                comment = text.trim_ascii_start().to_vec();
            } else if !text.is_empty() || read == 0 {
                if let Some(header) = Header::parse(text, offset + read)? {
                    return Ok(Some(header));
                }
                return Ok(Header::parse(&comment, offset)?);
            }
            offset += read;
        }
    }

    /// Understands a header, if the text is one.
    fn parse(text: &[u8], offset: u64) -> Result<Option<Self>, Problem> {
        for delimiter in DELIMITERS {
            let mut cells = csv::ByteRecord::new();
            let mut reader = reader(text, delimiter);
            if !matches!(reader.read_byte_record(&mut cells), Ok(true)) {
                continue;
            }
            let mut columns: Vec<Column> = cells.iter().map(|cell| column(&String::from_utf8_lossy(cell))).collect();
            if let Some((position, system)) = position(&columns)? {
                let coordinates: Vec<_> =
                    columns.iter().map(|c| coordinate(c).map(|(coordinate, _)| coordinate)).collect();
                let in_space = (0..3).all(|axis| coordinates.contains(&Some(Coordinate::Axis(axis))));
                for (column, coordinate) in columns.iter_mut().zip(coordinates) {
                    column.values = match coordinate {
                        // A column without a name counts the rows, as pandas writes it.
                        None => !column.heading.is_empty(),
                        // One of x, y and z alone is a value.
                        Some(Coordinate::Axis(_)) => !in_space,
                        Some(_) => false,
                    };
                }
                return Ok(Some(Header { delimiter, columns, position, system, offset }));
            }
        }
        Ok(None)
    }
}

/// A column of this heading.
fn column(heading: &str) -> Column {
    let bracketed = [('[', ']'), ('(', ')')].iter().find_map(|&(open, close)| {
        let (name, unit) = heading.strip_suffix(close)?.rsplit_once(open)?;
        (!name.trim().is_empty()).then(|| (name.trim().to_owned(), unit.trim().to_owned()))
    });
    let (name, unit) = bracketed.map_or((heading.to_owned(), None), |(name, unit)| (name, Some(unit)));
    Column { heading: heading.to_owned(), name, unit: unit.filter(|unit| !unit.is_empty()), values: false }
}

/// A column's coordinate and its unit.
fn coordinate(column: &Column) -> Option<(Coordinate, String)> {
    let name = column.name.to_lowercase();
    let lowered = column.unit.as_deref().map(str::to_lowercase);
    let (stem, unit) = match &lowered {
        Some(unit) => (name.as_str(), unit.as_str()),
        None => name.split_once(['_', ' ', '-', '.']).unwrap_or((&name, "")),
    };
    let unit = unit.trim().replace(' ', "_");
    if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == stem) {
        let length = column.unit.is_some() || LENGTHS.contains(&unit.as_str());
        return length.then_some((Coordinate::Axis(axis), unit));
    }
    let named = ANGLES.iter().enumerate().find_map(|(i, (longitudes, latitudes, _))| match stem {
        _ if longitudes.contains(&stem) => Some(Coordinate::Longitude(i)),
        _ if latitudes.contains(&stem) => Some(Coordinate::Latitude(i)),
        _ => None,
    });
    let angle = DEGREES.contains(&unit.as_str()) || RADIANS.contains(&unit.as_str());
    named.filter(|_| angle).map(|named| (named, unit))
}

/// The columns that say where a point is, if there are any.
fn position(columns: &[Column]) -> Result<Option<(Position, Option<CoordinateSystem>)>, Problem> {
    let coordinates: Vec<_> = columns.iter().map(coordinate).collect();
    let only = |wanted: Coordinate, name: &'static str| {
        let mut found = (0..columns.len()).filter(|&i| coordinates[i].as_ref().is_some_and(|(c, _)| *c == wanted));
        match (found.next(), found.next()) {
            (Some(first), Some(second)) => Err(Problem::TwoCoordinates {
                coordinate: name,
                first: shortened(&columns[first].heading),
                second: shortened(&columns[second].heading),
            }),
            (first, _) => Ok(first),
        }
    };
    let present = |wanted: Coordinate| coordinates.iter().flatten().any(|(c, _)| *c == wanted);
    for (i, (_, _, system)) in ANGLES.iter().enumerate() {
        if !present(Coordinate::Longitude(i)) || !present(Coordinate::Latitude(i)) {
            continue;
        }
        let pair = only(Coordinate::Longitude(i), "longitude")?.zip(only(Coordinate::Latitude(i), "latitude")?);
        let Some((longitude, latitude)) = pair else { continue };
        for i in [longitude, latitude] {
            if coordinates[i].as_ref().is_some_and(|(_, unit)| RADIANS.contains(&unit.as_str())) {
                return Err(Problem::RadianColumn { column: shortened(&columns[i].heading) });
            }
        }
        return Ok(Some((Position::Angles { longitude, latitude }, *system)));
    }
    if !(0..3).all(|axis| present(Coordinate::Axis(axis))) {
        return Ok(None);
    }
    let axes = [only(Coordinate::Axis(0), "x")?, only(Coordinate::Axis(1), "y")?, only(Coordinate::Axis(2), "z")?];
    Ok(match axes {
        [Some(x), Some(y), Some(z)] => Some((Position::Cartesian([x, y, z]), None)),
        _ => None,
    })
}

/// A table of points.
struct Table {
    path: PathBuf,
    header: Header,
}

impl Table {
    /// Understands the header of a table, and which of its columns hold numbers.
    fn open(path: &Path) -> Result<Self, Error> {
        let header = Header::find(&mut BufReader::new(File::open(path).map_err(Error::io("open it"))?))?;
        let header = header.ok_or(Problem::NoPointColumns)?;
        let mut table = Table { path: path.to_owned(), header };
        // The first cell that is not missing tells.
        let mut undecided: Vec<usize> =
            (0..table.header.columns.len()).filter(|&i| table.header.columns[i].values).collect();
        undecided.iter().for_each(|&i| table.header.columns[i].values = false);
        let mut rows = table.rows()?;
        let mut row = csv::ByteRecord::new();
        while !undecided.is_empty() && next(&mut rows, &mut row)? {
            undecided.retain(|&i| {
                let Some(cell) = row.get(i).filter(|cell| !is_missing(cell)) else { return true };
                table.header.columns[i].values = number(cell).is_some();
                false
            });
        }
        Ok(table)
    }

    /// The rows.
    fn rows(&self) -> Result<csv::Reader<File>, Error> {
        let mut file = File::open(&self.path).map_err(Error::io("open it"))?;
        file.seek(SeekFrom::Start(self.header.offset)).map_err(Error::io("read it"))?;
        Ok(reader(file, self.header.delimiter))
    }

    /// Where a row is, for people.
    fn place(&self, row: u64) -> Result<String, Error> {
        // Before the row as the reader counts there may be empty lines and comments.
        let mut text = BufReader::new(File::open(&self.path).map_err(Error::io("open it"))?);
        let (mut at, mut number) = (0, 0);
        loop {
            let mut line = Vec::new();
            let read = text.read_until(b'\n', &mut line).map_err(Error::io("read it"))? as u64;
            number += 1;
            at += read;
            // What the reader has not yet read of this line.
            let unread = at.saturating_sub(self.header.offset + row).min(line.len() as u64);
            let rest = &line[line.len() - unread as usize..];
            if read == 0 || !rest.trim_ascii().is_empty() && !rest.starts_with(b"#") {
                return Ok(format!("line {number}"));
            }
        }
    }

    /// The points, their values in a column (NaN where there is none), and where their rows begin.
    fn points(&self, values: usize) -> Result<Vec<([f64; 3], f64, u64)>, Error> {
        let mut rows = self.rows()?;
        let mut row = csv::ByteRecord::new();
        let mut points = Vec::new();
        while next(&mut rows, &mut row)? {
            let at = row.position().map_or(0, csv::Position::byte);
            if let Some((point, value)) = self.point(&row, values)? {
                points.push((point, value, at));
            }
        }
        Ok(points)
    }

    /// The points that have a value in a column, and the centre from which points in space are seen.
    fn samples(&self, values: usize, centre: Option<[f64; 3]>) -> Result<(Points, Option<[f64; 3]>), Error> {
        let mut points = self.points(values)?;
        // Points without a value count for the centre, which so is the same for all columns.
        let centre = match self.header.position {
            Position::Angles { .. } => None,
            Position::Cartesian(_) => Some(directions::centre(centre, points.iter().map(|(point, ..)| *point))?),
        };
        points.retain(|(_, value, _)| !value.is_nan());
        if points.is_empty() {
            return Err(columns::Problem::NoValues { column: shortened(&self.header.columns[values].name) }.into());
        }
        let mut samples = Points { directions: Vec::new(), values: Vec::new() };
        for (point, value, at) in points {
            let Some((direction, _)) = from_centre(point, centre.unwrap_or_default()) else {
                return Err(longan_grid::Error::AtCentre { place: self.place(at)? }.into());
            };
            samples.directions.push(direction);
            samples.values.push(value);
        }
        Ok((samples, centre))
    }

    /// The point in a row, as seen from the centre or as a position, and its value in a column; nothing for a row that
    /// says neither.
    fn point(&self, row: &csv::ByteRecord, values: usize) -> Result<Option<([f64; 3], f64)>, Error> {
        let columns = &self.header.columns;
        if row.iter().all(<[u8]>::is_empty) {
            return Ok(None);
        }
        let place = || self.place(row.position().map_or(0, csv::Position::byte));
        if row.len() < columns.len() || row.iter().skip(columns.len()).any(|cell| !cell.is_empty()) {
            return Err(Problem::RowLength { place: place()?, found: row.len(), expected: columns.len() }.into());
        }
        let bad = |i: usize, expected| -> Error {
            let (column, text) = (shortened(&columns[i].name), shortened(&String::from_utf8_lossy(&row[i])));
            place().map_or_else(|e| e, |place| columns::Problem::BadNumber { place, column, text, expected }.into())
        };
        let value = match number(&row[values]) {
            _ if is_missing(&row[values]) => f64::NAN,
            Some(value) if is_bad(value, UNSEEN) => f64::NAN,
            Some(value) => value,
            None => return Err(bad(values, NUMBER)),
        };
        let read = |i: usize, limit: f64, expected| match number(&row[i]) {
            Some(number) if number.abs() <= limit => Ok(number),
            Some(number) if !number.is_nan() => Err(bad(i, expected)),
            _ => Err(bad(i, NUMBER)),
        };
        if value.is_nan() && self.header.position.columns().iter().all(|&i| is_missing(&row[i])) {
            return Ok(None);
        }
        let point = match self.header.position {
            Position::Angles { longitude, latitude } => at(
                read(longitude, 360.0, "between -360 and 360 degrees")?.to_radians(),
                read(latitude, 90.0, "between -90 and 90 degrees")?.to_radians(),
            ),
            Position::Cartesian([x, y, z]) => {
                let read = |i| read(i, FARTHEST, "a number from -1e100 to 1e100");
                [read(x)?, read(y)?, read(z)?]
            }
        };
        Ok(Some((point, value)))
    }
}

/// A description of numbers, for people.
const NUMBER: &str = "a number such as -1.5";

/// A cell's number.
fn number(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

/// Whether a cell means "no value here".
fn is_missing(cell: &[u8]) -> bool {
    MISSING.iter().any(|missing| cell.eq_ignore_ascii_case(missing.as_bytes()))
}

/// A reader of rows.
fn reader<R: Read>(input: R, delimiter: u8) -> csv::Reader<R> {
    csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(input)
}

/// Reads the next row, if there is one.
fn next<R: Read>(rows: &mut csv::Reader<R>, row: &mut csv::ByteRecord) -> Result<bool, Error> {
    rows.read_byte_record(row).map_err(|e| match e.into_kind() {
        csv::ErrorKind::Io(cause) => Error::io("read it")(cause),
        _ => error::Problem::Io { action: "read it", cause: io::ErrorKind::InvalidData.into() }.into(),
    })
}
