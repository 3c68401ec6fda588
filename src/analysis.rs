//! An analysis: field, thresholds, window and measures brought together.
//!
//! Here the engine's moments meet the measures: the needs of all measures are united, one pass makes the moments, and
//! each window's moments go to every measure.

use std::collections::BTreeSet;

use longan_grid::{Healpix, Map};
use longan_measures::{Measure, MeasureError, Window};

use crate::contour::{Body, Field};
use crate::moments::{Layout, Selection, Weight};
use crate::region::Region;
use crate::statistics::{Statistics, statistics};
use crate::thresholds::{Doubt, ThresholdError, Thresholds};
use crate::totals::{Regional, Totals, totals_within};
use crate::window::{self, Moments, MovingWindows, Summation, Ways, Windows};

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
    /// Radii of the windows in degrees, up to 180; 0: each pixel by itself.
    pub windows: Vec<f64>,
    /// Thresholds, averaged over.
    pub thresholds: Thresholds,
    /// What they are counted in.
    pub threshold_unit: ThresholdUnit,
    /// Which side of a threshold is the body.
    pub body: Body,
    /// What the contour's pieces weigh in the moments ψ_s.
    pub weight: Weight,
    /// Nside of the result; default: the smaller of 16 and the field's, or the field's where a window is 0.
    pub nside_out: Option<usize>,
    /// Windows with a larger share of masked cells are masked.
    pub max_masked: f64,
    /// In windows with less contour than this, in window radii, the mean over the thresholds, measures that are
    /// [relative](Measure::is_relative) are undefined.
    pub min_contour: f64,
    /// How windows are summed.
    pub summation: Summation,
}

impl Default for Analysis {
    fn default() -> Self {
        Analysis {
            windows: vec![6.0],
            thresholds: Thresholds::standard(),
            threshold_unit: ThresholdUnit::Sigma,
            body: Body::Above,
            weight: Weight::Length,
            nside_out: None,
            max_masked: 1.0 / 16.0,
            min_contour: 0.0,
            summation: Summation::default(),
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
    /// A least length that is no length.
    #[error("a least contour of {length} window radii is not a finite number from 0")]
    MinContour {
        /// The length in window radii.
        length: f64,
    },
    /// A least length in radii of a window that has none.
    #[error(
        "a least contour is counted in window radii, and a window of 0 degrees has none; leave the least contour out"
    )]
    PixelContour,
    /// No window.
    #[error("no window is asked for")]
    NoWindow,
    /// A window asked for twice.
    #[error("the window of {degrees} degrees is asked for twice")]
    Repeated {
        /// The radius.
        degrees: f64,
    },
    /// Nothing to compute.
    #[error("no measure is asked for")]
    NoMeasure,
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
    /// Thresholds in σ of a field that has none, or too little to tell them apart.
    #[error(
        "the unmasked pixels vary too little about {mean:e} for thresholds in standard deviations; give thresholds in the map's unit"
    )]
    Constant {
        /// The mean.
        mean: f64,
    },
    /// Values too large for a mean.
    #[error(
        "the mean or standard deviation of the map is not finite, so thresholds cannot be counted in standard deviations; give them in the map's unit"
    )]
    NotFinite,
    /// Thresholds that do not work out.
    #[error(transparent)]
    Thresholds(#[from] ThresholdError),
    /// A measure of tensors of another weight.
    #[error(
        "the measure '{measure}' is defined for tensors weighted by {}, and these are weighted by {}; choose the other weight",
        named(*weight), named(other(*weight))
    )]
    Weight {
        /// The measure.
        measure: String,
        /// The weight that it needs.
        weight: Weight,
    },
    /// A measure that fails.
    #[error(transparent)]
    Measure(#[from] MeasureError),
}

fn named(weight: Weight) -> &'static str {
    match weight {
        Weight::Length => "length",
        Weight::Curvature => "curvature",
    }
}

fn other(weight: Weight) -> Weight {
    match weight {
        Weight::Length => Weight::Curvature,
        Weight::Curvature => Weight::Length,
    }
}

/// Minkowski maps of one field for one window: one array a measure.
#[derive(Clone, Debug)]
pub struct MinkowskiMaps {
    /// The grid of the maps.
    pub grid: Healpix,
    /// Radius of the window in degrees.
    pub window: f64,
    /// The thresholds, in the field's unit, of which these are the mean.
    pub thresholds: Thresholds,
    /// Statistics of the field analysed.
    pub of_map: Statistics,
    /// For each measure, in the order given, its values in RING order; NaN where masked or undefined.
    pub values: Vec<Vec<f64>>,
    /// Number of windows of which too large a share is masked; all measures are undefined there.
    pub masked: usize,
    /// How windows were summed.
    pub ways: Ways,
}

impl MinkowskiMaps {
    /// The mean of a measure over some pixels of the grid where it is defined, and their number; NaN where there are none.
    pub fn mean(&self, measure: usize, pixels: &[bool]) -> (f64, usize) {
        let defined = self.values[measure].iter().zip(pixels).filter(|(value, within)| **within && !value.is_nan());
        let (sum, windows) = defined.fold((0.0, 0), |(sum, n), (value, _)| (sum + value, n + 1));
        (sum / windows as f64, windows)
    }
}

impl Analysis {
    /// Checks all that can be checked without the field's values, before a long computation.
    ///
    /// # Errors
    /// What is out of range.
    pub fn check(&self, map: Healpix) -> Result<Healpix, AnalysisError> {
        for (i, &degrees) in self.windows.iter().enumerate() {
            if !(0.0..=180.0).contains(&degrees) {
                return Err(AnalysisError::Window { degrees });
            }
            if self.windows[..i].contains(&degrees) {
                return Err(AnalysisError::Repeated { degrees });
            }
        }
        if self.windows.is_empty() {
            return Err(AnalysisError::NoWindow);
        }
        if !(0.0..=1.0).contains(&self.max_masked) {
            return Err(AnalysisError::MaxMasked { share: self.max_masked });
        }
        let of_pixels = self.windows.contains(&0.0);
        let length = self.min_contour;
        if !length.is_finite() || length < 0.0 {
            return Err(AnalysisError::MinContour { length });
        }
        if of_pixels && length > 0.0 {
            return Err(AnalysisError::PixelContour);
        }
        let default = if of_pixels { map.nside() } else { map.nside().min(DEFAULT_NSIDE_OUT) };
        let nside = self.nside_out.unwrap_or(default);
        let output = Healpix::new(nside).map_err(|_| AnalysisError::NsideOut { nside })?;
        if of_pixels && output != map {
            return Err(AnalysisError::PixelWindow { map: map.nside(), output: nside });
        }
        Ok(output)
    }

    /// About how many bytes the Minkowski maps of a field take at most while they are made, beside the field itself.
    ///
    /// # Errors
    /// See [`check`](Self::check), and where measures need another weight.
    pub fn memory(
        &self,
        map: Healpix,
        measures: &[impl AsRef<dyn Measure>],
        sequence: bool,
    ) -> Result<usize, AnalysisError> {
        let output = self.check(map)?;
        let thresholds = self.thresholds.values().len();
        let selection = Selection { by_threshold: sequence, ..self.selection(measures)? };
        let rows = Layout::new(&selection, thresholds, true).rows;
        let tables = if sequence { thresholds } else { 1 };
        let windows = self.windows.iter().map(|degrees| window::memory(map, output, degrees.to_radians(), rows));
        let columns = tables * self.windows.len() * (measures.len() + 1) * size_of::<f64>();
        let maps = output.pixels().saturating_mul(columns);
        Ok(windows.fold(maps.saturating_add(window::band_memory(map, rows)), usize::saturating_add))
    }

    /// The thresholds in the map's unit, and the statistics of the map that they may be counted from.
    ///
    /// # Errors
    /// Where the map is masked everywhere, or has no standard deviation to count in.
    pub fn thresholds_of(&self, map: &Map) -> Result<(Thresholds, Statistics), AnalysisError> {
        let of_map = statistics(map.values()).ok_or(AnalysisError::AllMasked)?;
        let thresholds = match self.threshold_unit {
            ThresholdUnit::Value => self.thresholds.clone(),
            ThresholdUnit::Sigma if !of_map.mean.is_finite() || !of_map.sigma.is_finite() => {
                return Err(AnalysisError::NotFinite);
            }
            ThresholdUnit::Sigma if of_map.sigma == 0.0 => {
                return Err(AnalysisError::Constant { mean: of_map.mean });
            }
            ThresholdUnit::Sigma => match self.thresholds.in_units_of(of_map.mean, of_map.sigma) {
                Err(ThresholdError::Repeated { .. }) => return Err(AnalysisError::Constant { mean: of_map.mean }),
                thresholds => thresholds?,
            },
        };
        Ok((thresholds, of_map))
    }

    /// What makes one doubt that the thresholds are meant for a field. In standard deviations they may lie as close
    /// together as they like.
    pub fn doubt(&self, map: &Map) -> Option<Doubt> {
        let in_sigma = self.threshold_unit == ThresholdUnit::Sigma;
        // The mean lies within the values, so there is no need to look at them.
        if in_sigma && self.thresholds.values().contains(&0.0) {
            return None;
        }
        let (thresholds, of_map) = self.thresholds_of(map).ok()?;
        thresholds.doubt(of_map).filter(|doubt| !in_sigma || matches!(doubt, Doubt::Missed { .. }))
    }

    /// Minkowski maps, for each window: each measure about all pixels of the output grid, averaged over the thresholds.
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
    ) -> Result<Vec<MinkowskiMaps>, AnalysisError> {
        self.maps(map, measures, false, progress)
    }

    /// The same for every threshold by itself: for each window the thresholds in ascending order.
    ///
    /// # Errors
    /// As [`minkowski_maps`](Self::minkowski_maps).
    pub fn sequence(
        &self,
        map: &Map,
        measures: &[impl AsRef<dyn Measure> + Sync],
        progress: impl FnMut(f64),
    ) -> Result<Vec<MinkowskiMaps>, AnalysisError> {
        self.maps(map, measures, true, progress)
    }

    fn maps(
        &self,
        map: &Map,
        measures: &[impl AsRef<dyn Measure> + Sync],
        by_threshold: bool,
        progress: impl FnMut(f64),
    ) -> Result<Vec<MinkowskiMaps>, AnalysisError> {
        let grid = self.check(map.grid())?;
        let (thresholds, of_map) = self.thresholds_of(map)?;
        if measures.is_empty() {
            return Err(AnalysisError::NoMeasure);
        }
        let selection = Selection { by_threshold, ..self.selection(measures)? };
        let of_each = match by_threshold {
            true => thresholds.values().iter().map(|&t| Thresholds::new(vec![t])).collect::<Result<_, _>>()?,
            false => vec![thresholds.clone()],
        };
        let columns = measures.len() + 1;
        let relative: Vec<bool> = measures.iter().map(|measure| measure.as_ref().is_relative()).collect();
        let evaluate = |batch: &mut [Moments], values: &mut [f64]| {
            batch.iter_mut().for_each(|moments| moments.scale_up(self.weight));
            let masked =
                |m: &Moments| m.masked_fraction >= 1.0 || m.lost_edges >= 1.0 || m.masked_fraction > self.max_masked;
            let unmasked = batch.iter().enumerate().filter(|(_, moments)| !masked(moments));
            let (places, windows): (Vec<usize>, Vec<Window<'_>>) =
                unmasked.map(|(i, m)| (i, self.window_of(m, &selection.ranks))).unzip();
            let mut column = vec![f64::NAN; windows.len()];
            values.fill(f64::NAN);
            for (i, measure) in measures.iter().map(AsRef::as_ref).enumerate() {
                measure.evaluate_all(&windows, &mut column)?;
                for ((&place, value), window) in places.iter().zip(&column).zip(&windows) {
                    // What was made up for masked cells is no evidence.
                    let seen = window.length * (1.0 - window.masked_fraction);
                    if !relative[i] || seen >= self.min_contour * batch[place].radius {
                        values[place * columns + i] = *value;
                    }
                }
            }
            // The last column tells which windows are not lost to the mask; those without pixels are lost to their size.
            let kept = batch.iter().enumerate().filter(|(_, moments)| moments.pixels == 0 || !masked(moments));
            kept.for_each(|(place, _)| values[place * columns + measures.len()] = 1.0);
            Ok::<(), MeasureError>(())
        };
        let field = Field::new(map.grid(), map.values(), &thresholds, self.body);
        let radii: Vec<f64> = self.windows.iter().map(|degrees| degrees.to_radians()).collect();
        let windows = MovingWindows {
            field: &field,
            selection: &selection,
            output: grid,
            radii: &radii,
            summation: self.summation,
        };
        let all = windows.visit_batches(columns, evaluate, progress)?;
        let maps = all.into_iter().zip(&self.windows).flat_map(|(Windows { columns, ways }, &window)| {
            let mut columns = columns.into_iter();
            let maps = of_each.iter().map(|thresholds| {
                let values = columns.by_ref().take(measures.len()).collect();
                let masked = columns.next().map_or(0, |seen| seen.iter().filter(|seen| seen.is_nan()).count());
                MinkowskiMaps { grid, window, thresholds: thresholds.clone(), of_map, values, masked, ways }
            });
            maps.collect::<Vec<_>>()
        });
        Ok(maps.collect())
    }

    /// Area, length and curvature of the whole unmasked sphere for each threshold, curvature made up for the edges beside
    /// masked cells, with the thresholds in the map's unit, and the area of masked cells in steradian. Window, weight and
    /// output grid do not matter.
    ///
    /// # Errors
    /// See [`thresholds_of`](Self::thresholds_of).
    pub fn totals(&self, map: &Map) -> Result<(Thresholds, Vec<Totals>, f64), AnalysisError> {
        let (thresholds, whole) = self.totals_within(map, None)?;
        Ok((thresholds, whole.made_up(), whole.masked))
    }

    /// The same over a region, or over the sphere.
    ///
    /// # Errors
    /// See [`thresholds_of`](Self::thresholds_of).
    pub fn totals_within(&self, map: &Map, region: Option<&Region>) -> Result<(Thresholds, Regional), AnalysisError> {
        let (thresholds, _) = self.thresholds_of(map)?;
        let regional = totals_within(&Field::new(map.grid(), map.values(), &thresholds, self.body), region);
        Ok((thresholds, regional))
    }

    /// A window as measures see it.
    fn window_of<'a>(&self, moments: &'a Moments, ranks: &'a [u32]) -> Window<'a> {
        Window {
            centre: (moments.centre.0.to_degrees(), moments.centre.1.to_degrees()),
            masked_fraction: moments.masked_fraction,
            area: moments.area,
            length: moments.length,
            curvature: moments.curvature,
            psi0: match self.weight {
                Weight::Length => moments.length,
                Weight::Curvature => moments.curvature,
            },
            ranks,
            psi: &moments.psi,
            resolution: self.summation.resolution(),
        }
    }

    /// The moments that some measure needs.
    fn selection(&self, measures: &[impl AsRef<dyn Measure>]) -> Result<Selection, AnalysisError> {
        let mut selection = Selection { weight: self.weight, ..Selection::default() };
        let mut ranks = BTreeSet::new();
        for measure in measures.iter().map(AsRef::as_ref) {
            let needs = measure.needs();
            if let Some(weight) = needs.weight.filter(|weight| *weight != self.weight) {
                return Err(AnalysisError::Weight { measure: measure.name(), weight });
            }
            selection.area |= needs.area;
            selection.length |= needs.length;
            selection.curvature |= needs.curvature;
            ranks.extend(needs.ranks);
        }
        selection.length |= self.min_contour > 0.0;
        if ranks.remove(&0) {
            match self.weight {
                Weight::Length => selection.length = true,
                Weight::Curvature => selection.curvature = true,
            }
        }
        selection.ranks = ranks.into_iter().collect();
        Ok(selection)
    }
}
