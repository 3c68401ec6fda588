//! An analysis: field, thresholds, window and measures brought together.
//!
//! Here the engine's moments meet the measures: the needs of all measures are united, one pass makes the moments, and
//! each window's moments go to every measure.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use longan_grid::{Healpix, MapView};
use longan_measures::{Measure, MeasureError, Window};
use ndarray::Array2;

use crate::contour::{Body, Field};
use crate::minkowski_maps::{Block, MinkowskiMaps};
use crate::moments::{Layout, Selection, Weight};
use crate::region::Region;
use crate::statistics::{Statistics, statistics};
use crate::thresholds::{Doubt, ThresholdError, Thresholds};
use crate::totals::{Regional, Totals, totals_within};
use crate::window::{self, Moments, MovingWindows, Stopped, Summation, SummationCounts, Windows};

/// What thresholds are counted in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThresholdUnit {
    /// Standard deviations of the unmasked pixels from their mean.
    #[default]
    Sigma,
    /// The field's own unit.
    Value,
}

impl ThresholdUnit {
    /// The name in options, headers and recipes: `sigma` or `value`.
    pub fn name(self) -> &'static str {
        match self {
            ThresholdUnit::Sigma => "sigma",
            ThresholdUnit::Value => "value",
        }
    }
}

/// How a field is analysed. The default is the analysis of the paper.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Radii of the windows in degrees, up to 180; 0: each pixel by itself.
    pub windows: Vec<f64>,
    /// The thresholds.
    pub thresholds: Thresholds,
    /// What thresholds are counted in.
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
    /// Whether each threshold is kept by itself instead of the mean over all.
    pub by_threshold: bool,
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
            by_threshold: false,
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
        weight.name(), other(*weight).name()
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
    /// A field that is on no grid.
    #[error(transparent)]
    Grid(#[from] longan_grid::Error),
    /// The caller said to stop.
    #[error("the analysis was stopped")]
    Stopped,
}

impl From<Stopped> for AnalysisError {
    fn from(_: Stopped) -> Self {
        AnalysisError::Stopped
    }
}

impl From<Infallible> for AnalysisError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

fn other(weight: Weight) -> Weight {
    match weight {
        Weight::Length => Weight::Curvature,
        Weight::Curvature => Weight::Length,
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
    pub fn memory(&self, map: Healpix, measures: &[impl AsRef<dyn Measure>]) -> Result<usize, AnalysisError> {
        let output = self.check(map)?;
        let thresholds = self.thresholds.values().len();
        let rows = Layout::new(&self.selection(measures)?, thresholds, true).rows;
        let tables = if self.by_threshold { thresholds } else { 1 };
        let windows = self.windows.iter().map(|degrees| window::memory(map, output, degrees.to_radians(), rows));
        let columns = tables * self.windows.len() * measures.len() * size_of::<f64>();
        let maps = output.pixels().saturating_mul(columns);
        Ok(windows.fold(maps.saturating_add(window::band_memory(map, rows)), usize::saturating_add))
    }

    /// The thresholds in the map's unit, and the statistics of the map that they may be counted from.
    ///
    /// # Errors
    /// Where the map is masked everywhere, or has no standard deviation to count in.
    pub fn thresholds_of<'a, M>(&self, map: M) -> Result<(Thresholds, Statistics), AnalysisError>
    where
        M: TryInto<MapView<'a>, Error: Into<AnalysisError>>,
    {
        self.resolved(&map.try_into().map_err(Into::into)?)
    }

    fn resolved(&self, map: &MapView<'_>) -> Result<(Thresholds, Statistics), AnalysisError> {
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
    pub fn doubt<'a>(&self, map: impl TryInto<MapView<'a>>) -> Option<Doubt> {
        let in_sigma = self.threshold_unit == ThresholdUnit::Sigma;
        // The mean lies within the values, so there is no need to look at them.
        if in_sigma && self.thresholds.values().contains(&0.0) {
            return None;
        }
        let (thresholds, of_map) = self.resolved(&map.try_into().ok()?).ok()?;
        thresholds.doubt(of_map).filter(|doubt| !in_sigma || matches!(doubt, Doubt::Missed { .. }))
    }

    /// Minkowski maps, for each window: each measure about all pixels of the output grid, averaged over the thresholds or,
    /// with [`by_threshold`](Self::by_threshold), for each by itself.
    ///
    /// The field is a [`Map`](longan_grid::Map), or an array or slice in RING order: see [`MapView`]. `progress` is told the
    /// share done, from 0 to 1, and says whether to go on ([`go_on`](crate::go_on) always does). The result does not depend
    /// on the number of threads.
    ///
    /// # Errors
    /// See [`check`](Self::check) and [`thresholds_of`](Self::thresholds_of); those of measures; [`AnalysisError::Grid`] for a
    /// number of values that no grid has; [`AnalysisError::Stopped`].
    pub fn minkowski_maps<'a, M>(
        &self,
        map: M,
        measures: &[impl AsRef<dyn Measure> + Sync],
        progress: impl FnMut(f64) -> ControlFlow<()>,
    ) -> Result<MinkowskiMaps, AnalysisError>
    where
        M: TryInto<MapView<'a>, Error: Into<AnalysisError>>,
    {
        let map = &map.try_into().map_err(Into::into)?;
        let grid = self.check(map.grid())?;
        let (thresholds, of_map) = self.resolved(map)?;
        if measures.is_empty() {
            return Err(AnalysisError::NoMeasure);
        }
        let selection = self.selection(measures)?;
        let of_each = self.of_each_block(&thresholds);
        let columns = measures.len();
        let relative: Vec<bool> = measures.iter().map(|measure| measure.as_ref().is_relative()).collect();
        let radii: Vec<f64> = self.windows.iter().map(|degrees| degrees.to_radians()).collect();
        // Windows that are lost to the mask, of each radius; they come once for each threshold that is kept by itself.
        let lost: Vec<AtomicUsize> = radii.iter().map(|_| AtomicUsize::new(0)).collect();
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
            // Windows without pixels are lost to their size.
            for moments in batch.iter().filter(|moments| moments.pixels > 0 && masked(moments)) {
                let radius = radii.iter().position(|radius| *radius == moments.radius);
                radius.iter().for_each(|&i| _ = lost[i].fetch_add(1, Ordering::Relaxed));
            }
            Ok::<(), AnalysisError>(())
        };
        let field = Field::new(map.grid(), map.values(), &thresholds, self.body);
        let windows = MovingWindows {
            field: &field,
            selection: &selection,
            output: grid,
            radii: &radii,
            summation: self.summation,
        };
        let all = windows.visit_batches(columns, evaluate, progress)?;
        let names: Vec<String> = measures.iter().map(|measure| measure.as_ref().name()).collect();
        let mut blocks = Vec::new();
        for ((Windows { values, counts }, &window), lost) in all.into_iter().zip(&self.windows).zip(lost) {
            let masked = lost.into_inner() / of_each.len();
            for (values, thresholds) in values.into_iter().zip(&of_each) {
                let (thresholds, measures) = (thresholds.clone(), names.clone());
                blocks.push(Block { window, thresholds, measures, values, masked, counts });
            }
        }
        Ok(MinkowskiMaps { grid, of_map, blocks })
    }

    /// The thresholds of each block of one window.
    fn of_each_block(&self, thresholds: &Thresholds) -> Vec<Thresholds> {
        if self.by_threshold { thresholds.each().collect() } else { vec![thresholds.clone()] }
    }

    /// The result for a field that has no shape to measure, masked everywhere or constant: nothing but undefined values.
    /// The blocks have the thresholds as they were given, for there may be none in the field's unit.
    ///
    /// # Errors
    /// See [`check`](Self::check); [`AnalysisError::Grid`] for a number of values that no grid has.
    pub fn undefined<'a, M>(&self, map: M, measures: &[impl AsRef<dyn Measure>]) -> Result<MinkowskiMaps, AnalysisError>
    where
        M: TryInto<MapView<'a>, Error: Into<AnalysisError>>,
    {
        let map = map.try_into().map_err(Into::into)?;
        let grid = self.check(map.grid())?;
        let of_each = self.of_each_block(&self.thresholds);
        let block = |window: f64, thresholds: &Thresholds| Block {
            window,
            thresholds: thresholds.clone(),
            measures: measures.iter().map(|measure| measure.as_ref().name()).collect(),
            values: Array2::from_elem((measures.len(), grid.pixels()), f64::NAN),
            masked: grid.pixels(),
            counts: SummationCounts::default(),
        };
        let blocks = self.windows.iter().flat_map(|&window| of_each.iter().map(move |each| (window, each)));
        let blocks = blocks.map(|(window, each)| block(window, each)).collect();
        Ok(MinkowskiMaps { grid, of_map: statistics(map.values()).unwrap_or(Statistics::NOTHING), blocks })
    }

    /// Area, length and curvature of the whole unmasked sphere for each threshold, curvature made up for the edges beside
    /// masked cells, with the thresholds in the map's unit, and the area of masked cells in steradian. Window, weight and
    /// output grid do not matter.
    ///
    /// # Errors
    /// See [`thresholds_of`](Self::thresholds_of).
    pub fn totals<'a, M>(&self, map: M) -> Result<(Thresholds, Vec<Totals>, f64), AnalysisError>
    where
        M: TryInto<MapView<'a>, Error: Into<AnalysisError>>,
    {
        let (thresholds, whole) = self.totals_within(map, None)?;
        Ok((thresholds, whole.made_up(), whole.masked))
    }

    /// The same over a region, or over the sphere.
    ///
    /// # Errors
    /// See [`thresholds_of`](Self::thresholds_of).
    pub fn totals_within<'a, M>(&self, map: M, region: Option<&Region>) -> Result<(Thresholds, Regional), AnalysisError>
    where
        M: TryInto<MapView<'a>, Error: Into<AnalysisError>>,
    {
        let map = map.try_into().map_err(Into::into)?;
        let (thresholds, _) = self.resolved(&map)?;
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
        let mut selection = Selection { weight: self.weight, by_threshold: self.by_threshold, ..Selection::default() };
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
