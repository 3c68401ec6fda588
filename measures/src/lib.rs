//! The measures that longan takes of a window.
//!
//! A [`Measure`] says which moments it [needs](Measure::needs) and turns one window's moments into a number; how the
//! moments come about is the engine's affair. The built-ins stand in [`BUILT_INS`], one file an idea, with their
//! formulas; [`find`] makes one from its name. A [`Formula`] is a measure written as a text, [`plugin`] loads measures
//! from libraries, and a [`Catalogue`] knows them all by name. `ψ_s = Σ L e^{isϕ}` are the moments of Collischon et al. 2024,
//! "Morphometry on the sphere", Commun. Phys. 7.
//!
//! ```
//! use longan_measures::{Measure, Window, find};
//! use num_complex::Complex64;
//!
//! let evq = find("evq")?;
//! assert_eq!(evq.needs().ranks, [0, 2]);
//! let window = Window { psi0: 3.0, ranks: &[2], psi: &[Complex64::new(0.0, 1.0)], ..Window::default() };
//! assert_eq!(evq.evaluate(&window), Some(2.0));
//! # Ok::<(), longan_measures::UnknownMeasure>(())
//! ```

mod catalogue;
mod coverage;
mod formula;
mod functionals;
mod irreducible;
pub mod plugin;
mod rank2;
mod rank4;
mod registry;
pub mod testing;

use num_complex::Complex64;

pub use catalogue::{Catalogue, CatalogueError, split};
pub use formula::{Formula, FormulaError};
pub use registry::{BUILT_INS, BuiltIn, Kind, UnknownMeasure, find, usual};

/// What the contour's pieces weigh in the moments ψ_s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// Their length: ψ_s of the tensors W_1^{0,s}.
    #[default]
    Length,
    /// The exterior angles at its vertices: ψ_s = Σ ∫ e^{isϕ} dϕ of the curvature-weighted tensors W_2^{0,s}.
    Curvature,
}

/// Which moments of a window a measure needs.
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

/// Why a measure could not be evaluated. That it is not defined for a window is no error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the measure '{measure}' failed: {reason}")]
pub struct MeasureError {
    /// The measure's name.
    pub measure: String,
    /// What it says about it.
    pub reason: String,
}

/// Where a measure comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// The program itself.
    #[default]
    Program,
    /// A formula, with its text.
    Formula(String),
    /// A plugin, with its name, version and file.
    Plugin(String),
}

/// The moments of one window, the mean over the thresholds.
///
/// Areas, lengths and ψ_s are those of the whole window: what is masked has been made up for, once, by division by
/// 1 − `masked_fraction`, curvatures by their own share.
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
    /// The accuracy of ψ_s, s ≥ 1, as a share of the contour's weight: what differs by less is not told apart.
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

    /// What it is, in one line, with its formula.
    fn definition(&self) -> String;

    /// Its unit: `sr`, `rad`, `deg`, or empty for a pure number.
    fn unit(&self) -> &str;

    /// The rank of the tensor that it belongs to.
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

    /// Whether it is a ratio or a direction, which a window with hardly any contour gives at random, and not a quantity
    /// that adds up. By default what has no unit or degrees is, but for what needs no moments.
    fn is_relative(&self) -> bool {
        matches!(self.unit(), "" | "deg") && self.needs() != Needs::default()
    }

    /// The name of its column in a file: `EVQ_DIRECTION`.
    fn column(&self) -> String {
        self.name().to_uppercase().replace(['-', ':'], "_")
    }

    /// Where it comes from.
    fn origin(&self) -> Origin {
        Origin::Program
    }
}
