//! The measures that longan takes of a window.
//!
//! A [`Measure`] says which moments it [needs](Measure::needs) and turns one window's moments into a number; how the
//! moments come about is the engine's affair. The built-ins stand in [`BUILT_INS`], one file an idea, with their
//! formulas; [`find`] makes one from its name. `ψ_s = Σ L e^{isϕ}` are the moments of Collischon et al. 2024,
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

mod coverage;
mod functionals;
mod irreducible;
mod rank2;
mod rank4;
mod registry;
pub mod testing;

use num_complex::Complex64;

pub use registry::{BUILT_INS, BuiltIn, Kind, UnknownMeasure, find};

/// Which moments of a window a measure needs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// W0, the body's area.
    pub area: bool,
    /// W1, the contour's length.
    pub length: bool,
    /// W2, the contour's total curvature.
    pub curvature: bool,
    /// Ranks s of the moments ψ_s, 0 among them.
    pub ranks: Vec<u32>,
}

/// The moments of one window, the mean over the thresholds. Nothing is rescaled for masked cells.
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

    /// An extensive quantity, scaled up from the unmasked part of the window to the whole.
    pub fn rescaled(&self, value: f64) -> f64 {
        value / (1.0 - self.masked_fraction)
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

    /// The name of its column in a file: `EVQ_DIRECTION`.
    fn column(&self) -> String {
        self.name().to_uppercase().replace('-', "_")
    }
}
