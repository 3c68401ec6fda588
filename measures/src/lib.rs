//! The measures that longan takes of a window.
//!
//! A [`Measure`] says which moments it [needs](Measure::needs), turns one window's moments into a number, and states the
//! [`Quantity`] of that number, from which its treatment follows; how the moments come about is the engine's affair. The
//! built-ins stand in [`BUILT_INS`], one file an idea, with their formulas; [`find`] makes one from its name. A [`Formula`]
//! is a measure written as a text, [`plugin`] loads measures from libraries, and a [`Catalogue`] knows them all by name.
//! `ψ_s = Σ L e^{isϕ}` are the moments of Collischon et al. 2024, "Morphometry on the sphere", Commun. Phys. 7.
//!
//! ```
//! use longan_measures::{Measure, Quantity, Window, find};
//! use num_complex::Complex64;
//!
//! let evq = find("evq")?;
//! assert_eq!((evq.needs().ranks, evq.quantity()), (vec![0, 2], Quantity::Ratio));
//! let window = Window { psi0: 3.0, ranks: &[2], psi: &[Complex64::new(0.0, 1.0)], ..Window::default() };
//! assert_eq!(evq.evaluate(&window), Some(2.0));
//! # Ok::<(), longan_measures::UnknownMeasure>(())
//! ```

mod catalogue;
mod coverage;
mod formula;
mod functionals;
mod irreducible;
mod kind;
pub mod plugin;
mod quantity;
mod rank2;
mod rank4;
mod registry;
pub mod testing;

use std::fmt;
use std::path::PathBuf;

use num_complex::Complex64;

pub use catalogue::{Catalogue, CatalogueError, split};
pub use formula::{Formula, FormulaError};
pub use kind::Kind;
pub use quantity::Quantity;
pub use registry::{BUILT_INS, BuiltIn, UnknownMeasure, find, usual};

/// The weight of the contour's pieces in the moments ψ_s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// The length of a piece: ψ_s of the tensors W_1^{0,s}.
    #[default]
    Length,
    /// The exterior angles at the contour's vertices: ψ_s = Σ ∫ e^{isϕ} dϕ of the curvature-weighted tensors W_2^{0,s}.
    Curvature,
}

impl Weight {
    /// The name in options, headers and recipes: `length` or `curvature`.
    pub fn name(self) -> &'static str {
        match self {
            Weight::Length => "length",
            Weight::Curvature => "curvature",
        }
    }
}

/// The moments of a window that a measure needs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// W0, the body's area.
    pub area: bool,
    /// W1, the contour's length.
    pub length: bool,
    /// W2, the contour's total curvature.
    pub curvature: bool,
    /// Ranks s of the moments ψ_s, 0 among them, ascending.
    pub ranks: Vec<u32>,
    /// The weight of the moments ψ_s that the measure is defined for; `None`: either.
    pub weight: Option<Weight>,
}

/// The failure of a measure. A window for which the measure is not defined is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the measure '{measure}' failed: {reason}")]
pub struct MeasureError {
    /// The measure's name.
    pub measure: String,
    /// The reason, in the measure's words.
    pub reason: String,
}

/// The origin of a measure.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// The program itself.
    #[default]
    Program,
    /// A formula, with its text.
    Formula(String),
    /// A plugin.
    Plugin(PluginOrigin),
}

/// The plugin that a measure is from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluginOrigin {
    /// The name.
    pub name: String,
    /// The plugin's own version.
    pub version: String,
    /// The library.
    pub path: PathBuf,
}

impl fmt::Display for PluginOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ({})", self.name, self.version, self.path.display())
    }
}

/// The name of the column in a file for a measure of this name: `EVQ_DIRECTION` for `evq-direction`.
pub fn column_of(name: &str) -> String {
    name.to_uppercase().replace(['-', ':'], "_")
}

/// The moments of one window, the mean over the thresholds.
///
/// Areas, lengths and ψ_s are those of the whole window: they have been divided, once, by 1 − `masked_fraction`, the share
/// of its cells that is not masked, and curvatures by the share of its edges.
#[derive(Clone, Copy, Debug, Default)]
pub struct Window<'a> {
    /// Colatitude and longitude of the centre in degrees.
    pub centre: (f64, f64),
    /// Share of the window's cells that are masked, below 1.
    pub masked_fraction: f64,
    /// W0 in steradian, if needed.
    pub area: f64,
    /// W1 in radians, if needed.
    pub length: f64,
    /// W2 in radians, if needed.
    pub curvature: f64,
    /// ψ_0: the length, or for curvature-weighted tensors the total curvature.
    pub psi0: f64,
    /// Ranks s ≥ 1 of the moments in `psi`, ascending; all that were needed, perhaps more.
    pub ranks: &'a [u32],
    /// ψ_s of these ranks, in the frame of the centre: angles count from south towards east.
    pub psi: &'a [Complex64],
    /// The accuracy of ψ_s, s ≥ 1, as a share of the contour's weight: values that differ by less are not told apart.
    pub resolution: f64,
}

impl Window<'_> {
    /// ψ_s.
    ///
    /// # Panics
    /// For a rank that the measure did not name in its needs.
    pub fn psi(&self, rank: u32) -> Complex64 {
        match rank {
            0 => self.psi0.into(),
            _ => self.psi[self.ranks.binary_search(&rank).expect("a rank that the measure needs")],
        }
    }
}

/// A number that characterises the shape in a window.
pub trait Measure: Send + Sync {
    /// The name on the command line, such as `evq-direction`: lower case, digits and hyphens.
    fn name(&self) -> String;

    /// The definition in one line, with the formula.
    fn definition(&self) -> String;

    /// The kind of quantity: how values are drawn, averaged and compared follows from it.
    fn quantity(&self) -> Quantity;

    /// The unit: `sr`, `rad`, `deg`, or empty for a pure number. That of an [angle](Quantity::Angle) is `deg`.
    fn unit(&self) -> &str;

    /// The rank of the tensor that the measure belongs to.
    fn rank(&self) -> u32;

    /// The moments that [`evaluate`](Self::evaluate) reads.
    fn needs(&self) -> Needs;

    /// The measure of one window, in its [unit](Self::unit); `None` where it is not defined.
    fn evaluate(&self, window: &Window<'_>) -> Option<f64>;

    /// The measure of many windows, each as [`evaluate`](Self::evaluate) has it; NaN where it is not defined.
    ///
    /// # Errors
    /// Where the measure itself fails, as one from a plugin may.
    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        for (value, window) in values.iter_mut().zip(windows) {
            *value = self.evaluate(window).unwrap_or(f64::NAN);
        }
        Ok(())
    }

    /// Whether a window with hardly any contour leaves the measure to chance, as it does ratios and angles, unlike
    /// quantities that add up. Of numbers of no stated kind, those without unit or in degrees are taken as ratios. A
    /// measure that needs no moments is never left to chance.
    fn is_relative(&self) -> bool {
        let is_ratio = match self.quantity() {
            Quantity::Ratio | Quantity::Angle { .. } => true,
            Quantity::Area | Quantity::Length | Quantity::Curvature | Quantity::Moment | Quantity::Count => false,
            Quantity::Deviation | Quantity::Percentile | Quantity::Number => matches!(self.unit(), "" | "deg"),
        };
        is_ratio && self.needs() != Needs::default()
    }

    /// The name of the measure's column in a file: `EVQ_DIRECTION`.
    fn column(&self) -> String {
        column_of(&self.name())
    }

    /// The origin of the measure.
    fn origin(&self) -> Origin {
        Origin::Program
    }
}
