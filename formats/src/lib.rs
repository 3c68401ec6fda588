//! Files that hold maps on the sphere.
//!
//! Every reader makes a [`Map`](longan_grid::Map). Each family of files has an [`Adapter`], chosen by the file's content,
//! never by its name. Writing goes through [`save()`], the one place that puts a finished file in its place. Every
//! [`Error`] has an [`ErrorKind`] to act on. The use of maps is left to others.

mod adapter;
mod card;
mod cf;
mod cfitsio;
mod columns;
mod csv_points;
mod dataset;
mod describe;
mod error;
mod gzip;
mod healpix_cf;
mod healpix_fits;
mod input_record;
mod interpret;
mod latlon;
mod libnetcdf;
mod multi_order;
mod names;
mod netcdf_files;
mod netcdf_write;
mod ply_surfaces;
mod quantity;
mod registry;
mod request;
mod save;
mod text;
mod units;
mod zarr;
mod zarr_zstd;

pub use adapter::{About, Adapter, MapSeries, MemoryEstimate, Target};
pub use card::{Card, CardValue};
pub use describe::{
    AxisDescription, Description, DimensionDescription, FieldDescription, GridDescription, Indexing, TableDescription,
    TablePlace,
};
pub use error::{Ask, Error, ErrorKind};
pub use healpix_fits::{Column, Extension, HealpixFile, HealpixLayout, HealpixWriter, write_healpix};
pub use input_record::{InputRecord, Role};
pub use names::is_alike;
pub use netcdf_write::{NetcdfColumn, NetcdfLayout, NetcdfWriter, TimeAxis};
pub use quantity::StatedQuantity;
pub use registry::{describe, is_store, open, read};
pub use request::{At, Field, Place, Selection};
pub use save::{abandon, check_writable, save, tidy};
pub use units::differ as units_differ;
