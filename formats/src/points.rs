//! Values at points of the sphere, gathered to a map.
//!
//! Where the points come from is left to the adapters.

use std::collections::HashMap;
use std::f64::consts::{LN_2, PI};

use rstar::{PointDistance, RTree};

use crate::directions::{
    Direction, Numbered, angle, chart, chord, closest_nside, nearest, pixel_at, places, spacing, tree,
};
use crate::{CoordinateSystem, Error, Gather, GridDescription, Healpix, Map, Regrid, Regridded, regridded};

/// A Gaussian is cut at this many standard deviations, where its weight is 1.5e-8, below the rounding of
/// single-precision values.
const CUT: f64 = 6.0;

/// Pixels farther than this many times the typical distance from any point are masked, unless a reach is given.
const REACH: f64 = 2.0;

/// Where pixels are finer than points lie, they are smoothed by a Gaussian of this many times the typical distance, unless
/// another way is asked for. Among points at random, the contours of a Gaussian field whose correlation angle is four and
/// eight distances come out 2 % and 0.3 % too short, with the mean and the nearest point 29 % too long. At 1.5 times the
/// distance they are 1 % and 2 % too long: how points happen to lie shows. What is smaller is lost, 12 % of the contours
/// where the correlation angle is but two distances.
pub(crate) const SMOOTH: f64 = 2.0;

/// How samples become a map.
pub(crate) struct Plan {
    /// The places of the samples.
    places: RTree<Numbered>,
    grid: Healpix,
    /// Pixels farther than this from any place are masked, in radians.
    reach: f64,
    gather: Gather,
    pub(crate) regridded: Regridded,
}

/// An angle of a setting in radians.
fn positive(what: &'static str, degrees: f64) -> Result<f64, Error> {
    match degrees {
        _ if degrees.is_finite() && degrees > 0.0 => Ok(degrees.to_radians()),
        value => Err(Error::Setting { what, value, expected: "an angle in degrees greater than 0" }),
    }
}

/// Values at points.
pub(crate) struct Samples {
    /// Where they are.
    pub(crate) directions: Vec<Direction>,
    /// One for each direction.
    pub(crate) values: Vec<f64>,
}

impl Samples {
    /// What the points are, for people.
    pub(crate) fn describe(&self, coordinates: Option<CoordinateSystem>) -> Result<GridDescription, Error> {
        let spacing = spacing(&places(self.directions.iter().copied()));
        let nside = spacing.map(closest_nside);
        let covered = match nside {
            Some(_) => {
                Some(self.gather(nside, &Regrid { gather: Some(Gather::Nearest), ..Regrid::default() })?.share_valid())
            }
            None => None,
        };
        let points = self.values.len();
        Ok(GridDescription::Points { points, coordinates, spacing: spacing.map(f64::to_degrees), nside, covered })
    }

    /// How the samples, of which there is at least one, become a map.
    ///
    /// The Nside is that of the pixels closest to the typical distance between points unless given.
    ///
    /// # Errors
    /// Where the settings are impossible, or missing where all samples are at one place.
    pub(crate) fn plan(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Plan, Error> {
        let reach = regrid.reach.map(|reach| positive("the reach", reach)).transpose()?;
        let places = places(self.directions.iter().copied());
        let spacing = spacing(&places);
        let nside = nside.or_else(|| spacing.map(closest_nside)).ok_or(Error::OnePlace)?;
        let reach = reach.or_else(|| spacing.map(|spacing| REACH * spacing)).ok_or(Error::OnePlace)?;
        let grid = Healpix::new(nside)?;
        let (gather, regridded) = regridded::gather(spacing, grid, regrid.gather);
        Ok(Plan { places, grid, reach, gather, regridded })
    }

    /// Makes a map of the samples, of which there is at least one.
    ///
    /// Coincident samples count each, except that the nearest one is the first of them. A pixel whose centre no Gaussian
    /// reaches has the value of the nearest sample, to which the weighted mean tends far from all samples.
    ///
    /// # Errors
    /// Where the settings are impossible, or missing where all samples are at one place.
    pub(crate) fn gather(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Map, Error> {
        let Plan { places, grid, reach, gather, mut regridded } = self.plan(nside, regrid)?;
        let reach = (reach < PI).then(|| chord(reach).powi(2));
        // The value of the nearest sample, where it is within reach.
        let near = |direction| {
            let (sample, squared) = nearest(&places, direction)?;
            reach.is_none_or(|reach| squared <= reach).then(|| self.values[sample])
        };
        let mut map = match gather {
            Gather::Nearest => chart(grid, |_, direction| near(direction).unwrap_or(f64::NAN)),
            Gather::Mean => {
                let means = self.means(grid);
                let map = chart(grid, |pixel, direction| {
                    near(direction).map_or(f64::NAN, |near| means.get(&pixel).copied().unwrap_or(near))
                })?;
                let unmasked = (0..grid.pixels()).filter(|&pixel| !map.values()[pixel].is_nan());
                let (all, held) =
                    unmasked.fold((0, 0), |(all, held), pixel| (all + 1, held + u32::from(means.contains_key(&pixel))));
                regridded.empty = 1.0 - f64::from(held) / f64::from(all.max(1));
                Ok(map)
            }
            Gather::Gaussian { fwhm } => {
                let sigma = positive("the width of the Gaussian", fwhm)? / (8.0 * LN_2).sqrt();
                let cut = chord(CUT * sigma).powi(2);
                let all = tree(&self.directions);
                chart(grid, |_, direction| {
                    let Some(near) = near(direction) else { return f64::NAN };
                    let (mut weights, mut sum) = (0.0, 0.0);
                    for sample in all.locate_within_distance(direction, cut) {
                        let squared = sample.distance_2(&direction);
                        let weight = (-0.5 * (angle(squared) / sigma).powi(2)).exp();
                        weights += weight;
                        // From a value nearby, so that a constant stays what it is.
                        sum += weight * (self.values[sample.data] - near);
                    }
                    if weights > 0.0 { near + sum / weights } else { near }
                })
            }
        }?;
        map.regridded = Some(regridded);
        Ok(map)
    }

    /// The mean of the samples in each pixel that has any.
    fn means(&self, grid: Healpix) -> HashMap<usize, f64> {
        // First sample, their sum counted from it, so that a constant stays what it is, and their number.
        let mut sums = HashMap::new();
        for (&direction, &value) in self.directions.iter().zip(&self.values) {
            let (first, sum, count) = sums.entry(pixel_at(grid, direction)).or_insert((value, 0.0, 0.0));
            *sum += value - *first;
            *count += 1.0;
        }
        sums.into_iter().map(|(pixel, (first, sum, count))| (pixel, first + sum / count)).collect()
    }
}
