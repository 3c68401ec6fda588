//! Maps on the sphere and the files that hold them.
//!
//! [`Map`] is what every reader makes and the engine takes; [`Healpix`] is its grid. Each family of files has an
//! [`Adapter`], chosen by the file's content, never by its name. Writing goes through [`save`], the one place that
//! puts a finished file in its place. What is done with a map is left to others.

mod healpix;
mod map;

pub use healpix::{Healpix, NSIDE_MAX, Ordering, Ring};
pub use map::{BAD_DATA_TOLERANCE, CoordinateSystem, Map, UNSEEN, is_bad};

/// What can be wrong with a map or a file of one.
#[derive(Debug, thiserror::Error)]
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
    #[error(
        "the mask has Nside {mask} but the map has Nside {map}; bring the mask to Nside {map} first (for example with healpy.ud_grade)"
    )]
    MaskNside {
        /// Nside of the map.
        map: usize,
        /// Nside of the mask.
        mask: usize,
    },
}
