//! What can be wrong with a map, a grid, or settings of regridding, each said in one sentence.

use std::fmt;

/// What can be wrong with a map, a grid, or settings of regridding.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An Nside that HEALPix does not have.
    #[error("Nside {nside} is not between 1 and 2^29")]
    Nside {
        /// The value given.
        nside: usize,
    },
    /// NESTED order asked of an Nside that is not a power of two.
    #[error("Nside {nside} is not a power of two, which NESTED ordering needs; use RING")]
    NotNested {
        /// The value given.
        nside: usize,
    },
    /// A number of pixels that no grid has.
    #[error("{pixels} values are not a HEALPix map: no Nside has 12 Nside² = {pixels} pixels")]
    PixelCount {
        /// The number of values.
        pixels: usize,
    },
    /// A mask on another grid than its map.
    #[error("the mask has Nside {mask} but the map has Nside {map}; bring the mask to Nside {map} first")]
    MaskNside {
        /// Nside of the map.
        map: usize,
        /// Nside of the mask.
        mask: usize,
    },
    /// More memory than there is.
    #[error("a map of Nside {nside} needs {gibibytes:.1} GiB, more memory than there is; use a coarser map")]
    Memory {
        /// The Nside.
        nside: usize,
        /// The memory needed.
        gibibytes: f64,
    },
    /// Too few points to know how dense they are.
    #[error("the points are all at one place, so nothing tells how dense they are; give both an Nside and a reach")]
    OnePlace,
    /// A way of gathering that cannot be.
    #[error("{what} is {value}, which is not {expected}; correct it")]
    Setting {
        /// The setting, such as "the reach".
        what: &'static str,
        /// Its value.
        value: f64,
        /// What would do.
        expected: &'static str,
    },
    /// A point without a direction.
    #[error("{place} lies at the centre, so it has no direction from there; name another centre")]
    AtCentre {
        /// The row or vertex.
        place: String,
    },
    /// Arrays that belong together but differ in length.
    #[error("there are {first} {one} but {second} {other}; give as many of the one as of the other")]
    Lengths {
        /// What the first array holds.
        one: &'static str,
        /// Its length.
        first: usize,
        /// What the second array holds.
        other: &'static str,
        /// Its length.
        second: usize,
    },
    /// Rows of another number than three.
    #[error("the rows of the {name} have {found} numbers, not 3; give one row for each")]
    Columns {
        /// What the array holds.
        name: &'static str,
        /// Numbers in a row.
        found: usize,
    },
    /// No point with a value.
    #[error("no point has a value; give at least one that is not NaN")]
    NoPoints,
    /// A corner of a triangle that is not there.
    #[error("triangle {triangle} (from 0) has vertex {vertex}, but there are {vertices} vertices, numbered from 0")]
    Vertex {
        /// The triangle.
        triangle: usize,
        /// The number of the vertex.
        vertex: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// A surface that is not seen from its centre once in each direction.
    #[error(
        "seen from the centre, {never} of the sphere has no surface and {several} has more than one layer; name a centre inside, or allow folds, so that the outermost layer counts"
    )]
    Crossings {
        /// Share of the sphere whose rays never cross the surface.
        never: Percent,
        /// Share of the sphere whose rays cross it more than once.
        several: Percent,
    },
    /// A coordinate without values.
    #[error("the {coordinate} has no values; check the file")]
    NoCoordinates {
        /// Which coordinate: latitude or longitude.
        coordinate: &'static str,
    },
    /// A coordinate that turns back, or stands still.
    #[error(
        "the {coordinate} {value} at index {index} follows {before} against the order of the other values; sort the field along it"
    )]
    NotMonotonic {
        /// Which coordinate.
        coordinate: &'static str,
        /// The number of the value, from 0.
        index: usize,
        /// The value before.
        before: f64,
        /// The value.
        value: f64,
    },
    /// A coordinate, or a bound of a cell, that is not on the sphere.
    #[error("the {coordinate} {value} at index {index} is not between {least} and {most} degrees; {remedy}")]
    CoordinateRange {
        /// Which coordinate.
        coordinate: &'static str,
        /// The number of the value, from 0.
        index: usize,
        /// The value.
        value: f64,
        /// The least it could be.
        least: f64,
        /// The most it could be.
        most: f64,
        /// What it looks like, and what to do.
        remedy: &'static str,
    },
    /// Coordinates in radians.
    #[error("the longitudes go once around in 2π, so they look like radians; convert the coordinates to degrees")]
    Radians,
    /// Longitudes that go around the sphere more than once.
    #[error("the longitudes span {span} degrees, more than the circle has; remove the columns that repeat others")]
    LongitudeSpan {
        /// From the first to the last.
        span: f64,
    },
    /// A single value, from which no size of a cell follows.
    #[error(
        "the {coordinate} has the single value {value} and no bounds, so the extent of its cells is unknown; add bounds"
    )]
    NoSpacing {
        /// Which coordinate.
        coordinate: &'static str,
        /// The value.
        value: f64,
    },
    /// Bounds of cells that do not match the coordinate.
    #[error(
        "the {coordinate} has {points} values but {bounds} bounds, which are neither edges ({points} + 1) nor pairs (2 x {points}); correct the bounds"
    )]
    BoundsCount {
        /// Which coordinate.
        coordinate: &'static str,
        /// The number of values.
        points: usize,
        /// The number of bounds.
        bounds: usize,
    },
    /// A cell that its own point is not in.
    #[error("the {coordinate} {value} at index {index} is not within its bounds {low} and {high}; correct the bounds")]
    BoundsApart {
        /// Which coordinate.
        coordinate: &'static str,
        /// The number of the value, from 0.
        index: usize,
        /// The value.
        value: f64,
        /// One bound.
        low: f64,
        /// The other.
        high: f64,
    },
    /// Cells that share an area.
    #[error("the bounds of the {coordinate} at the indices {first} and {second} overlap; correct the bounds")]
    BoundsOverlap {
        /// Which coordinate.
        coordinate: &'static str,
        /// The number of one value, from 0.
        first: usize,
        /// The number of the other.
        second: usize,
    },
    /// A grid beyond what weights can name.
    #[error(
        "a grid of {latitudes} latitudes and {longitudes} longitudes has more than 2^32 cells; select a part of it"
    )]
    GridSize {
        /// The number of latitudes.
        latitudes: usize,
        /// The number of longitudes.
        longitudes: usize,
    },
}

/// A share of a number of pixels, shown in percent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Percent {
    /// The pixels in question.
    pub pixels: usize,
    /// All pixels.
    pub of: usize,
}

impl fmt::Display for Percent {
    /// With two digits or more, so that what is small does not look like nothing.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.pixels == 0 {
            return f.write_str("0%");
        }
        let percent = 100.0 * self.pixels as f64 / self.of as f64;
        let decimals = (1.0 - percent.log10().floor()).max(1.0) as usize;
        write!(f, "{percent:.decimals$}%")
    }
}
