//! The map type that every adapter fills and the engine reads.

use crate::{Error, Healpix, Ordering};

/// HEALPix's marker for "no value here".
pub const UNSEEN: f64 = -1.6375e30;

/// Relative distance to a bad-data marker below which a value is one (healpy's).
pub const BAD_DATA_TOLERANCE: f64 = 1e-5;

/// Celestial coordinate systems that HEALPix files name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CoordinateSystem {
    /// Galactic, `G`.
    Galactic,
    /// Ecliptic, `E`.
    Ecliptic,
    /// Celestial (equatorial), `C`.
    Celestial,
}

impl CoordinateSystem {
    /// Reads a COORDSYS value by its first letter, in any case; Q (equatorial) counts as C.
    pub fn parse(text: &str) -> Option<Self> {
        match text.trim().chars().next()?.to_ascii_uppercase() {
            'G' => Some(Self::Galactic),
            'E' if text.trim().to_ascii_uppercase().starts_with("EQ") => Some(Self::Celestial),
            'E' => Some(Self::Ecliptic),
            'C' | 'Q' => Some(Self::Celestial),
            _ => None,
        }
    }

    /// The letter that FITS files use.
    pub fn letter(self) -> &'static str {
        match self {
            Self::Galactic => "G",
            Self::Ecliptic => "E",
            Self::Celestial => "C",
        }
    }
}

/// A scalar field on a HEALPix grid, in RING order. A pixel is masked exactly if its value is NaN.
#[derive(Clone, Debug)]
pub struct Map {
    grid: Healpix,
    values: Vec<f64>,
    /// The field's name, as the file has it.
    pub name: String,
    /// The field's unit, as the file has it.
    pub unit: Option<String>,
    /// The coordinate system, where the file names one.
    pub coordinates: Option<CoordinateSystem>,
    /// The ordering of the file that the map was read from (the values here are always in RING order).
    pub ordering: Ordering,
}

impl Map {
    /// A map of values in RING order; UNSEEN, NaN and ±Inf become masked.
    ///
    /// # Errors
    /// [`Error::PixelCount`] where the number of values is not 12 Nside² for any Nside.
    pub fn new(name: impl Into<String>, mut values: Vec<f64>) -> Result<Self, Error> {
        let grid = Healpix::with_pixels(values.len()).ok_or(Error::PixelCount { pixels: values.len() })?;
        for v in &mut values {
            if is_bad(*v, UNSEEN) {
                *v = f64::NAN;
            }
        }
        Ok(Map { grid, values, name: name.into(), unit: None, coordinates: None, ordering: Ordering::Ring })
    }

    /// The grid.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// The values in RING order, NaN where masked.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Masks every pixel at which `mask` is below `threshold` or is itself masked.
    ///
    /// # Errors
    /// [`Error::MaskNside`] where the grids differ.
    pub fn apply_mask(&mut self, mask: &Map, threshold: f64) -> Result<(), Error> {
        if mask.grid != self.grid {
            return Err(Error::MaskNside { map: self.grid.nside(), mask: mask.grid.nside() });
        }
        for (v, m) in self.values.iter_mut().zip(&mask.values) {
            if m.is_nan() || *m < threshold {
                *v = f64::NAN;
            }
        }
        Ok(())
    }
}

/// Whether a value means "no value": not finite, or within [`BAD_DATA_TOLERANCE`] of the marker.
pub fn is_bad(value: f64, marker: f64) -> bool {
    !value.is_finite() || (value - marker).abs() <= BAD_DATA_TOLERANCE * marker.abs()
}
