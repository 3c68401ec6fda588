//! Maps on the sphere and the files that hold them.
//!
//! [`Map`] is what every reader makes and the engine takes; [`Healpix`] is its grid. Each family of files has an
//! [`Adapter`], chosen by the file's content, never by its name. Writing goes through [`save()`], the one place that
//! puts a finished file in its place. What is done with a map is left to others.

mod adapter;
mod canvas;
mod cf;
mod cfitsio;
mod columns;
mod csv;
mod dataset;
mod directions;
mod error;
mod healpix;
mod healpix_cf;
mod healpix_fits;
mod interpret;
mod latlon;
mod libnetcdf;
mod map;
mod multi_order;
mod names;
mod netcdf;
mod netcdf_write;
mod ply;
mod points;
mod regrid;
mod regridded;
mod save;
mod surface;
mod units;
mod zarr;
mod zarr_zstd;

pub use adapter::{
    About, Adapter, At, AxisDescription, Description, DimensionDescription, Field, FieldDescription, Gather,
    GridDescription, Indexing, Maps, Method, Place, Regrid, Room, Selection, TableDescription, TablePlace, describe,
    has_ways, is_store, open, read,
};
pub use error::{Error, Percent};
pub use healpix::{Healpix, NSIDE_MAX, Ordering, Ring};
pub use healpix_fits::{Card, CardValue, Column, Extension, HealpixFile, HealpixLayout, HealpixWriter, write_healpix};
pub use map::{BAD_DATA_TOLERANCE, CoordinateSystem, Map, Sphere, Time, UNSEEN, is_bad};
pub use names::is_alike;
pub use netcdf_write::{NetcdfColumn, NetcdfLayout, NetcdfWriter, TimeAxis};
pub use regrid::{LatLon, Weights};
pub use regridded::{FINER, Regridded, Way};
pub use save::{abandon, check_writable, save, tidy};
pub use units::differ as units_differ;
