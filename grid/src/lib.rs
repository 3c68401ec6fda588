//! Maps on the sphere, and the way to them from arrays.
//!
//! [`Map`] is a field on a [`Healpix`] grid. Fields on other grids come to HEALPix by [`Weights`] (latitude × longitude,
//! [`LatLon`]), from [`Points`], or from a [`Surface`]; [`Regrid`] has the settings. A [`Disc`](disc::Disc) has the
//! pixels about a point. Files are left to others.

pub mod accumulate;
pub mod directions;
pub mod disc;
mod error;
mod healpix;
mod map;
mod map_view;
mod points;
mod regrid;
pub mod regridded;
mod surface;

pub use error::{Error, Percent};
pub use healpix::{Healpix, NSIDE_MAX, Ordering, Ring};
pub use map::{BAD_DATA_TOLERANCE, CoordinateSystem, Map, Sphere, Time, UNSEEN, is_bad};
pub use map_view::MapView;
pub use points::{Points, PointsSummary};
pub use regrid::{Gather, LatLon, Method, Regrid, Weights};
pub use regridded::{FINER, Regridded, Way};
pub use surface::{Surface, SurfaceSummary};
