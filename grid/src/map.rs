//! The map: values on a HEALPix grid with their name, unit, coordinates and time.

use rayon::prelude::*;

use crate::{Error, Healpix, Ordering, Regridded};

/// Values to handle at once: many enough that calls cost nothing, few enough to stay in the cache.
pub const CHUNK: usize = 1 << 17;

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

    /// Its name in full.
    pub fn name(self) -> &'static str {
        match self {
            Self::Galactic => "galactic",
            Self::Ecliptic => "ecliptic",
            Self::Celestial => "celestial",
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
    ///
    /// # Panics
    /// Where the number of values is not the grid's.
    pub fn from_masked(grid: Healpix, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), grid.pixels(), "one value for each pixel");
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

    /// This map as a mask on another grid.
    ///
    /// Where it is coarser, each pixel takes the value of the mask's pixel that its centre lies in. Where it is finer,
    /// each pixel takes the mean of the mask's pixels whose centres lie in it; among them a missing value counts as 0,
    /// for what was not observed is masked, and where all are missing so is the mean.
    ///
    /// # Errors
    /// [`Error::Memory`] where there is not the memory for it.
    pub fn as_mask_on(&self, grid: Healpix) -> Result<Map, Error> {
        let nearest = |pixel: usize| {
            let (theta, phi) = grid.centre(pixel);
            self.values[self.grid.pixel_at(theta, phi)]
        };
        let mut values = reserved(grid)?;
        values.resize(grid.pixels(), f64::NAN);
        if self.grid.nside() > grid.nside() {
            let mut counts = vec![Count::default(); grid.pixels()];
            for (start, values) in (0..).step_by(CHUNK).zip(self.values.chunks(CHUNK)) {
                let place = |pixel: usize| {
                    let (theta, phi) = self.grid.centre(pixel);
                    grid.pixel_at(theta, phi)
                };
                let places: Vec<usize> = (start..start + values.len()).into_par_iter().map(place).collect();
                places.into_iter().zip(values).for_each(|(place, value)| counts[place].add(*value));
            }
            // A grid that is hardly finer may have no centre in some pixel.
            let mean = |(pixel, count): (usize, &Count)| count.mean().unwrap_or_else(|| nearest(pixel));
            values.par_iter_mut().zip(counts.par_iter().enumerate()).for_each(|(value, count)| *value = mean(count));
        } else {
            values.par_iter_mut().enumerate().for_each(|(pixel, value)| *value = nearest(pixel));
        }
        let mut mask = Map::from_masked(grid, values);
        (mask.name, mask.unit, mask.coordinates) = (self.name.clone(), self.unit.clone(), self.coordinates);
        (mask.sphere, mask.ordering) = (self.sphere, self.ordering);
        Ok(mask)
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

/// Values of a mask within one pixel of a coarser grid.
#[derive(Clone, Copy, Default)]
struct Count {
    all: u32,
    present: u32,
    sum: f64,
}

impl Count {
    fn add(&mut self, value: f64) {
        self.all += 1;
        if !value.is_nan() {
            self.present += 1;
            self.sum += value;
        }
    }

    /// The mean, in which missing values are 0: NaN where all are, nothing where there are none.
    fn mean(&self) -> Option<f64> {
        let mean = if self.present > 0 { self.sum / f64::from(self.all) } else { f64::NAN };
        (self.all > 0).then_some(mean)
    }
}

/// The memory for the values of a grid, none of them there yet.
///
/// # Errors
/// [`Error::Memory`] where there is not the memory for it.
pub(crate) fn reserved(grid: Healpix) -> Result<Vec<f64>, Error> {
    let mut values = Vec::new();
    values.try_reserve_exact(grid.pixels()).map_err(|_| Error::Memory {
        nside: grid.nside(),
        gibibytes: grid.pixels() as f64 * 8.0 / f64::from(1 << 30),
    })?;
    Ok(values)
}

/// Whether a value means "no value": not finite, or within [`BAD_DATA_TOLERANCE`] of the marker.
pub fn is_bad(value: f64, marker: f64) -> bool {
    !value.is_finite() || (value - marker).abs() <= BAD_DATA_TOLERANCE * marker.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(nside: usize, value: impl Fn(usize) -> f64) -> Map {
        Map::new("mask", (0..12 * nside * nside).map(value).collect()).unwrap()
    }

    /// The pixel of a coarser grid that a pixel's centre lies in, by the NESTED tree.
    fn parent(grid: Healpix, coarse: Healpix, pixel: usize) -> usize {
        let [fine, coarse] = [grid, coarse].map(|grid| cdshealpix::nested::get(grid.depth().unwrap()));
        let finer = 2 * (fine.depth() - coarse.depth());
        coarse.to_ring(fine.from_ring(pixel as u64) >> finer) as usize
    }

    #[test]
    fn a_coarser_mask_is_that_of_the_parents() {
        let (coarse, grid) = (map(4, |p| p as f64), Healpix::new(32).unwrap());
        let mask = coarse.as_mask_on(grid).unwrap();
        assert!((0..grid.pixels()).all(|p| mask.values()[p] == parent(grid, coarse.grid(), p) as f64));
    }

    #[test]
    fn a_finer_mask_is_the_mean_of_the_children_with_missing_ones_as_0() {
        let (fine, grid) = (Healpix::new(16).unwrap(), Healpix::new(4).unwrap());
        // Pixel 7 lacks all, pixel 9 all but one, others every third value.
        let missing = |p: usize, seen: &mut [usize]| {
            let parent = parent(fine, grid, p);
            seen[parent] += 1;
            parent == 7 || parent == 9 && seen[parent] > 1 || ![7, 9].contains(&parent) && p.is_multiple_of(3)
        };
        let mut seen = vec![0; grid.pixels()];
        let values: Vec<f64> = (0..fine.pixels()).map(|p| if missing(p, &mut seen) { f64::NAN } else { 1.0 }).collect();
        let mask = Map::new("mask", values.clone()).unwrap().as_mask_on(grid).unwrap();
        let mut present = vec![0.0; grid.pixels()];
        values.iter().enumerate().filter(|(_, v)| !v.is_nan()).for_each(|(p, v)| present[parent(fine, grid, p)] += v);
        for (pixel, (value, present)) in mask.values().iter().zip(present).enumerate() {
            assert!(if pixel == 7 { value.is_nan() } else { *value == present / 16.0 }, "{pixel}");
        }
        assert_eq!(mask.values()[9], 1.0 / 16.0);
    }

    #[test]
    fn masks_come_from_grids_of_any_nside() {
        for (from, to) in [(3, 16), (48, 16), (17, 16), (16, 17), (5, 3), (16, 16)] {
            let mask = map(from, |_| 1.0).as_mask_on(Healpix::new(to).unwrap()).unwrap();
            assert!(mask.values().len() == 12 * to * to && mask.values().iter().all(|v| *v == 1.0), "{from} to {to}");
        }
    }
}
