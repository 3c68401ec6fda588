//! Files that hold maps on the sphere.
//!
//! [`Map`](longan_grid::Map) is what every reader makes. Each family of files has an
//! [`Adapter`], chosen by the file's content, never by its name. Writing goes through [`save()`], the one place that
//! puts a finished file in its place. What is done with a map is left to others.

mod adapter;
mod cf;
mod cfitsio;
mod columns;
mod csv;
mod dataset;
mod error;
mod healpix_cf;
mod healpix_fits;
mod interpret;
mod latlon;
mod libnetcdf;
mod multi_order;
mod names;
mod netcdf;
mod netcdf_write;
mod ply;
mod save;
mod units;
mod zarr;
mod zarr_zstd;

pub use adapter::{
    About, Adapter, At, AxisDescription, Description, DimensionDescription, Field, FieldDescription, GridDescription,
    Indexing, Maps, Place, Room, Selection, TableDescription, TablePlace, describe, has_ways, is_store, open, read,
};
pub use error::Error;
pub use healpix_fits::{Card, CardValue, Column, Extension, HealpixFile, HealpixLayout, HealpixWriter, write_healpix};
pub use names::is_alike;
pub use netcdf_write::{NetcdfColumn, NetcdfLayout, NetcdfWriter, TimeAxis};
pub use save::{abandon, check_writable, save, tidy};
pub use units::differ as units_differ;
