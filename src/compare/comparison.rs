//! Both passes over the simulations, in their order, and what comes of them.

use std::borrow::Cow;

use longan_grid::{Healpix, MapView};

use super::ComparisonError;
use super::ensemble::{Deviation, Ensemble, Rank};
use super::peaks::{Peak, peaks};

/// A map of data on its way through two passes over simulations. One comparison takes one measure; several measures are
/// as many comparisons.
#[derive(Clone, Debug)]
pub struct Comparison<'a> {
    grid: Healpix,
    ensemble: Ensemble<'a>,
    /// Simulations of the first pass.
    simulations: usize,
    /// The largest deviation of each simulation of the second pass.
    largest: Vec<Option<f64>>,
}

impl<'a> Comparison<'a> {
    /// A comparison of data without simulations yet. Data and simulations are maps, or arrays or slices in RING order:
    /// see [`MapView`].
    ///
    /// # Errors
    /// [`ComparisonError::Grid`].
    pub fn new<M>(data: M) -> Result<Self, ComparisonError>
    where
        M: TryInto<MapView<'a>, Error: Into<ComparisonError>>,
    {
        let data = data.try_into().map_err(Into::into)?;
        let grid = data.grid();
        Ok(Comparison { grid, ensemble: Ensemble::new(data.into_values()), simulations: 0, largest: Vec::new() })
    }

    /// Takes a simulation into account for mean, scatter and percentiles.
    ///
    /// # Errors
    /// [`ComparisonError::SecondBegan`], [`ComparisonError::Grid`], [`ComparisonError::Pixels`].
    pub fn first<'b, M>(&mut self, simulation: M) -> Result<(), ComparisonError>
    where
        M: TryInto<MapView<'b>, Error: Into<ComparisonError>>,
    {
        if !self.largest.is_empty() {
            return Err(ComparisonError::SecondBegan);
        }
        self.ensemble.add(simulation.try_into().map_err(Into::into)?.values())?;
        self.simulations += 1;
        Ok(())
    }

    /// Finds the largest deviation of a simulation from the data and all other simulations. The second pass has the
    /// same simulations as the first.
    ///
    /// # Errors
    /// [`ComparisonError::TooFew`] before two simulations have gone through the first pass,
    /// [`ComparisonError::Passes`] beyond as many as it had, [`ComparisonError::Grid`], [`ComparisonError::Pixels`].
    pub fn second<'b, M>(&mut self, simulation: M) -> Result<(), ComparisonError>
    where
        M: TryInto<MapView<'b>, Error: Into<ComparisonError>>,
    {
        self.check_enough()?;
        if self.largest.len() == self.simulations {
            return Err(ComparisonError::Passes { first: self.simulations, second: self.simulations + 1 });
        }
        let simulation = simulation.try_into().map_err(Into::into)?;
        self.largest.push(self.ensemble.largest_left_out(simulation.values())?);
        Ok(())
    }

    /// The grid of all maps.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// The number of simulations that have gone through the first pass.
    pub fn simulations(&self) -> usize {
        self.simulations
    }

    /// The deviation of the data from the simulations that have gone through the first pass so far.
    pub fn deviation(&self) -> Deviation {
        self.ensemble.deviation()
    }

    /// The outcome of both passes.
    ///
    /// # Errors
    /// [`ComparisonError::TooFew`], and [`ComparisonError::Passes`] where the second pass has not had all simulations.
    pub fn finish(self) -> Result<Outcome<'a>, ComparisonError> {
        self.check_enough()?;
        let (first, second) = (self.simulations, self.largest.len());
        if first != second {
            return Err(ComparisonError::Passes { first, second });
        }
        let (deviation, largest) = (self.ensemble.deviation(), self.ensemble.largest());
        let rank = largest.map(|data| Rank::new(data, self.largest));
        Ok(Outcome { grid: self.grid, data: self.ensemble.into_data(), deviation, largest, rank })
    }

    fn check_enough(&self) -> Result<(), ComparisonError> {
        match self.simulations {
            found @ (0 | 1) => Err(ComparisonError::TooFew { found }),
            _ => Ok(()),
        }
    }
}

/// The outcome of a comparison.
#[derive(Clone, Debug)]
pub struct Outcome<'a> {
    /// The grid of all maps.
    pub grid: Healpix,
    data: Cow<'a, [f64]>,
    /// The deviation of the data at each pixel.
    pub deviation: Deviation,
    /// The largest deviation of the data in standard deviations, without its sign; nothing where none is defined.
    pub largest: Option<f64>,
    /// The rank of the largest deviation among those of the simulations; nothing where the data has none.
    pub rank: Option<Rank>,
}

/// A pixel at which data deviates more than about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// The pixel, its longitude and latitude in degrees, and the deviation in standard deviations.
    pub peak: Peak,
    /// The value of the data.
    pub value: f64,
    /// Mean of the simulations.
    pub mean: f64,
    /// Standard deviation of the simulations, with n − 1 in the denominator.
    pub std: f64,
    /// The share of simulations with a lower value at this pixel, from 0 to 100.
    pub local_percentile: f64,
    /// The share of all simulated pixels with a lower value, from 0 to 100.
    pub global_percentile: f64,
    /// The number of simulations that are not masked at this pixel.
    pub simulations: usize,
}

impl Outcome<'_> {
    /// The pixels of largest |σ|, the largest first: at most `most`, none below `level` standard deviations, and none
    /// within `distance` degrees of one before it (see [`peaks`]).
    pub fn outliers(&self, distance: f64, level: f64, most: usize) -> Vec<Outlier> {
        let of = &self.deviation;
        let outlier = |peak: Peak| Outlier {
            peak,
            value: self.data[peak.pixel],
            mean: of.mean[peak.pixel],
            std: of.std[peak.pixel],
            local_percentile: of.local_percentile[peak.pixel],
            global_percentile: of.global_percentile[peak.pixel],
            simulations: of.count[peak.pixel] as usize,
        };
        peaks(self.grid, &of.sigma, distance, level, most).into_iter().map(outlier).collect()
    }
}

#[cfg(test)]
mod tests {
    use ndarray::{Array1, Array2, ArrayView1, s};

    use super::*;

    /// Data and simulations of Nside 1, one a row.
    fn maps() -> Array2<f64> {
        Array2::from_shape_fn((5, 12), |(map, pixel)| ((3 * map + 5 * pixel) % 7) as f64 + 0.1 * map as f64)
    }

    fn compared<'a>(maps: &[ArrayView1<'a, f64>]) -> Result<Outcome<'a>, ComparisonError> {
        let mut comparison = Comparison::new(maps[0])?;
        maps[1..].iter().try_for_each(|map| comparison.first(*map))?;
        maps[1..].iter().try_for_each(|map| comparison.second(*map))?;
        comparison.finish()
    }

    #[test]
    fn views_of_any_stride_give_the_same() {
        let maps = maps();
        let rows: Vec<_> = maps.rows().into_iter().collect();
        // The same maps with other values between theirs.
        let mut wide = Array2::from_elem((5, 24), f64::NAN);
        wide.slice_mut(s![.., ..;2]).assign(&maps);
        let strided: Vec<_> = wide.rows().into_iter().map(|row| row.slice_move(s![..;2])).collect();
        assert!(strided[0].to_slice().is_none());
        let [one, other] = [rows, strided].map(|maps| compared(&maps).unwrap());
        assert_eq!((one.largest, one.rank), (other.largest, other.rank));
        assert_eq!(one.outliers(1.0, 0.0, 20), other.outliers(1.0, 0.0, 20));
        assert_eq!(one.deviation.mean, other.deviation.mean);
    }

    #[test]
    fn unseen_is_masked() {
        let mut maps = maps();
        let without = |maps: &Array2<f64>| {
            let outcome = compared(&maps.rows().into_iter().collect::<Vec<_>>()).unwrap();
            (outcome.rank, outcome.deviation.mean.to_vec(), outcome.deviation.count.to_vec())
        };
        (maps[[0, 2]], maps[[3, 5]]) = (f64::NAN, f64::NAN);
        let expected = without(&maps);
        (maps[[0, 2]], maps[[3, 5]]) = (longan_grid::UNSEEN, f64::INFINITY);
        assert_eq!(without(&maps), expected);
        assert_eq!(expected.2[5], 3.0);
    }

    #[test]
    fn passes_have_their_order() {
        let maps = maps();
        let rows: Vec<_> = maps.rows().into_iter().collect();
        let mut comparison = Comparison::new(rows[0]).unwrap();
        assert_eq!(comparison.second(rows[1]), Err(ComparisonError::TooFew { found: 0 }));
        comparison.first(rows[1]).unwrap();
        assert_eq!(comparison.second(rows[1]), Err(ComparisonError::TooFew { found: 1 }));
        assert_eq!(comparison.clone().finish().unwrap_err(), ComparisonError::TooFew { found: 1 });
        comparison.first(rows[2]).unwrap();
        assert_eq!(comparison.clone().finish().unwrap_err(), ComparisonError::Passes { first: 2, second: 0 });
        comparison.second(rows[1]).unwrap();
        assert_eq!(comparison.first(rows[3]), Err(ComparisonError::SecondBegan));
        assert_eq!(comparison.clone().finish().unwrap_err(), ComparisonError::Passes { first: 2, second: 1 });
        let other = Array1::zeros(48);
        assert_eq!(comparison.second(&other), Err(ComparisonError::Pixels { found: 48, expected: 12 }));
        comparison.second(rows[2]).unwrap();
        assert_eq!(comparison.second(rows[3]), Err(ComparisonError::Passes { first: 2, second: 3 }));
        assert_eq!(comparison.simulations(), 2);
        assert!(comparison.finish().is_ok());
        let none = Comparison::new(&vec![0.0; 13]).unwrap_err();
        assert_eq!(none, longan_grid::Error::PixelCount { pixels: 13 }.into());
    }
}
