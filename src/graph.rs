//! Curves of measures against threshold, of a map and of simulations beside it.
//!
//! A [`Graph`] states what is measured: [`Ordinate`]s, which are densities of the body as a whole or means of measures in
//! moving windows, at the thresholds and in the windows of an [`Analysis`], over the sphere or a [`Region`]. It gives the
//! [`Curves`] of each map; an [`Ensemble`] of curves has median, bands and percentiles. Pictures, tables and files are
//! left to others.
//!
//! Data beside simulations, with bands:
//!
//! ```
//! use longan::graph::{BAND_95, Graph};
//! use longan::{Healpix, go_on, simulate::Waves};
//!
//! let sky = |seed| Ok::<_, Box<dyn std::error::Error>>(Waves::new(20.0, seed)?.map(Healpix::new(16)?));
//! let graph = Graph::named(["w1", "euler", "evq"])?;
//! let data = graph.curves(&sky(0)?, go_on)?;
//! let mut ensemble = graph.ensemble();
//! for seed in 1..=9 {
//!     ensemble.add(&graph.curves(&sky(seed)?, go_on)?)?;
//! }
//! let (median, [low, high]) = (ensemble.median(), ensemble.band(BAND_95)); // quantity × threshold
//! let percentile = ensemble.percentile(&data)?;
//! # assert_eq!((median.dim(), data.get("evq").unwrap().values.len()), ((3, 33), 33));
//! # assert!(low.iter().zip(&median).zip(&high).all(|((low, m), high)| low <= m && m <= high || m.is_nan()));
//! # assert!(percentile.iter().all(|p| p.is_nan() || (0.0..=100.0).contains(p)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod curves;
mod ensemble;
mod error;
mod ordinate;

use std::ops::ControlFlow;

use longan_grid::{Healpix, Map};
use longan_measures::Catalogue;
use ndarray::{Array1, Array2};

pub use curves::{Curve, Curves};
pub use ensemble::{BAND_68, BAND_95, Ensemble};
pub use error::GraphError;
pub use ordinate::{Density, Ordinate};

use crate::analysis::{Analysis, ThresholdUnit};
use crate::gaussian::Gaussian;
use crate::minkowski_maps::Block;
use crate::region::Region;
use crate::statistics::Statistics;
use crate::thresholds::Thresholds;
use crate::totals::{Regional, Totals};

/// The thresholds of a graph where none are given: 33 from −4 to 4, to be taken in standard deviations.
pub fn standard_thresholds() -> Thresholds {
    Thresholds::new((-16..=16).map(|i| f64::from(i) / 4.0).collect()).expect("finite and distinct thresholds")
}

/// A graph: what is measured of each map, and where.
#[derive(Clone, Debug)]
pub struct Graph {
    ordinates: Vec<Ordinate>,
    /// Thresholds, the body's side, and the one window of the measures that are means over windows.
    pub analysis: Analysis,
    /// The part of the sphere that counts. Of densities these are the shares of the pixels, of means the windows, whose
    /// centres lie there; thresholds in standard deviations are those of the whole map.
    pub region: Option<Region>,
    /// Whether densities come with the expectation of an isotropic Gaussian field of the map's own σ0 and σ1.
    pub gaussian: bool,
}

/// A graph without ordinates yet, over the sphere, at the [`standard_thresholds`].
impl Default for Graph {
    fn default() -> Self {
        let analysis = Analysis { thresholds: standard_thresholds(), ..Analysis::default() };
        Graph { ordinates: Vec::new(), analysis, region: None, gaussian: false }
    }
}

impl Graph {
    /// A graph of these ordinates over the sphere, at the [`standard_thresholds`].
    ///
    /// # Errors
    /// Those of [`add`](Self::add).
    pub fn new(ordinates: impl IntoIterator<Item = Ordinate>) -> Result<Self, GraphError> {
        let mut graph = Graph::default();
        ordinates.into_iter().try_for_each(|ordinate| graph.add(ordinate))?;
        Ok(graph)
    }

    /// A graph of densities (`w0`, `w1`, `w2`, `euler`), built-in measures and formulas by their names, as in
    /// [`Ordinate::named`].
    ///
    /// # Errors
    /// [`GraphError::Unknown`], and those of [`add`](Self::add).
    pub fn named<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self, GraphError> {
        let catalogue = Catalogue::default();
        let ordinates = names.into_iter().map(|name| Ordinate::named(name, &catalogue));
        Graph::new(ordinates.collect::<Result<Vec<_>, _>>()?)
    }

    /// Adds an ordinate.
    ///
    /// # Errors
    /// [`GraphError::Direction`], [`GraphError::Repeated`].
    pub fn add(&mut self, ordinate: Ordinate) -> Result<(), GraphError> {
        ordinate.check()?;
        let name = ordinate.name();
        if self.ordinates.iter().any(|other| other.name().eq_ignore_ascii_case(&name)) {
            return Err(GraphError::Repeated { name });
        }
        self.ordinates.push(ordinate);
        Ok(())
    }

    /// The ordinates, each of which makes a row of [`Curves::values`].
    pub fn ordinates(&self) -> &[Ordinate] {
        &self.ordinates
    }

    /// An ensemble without simulations yet, for curves of this graph.
    pub fn ensemble(&self) -> Ensemble {
        let names: Vec<String> = self.ordinates.iter().map(Ordinate::name).collect();
        Ensemble::new(&names, self.analysis.thresholds.values().len())
    }

    /// Checks all that can be checked without a map's values; the grid of the windows' centres.
    ///
    /// # Errors
    /// [`GraphError::Nothing`], [`GraphError::Windows`], [`GraphError::NoDensity`], [`GraphError::Analysis`], and
    /// [`GraphError::NoWindow`] where the region is too small for the grid.
    pub fn check(&self, map: Healpix) -> Result<Healpix, GraphError> {
        if self.ordinates.is_empty() {
            return Err(GraphError::Nothing);
        }
        if self.analysis.windows.len() > 1 {
            return Err(GraphError::Windows { count: self.analysis.windows.len() });
        }
        if self.gaussian && !self.has_densities() {
            return Err(GraphError::NoDensity);
        }
        let grid = self.analysis.check(map)?;
        let has_means = self.ordinates.iter().any(|ordinate| ordinate.measure().is_some());
        match &self.region {
            Some(region) if has_means && region.disc().pixels(grid).next().is_none() => Err(GraphError::NoWindow),
            _ => Ok(grid),
        }
    }

    /// The curves of a map: one pass over it for all densities, and one for all windows.
    ///
    /// `progress` is told the share done, from 0 to 1, and says whether to go on. The result does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// Those of [`check`](Self::check); [`GraphError::Masked`], [`GraphError::NoPixel`] and [`GraphError::NoGaussian`].
    pub fn curves(&self, map: &Map, progress: impl FnMut(f64) -> ControlFlow<()>) -> Result<Curves, GraphError> {
        let grid = self.check(map.grid())?;
        let (thresholds, of_map) = self.analysis.thresholds_of(map)?;
        let gaussian = self.gaussian.then(|| Gaussian::of(map).ok_or(GraphError::NoGaussian)).transpose()?;
        let (area, densities) = match self.has_densities() {
            true => self.densities(map)?,
            false => (None, Vec::new()),
        };
        let mut curves = Curves {
            ordinates: self.ordinates.clone(),
            sigmas: self.sigmas(&thresholds, of_map),
            values: self.rows(thresholds.values().len(), f64::NAN),
            windows: self.rows(thresholds.values().len(), 0),
            expected: gaussian.map(|_| self.rows(thresholds.values().len(), f64::NAN)),
            thresholds: Array1::from_vec(thresholds.values().to_vec()),
            statistics: of_map,
            area,
            gaussian,
        };
        for (row, ordinate) in self.ordinates.iter().enumerate() {
            let Ordinate::Density(density) = ordinate else { continue };
            curves.values.row_mut(row).iter_mut().zip(&densities).for_each(|(value, t)| *value = density.of(t));
            if let (Some(gaussian), Some(expected)) = (&gaussian, &mut curves.expected) {
                for (value, threshold) in expected.row_mut(row).iter_mut().zip(thresholds.values()) {
                    *value = density.of(&gaussian.per_area(*threshold, self.analysis.body));
                }
            }
        }
        let (rows, measures): (Vec<usize>, Vec<_>) = (self.ordinates.iter().enumerate())
            .filter_map(|(row, ordinate)| Some((row, ordinate.measure()?.clone())))
            .unzip();
        if !measures.is_empty() {
            let analysis = Analysis { by_threshold: true, ..self.analysis.clone() };
            let maps = analysis.minkowski_maps(map, &measures, progress)?;
            self.means(&maps.blocks, grid, &rows, &mut curves);
        }
        Ok(curves)
    }

    /// Fills these rows with means over windows.
    fn means(&self, blocks: &[Block], grid: Healpix, rows: &[usize], curves: &mut Curves) {
        let centres = match &self.region {
            Some(region) => region.pixels(grid),
            None => vec![true; grid.pixels()],
        };
        for (threshold, block) in blocks.iter().enumerate() {
            for (measure, &row) in rows.iter().enumerate() {
                let (mean, windows) = block.mean(measure, &centres);
                curves.values[[row, threshold]] = mean;
                curves.windows[[row, threshold]] = windows;
            }
        }
    }

    /// The unmasked area in steradian, and for each threshold W0, W1 and W2 per area, W2 made up for the edges beside
    /// masked cells.
    fn densities(&self, map: &Map) -> Result<(Option<f64>, Vec<Totals>), GraphError> {
        let (_, regional) = self.analysis.totals_within(map, self.region.as_ref())?;
        let Regional { unmasked, masked, .. } = regional;
        if unmasked + masked <= 0.0 {
            return Err(GraphError::NoPixel);
        }
        if unmasked <= 0.0 {
            return Err(GraphError::Masked);
        }
        Ok((Some(unmasked), regional.made_up().iter().map(|totals| totals.per_area(unmasked)).collect()))
    }

    /// Thresholds in standard deviations, as they were given if so.
    fn sigmas(&self, thresholds: &Thresholds, Statistics { mean, sigma, .. }: Statistics) -> Array1<f64> {
        if self.analysis.threshold_unit == ThresholdUnit::Sigma {
            return Array1::from_vec(self.analysis.thresholds.values().to_vec());
        }
        let in_sigma = |threshold: &f64| threshold / sigma - mean / sigma;
        thresholds.values().iter().map(in_sigma).map(|nu| if nu.is_finite() { nu } else { f64::NAN }).collect()
    }

    fn has_densities(&self) -> bool {
        self.ordinates.iter().any(|ordinate| matches!(ordinate, Ordinate::Density(_)))
    }

    /// A row for each ordinate.
    fn rows<T: Clone>(&self, thresholds: usize, value: T) -> Array2<T> {
        Array2::from_elem((self.ordinates.len(), thresholds), value)
    }
}

#[cfg(test)]
mod tests {
    use longan_measures::find;

    use super::*;
    use crate::simulate::Waves;
    use crate::window::go_on;

    fn sky(seed: u64) -> Map {
        Waves::new(20.0, seed).unwrap().map(Healpix::new(8).unwrap())
    }

    #[test]
    fn curves_are_the_totals_and_the_means_of_windows() {
        let mut graph = Graph::named(["euler", "evq", "w0", "longan:w0", "x = w1/2"]).unwrap();
        graph.region = Some("30,20,50".parse().unwrap());
        graph.gaussian = true;
        let map = sky(3);
        let curves = graph.curves(&map, go_on).unwrap();
        assert_eq!(curves.names().collect::<Vec<_>>(), ["euler", "evq", "w0", "longan:w0", "x"]);
        let (thresholds, regional) = graph.analysis.totals_within(&map, graph.region.as_ref()).unwrap();
        let measures = ["evq", "w0"].map(|name| find(name).unwrap());
        let analysis = Analysis { by_threshold: true, ..graph.analysis.clone() };
        let maps = analysis.minkowski_maps(&map, &measures, go_on).unwrap().blocks;
        let centres = graph.region.unwrap().pixels(Healpix::new(8).unwrap());
        for t in 0..33 {
            let whole = &regional.totals[t];
            assert_eq!(curves.thresholds[t], thresholds.values()[t]);
            assert_eq!(curves.sigmas[t], t as f64 / 4.0 - 4.0);
            assert_eq!(curves.values[[2, t]], whole.area / regional.unmasked);
            let euler = whole.euler_characteristic() / regional.unmasked;
            assert!((curves.values[[0, t]] - euler).abs() < 1e-12);
            for (row, measure) in [(1, 0), (3, 1)] {
                let (mean, windows) = maps[t].mean(measure, &centres);
                assert!(curves.values[[row, t]] == mean || mean.is_nan());
                assert_eq!(curves.windows[[row, t]], windows);
            }
            let expected = curves.gaussian.unwrap().per_area(thresholds.values()[t], graph.analysis.body).area;
            assert_eq!(curves.get("W0").unwrap().expected.unwrap()[t], expected);
        }
        assert_eq!(curves.area, Some(regional.unmasked));
        assert!(curves.get("evq").unwrap().expected.is_none() && curves.get("evq").unwrap().windows.is_some());
        assert!(curves.get("w0").unwrap().windows.is_none() && curves.get("w3").is_none());
    }

    #[test]
    fn thresholds_come_in_both_units() {
        let mut graph = Graph::named(["w0"]).unwrap();
        let sigma = graph.curves(&sky(1), go_on).unwrap();
        graph.analysis.thresholds = Thresholds::new(sigma.thresholds.to_vec()).unwrap();
        graph.analysis.threshold_unit = ThresholdUnit::Value;
        let value = graph.curves(&sky(1), go_on).unwrap();
        assert_eq!((&value.thresholds, &value.values), (&sigma.thresholds, &sigma.values));
        assert!(value.sigmas.iter().zip(&sigma.sigmas).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn graphs_that_make_no_sense_are_refused() {
        use GraphError as E;
        assert!(matches!(Graph::default().check(Healpix::new(4).unwrap()), Err(E::Nothing)));
        assert!(matches!(Graph::named(["w1", "W1"]), Err(E::Repeated { name }) if name == "w1"));
        assert!(matches!(Graph::named(["psi2-direction"]), Err(E::Direction { .. })));
        assert!(matches!(Graph::named(["w9"]), Err(E::Unknown(_))));
        let graph = Graph::named(["evq"]).unwrap();
        let map = sky(2);
        let with = |change: fn(&mut Graph)| {
            let mut graph = graph.clone();
            change(&mut graph);
            graph.curves(&map, go_on).unwrap_err()
        };
        assert!(matches!(with(|g| g.gaussian = true), E::NoDensity));
        assert!(matches!(with(|g| g.analysis.windows = vec![1.0, 2.0]), E::Windows { count: 2 }));
        assert!(matches!(with(|g| g.region = Some("1,1,0.01".parse().unwrap())), E::NoWindow));
        assert!(matches!(with(|g| g.analysis.max_masked = 2.0), E::Analysis(_)));
        let mut graph = Graph::named(["w0"]).unwrap();
        graph.region = Some("1,1,0.01".parse().unwrap());
        assert!(matches!(graph.curves(&map, go_on), Err(E::NoPixel)));
        graph.region = Some("0,90,5".parse().unwrap());
        let holed =
            Map::new("", map.values().iter().enumerate().map(|(p, v)| if p < 100 { f64::NAN } else { *v }).collect());
        assert!(matches!(graph.curves(&holed.unwrap(), go_on), Err(E::Masked | E::NoPixel)));
        graph.region = None;
        graph.gaussian = true;
        graph.analysis = Analysis { threshold_unit: ThresholdUnit::Value, ..graph.analysis };
        let flat = Map::new("", vec![1.0; 12]).unwrap();
        assert!(matches!(graph.curves(&flat, go_on), Err(E::NoGaussian)));
    }
}
