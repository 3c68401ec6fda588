//! Counts and moments of simulations about data, simulation by simulation.
//!
//! Local percentiles count the simulations below the data at the same pixel, global ones the pixels of all simulations
//! below it: exact whole numbers, of which an equal value counts one half. NaN is a masked pixel, and left out.

use std::borrow::Cow;

use ndarray::Array1;
use rayon::prelude::*;

use super::ComparisonError;
use crate::quantile::percent;

/// Below this share of a sum of squares, the rest of it without one of its terms is rounding, and so no scatter.
const ROUNDING: f64 = 1e-12;

/// Largest deviations this close to each other, as a share, are equal: they are computed in different ways.
const EQUAL: f64 = 1e-9;

/// The simulated values at one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    /// Simulations that are not masked here.
    count: u32,
    /// Twice the number below the data; once more for each equal to it.
    twice_below: u64,
    /// The value of the first, which all are taken relative to: constants have no scatter, however large they are.
    origin: f64,
    /// Mean, relative to the origin.
    mean: f64,
    /// Sum of the squared distances to the mean.
    squares: f64,
}

/// Data and the simulations seen so far.
#[derive(Clone, Debug)]
pub(super) struct Ensemble<'a> {
    data: Cow<'a, [f64]>,
    places: Vec<Place>,
    /// The data's values, ascending, each once.
    levels: Vec<f64>,
    /// Numbers of simulated pixels below the first level, at it, between it and the second, and so on.
    histogram: Vec<u64>,
}

/// The deviation of data from simulations: one value for each pixel in RING order, NaN where undefined.
#[derive(Clone, Debug)]
pub struct Deviation {
    /// Mean of the simulations.
    pub mean: Array1<f64>,
    /// Their standard deviation, with n − 1 in the denominator; of at least two.
    pub std: Array1<f64>,
    /// The data less the mean, in standard deviations; undefined where these are 0.
    pub sigma: Array1<f64>,
    /// The share of simulations with a lower value at this pixel, from 0 to 100.
    pub local_percentile: Array1<f64>,
    /// The share of all simulated pixels with a lower value, from 0 to 100.
    pub global_percentile: Array1<f64>,
    /// The number of simulations behind each pixel, masked ones left out.
    pub count: Array1<f64>,
}

impl Place {
    /// With one more value (Welford's update).
    fn with(self, value: f64) -> Self {
        let origin = if self.count == 0 { value } else { self.origin };
        let count = self.count + 1;
        let step = value - origin - self.mean;
        let mean = self.mean + step / f64::from(count);
        Place { count, origin, mean, squares: self.squares + step * (value - origin - mean), ..self }
    }

    /// The standard deviation of at least two values.
    fn std(&self) -> f64 {
        if self.count < 2 { f64::NAN } else { (self.squares / f64::from(self.count - 1)).sqrt() }
    }

    /// How many standard deviations a value lies above the mean; NaN where there is no scatter.
    fn sigma(&self, value: f64) -> f64 {
        let std = self.std();
        if std > 0.0 { (value - self.origin - self.mean) / std } else { f64::NAN }
    }

    /// The same for a value that is itself among them, from all others.
    fn sigma_left_out(&self, value: f64) -> f64 {
        if self.count < 3 {
            return f64::NAN;
        }
        let others = f64::from(self.count - 1);
        let distance = value - self.origin - self.mean;
        // Without the value the mean is farther off by 1/others of the distance, and the squares are fewer by this.
        let farther = distance * (1.0 + 1.0 / others);
        let squares = self.squares - distance * farther;
        if squares > ROUNDING * self.squares { farther / (squares / (others - 1.0)).sqrt() } else { f64::NAN }
    }
}

impl<'a> Ensemble<'a> {
    /// Data without simulations yet: values in RING order, NaN where masked.
    pub(super) fn new(data: impl Into<Cow<'a, [f64]>>) -> Self {
        let data = data.into();
        let mut levels: Vec<f64> = data.iter().copied().filter(|v| !v.is_nan()).collect();
        levels.par_sort_unstable_by(f64::total_cmp);
        levels.dedup();
        let histogram = vec![0; 2 * levels.len() + 1];
        Ensemble { places: vec![Place::default(); data.len()], data, levels, histogram }
    }

    /// Takes a simulation into account: values in RING order, NaN where masked.
    ///
    /// # Errors
    /// [`ComparisonError::Pixels`].
    pub(super) fn add(&mut self, simulation: &[f64]) -> Result<(), ComparisonError> {
        self.check(simulation)?;
        let places = self.places.par_iter_mut().zip(&*self.data).zip(simulation);
        places.filter(|(_, value)| !value.is_nan()).for_each(|((place, data), value)| {
            *place = place.with(*value);
            place.twice_below += if value < data { 2 } else { u64::from(value == data) };
        });
        let mut sorted: Vec<f64> = simulation.iter().copied().filter(|v| !v.is_nan()).collect();
        sorted.par_sort_unstable_by(f64::total_cmp);
        let mut slot = 0;
        for value in sorted {
            // Slot 2k + 1 is level k itself, the one before it all between it and the level below.
            while self.levels.get(slot / 2).is_some_and(|level| *level < value || slot % 2 == 1 && *level != value) {
                slot += 2 - slot % 2;
            }
            slot += usize::from(slot % 2 == 0 && self.levels.get(slot / 2) == Some(&value));
            self.histogram[slot] += 1;
        }
        Ok(())
    }

    fn check(&self, simulation: &[f64]) -> Result<(), ComparisonError> {
        let (found, expected) = (simulation.len(), self.data.len());
        if found == expected { Ok(()) } else { Err(ComparisonError::Pixels { found, expected }) }
    }

    /// The data.
    pub(super) fn into_data(self) -> Cow<'a, [f64]> {
        self.data
    }

    /// How the data lies among the simulations. Where it is masked, all but mean, scatter and count is undefined.
    pub(super) fn deviation(&self) -> Deviation {
        let column = |of: &(dyn Fn(&Place, f64) -> f64 + Sync)| -> Array1<f64> {
            let values: Vec<f64> =
                self.places.par_iter().zip(&*self.data).map(|(place, data)| of(place, *data)).collect();
            values.into()
        };
        let defined = |x: f64, yes: bool| if yes { x } else { f64::NAN };
        let local = |p: &Place, data: f64| {
            let share = percent(u128::from(p.twice_below), u64::from(p.count));
            defined(share, !data.is_nan() && p.count > 0)
        };
        let percentiles = self.percentiles();
        let global = |_: &Place, data: f64| {
            let level = self.levels.partition_point(|level| *level < data);
            percentiles.get(level).copied().filter(|_| !data.is_nan()).unwrap_or(f64::NAN)
        };
        Deviation {
            mean: column(&|p, _| defined(p.origin + p.mean, p.count > 0)),
            std: column(&|p, _| p.std()),
            sigma: column(&|p, data| p.sigma(data)),
            local_percentile: column(&local),
            global_percentile: column(&global),
            count: column(&|p, _| f64::from(p.count)),
        }
    }

    /// The global percentile of each level; NaN without simulated pixels.
    fn percentiles(&self) -> Vec<f64> {
        let all: u64 = self.histogram.iter().sum();
        let mut below = 0;
        let percentile = |slots: &[u64]| {
            below += slots[0];
            let twice = 2 * u128::from(below) + u128::from(slots[1]);
            below += slots[1];
            percent(twice, all)
        };
        self.histogram.chunks_exact(2).map(percentile).collect()
    }

    /// The largest |σ| of the data over all pixels; nothing where it is undefined at all of them.
    pub(super) fn largest(&self) -> Option<f64> {
        largest(self.places.par_iter().zip(&*self.data).map(|(place, data)| place.sigma(*data)))
    }

    /// The largest |σ| of a simulation that was [`add`](Self::add)ed before, over all of its pixels, from the mean and
    /// scatter of all other simulations and the data: what [`largest`](Self::largest) would be were this one the data.
    ///
    /// # Errors
    /// [`ComparisonError::Pixels`].
    pub(super) fn largest_left_out(&self, simulation: &[f64]) -> Result<Option<f64>, ComparisonError> {
        self.check(simulation)?;
        let sigma = |((place, data), value): ((&Place, &f64), &f64)| {
            let all = if data.is_nan() { *place } else { place.with(*data) };
            all.sigma_left_out(*value)
        };
        Ok(largest(self.places.par_iter().zip(&*self.data).zip(simulation).map(sigma)))
    }
}

/// The largest distance from 0 of numbers of which some are NaN.
fn largest(sigmas: impl ParallelIterator<Item = f64>) -> Option<f64> {
    Some(sigmas.map(f64::abs).reduce(|| f64::NAN, f64::max)).filter(|x| !x.is_nan())
}

/// The place of the data's largest deviation among those of the simulations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rank {
    /// Simulations whose largest deviation is as large as that of the data.
    pub as_large: usize,
    /// All simulations.
    pub simulations: usize,
}

impl Rank {
    /// The rank among simulations' largest deviations; one without any has none as large.
    pub fn new(data: f64, simulations: impl IntoIterator<Item = Option<f64>>) -> Self {
        let mut rank = Rank { as_large: 0, simulations: 0 };
        for largest in simulations {
            rank.simulations += 1;
            rank.as_large += usize::from(largest.is_some_and(|largest| largest >= data * (1.0 - EQUAL)));
        }
        rank
    }

    /// The probability that one of as many maps, all of the same kind, deviates at least as much anywhere:
    /// (1 + #{as large})/(1 + #{simulations}).
    pub fn p_value(&self) -> f64 {
        (1 + self.as_large) as f64 / (1 + self.simulations) as f64
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Maps of few different values, some of them masked.
    fn ensemble(maps: usize, pixels: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut value = |_| match rng.random_range(0..10) {
            0 => f64::NAN,
            n => f64::from(n % 5) * 0.1 - 0.2,
        };
        (0..maps).map(|_| (0..pixels).map(&mut value).collect()).collect()
    }

    fn of(maps: &[Vec<f64>]) -> Ensemble<'static> {
        let mut ensemble = Ensemble::new(maps[0].clone());
        maps[1..].iter().for_each(|map| ensemble.add(map).unwrap());
        ensemble
    }

    #[track_caller]
    fn assert_near(found: f64, expected: f64, what: &str) {
        let same = found.is_nan() && expected.is_nan() || (found - expected).abs() < 1e-9 * (1.0 + expected.abs());
        assert!(same, "{what}: {found} instead of {expected}");
    }

    /// Mean and standard deviation of the numbers, two passes.
    fn moments(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let constant = values.iter().all(|v| *v == values[0]);
        (
            mean,
            if values.len() < 2 {
                f64::NAN
            } else if constant {
                0.0
            } else {
                (squares / (n - 1.0)).sqrt()
            },
        )
    }

    /// The share of values below, ties one half.
    fn percentile(value: f64, of: &[f64]) -> f64 {
        let count = |test: &dyn Fn(f64) -> bool| of.iter().filter(|x| test(**x)).count() as f64;
        if value.is_nan() || of.is_empty() {
            return f64::NAN;
        }
        100.0 * (count(&|x| x < value) + 0.5 * count(&|x| x == value)) / of.len() as f64
    }

    fn unmasked(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
        values.into_iter().filter(|v| !v.is_nan()).collect()
    }

    #[test]
    fn counts_and_moments_are_those_of_a_direct_computation() {
        for (maps, pixels, seed) in [(2, 5, 1), (3, 40, 2), (4, 100, 3), (30, 50, 4)] {
            let maps = ensemble(maps, pixels, seed);
            let found = of(&maps).deviation();
            let all = unmasked(maps[1..].iter().flatten().copied());
            for p in 0..pixels {
                let (data, here) = (maps[0][p], unmasked(maps[1..].iter().map(|map| map[p])));
                let (mean, std) = moments(&here);
                let sigma = if std > 0.0 { (data - mean) / std } else { f64::NAN };
                let about = format!("{pixels} pixels, pixel {p}");
                assert_near(found.mean[p], mean, &about);
                assert_near(found.std[p], std, &about);
                assert_near(found.sigma[p], sigma, &about);
                assert_eq!(found.count[p], here.len() as f64);
                assert_near(found.local_percentile[p], percentile(data, &here), &about);
                assert_near(found.global_percentile[p], percentile(data, &all), &about);
            }
        }
    }

    #[test]
    fn each_map_is_compared_with_all_others_alike() {
        for seed in 0..5 {
            let maps = ensemble(6, 30, seed);
            let with_data = of(&maps);
            for i in 0..maps.len() {
                // The same with this map in the place of the data.
                let mut turned = maps.clone();
                turned.swap(0, i);
                let expected = of(&turned).largest().unwrap_or(f64::NAN);
                let found = if i == 0 { with_data.largest() } else { with_data.largest_left_out(&maps[i]).unwrap() };
                assert_near(found.unwrap_or(f64::NAN), expected, &format!("map {i}"));
            }
        }
    }

    #[test]
    fn constants_have_no_scatter_however_large() {
        for offset in [0.0, 1e9] {
            let maps = [vec![offset + 1.0], vec![offset], vec![offset], vec![offset + 0.5], vec![offset]];
            let found = of(&maps[..3]);
            assert!(found.deviation().std[0] == 0.0 && found.deviation().sigma[0].is_nan());
            assert_eq!(found.largest(), None);
            // The same of a simulation that alone differs.
            let alone = [maps[1].clone(), maps[2].clone(), maps[3].clone(), maps[4].clone()];
            assert_eq!(of(&alone).largest_left_out(&alone[2]).unwrap(), None);
            assert!(of(&alone).largest_left_out(&alone[1]).unwrap().is_some());
        }
    }

    #[test]
    fn what_is_masked_everywhere_is_undefined() {
        let nan = f64::NAN;
        let found = of(&[vec![1.0, nan, nan], vec![nan, 1.0, nan], vec![nan, 2.0, nan]]).deviation();
        assert!(found.mean[0].is_nan() && found.local_percentile[0].is_nan() && found.count[0] == 0.0);
        assert_eq!(found.global_percentile[0], 25.0);
        assert!(found.mean[1] == 1.5 && found.sigma[1].is_nan() && found.local_percentile[1].is_nan());
        assert!(found.global_percentile[1].is_nan() && found.count[1] == 2.0);
        assert!(found.mean[2].is_nan() && found.global_percentile[2].is_nan());
        let empty = of(&[vec![1.0], vec![nan]]);
        assert!(empty.deviation().global_percentile[0].is_nan() && empty.largest().is_none());
        assert_eq!(Ensemble::new(vec![1.0]).add(&[1.0, 2.0]), Err(ComparisonError::Pixels { found: 2, expected: 1 }));
    }

    #[test]
    fn p_values_are_ranks() {
        let of = |data, simulations: &[f64]| Rank::new(data, simulations.iter().map(|x| Some(*x))).p_value();
        assert_eq!(of(3.0, &[1.0, 2.0, 4.0]), 0.5);
        assert_eq!(of(5.0, &[1.0, 2.0, 4.0]), 0.25);
        assert_eq!(of(1.0, &[1.0, 2.0, 4.0]), 1.0);
        assert_eq!(Rank::new(1.0, [None, Some(0.5)]).p_value(), 1.0 / 3.0);
    }

    /// Distance of a sample from the uniform distribution on these many equal steps of 0 to 1: Pearson's χ².
    fn chi_square(sample: &[f64], steps: usize) -> f64 {
        let mut counts = vec![0.0; steps];
        sample.iter().for_each(|x| counts[((x * steps as f64) as usize).min(steps - 1)] += 1.0);
        let expected = sample.len() as f64 / steps as f64;
        counts.iter().map(|n| (n - expected).powi(2) / expected).sum()
    }

    /// χ² with 9 degrees of freedom is above this once in 100 000 times.
    const CHI_SQUARE_9: f64 = 39.34;

    #[test]
    fn percentiles_and_p_values_are_uniform_when_the_data_is_one_more_simulation() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut local, mut global, mut p_values) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..5000 {
            // 9 simulations: 10 ranks. Pixels of a map resemble each other, as do those of moving windows, and scatter
            // by different amounts.
            let maps: Vec<Vec<f64>> = (0..10)
                .map(|_| {
                    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
                    let common = normal();
                    (1..=6).map(|p| f64::from(p) * (normal() + 0.5 * common)).collect()
                })
                .collect();
            let ensemble = of(&maps);
            let found = ensemble.deviation();
            // 0, 1/9, … 1, as likely as each other, and each to a step of its own.
            local.push((found.local_percentile[2] / 100.0 * 9.0 + 0.5) / 10.0);
            global.push(found.global_percentile[2]);
            let simulations = maps[1..].iter().map(|map| ensemble.largest_left_out(map).unwrap());
            let p = Rank::new(ensemble.largest().unwrap(), simulations).p_value();
            p_values.push(p - 0.05);
        }
        assert!(chi_square(&local, 10) < CHI_SQUARE_9, "{}", chi_square(&local, 10));
        assert!(chi_square(&p_values, 10) < CHI_SQUARE_9, "{}", chi_square(&p_values, 10));
        // Of one pixel the global percentile need not be uniform, but its mean is 50: here within 5 standard errors.
        let (mean, std) = moments(&global);
        assert!((mean - 50.0).abs() < 5.0 * std / (global.len() as f64).sqrt(), "{mean}");
    }

    #[test]
    fn ties_keep_percentiles_about_50() {
        // Values 0 and 1 only, so that most are ties; the mean percentile is 50 within 5 standard errors.
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let (mut local, mut global) = (Vec::new(), Vec::new());
        for _ in 0..5000 {
            let maps: Vec<Vec<f64>> =
                (0..8).map(|_| (0..4).map(|_| f64::from(rng.random_range(0..4) / 3)).collect()).collect();
            let found = of(&maps).deviation();
            local.push(found.local_percentile[0]);
            global.push(found.global_percentile[0]);
        }
        for sample in [local, global] {
            let (mean, std) = moments(&sample);
            assert!((mean - 50.0).abs() < 5.0 * std / (sample.len() as f64).sqrt(), "{mean}");
        }
    }
}
