//! Ordinates of graphs: densities of the body as a whole, and means of measures over windows.

use std::fmt;
use std::sync::Arc;

use longan_measures::{Catalogue, Measure, usual};

use super::error::GraphError;
use crate::totals::Totals;

/// A Minkowski functional or the Euler characteristic of the body, divided by the unmasked area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Density {
    /// W0/A, the share of the area, a pure number.
    Area,
    /// W1/A, the contour's length per area, in rad/sr.
    Length,
    /// W2/A, the contour's total curvature per area, in rad/sr.
    Curvature,
    /// χ/A with χ = (W0 + W2)/2π, in 1/sr.
    Euler,
}

impl Density {
    /// All densities.
    pub const ALL: [Density; 4] = [Density::Area, Density::Length, Density::Curvature, Density::Euler];

    /// The name: `w0`, `w1`, `w2` or `euler`.
    pub fn name(self) -> &'static str {
        match self {
            Density::Area => "w0",
            Density::Length => "w1",
            Density::Curvature => "w2",
            Density::Euler => "euler",
        }
    }

    /// The density of this name, however it is typed.
    pub fn named(name: &str) -> Option<Self> {
        Density::ALL.into_iter().find(|density| density.name() == usual(name))
    }

    /// The unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Density::Area => "",
            Density::Length | Density::Curvature => "rad/sr",
            Density::Euler => "1/sr",
        }
    }

    /// The density among totals [per area](Totals::per_area).
    pub fn of(self, per_area: &Totals) -> f64 {
        match self {
            Density::Area => per_area.area,
            Density::Length => per_area.length,
            Density::Curvature => per_area.curvature,
            Density::Euler => per_area.euler_characteristic(),
        }
    }
}

/// The quantity of a curve.
#[derive(Clone)]
pub enum Ordinate {
    /// A density of the body as a whole.
    Density(Density),
    /// The mean of a measure over moving windows, those left out in which it is undefined.
    Mean(Arc<dyn Measure>),
}

impl Ordinate {
    /// The ordinate that a text names: a density, or else a measure or formula of a catalogue. `longan:w0` is the mean of
    /// W0 in windows.
    ///
    /// # Errors
    /// [`GraphError::Unknown`], [`GraphError::Direction`].
    pub fn named(text: &str, catalogue: &Catalogue) -> Result<Self, GraphError> {
        let ordinate = match Density::named(text) {
            Some(density) => Ordinate::Density(density),
            None => Ordinate::Mean(catalogue.find(text)?),
        };
        ordinate.check()?;
        Ok(ordinate)
    }

    /// The name: that of the density or measure, with `longan:` before a measure that shares it with a density.
    pub fn name(&self) -> String {
        match self {
            Ordinate::Density(density) => density.name().to_owned(),
            Ordinate::Mean(measure) => {
                let name = measure.name();
                if Density::ALL.iter().any(|density| density.name() == name) { format!("longan:{name}") } else { name }
            }
        }
    }

    /// The unit; empty for a pure number.
    pub fn unit(&self) -> &str {
        match self {
            Ordinate::Density(density) => density.unit(),
            Ordinate::Mean(measure) => measure.unit(),
        }
    }

    /// The measure whose mean this is.
    pub fn measure(&self) -> Option<&Arc<dyn Measure>> {
        match self {
            Ordinate::Density(_) => None,
            Ordinate::Mean(measure) => Some(measure),
        }
    }

    /// Refuses measures of which there is no mean.
    pub(super) fn check(&self) -> Result<(), GraphError> {
        match self.measure() {
            Some(measure) if !measure.quantity().has_mean() => Err(GraphError::Direction { name: measure.name() }),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for Ordinate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ordinate::Density(density) => f.debug_tuple("Density").field(density).finish(),
            Ordinate::Mean(measure) => f.debug_tuple("Mean").field(&measure.name()).finish(),
        }
    }
}
