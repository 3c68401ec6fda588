//! The extension point for file formats: what an adapter does, and the series of maps that it opens.
//!
//! A new format is one type that implements [`Adapter`] and one entry in the list of the registry. The meaning of a
//! format is left to its adapter.

use std::path::Path;

use longan_grid::{CoordinateSystem, Healpix, Map, Ordering, Sphere, Time};

use crate::describe::Description;
use crate::error::Error;
use crate::quantity::StatedQuantity;
use crate::request::Selection;

/// A reader of one family of files.
pub trait Adapter: Sync {
    /// The format's name, as users know it.
    fn name(&self) -> &'static str;

    /// Whether a file that begins with `head` (at least the first 512 bytes, or all of a shorter file) is of this
    /// format. The file's name plays no part.
    fn recognises(&self, head: &[u8]) -> bool;

    /// The tables, variables and fields of a file.
    ///
    /// # Errors
    /// Where the file cannot be read or holds no map.
    fn describe(&self, path: &Path) -> Result<Description, Error>;

    /// Finds the selected field, so that its maps can be read.
    ///
    /// # Errors
    /// Where the file cannot be read, or does not have the selected field.
    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error>;
}

/// The memory that maps take, as far as it is known before one is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Nside of the maps; where that depends on how close points are, one that suits their number.
    pub nside: usize,
    /// The approximate size of one map and of all that it takes to read it, in bytes.
    pub bytes: usize,
}

impl MemoryEstimate {
    /// The estimate for maps of a grid with this many bytes beside one of them.
    pub(crate) fn of(grid: Healpix, beside: usize) -> Self {
        let bytes = grid.pixels().saturating_mul(size_of::<f64>()).saturating_add(beside);
        MemoryEstimate { nside: grid.nside(), bytes }
    }

    /// The estimate for maps made of points, each of which takes this many bytes.
    pub(crate) fn of_points(nside: Option<usize>, points: usize, bytes: usize) -> Option<Self> {
        let nside = nside.unwrap_or_else(|| (points as f64 / 12.0).sqrt().ceil().max(1.0) as usize);
        Some(MemoryEstimate::of(Healpix::new(nside).ok()?, points.saturating_mul(bytes)))
    }
}

/// Name, unit and sphere of maps, known before one is read.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The field's name, as the file has it.
    pub name: String,
    /// The field's unit, as the file has it.
    pub unit: Option<String>,
    /// The coordinate system, where the file names one.
    pub coordinates: Option<CoordinateSystem>,
    /// Whether the sphere is the sky, the Earth or a body.
    pub sphere: Sphere,
    /// The quantity, where the file states one.
    pub quantity: Option<StatedQuantity>,
}

impl About {
    /// Writes name, unit and sphere into a map.
    pub(crate) fn label(self, map: &mut Map) {
        let About { name, unit, coordinates, sphere, quantity: _ } = self;
        (map.name, map.unit, map.coordinates, map.sphere) = (name, unit, coordinates, sphere);
    }
}

/// The grid that maps are brought to.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The grid.
    pub grid: Healpix,
    /// The ordering that the maps have in the file; RING for those that are regridded.
    pub ordering: Ordering,
    /// The settings of regridding, the way first and every default resolved: `bilinear`, `min-valid=0.5`; empty for
    /// fields that are on HEALPix.
    pub settings: Vec<String>,
}

impl Target {
    /// The target of a field that is regridded.
    pub(crate) fn regridded(grid: Healpix, settings: Vec<String>) -> Self {
        Target { grid, ordering: Ordering::Ring, settings }
    }
}

/// The entry of a field in a [place](MapSeries::place).
pub(crate) fn field_place(name: &str) -> String {
    format!("field={name}")
}

/// The maps that a selection names: one, or one for each step in time, all on one grid.
pub trait MapSeries {
    /// The times of the steps; one map without a time has none and counts as one step.
    fn times(&self) -> &[Time];

    /// Name, unit and sphere of the maps.
    fn about(&self) -> About;

    /// The memory that a map takes; nothing where that is not known before one is read.
    fn memory(&self) -> Option<MemoryEstimate>;

    /// The place of the maps in their file: the table, the field and the places along other dimensions, such as `hdu=1`,
    /// `field=z`, `level=500`. Two selections of the same maps have equal places, whether a choice is made or left out.
    fn place(&self) -> Vec<String>;

    /// The grid that maps are brought to, and how. This may read as much as a map does.
    ///
    /// # Errors
    /// Where the file cannot be read, or settings are missing or impossible.
    fn target(&mut self) -> Result<Target, Error>;

    /// Reads one map, by the number of its step from 0. Weights and other things that steps share are computed once.
    ///
    /// # Errors
    /// Where the file cannot be read.
    fn read(&mut self, step: usize) -> Result<Map, Error>;

    /// Reads the values of one map as the file has them, whatever their grid, but unpacked; NaN where missing.
    ///
    /// # Errors
    /// Where the file cannot be read.
    fn values(&mut self, step: usize) -> Result<Vec<f64>, Error> {
        self.read(step).map(Map::into_values)
    }
}
