//! Values at points of the sphere, gathered to a map.
//!
//! Where the points come from is left to others.

use std::collections::HashMap;
use std::f64::consts::{LN_2, PI};

use ndarray::{ArrayView1, ArrayView2};
use rstar::{PointDistance, RTree};

use crate::directions::{self, Direction, Numbered, angle, chart, chord, nearest, pixel_at, places, spacing, tree};
use crate::healpix::closest_nside;
use crate::{Error, Gather, Healpix, Map, Regrid, Regridded, regridded};

/// A Gaussian is cut at this many standard deviations, where its weight is 1.5e-8, below the rounding of
/// single-precision values.
const CUT: f64 = 6.0;

/// Pixels farther than this many times the typical distance from any point are masked, unless a reach is given.
const REACH: f64 = 2.0;

/// How points become a map.
struct Plan {
    /// The places of the points.
    places: RTree<Numbered>,
    grid: Healpix,
    /// Pixels farther than this from any place are masked, in radians.
    reach: f64,
    gather: Gather,
    regridded: Regridded,
}

/// An angle of a setting in radians.
fn positive(what: &'static str, degrees: f64) -> Result<f64, Error> {
    match degrees {
        _ if degrees.is_finite() && degrees > 0.0 => Ok(degrees.to_radians()),
        value => Err(Error::Setting { what, value, expected: "an angle in degrees greater than 0" }),
    }
}

/// Values at points.
#[derive(Clone, Debug)]
pub struct Points {
    /// Where the points are, as unit vectors.
    pub directions: Vec<Direction>,
    /// One value for each point, none of them NaN.
    pub values: Vec<f64>,
}

/// How points lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointsSummary {
    /// The typical distance between them in degrees: the median of the distances to the fourth nearest neighbour; none
    /// where all are at one place.
    pub spacing: Option<f64>,
    /// The Nside that is used unless one is given; none where all points are at one place.
    pub nside: Option<usize>,
    /// The share of the sphere that is as near to a point as it must be, unless a reach is given.
    pub covered: Option<f64>,
}

impl Points {
    /// Points at longitudes and latitudes in degrees. Points whose value is NaN are left out.
    ///
    /// # Errors
    /// [`Error::Lengths`] where the arrays differ in length, [`Error::Setting`] for a latitude beyond ±90 or a longitude
    /// that is not finite, [`Error::NoPoints`] where no point has a value.
    pub fn from_degrees(
        longitudes: ArrayView1<'_, f64>,
        latitudes: ArrayView1<'_, f64>,
        values: ArrayView1<'_, f64>,
    ) -> Result<Self, Error> {
        check_lengths("longitudes", longitudes.len(), "latitudes", latitudes.len())?;
        check_lengths("points", longitudes.len(), "values", values.len())?;
        let mut points = Points { directions: Vec::new(), values: Vec::new() };
        for ((&longitude, &latitude), &value) in longitudes.iter().zip(latitudes).zip(values) {
            if !longitude.is_finite() {
                return Err(Error::Setting {
                    what: "a longitude",
                    value: longitude,
                    expected: "a finite number of degrees",
                });
            }
            if latitude.is_nan() || latitude.abs() > 90.0 {
                return Err(Error::Setting {
                    what: "a latitude",
                    value: latitude,
                    expected: "between -90 and 90 degrees",
                });
            }
            points.push(directions::at(longitude.to_radians(), latitude.to_radians()), value);
        }
        points.some()
    }

    /// Points in space, as they are seen from a centre, the mean of all points unless given: `positions` has a row x, y, z
    /// for each. Points whose value is NaN are left out, though they count for the mean.
    ///
    /// # Errors
    /// [`Error::Lengths`] where the arrays do not go together, [`Error::AtCentre`] where a point lies at the centre,
    /// [`Error::Setting`] for a position or centre out of range, [`Error::NoPoints`] where no point has a value.
    pub fn from_positions(
        positions: ArrayView2<'_, f64>,
        centre: Option<[f64; 3]>,
        values: ArrayView1<'_, f64>,
    ) -> Result<Self, Error> {
        let positions = directions::positions("positions", positions)?;
        check_lengths("points", positions.len(), "values", values.len())?;
        let centre = directions::centre(centre, positions.iter().copied())?;
        let mut points = Points { directions: Vec::new(), values: Vec::new() };
        for (i, (&position, &value)) in positions.iter().zip(values).enumerate() {
            let seen = directions::from_centre(position, centre);
            let (direction, _) = seen.ok_or_else(|| Error::AtCentre { place: format!("point {i} (from 0)") })?;
            points.push(direction, value);
        }
        points.some()
    }

    fn push(&mut self, direction: Direction, value: f64) {
        if !value.is_nan() {
            self.directions.push(direction);
            self.values.push(value);
        }
    }

    fn some(self) -> Result<Self, Error> {
        if self.values.is_empty() { Err(Error::NoPoints) } else { Ok(self) }
    }

    /// How the points lie.
    ///
    /// # Errors
    /// [`Error::Memory`] where there is not the memory for a map.
    pub fn summary(&self) -> Result<PointsSummary, Error> {
        let spacing = spacing(&places(self.directions.iter().copied()));
        let nside = spacing.map(closest_nside);
        let nearest = Regrid { gather: Some(Gather::Nearest), ..Regrid::default() };
        let covered = nside.map(|_| self.regrid(nside, &nearest)).transpose()?.map(|map| map.share_valid());
        Ok(PointsSummary { spacing: spacing.map(f64::to_degrees), nside, covered })
    }

    /// How the points, of which there is at least one, come to HEALPix.
    ///
    /// # Errors
    /// Where the settings are impossible, or missing where all points are at one place.
    pub fn regridded(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Regridded, Error> {
        Ok(self.plan(nside, regrid)?.regridded)
    }

    /// How the points, of which there is at least one, become a map.
    ///
    /// The Nside is that of the pixels closest to the typical distance between points unless given.
    ///
    /// # Errors
    /// Where the settings are impossible, or missing where all points are at one place.
    fn plan(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Plan, Error> {
        let reach = regrid.reach.map(|reach| positive("the reach", reach)).transpose()?;
        let places = places(self.directions.iter().copied());
        let spacing = spacing(&places);
        let nside = nside.or_else(|| spacing.map(closest_nside)).ok_or(Error::OnePlace)?;
        let reach = reach.or_else(|| spacing.map(|spacing| REACH * spacing)).ok_or(Error::OnePlace)?;
        let grid = Healpix::new(nside)?;
        let (gather, mut regridded) = regridded::gather(spacing, grid, regrid.gather);
        regridded.reach = Some(reach.to_degrees());
        Ok(Plan { places, grid, reach, gather, regridded })
    }

    /// Makes a map of the points, of which there is at least one, at an Nside: that of the pixels closest to the typical
    /// distance between points unless given.
    ///
    /// Coincident points count each, except that the nearest one is the first of them. A pixel whose centre no Gaussian
    /// reaches has the value of the nearest point, to which the weighted mean tends far from all points.
    ///
    /// # Errors
    /// Where the settings are impossible, or missing where all points are at one place.
    pub fn regrid(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Map, Error> {
        let Plan { places, grid, reach, gather, mut regridded } = self.plan(nside, regrid)?;
        let reach = (reach < PI).then(|| chord(reach).powi(2));
        // The value of the nearest point, where it is within reach.
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

    /// The mean of the points in each pixel that has any.
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

/// Whether two arrays that belong together are of one length.
pub(crate) fn check_lengths(one: &'static str, first: usize, other: &'static str, second: usize) -> Result<(), Error> {
    if first == second { Ok(()) } else { Err(Error::Lengths { one, first, other, second }) }
}
