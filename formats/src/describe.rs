//! The description of a file: its tables or variables, their grids, dimensions and fields.
//!
//! The adapter of a file finds out what the file says.

use longan_grid::{CoordinateSystem, Ordering};

use crate::card::{Card, CardValue};
use crate::quantity::StatedQuantity;

/// The tables or variables of a file.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Description {
    /// The file format.
    pub format: &'static str,
    /// The tables or variables that hold maps, in the file's order.
    pub tables: Vec<TableDescription>,
}

/// One table or variable of a file.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TableDescription {
    /// The place of the table or variable in the file.
    #[serde(flatten)]
    pub place: TablePlace,
    /// The grid.
    #[serde(flatten)]
    pub grid: GridDescription,
    /// The dimensions other than those of the sphere.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dimensions: Vec<DimensionDescription>,
    /// The data columns, or the one field of a variable.
    pub fields: Vec<FieldDescription>,
    /// All words of the file about the table or variable: the header entries of a FITS table, with their own numbering
    /// of columns and sizes, or the attributes of a variable's groups, with their names in capitals. Comments are left
    /// out.
    #[serde(skip)]
    pub cards: Vec<Card>,
}

impl TableDescription {
    /// The value of a header entry.
    pub fn card(&self, key: &str) -> Option<&CardValue> {
        self.cards.iter().find(|card| card.key == key).map(|card| &card.value)
    }
}

/// The place of a table or variable in its file.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(untagged)]
pub enum TablePlace {
    /// In an HDU of a FITS file.
    Hdu {
        /// Number of the HDU, 0 for the primary one.
        hdu: usize,
        /// Name of the extension.
        name: Option<String>,
    },
    /// In a variable of its own.
    Variable {
        /// The path of the variable: its name, after its group's.
        variable: String,
    },
    /// The whole of a file that has but one.
    File {},
}

/// The grid of a table or variable.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum GridDescription {
    /// HEALPix.
    Healpix {
        /// Nside of the grid; of a multi-order table that of the finest cells.
        nside: usize,
        /// The ordering.
        ordering: Ordering,
        /// Whether the file does not say its ordering, so that RING is assumed.
        ordering_assumed: bool,
        /// The coordinate system, where the file names one.
        coordinates: Option<CoordinateSystem>,
        /// How values are tied to pixels.
        indexing: Indexing,
        /// Number of pixels (of a multi-order table: cells) that the table has values for.
        pixels: usize,
    },
    /// Latitudes and longitudes.
    LatLon {
        /// The latitudes, in degrees.
        latitudes: AxisDescription,
        /// The longitudes, in degrees.
        longitudes: AxisDescription,
        /// Whether the cells cover the sphere.
        global: bool,
    },
    /// Points anywhere.
    Points {
        /// The number of points.
        points: usize,
        /// The coordinate system, where the file names one.
        coordinates: Option<CoordinateSystem>,
        /// The typical distance between points, in degrees.
        spacing: Option<f64>,
        /// The Nside that is used unless one is given.
        nside: Option<usize>,
        /// The share of the sphere that is as near to a point as it must be, unless a reach is given.
        covered: Option<f64>,
    },
    /// A surface of triangles.
    Surface {
        /// The number of vertices.
        vertices: usize,
        /// The number of triangles.
        triangles: usize,
        /// The point that it is seen from unless one is given.
        centre: [f64; 3],
        /// The Nside that is used unless one is given.
        nside: usize,
        /// The share of the sphere in which it is seen from there.
        covered: f64,
        /// The share of the sphere in which it is seen more than once.
        folded: f64,
    },
}

/// The values of a coordinate.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct AxisDescription {
    /// The number of values.
    pub count: usize,
    /// The first value.
    pub first: f64,
    /// The last value.
    pub last: f64,
    /// The distance from one to the next, where it is always the same.
    pub spacing: Option<f64>,
}

/// A dimension other than those of the sphere.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DimensionDescription {
    /// The dimension's name.
    pub name: String,
    /// The dimension's length.
    pub len: usize,
    /// Whether the dimension is time, so that there is a map for each place.
    pub time: bool,
    /// The values of the coordinate and their unit, abbreviated.
    pub values: String,
}

/// The way in which a table ties values to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Indexing {
    /// By their place in the table.
    Implicit,
    /// By a column of pixel numbers.
    Explicit,
    /// By a column of UNIQ numbers, of cells of several sizes.
    MultiOrder,
}

/// One data column.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FieldDescription {
    /// The column's name.
    pub name: String,
    /// The column's unit, where the file names one.
    pub unit: Option<String>,
    /// A description in words, where the file has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub long_name: Option<String>,
    /// The quantity, where the file states one.
    #[serde(flatten)]
    pub quantity: Option<StatedQuantity>,
}
