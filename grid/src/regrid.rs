//! Fields on grids of latitude and longitude, brought to HEALPix, and the settings of all regridding.
//!
//! [`Regrid`] has the settings. [`LatLon`] is the grid, [`Weights`] what each pixel takes from each of its cells or points, computed once for all
//! fields on the grid. [`conservative`], [`bilinear`] and [`nearest`] compute them. Reading fields is left to
//! others.

mod bilinear;
mod conservative;
mod lat_lon;
mod nearest;

use rayon::prelude::*;

use crate::{Error, Healpix};

pub use lat_lon::LatLon;

/// How fields on other grids, or at points, are brought to HEALPix.
#[derive(Clone, Debug, PartialEq)]
pub struct Regrid {
    /// From grids of longitude and latitude; unless given, [`Method::Bilinear`] where pixels are finer than the grid by
    /// more than [`FINER`](crate::FINER), and [`Method::Conservative`] where they are not.
    pub method: Option<Method>,
    /// Pixels with a smaller share of valid values than this are masked.
    pub min_valid: f64,
    /// From points; unless given, [`Gather::Gaussian`] of twice the typical distance between points where pixels are finer
    /// than that by more than [`FINER`](crate::FINER), and [`Gather::Mean`] where they are not.
    pub gather: Option<Gather>,
    /// Pixels whose centre is farther than this from any point, in degrees, are masked; unless given, twice the typical
    /// distance between points, which is the median distance to the fourth nearest neighbour (coincident points count
    /// once).
    pub reach: Option<f64>,
    /// The point from which a surface, or points in space, are seen; the mean of its vertices, or of them, unless given.
    pub centre: Option<[f64; 3]>,
    /// Whether, where a ray from the centre crosses a surface more than once, the outermost crossing counts.
    pub allow_folds: bool,
}

impl Default for Regrid {
    fn default() -> Self {
        Regrid { method: None, min_valid: 0.5, gather: None, reach: None, centre: None, allow_folds: false }
    }
}

/// How a field on a grid of longitude and latitude is brought to HEALPix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The mean over the pixel, from the areas that grid cells and pixel share.
    Conservative,
    /// Interpolated between the four grid points about the pixel's centre.
    Bilinear,
    /// The grid point nearest to the pixel's centre.
    Nearest,
}

/// How values at points make a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gather {
    /// The mean of the points in a pixel; the nearest point where there is none.
    Mean,
    /// The mean of all points, weighted by a Gaussian of this full width at half maximum in degrees.
    Gaussian {
        /// The width.
        fwhm: f64,
    },
    /// The nearest point.
    Nearest,
}

/// Coordinates in degrees closer than this are one: far above rounding, a tenth of a millimetre on Earth.
const COINCIDENT: f64 = 1e-9;

/// A share of valid weight may fall short of the least by this, for weights that sum to 1 but for rounding.
const SHARE_TOLERANCE: f64 = 1e-9;

/// What each pixel of a HEALPix grid takes from a field on a grid of latitude and longitude.
///
/// A pixel's value is the sum of weight times value over the valid values, divided by the sum of their weights. Missing
/// values thus do not spread.
#[derive(Clone, Debug)]
pub struct Weights {
    grid: Healpix,
    /// The number of values that a field has.
    values: usize,
    /// For each ring from the north.
    rings: Vec<RingWeights>,
}

/// The weights of the pixels on one ring, one pixel after the other.
#[derive(Clone, Debug, Default)]
struct RingWeights {
    /// Where each pixel's weights end.
    ends: Vec<usize>,
    /// The place of each weight's value in the field.
    places: Vec<u32>,
    weights: Vec<f64>,
}

impl RingWeights {
    fn push(&mut self, place: u32, weight: f64) {
        self.places.push(place);
        self.weights.push(weight);
    }

    /// All weights of the next pixel have been pushed.
    fn end_pixel(&mut self) {
        self.ends.push(self.weights.len());
    }

    /// Place and weight of each value that a pixel takes.
    fn pixel(&self, number: usize) -> impl Iterator<Item = (usize, f64)> {
        let begin = if number == 0 { 0 } else { self.ends[number - 1] };
        let range = begin..self.ends[number];
        self.places[range.clone()].iter().map(|&place| place as usize).zip(self.weights[range].iter().copied())
    }
}

impl Weights {
    /// The weights by which fields on a grid are brought to HEALPix.
    ///
    /// - [`Method::Conservative`]: the share of the pixel that is in each cell, exact. On a grid of the whole sphere
    ///   integrals are kept.
    /// - [`Method::Bilinear`]: between the four points about the pixel's centre, linear in longitude and latitude. The
    ///   value at a pole is the mean of the row there; where the outermost row is short of the pole but its cells reach
    ///   it, the mean of that row. Elsewhere, what is not between points gets nothing: on a regional grid, the outer
    ///   halves of the outermost cells.
    /// - [`Method::Nearest`]: the point at the least great-circle distance from the pixel's centre, within the grid's
    ///   cells.
    ///
    /// # Errors
    /// [`Error::Memory`] where there is not enough for so many pixels.
    pub fn new(from: &LatLon, to: Healpix, method: Method) -> Result<Self, Error> {
        check_memory(to)?;
        let rings = match method {
            Method::Conservative => conservative::weights(from, to),
            Method::Bilinear => bilinear::weights(from, to),
            Method::Nearest => nearest::weights(from, to),
        };
        Ok(Weights { grid: to, values: from.values(), rings })
    }

    /// The grid of the maps.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// Place in the field, and weight, of each value that a pixel (RING index) takes. A place may come twice. The sum
    /// is 1, or less where the pixel is not wholly on the grid.
    pub fn pixel(&self, pixel: usize) -> impl Iterator<Item = (usize, f64)> {
        let ring = self.grid.ring_of(pixel);
        self.rings[ring - 1].pixel(pixel - self.grid.ring(ring).start)
    }

    /// Brings a field to HEALPix.
    ///
    /// Values are in row-major order, longitudes the faster, both as they were given to [`LatLon::new`], and NaN where
    /// missing. The map is in RING order, and NaN where valid values have less than `min_valid` of the weight, or none;
    /// what of a pixel is not on the grid counts as not valid.
    ///
    /// # Panics
    /// Where the field has not [`LatLon::values`] values.
    pub fn apply(&self, values: &[f64], min_valid: f64) -> Vec<f64> {
        assert_eq!(values.len(), self.values, "a field is not on the grid that the weights are for");
        let mut map = vec![f64::NAN; self.grid.pixels()];
        let mut rest = map.as_mut_slice();
        let mut parts = Vec::with_capacity(self.rings.len());
        for ring in &self.rings {
            let (part, after) = rest.split_at_mut(ring.ends.len());
            parts.push((ring, part));
            rest = after;
        }
        parts.into_par_iter().for_each(|(ring, part)| {
            for (number, pixel) in part.iter_mut().enumerate() {
                let (mut sum, mut share) = (0.0, 0.0);
                for (place, weight) in ring.pixel(number) {
                    let value = values[place];
                    if !value.is_nan() {
                        sum += weight * value;
                        share += weight;
                    }
                }
                if share > 0.0 && share >= min_valid - SHARE_TOLERANCE {
                    *pixel = sum / share;
                }
            }
        });
        map
    }
}

/// Whether there is memory for the least that weights for this grid and a map need.
fn check_memory(grid: Healpix) -> Result<(), Error> {
    // The map, and for each pixel the end of its weights and one of them.
    const BYTES: usize = 8 + 8 + 12;
    let mut memory = Vec::<[u8; BYTES]>::new();
    memory.try_reserve_exact(grid.pixels()).map_err(|_| Error::Memory {
        nside: grid.nside(),
        gibibytes: grid.pixels() as f64 * BYTES as f64 / f64::from(1 << 30),
    })
}

/// The weights of each ring in parallel.
fn for_rings(to: Healpix, ring: impl Fn(usize) -> RingWeights + Send + Sync) -> Vec<RingWeights> {
    (1..=to.rings()).into_par_iter().map(ring).collect()
}
