//! The map type that every adapter fills and the engine reads.

use crate::{Error, Healpix, Ordering, Regridded};

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

/// What the sphere of a map is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sphere {
    /// The sky, seen from inside: what HEALPix in FITS is unless it says otherwise, and all with a celestial
    /// [`CoordinateSystem`].
    #[default]
    Sky,
    /// The Earth, or another globe of latitudes and longitudes.
    Earth,
    /// A body seen from its middle.
    Body,
}

/// A time, as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Time {
    /// The value of the time coordinate.
    pub value: f64,
    /// Its unit, such as `days since 1979-01-01`.
    pub units: String,
    /// Its calendar, as CF names it.
    pub calendar: String,
    /// The date in ISO 8601, as far as it is not all zero: `1997-12-01` or `1997-12-01T06:00`.
    pub label: String,
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
    /// What the sphere is.
    pub sphere: Sphere,
    /// The ordering of the file that the map was read from (the values here are always in RING order).
    pub ordering: Ordering,
    /// The time of the field, where the file has one.
    pub time: Option<Time>,
    /// What the field is in words (`long_name`), where the file says it.
    pub long_name: Option<String>,
    /// How the field came to HEALPix, where it was on another grid or at points.
    pub regridded: Option<Regridded>,
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
        Ok(Map {
            grid,
            values,
            name: name.into(),
            unit: None,
            coordinates: None,
            sphere: Sphere::default(),
            ordering: Ordering::Ring,
            time: None,
            long_name: None,
            regridded: None,
        })
    }

    /// A map of values in RING order in which nothing but NaN means "no value"; one value for each pixel.
    pub(crate) fn from_masked(grid: Healpix, values: Vec<f64>) -> Self {
        debug_assert_eq!(values.len(), grid.pixels());
        Map {
            grid,
            values,
            name: String::new(),
            unit: None,
            coordinates: None,
            sphere: Sphere::default(),
            ordering: Ordering::Ring,
            time: None,
            long_name: None,
            regridded: None,
        }
    }

    /// The grid.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// The values in RING order, NaN where masked.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The values alone.
    pub fn into_values(self) -> Vec<f64> {
        self.values
    }

    /// The share of pixels that have a value.
    pub(crate) fn share_valid(&self) -> f64 {
        self.values.iter().filter(|v| !v.is_nan()).count() as f64 / self.values.len() as f64
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
