//! An analysis: field, thresholds, window and measures brought together.
//!
//! Here the engine's moments meet the measures: the needs of all measures are united, one pass makes the moments, and
//! each window's moments go to every measure.

use std::collections::BTreeSet;

use longan_formats::{Healpix, Map};
use longan_measures::{Measure, Window};

use crate::contour::{Body, Field};
use crate::moments::{Selection, Weight};
use crate::statistics::statistics;
use crate::thresholds::{ThresholdError, Thresholds};
use crate::totals::{Totals, totals};
use crate::window::{Moments, windows};

/// What thresholds are counted in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThresholdUnit {
    /// Standard deviations of the unmasked pixels from their mean.
    #[default]
    Sigma,
    /// The field's own unit.
    Value,
}

/// How a field is analysed. The default is the analysis of the paper.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Radius of the window in degrees, up to 180; 0: each pixel by itself.
    pub window: f64,
    /// Thresholds, averaged over.
    pub thresholds: Thresholds,
    /// What they are counted in.
    pub threshold_unit: ThresholdUnit,
    /// Which side of a threshold is the body.
    pub body: Body,
    /// What the contour's pieces weigh in the moments ψ_s.
    pub weight: Weight,
    /// Nside of the result; default: the smaller of 16 and the field's, or the field's where the window is 0.
    pub nside_out: Option<usize>,
    /// Windows with a larger share of masked cells are masked.
    pub max_masked: f64,
}

impl Default for Analysis {
    fn default() -> Self {
        Analysis {
            window: 6.0,
            thresholds: Thresholds::standard(),
            threshold_unit: ThresholdUnit::Sigma,
            body: Body::Above,
            weight: Weight::Length,
            nside_out: None,
            max_masked: 1.0 / 16.0,
        }
    }
}

/// Nside of the result where none is asked for, at most.
pub const DEFAULT_NSIDE_OUT: usize = 16;

/// Why a field cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// A window that is no window.
    #[error("a window radius of {degrees} degrees is not between 0 and 180")]
    Window {
        /// The radius.
        degrees: f64,
    },
    /// A masked share that is no share.
    #[error("{share} is not a share between 0 and 1 of masked cells")]
    MaxMasked {
        /// The share.
        share: f64,
    },
    /// An output Nside that does not exist.
    #[error("an output Nside of {nside} is not between 1 and 2^29")]
    NsideOut {
        /// The Nside.
        nside: usize,
    },
    /// A window of one pixel on another grid.
    #[error("a window of 0 degrees is the pixel itself, so the output Nside must be the map's, {map}, not {output}")]
    PixelWindow {
        /// Nside of the map.
        map: usize,
        /// Nside asked for.
        output: usize,
    },
    /// Nothing to look at.
    #[error("every pixel of the map is masked")]
    AllMasked,
    /// Thresholds in σ of a field that has none.
    #[error("the unmasked pixels all have the value {value}, so thresholds cannot be counted in standard deviations; give them in the map's unit")]
    Constant {
        /// The value.
        value: f64,
    },
    /// Values too large for a mean.
    #[error("the mean or standard deviation of the map is not finite, so thresholds cannot be counted in standard deviations; give them in the map's unit")]
    NotFinite,
    /// Thresholds that do not work out.
    #[error(transparent)]
    Thresholds(#[from] ThresholdError),
}

/// Minkowski maps of one field: one array a measure.
#[derive(Clone, Debug)]
pub struct MinkowskiMaps {
    /// The grid of the maps.
    pub grid: Healpix,
    /// The thresholds, in the field's unit, of which these are the mean.
    pub thresholds: Thresholds,
    /// For each measure, in the order given, its values in RING order; NaN where masked or undefined.
    pub values: Vec<Vec<f64>>,
}

impl Analysis {
    /// Checks all that can be checked without the field's values, before a long computation.
    ///
    /// # Errors
    /// What is out of range.
    pub fn check(&self, map: Healpix) -> Result<Healpix, AnalysisError> {
        if !(0.0..=180.0).contains(&self.window) {
            return Err(AnalysisError::Window { degrees: self.window });
        }
        if !(0.0..=1.0).contains(&self.max_masked) {
            return Err(AnalysisError::MaxMasked { share: self.max_masked });
        }
        let default = if self.window == 0.0 { map.nside() } else { map.nside().min(DEFAULT_NSIDE_OUT) };
        let nside = self.nside_out.unwrap_or(default);
        let output = Healpix::new(nside).map_err(|_| AnalysisError::NsideOut { nside })?;
        if self.window == 0.0 && output != map {
            return Err(AnalysisError::PixelWindow { map: map.nside(), output: nside });
        }
        Ok(output)
    }

    /// The thresholds in the map's unit.
    ///
    /// # Errors
    /// Where the map is masked everywhere, or has no standard deviation to count in.
    pub fn thresholds_of(&self, map: &Map) -> Result<Thresholds, AnalysisError> {
        let of_map = statistics(map.values()).ok_or(AnalysisError::AllMasked)?;
        match self.threshold_unit {
            ThresholdUnit::Value => Ok(self.thresholds.clone()),
            ThresholdUnit::Sigma if !of_map.mean.is_finite() || !of_map.sigma.is_finite() => {
                Err(AnalysisError::NotFinite)
            }
            ThresholdUnit::Sigma if of_map.min == of_map.max => Err(AnalysisError::Constant { value: of_map.min }),
            ThresholdUnit::Sigma => Ok(self.thresholds.in_units_of(of_map.mean, of_map.sigma)?),
        }
    }

    /// Minkowski maps: each measure in windows about all pixels of the output grid, averaged over the thresholds.
    ///
    /// `progress` is told the share done, from 0 to 1. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// See [`check`](Self::check) and [`thresholds_of`](Self::thresholds_of).
    pub fn minkowski_maps(
        &self,
        map: &Map,
        measures: &[impl AsRef<dyn Measure> + Sync],
        progress: impl FnMut(f64),
    ) -> Result<MinkowskiMaps, AnalysisError> {
        let grid = self.check(map.grid())?;
        let thresholds = self.thresholds_of(map)?;
        let selection = self.selection(measures);
        let evaluate = |moments: &Moments, values: &mut [f64]| {
            let window = Window {
                centre: (moments.centre.0.to_degrees(), moments.centre.1.to_degrees()),
                masked_fraction: moments.masked_fraction,
                area: moments.area,
                length: moments.length,
                curvature: moments.curvature,
                psi0: match self.weight {
                    Weight::Length => moments.length,
                    Weight::Curvature => moments.curvature,
                },
                ranks: &selection.ranks,
                psi: &moments.psi,
            };
            let masked = moments.masked_fraction >= 1.0 || moments.masked_fraction > self.max_masked;
            for (value, measure) in values.iter_mut().zip(measures) {
                let defined = if masked { None } else { measure.as_ref().evaluate(&window) };
                *value = defined.unwrap_or(f64::NAN);
            }
        };
        let field = Field::new(map.grid(), map.values(), &thresholds, self.body);
        let values = windows(&field, &selection, grid, self.window.to_radians(), measures.len(), evaluate, progress);
        Ok(MinkowskiMaps { grid, thresholds, values })
    }

    /// The same for every threshold by itself, in ascending order.
    ///
    /// # Errors
    /// As [`minkowski_maps`](Self::minkowski_maps).
    pub fn sequence(
        &self,
        map: &Map,
        measures: &[impl AsRef<dyn Measure> + Sync],
        mut progress: impl FnMut(f64),
    ) -> Result<Vec<MinkowskiMaps>, AnalysisError> {
        let thresholds = self.thresholds_of(map)?;
        let count = thresholds.values().len() as f64;
        let each = |(i, &threshold): (usize, &f64)| {
            let thresholds = Thresholds::new(vec![threshold])?;
            let alone = Analysis { thresholds, threshold_unit: ThresholdUnit::Value, ..self.clone() };
            alone.minkowski_maps(map, measures, |share| progress((i as f64 + share) / count))
        };
        thresholds.values().iter().enumerate().map(each).collect()
    }

    /// Area, length and curvature of the whole unmasked sphere for each threshold, with the thresholds in the map's
    /// unit, and the area of masked cells in steradian. Window, weight and output grid do not matter.
    ///
    /// # Errors
    /// See [`thresholds_of`](Self::thresholds_of).
    pub fn totals(&self, map: &Map) -> Result<(Thresholds, Vec<Totals>, f64), AnalysisError> {
        let thresholds = self.thresholds_of(map)?;
        let (totals, masked) = totals(&Field::new(map.grid(), map.values(), &thresholds, self.body));
        Ok((thresholds, totals, masked))
    }

    /// The moments that some measure needs.
    fn selection(&self, measures: &[impl AsRef<dyn Measure>]) -> Selection {
        let mut selection = Selection { weight: self.weight, ..Selection::default() };
        let mut ranks = BTreeSet::new();
        for needs in measures.iter().map(|m| m.as_ref().needs()) {
            selection.area |= needs.area;
            selection.length |= needs.length;
            selection.curvature |= needs.curvature;
            ranks.extend(needs.ranks);
        }
        if ranks.remove(&0) {
            match self.weight {
                Weight::Length => selection.length = true,
                Weight::Curvature => selection.curvature = true,
            }
        }
        selection.ranks = ranks.into_iter().collect();
        selection
    }
}
