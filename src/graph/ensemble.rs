//! Curves of simulations, and the place of data among them.

use ndarray::{Array2, Zip};

use super::curves::Curves;
use super::error::GraphError;
use crate::quantile::{percentile, quantile};

/// The quantiles between which 68 % of simulations lie.
pub const BAND_68: [f64; 2] = [0.16, 0.84];

/// The quantiles between which 95 % of simulations lie. With fewer than 40 simulations these are near the extremes.
pub const BAND_95: [f64; 2] = [0.025, 0.975];

/// The curves of simulations, all of one graph. All arrays are ordinate × threshold; a value that is undefined in a
/// simulation is left out there.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// The defined values, ascending.
    values: Array2<Vec<f64>>,
    /// The names of the ordinates.
    names: Vec<String>,
    simulations: usize,
}

impl Ensemble {
    pub(super) fn new(names: &[String], thresholds: usize) -> Self {
        let values = Array2::from_elem((names.len(), thresholds), Vec::new());
        Ensemble { values, names: names.to_vec(), simulations: 0 }
    }

    /// Adds the curves of a simulation.
    ///
    /// # Errors
    /// [`GraphError::Different`] where they are of another graph.
    pub fn add(&mut self, curves: &Curves) -> Result<(), GraphError> {
        self.check(curves)?;
        self.simulations += 1;
        Zip::from(&mut self.values).and(&curves.values).for_each(|all, &value| {
            if !value.is_nan() {
                let place = all.partition_point(|other| other.total_cmp(&value).is_lt());
                all.insert(place, value);
            }
        });
        Ok(())
    }

    /// The number of simulations.
    pub fn simulations(&self) -> usize {
        self.simulations
    }

    /// The number of simulations in which each value is defined.
    pub fn counts(&self) -> Array2<usize> {
        self.values.map(Vec::len)
    }

    /// The median.
    pub fn median(&self) -> Array2<f64> {
        self.quantile(0.5)
    }

    /// Both ends of a band, such as [`BAND_68`] or [`BAND_95`].
    pub fn band(&self, shares: [f64; 2]) -> [Array2<f64>; 2] {
        shares.map(|share| self.quantile(share))
    }

    /// The [`quantile`] of a share, from 0 to 1; NaN where no simulation is defined.
    pub fn quantile(&self, share: f64) -> Array2<f64> {
        self.values.map(|all| quantile(all, share))
    }

    /// The [`percentile`] of the values of curves, such as those of data, among the simulations, from 0 to 100; NaN where
    /// either is undefined.
    ///
    /// # Errors
    /// [`GraphError::Different`].
    pub fn percentile(&self, curves: &Curves) -> Result<Array2<f64>, GraphError> {
        self.check(curves)?;
        Ok(Zip::from(&self.values).and(&curves.values).map_collect(|all, &value| percentile(all, value)))
    }

    /// Whether the values of curves lie outside a band, such as [`BAND_95`], by their percentile; undefined ones do not.
    ///
    /// # Errors
    /// [`GraphError::Different`].
    pub fn outside(&self, curves: &Curves, [low, high]: [f64; 2]) -> Result<Array2<bool>, GraphError> {
        Ok(self.percentile(curves)?.map(|percent| *percent < 100.0 * low || *percent > 100.0 * high))
    }

    fn check(&self, curves: &Curves) -> Result<(), GraphError> {
        let names: Vec<String> = curves.names().collect();
        if names == self.names && curves.values.dim() == self.values.dim() {
            return Ok(());
        }
        let described =
            |names: &[String], thresholds: usize| format!("{} at {thresholds} thresholds", names.join(", "));
        Err(GraphError::Different {
            found: described(&names, curves.thresholds.len()),
            expected: described(&self.names, self.values.ncols()),
        })
    }
}

#[cfg(test)]
mod tests {
    use longan_grid::Healpix;

    use super::super::Graph;
    use super::*;
    use crate::simulate::Waves;
    use crate::window::go_on;

    #[test]
    fn quantiles_and_percentiles_are_those_of_the_values() {
        let graph = Graph::named(["w1", "evq"]).unwrap();
        let curves =
            |seed| graph.curves(&Waves::new(25.0, seed).unwrap().map(Healpix::new(8).unwrap()), go_on).unwrap();
        let all: Vec<Curves> = (0..12).map(curves).collect();
        let mut ensemble = graph.ensemble();
        all[1..].iter().for_each(|curves| ensemble.add(curves).unwrap());
        assert_eq!(ensemble.simulations(), 11);
        let (median, [low, high]) = (ensemble.median(), ensemble.band(BAND_68));
        let (percent, outside) = (ensemble.percentile(&all[0]).unwrap(), ensemble.outside(&all[0], BAND_95).unwrap());
        for ((row, t), count) in ensemble.counts().indexed_iter() {
            let mut values: Vec<f64> =
                all[1..].iter().map(|curves| curves.values[[row, t]]).filter(|v| !v.is_nan()).collect();
            values.sort_by(f64::total_cmp);
            assert_eq!(*count, values.len());
            let same = |a: f64, b: f64| a == b || a.is_nan() && b.is_nan();
            assert!(same(median[[row, t]], quantile(&values, 0.5)));
            assert!(same(low[[row, t]], quantile(&values, 0.16)) && same(high[[row, t]], quantile(&values, 0.84)));
            assert!(same(percent[[row, t]], percentile(&values, all[0].values[[row, t]])));
            assert_eq!(outside[[row, t]], percent[[row, t]] < 2.5 || percent[[row, t]] > 97.5);
        }
    }

    #[test]
    fn curves_of_another_graph_are_refused() {
        let map = Waves::new(25.0, 1).unwrap().map(Healpix::new(8).unwrap());
        let [graph, other] = ["w1", "w0"].map(|name| Graph::named([name]).unwrap());
        let [one, other] = [&graph, &other].map(|graph| graph.curves(&map, go_on).unwrap());
        let mut ensemble = graph.ensemble();
        assert!(ensemble.percentile(&one).unwrap().iter().all(|percent| percent.is_nan()));
        ensemble.add(&one).unwrap();
        assert!(matches!(ensemble.add(&other), Err(GraphError::Different { .. })));
        assert!(ensemble.percentile(&other).is_err() && ensemble.simulations() == 1);
    }
}
